#include <zlib.h>

#include <cctype>

#include "core/error.h"
#include "report/detail/encode.h"

namespace coral::report::detail {

std::string base64(std::string_view bytes)
{
    static const char alphabet[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string text;
    text.reserve((bytes.size() + 2) / 3 * 4);
    for (std::size_t i = 0; i < bytes.size(); i += 3) {
        std::uint32_t group = 0;
        const std::size_t count = std::min<std::size_t>(3, bytes.size() - i);
        for (std::size_t k = 0; k < 3; ++k) group = group << 8 | (k < count ? static_cast<unsigned char>(bytes[i + k]) : 0u);
        for (std::size_t k = 0; k < 4; ++k) text += k <= count ? alphabet[group >> (18 - 6 * k) & 63] : '=';
    }
    return text;
}

std::string deflate_words(std::span<const std::uint16_t> words)
{
    std::string planes;
    planes.reserve(2 * words.size());
    for (std::uint16_t word : words) planes += static_cast<char>(word & 255);
    for (std::uint16_t word : words) planes += static_cast<char>(word >> 8);
    uLongf size = compressBound(planes.size());
    std::string packed(size, '\0');
    if (compress2(reinterpret_cast<Bytef*>(packed.data()), &size, reinterpret_cast<const Bytef*>(planes.data()), planes.size(), 9) != Z_OK)
        throw Error("report.html", "the 3-D view could not be packed", "out of memory?");
    packed.resize(size);
    return packed;
}

std::string html(std::string_view text)
{
    std::string out;
    for (char c : text) {
        if (c == '&') out += "&amp;";
        else if (c == '<') out += "&lt;";
        else if (c == '>') out += "&gt;";
        else if (c == '"') out += "&quot;";
        else out += c;
    }
    return out;
}

std::string script_safe_json(std::string json)
{
    std::string out;
    out.reserve(json.size());
    for (char c : json) {
        if (c == '<') out += "\\u003c";
        else out += c;
    }
    return out;
}

std::string script_safe_source(std::string source)
{
    const std::string_view tag = "script";
    for (std::size_t at = source.find("</"); at != std::string::npos; at = source.find("</", at + 2)) {
        bool is_tag = at + 2 + tag.size() <= source.size();
        for (std::size_t k = 0; is_tag && k < tag.size(); ++k)
            is_tag = std::tolower(static_cast<unsigned char>(source[at + 2 + k])) == tag[k];
        if (is_tag) source.insert(at + 1, "\\");
    }
    return source;
}

}  // namespace coral::report::detail
