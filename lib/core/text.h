#pragma once
/// \file core/text.h
/// Text that round-trips, and the nearest word to a misspelt one.
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace coral {

/// Shortest decimal text that reads back as the same double (std::to_chars).
std::string to_text(double value);

/// The candidate nearest to `word` by edit distance (insert, delete, replace, swap), or empty if none is close.
std::string nearest_word(std::string_view word, std::span<const std::string> candidates);

/// "did you mean 'half_width'?" or an empty string.
std::string did_you_mean(std::string_view word, std::span<const std::string> candidates);

/// Text pieces between separators, blanks around each removed.
std::vector<std::string> split(std::string_view text, char separator);

}  // namespace coral
