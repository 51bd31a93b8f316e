#pragma once
/// \file report/detail/encode.h
/// Bytes and text as they go into the page.
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace coral::report::detail {

/// Standard base64 with padding.
std::string base64(std::string_view bytes);

/// Low bytes of all words, then high bytes, deflated with the zlib header (what a browser's DecompressionStream("deflate") reads).
std::string deflate_words(std::span<const std::uint16_t> words);

/// Text for HTML: & < > " escaped.
std::string html(std::string_view text);

/// JSON for a <script> element: every "<" becomes \u003c, so that no "</script" or "<!--" can end or change it.
std::string script_safe_json(std::string json);

/// Library source for a <script> element. "</script" inside becomes "<\/script", the same text within a JavaScript string.
std::string script_safe_source(std::string source);

}  // namespace coral::report::detail
