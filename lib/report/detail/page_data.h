#pragma once
/// \file report/detail/page_data.h
/// What the scripts of the page read, and its own files, which the build compiles in.
#include <array>
#include <string>
#include <vector>

#include "report/figure.h"

namespace coral::report::detail {

/// Colours that stay apart for colour-blind readers [Okabe and Ito 2008]; the yellow is left out, too faint on white.
inline constexpr std::array<const char*, 7> curve_colours{"#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000"};

/// JSON array of the figures over time: title, and for each panel its labels, colours and rows [time, values...] in drawn units.
std::string curves_json(const std::vector<Figure>& figures);

/// lib/report/web/page.css, page.js, viewer.js.
extern const char* const page_css;
extern const char* const page_js;
extern const char* const viewer_js;

}  // namespace coral::report::detail
