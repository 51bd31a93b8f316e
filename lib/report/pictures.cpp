#include "report/detail/pictures.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "core/error.h"
#include "core/output_file.h"
#include "pack/picture.h"
#include "pack/sample.h"
#include "report/summary.h"

namespace coral::report::detail {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t most_cases = 4;
constexpr int sample_pixels = 420;

/// The sample with the poses of one stored time; bodies that are not tracked stay, eroded fines go when `after` is set.
pack::Sample sample_at(const CaseData& data, pack::Sample sample, std::size_t step, bool after)
{
    const Tracks& tracks = data.tracks;
    const std::size_t count = tracks.id.size();
    for (std::size_t c = 0; c < count; ++c) {
        const auto body = static_cast<std::size_t>(tracks.id[c]);
        if (body >= sample.particles.size()) continue;
        const double* x = &tracks.position[3 * (step * count + c)];
        sample.particles[body].position = {x[0], x[1], x[2]};
        if (tracks.orientation.empty()) continue;
        const double* q = &tracks.orientation[4 * (step * count + c)];
        sample.particles[body].orientation = Eigen::Quaterniond(q[0], q[1], q[2], q[3]);
    }
    if (!after) return sample;
    std::set<std::size_t> gone;
    for (std::size_t i = 0; i < data.migration.id.size() && i < data.migration.eroded.size(); ++i)
        if (data.migration.eroded[i] != 0) gone.insert(static_cast<std::size_t>(data.migration.id[i]));
    std::vector<pack::Particle> left;
    for (std::size_t i = 0; i < sample.particles.size(); ++i)
        if (!gone.contains(i)) left.push_back(sample.particles[i]);
    sample.particles = std::move(left);
    return sample;
}

void draw_sample(const CaseData& data, const std::string& stem, const fs::path& folder, std::vector<NamedPicture>& pictures)
{
    if (data.sample.empty() || data.tracks.position.empty() || data.tracks.time.empty()) return;
    const pack::Sample sample = pack::read_sample(data.sample, pack::SampleDetail::without_apparent_grids);
    for (const bool after : {false, true}) {
        const std::size_t step = after ? data.tracks.time.size() - 1 : 0;
        const std::string file = stem + (after ? "_after.png" : "_before.png");
        pack::write_png(pack::draw_sample(sample_at(data, sample, step, after), sample_pixels), folder / file);
        pictures.push_back({file, data.name + (after ? ", at " + short_number(data.tracks.time[step]) + " s" : ", at the start"),
                            after ? "Cut open in the middle; eroded fines are left out [Fig. 18]." : "Cut open in the middle; fines by size [Figs 9, 18]."});
    }
}

void copy_slice(const CaseData& data, const std::string& stem, const fs::path& folder, std::vector<NamedPicture>& pictures)
{
    fs::path last;
    if (!fs::is_directory(data.folder / "frames")) return;
    for (const auto& entry : fs::directory_iterator(data.folder / "frames"))
        if (entry.path().extension() == ".png" && entry.path().filename().string().starts_with("slice_") && entry.path() > last) last = entry.path();
    if (last.empty()) return;
    const std::string file = stem + "_flow.png";
    fs::copy_file(last, folder / file, fs::copy_options::overwrite_existing);
    pictures.push_back({file, data.name + ", speed of the water",
                        "A slice through the grain with voids that is nearest to the middle: violet is at rest, yellow five times the inflow or more; grains grey, fines orange [Fig. 16]. "
                        "Its numbers are in frames/slice.pvd of the case."});
}

}  // namespace

std::vector<NamedPicture> draw_pictures(const std::vector<CaseData>& cases, const fs::path& folder, std::vector<std::string>& notes)
{
    std::vector<NamedPicture> pictures;
    fs::create_directories(folder);
    for (std::size_t k = 0; k < std::min(cases.size(), most_cases); ++k) {
        const std::string stem = "case" + std::to_string(k + 1);
        try {
            draw_sample(cases[k], stem, folder, pictures);
            copy_slice(cases[k], stem, folder, pictures);
        } catch (const Error& error) {
            notes.push_back("no picture of " + cases[k].name + ": " + error.what());
        }
    }
    std::error_code ignored;
    fs::remove(folder, ignored);  // when nothing came in
    if (cases.size() > most_cases && !pictures.empty()) notes.push_back("pictures are drawn of the first " + std::to_string(most_cases) + " cases");
    return pictures;
}

}  // namespace coral::report::detail
