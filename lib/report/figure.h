#pragma once
/// \file report/figure.h
/// Figures of the report: a table with one row for each case and abscissa, and panels that say which columns to draw.
/// gnuplot draws them from a script that lies beside its csv, so that users can restyle them.
#include <filesystem>
#include <string>
#include <vector>

#include "core/table.h"
#include "report/case_data.h"

namespace coral::report {

/// Column drawn as one curve for each case.
struct Curve {
    std::string column;
    std::string label;  ///< empty when the panel holds only one column
    std::string low, high;  ///< columns of the band around it; empty without
    std::string x_column;   ///< of its own abscissa (paths); empty: that of the figure
};

/// Axes with one or more columns. Table values (SI) times `factor` are drawn.
struct Panel {
    std::string title;  ///< empty for figures of one panel
    std::string y_label;
    double factor = 1;
    bool logarithmic = false;
    std::vector<Curve> curves;
    std::string only_case;  ///< the one case that it shows; empty: all
};

enum class FigureKind {
    lines,
    steps,
    bars,    ///< first curve outlined, second filled, over figure.categories
    paths,   ///< curves over abscissae of their own, axes of one scale
    table,   ///< the table as text
};

struct Figure {
    std::string name;     ///< stem of its files
    std::string title;
    std::string caption;  ///< definition of what is drawn, one or two sentences
    FigureKind kind = FigureKind::lines;
    std::string x_column, x_label;
    double x_factor = 1;
    bool x_logarithmic = false;
    Table table;          ///< first column `case`, then x and the curves, SI
    std::vector<Panel> panels;
    std::vector<std::string> cases;  ///< values of the column `case`, in drawing order
    std::vector<std::string> categories;  ///< of bars: names of x = 0, 1, ...
    bool over_time = false;          ///< x is the time of the series (the page then offers interactive curves)
};

/// Figures that the cases have finite data for, in the order of the page; repeats as mean and band (pool.h).
std::vector<Figure> make_figures(const std::vector<CaseData>& cases);

/// All series of all cases: `case,time,eroded_mass_fraction,...`; series that a case lacks are empty cells.
Table erosion_table(const std::vector<CaseData>& cases);

/// gnuplot script that draws figure.name + ".svg" and ".png" from figure.name + ".csv" in the folder it runs in.
std::string gnuplot_script(const Figure& figure);

/// Writes csv and gp of every figure into `folder` and runs gnuplot there.
/// \throws Error when gnuplot is missing (with the package to install) or fails (with its message)
void draw_figures(const std::vector<Figure>& figures, const std::filesystem::path& folder);

}  // namespace coral::report
