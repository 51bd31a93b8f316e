#include "report/report.h"

#include <fcntl.h>
#include <stdio.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <set>

#include "core/error.h"
#include "core/output_file.h"
#include "report/figure.h"
#include "report/page.h"

namespace coral::report {
namespace {

namespace fs = std::filesystem;

/// Refuses a folder that holds anything a report does not: nothing of the user's may be lost by replacing it.
void require_replaceable(const fs::path& folder)
{
    if (!fs::exists(folder) && !fs::is_symlink(folder)) return;
    const auto refuse = [&](const std::string& what) {
        throw Error(folder.string(), "is in the way: " + what, "give another folder with -o, or move it aside");
    };
    if (fs::is_symlink(folder)) refuse("it is a link");
    if (!fs::is_directory(folder)) refuse("it is a file");
    if (fs::is_empty(folder)) return;
    for (const auto& entry : fs::directory_iterator(folder)) {
        const std::string name = entry.path().filename().string();
        const bool ours = name == "figures" || name == "pictures" ? entry.is_directory() : (name == "erosion.csv" || name == "report.html") && entry.is_regular_file();
        if (!ours) refuse("it holds " + name + ", which is not of a report");
    }
    if (!fs::exists(folder / "report.html")) refuse("it holds no report.html of an earlier report");
    std::ifstream page(folder / "report.html");
    std::string doctype, mark;
    std::getline(page, doctype);
    std::getline(page, mark);
    if (mark != page_mark) refuse("its report.html was not written by erosion-report");
    static const std::set<std::string> kinds{".csv", ".gp", ".svg", ".png"};
    if (fs::exists(folder / "figures"))
        for (const auto& entry : fs::directory_iterator(folder / "figures"))
            if (!entry.is_regular_file() || !kinds.contains(entry.path().extension().string()) ||
                !fs::exists(fs::path(entry.path()).replace_extension(".gp")))
                refuse("it holds figures/" + entry.path().filename().string() + ", which is not of a report");
    if (fs::exists(folder / "pictures"))
        for (const auto& entry : fs::directory_iterator(folder / "pictures"))
            if (!entry.is_regular_file() || entry.path().extension() != ".png" || !entry.path().filename().string().starts_with("case"))
                refuse("it holds pictures/" + entry.path().filename().string() + ", which is not of a report");
}

/// Folder beside the target, removed again unless move_into_place() was reached.
class PartFolder {
public:
    explicit PartFolder(const fs::path& target)
    {
        const fs::path parent = target.has_parent_path() ? target.parent_path() : fs::path(".");
        if (!fs::is_directory(parent)) throw UsageError(target.string(), "the folder " + parent.string() + " does not exist", "make it first");
        path_ = parent / ("." + target.filename().string() + ".part" + std::to_string(::getpid()));
        std::error_code failure;
        fs::create_directories(path_ / "figures", failure);
        if (failure) throw Error(target.string(), "cannot be written: " + failure.message());
    }
    ~PartFolder()
    {
        std::error_code ignored;
        fs::remove_all(path_, ignored);
    }
    PartFolder(const PartFolder&) = delete;
    PartFolder& operator=(const PartFolder&) = delete;
    const fs::path& path() const { return path_; }

    /// The new folder takes the place of the old one in one step; the old one then lies here and goes with this object.
    void move_into_place(const fs::path& target)
    {
        int failure = 0;
        if (fs::exists(target)) {
            failure = ::renameat2(AT_FDCWD, path_.c_str(), AT_FDCWD, target.c_str(), RENAME_EXCHANGE);
            if (failure != 0 && (errno == EINVAL || errno == ENOSYS)) {  // a file system without exchange
                const fs::path old = path_.string() + ".old";
                fs::rename(target, old);
                fs::rename(path_, target);
                fs::rename(old, path_);
                failure = 0;
            }
        } else {
            failure = ::rename(path_.c_str(), target.c_str());
        }
        if (failure != 0) throw Error(target.string(), std::string("cannot be written: ") + std::strerror(errno));
    }

private:
    fs::path path_;
};

}  // namespace

ReportOutcome write_report(const std::vector<CaseData>& cases, const fs::path& folder, const ReportOptions& options)
{
    fs::path target = folder.lexically_normal();
    if (!target.has_filename()) target = target.parent_path();
    if (target.filename() == "." || target.filename() == ".." || target.empty())
        throw UsageError(folder.string(), "is the folder you are in or above it", "give a new folder with -o, such as -o report");
    require_replaceable(target);
    PartFolder part(target);
    ReportOutcome outcome;
    const std::vector<Figure> figures = make_figures(cases);
    for (const Figure& figure : figures) outcome.figures.push_back(figure.name);
    draw_figures(figures, part.path() / "figures");
    erosion_table(cases).write(part.path() / "erosion.csv");
    const std::string page = report_page(cases, figures, part.path() / "figures", options, outcome.notes);
    outcome.page_bytes = page.size();
    write_text_file(part.path() / "report.html", page);
    part.move_into_place(target);
    return outcome;
}

}  // namespace coral::report
