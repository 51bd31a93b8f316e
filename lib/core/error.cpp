#include "core/error.h"

namespace coral {
namespace {

std::string one_line(std::string_view where, std::string_view what, std::string_view how_to_fix)
{
    std::string text;
    if (!where.empty()) text.append(where).append(": ");
    text.append(what);
    if (!how_to_fix.empty()) text.append("; ").append(how_to_fix);
    return text;
}

}  // namespace

Error::Error(std::string_view where, std::string_view what, std::string_view how_to_fix)
    : std::runtime_error(one_line(where, what, how_to_fix))
{
}

}  // namespace coral
