#include "pack-sample/psd_figure.h"

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <string>
#include <vector>

#include "core/error.h"
#include "pack/criteria.h"
#include "report/figure.h"

namespace coral::tool {
namespace {

namespace fs = std::filesystem;

/// Folder beside the picture where gnuplot works; gone with its content at the end.
class WorkFolder {
public:
    explicit WorkFolder(const fs::path& beside)
    {
        std::string name = (beside / "psd-figure-XXXXXX").string();
        if (!::mkdtemp(name.data())) throw Error(beside.string(), std::string("no folder can be made in it: ") + std::strerror(errno), "");
        path = name;
    }
    ~WorkFolder()
    {
        std::error_code ignored;
        fs::remove_all(path, ignored);
    }
    WorkFolder(const WorkFolder&) = delete;
    WorkFolder& operator=(const WorkFolder&) = delete;
    fs::path path;
};

fs::path folder_of(const fs::path& file) { return file.has_parent_path() ? file.parent_path() : fs::path("."); }

/// Gradation of the grains of one role.
pack::Psd gradation_of(const pack::Sample& sample, pack::Role role)
{
    std::vector<double> diameters, masses;
    for (const pack::Particle& p : sample.particles) {
        if (p.role != role) continue;
        diameters.push_back(pack::equivalent_diameter(sample, p));
        masses.push_back(pack::mass(sample, p));
    }
    return pack::gradation(diameters, masses);
}

}  // namespace

void check_psd_figure(const fs::path& file)
{
    if (file.extension() != ".png" && file.extension() != ".svg") throw UsageError("--psd-figure " + file.string(), "is no kind of picture that is drawn", "end it in .png or .svg");
    if (!fs::is_directory(folder_of(file))) throw UsageError("--psd-figure " + file.string(), "its folder does not exist", "make the folder first");
}

void draw_psd(const pack::Sample& sample, const fs::path& file)
{
    report::Figure figure;
    figure.name = "psd";
    figure.title = "Gradation by mass";
    figure.kind = report::FigureKind::steps;
    figure.x_column = "diameter";
    figure.x_label = "equivalent diameter [mm]";
    figure.x_factor = 1e3;
    figure.x_logarithmic = true;
    figure.table.columns = {"case", "diameter", "passing"};
    report::Panel& panel = figure.panels.emplace_back();
    panel.y_label = "passing [% of mass]";
    panel.factor = 100;
    panel.curves.emplace_back().column = "passing";
    const auto add = [&](const char* name, const pack::Psd& psd) {
        if (psd.empty()) return;
        figure.cases.push_back(name);
        // the upper end of every step: the curve rises where it gets there
        for (std::size_t i = 0; i < psd.size(); ++i)
            if (i == 0 || i + 1 == psd.size() || psd[i + 1].size > psd[i].size) figure.table.add({std::string(name), psd[i].size, psd[i].passing});
    };
    add("coarse grains", gradation_of(sample, pack::Role::coarse));
    add("fine grains", gradation_of(sample, pack::Role::fine));
    add("whole sample", sample.psd);  // last, so that it lies on top
    const WorkFolder work(folder_of(file));
    report::draw_figures({figure}, work.path);
    fs::rename(work.path / ("psd" + file.extension().string()), file);
}

}  // namespace coral::tool
