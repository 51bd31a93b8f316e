/// make-sample-ct: a CT stack of random coral-like grains with the truth beside it.
#include <fmt/format.h>
#include <filesystem>

#include "cli.h"
#include "core/error.h"
#include "morph/stack_io.h"
#include "phantom/sample_ct.h"

namespace {
using namespace coral;

struct Options {
    std::filesystem::path output, truth;
    phantom::SampleSpec sample;
    phantom::GreySpec grey;
    double voxel_size = 125e-6, slice_spacing = 0;
    bool is_binary = false, is_grey = false;
};

void declare(cli::Options& options, Options& o)
{
    phantom::SampleSpec& s = o.sample;
    options.add("-o,--output", o.output, "Stack, multi-page TIFF with ImageJ's calibration").required();
    options.add("--truth", o.truth, "CSV of the true figures, one row a grain, SI");
    options.add("--grains", s.grains, "Number of grains").between(1, 65535);
    options.add("--sticks", s.sticks, "How many of them are sticks").not_negative();
    options.quantity("--diameter", s.diameter, Dimension::length,
                 "Mean equivalent diameter of the grains, voids filled");
    options.quantity("--spread", s.spread, Dimension::number, "Diameters are uniform in diameter*(1 +- spread)");
    options.quantity("--voxel-size", o.voxel_size, Dimension::length, "Edge of a voxel");
    options.quantity("--slice-spacing", o.slice_spacing, Dimension::length,
                 "Distance of slices; 0: as the voxel size");
    options.add("--degree", s.degree, "Spherical-harmonic degree of the outlines").between(2, 40);
    options.quantity("--porosity", s.voids.porosity, Dimension::number, "Intraparticle porosity; 0: solid grains");
    options.flag("!--no-sponge", s.voids.sponge, "Only chambers and channels; the porosity is what they give");
    options.quantity("--wavelength", s.voids.wavelength, Dimension::number,
                 "One void and one wall of the sponge / diameter");
    options.add("--compartments", s.voids.compartments, "Parts of a grain divided by septa").between(1, 1000);
    options.quantity("--open", s.voids.open_share, Dimension::number,
                 "Share of the compartments that are open to the outside");
    options.quantity("--wall", s.voids.wall, Dimension::number, "Least thickness of skin and septa / diameter");
    options.add("--chambers", s.voids.chambers, "Sealed spheres in a grain").between(0, 1000);
    options.add("--channels", s.voids.channels, "Cylinders from the outside to a blind ball in a grain").between(0, 1000);
    options.add("--chamber-radius", s.voids.chamber_radius, "Smallest and largest / diameter");
    options.add("--channel-radius", s.voids.channel_radius, "Smallest and largest / diameter");
    options.add("--gap", s.gap, "Voxels between the boxes of grains and around them").between(1, 1000);
    options.flag("--touching", s.touching, "Slide the grains together until they touch");
    const cli::Option binary = options.flag("--binary", o.is_binary, "Write solid 255, void 0 instead of labels");
    options.flag("--grey", o.is_grey, "Write grey values with partial volume and noise instead of labels").excludes(binary);
    options.add("--noise", o.grey.noise, "Standard deviation of the grey values").not_negative();
    options.add("--supersample", s.supersample, "Points per voxel and axis on which the truth is counted; odd").between(1, 9);
}

void check(const Options& o)
{
    const auto in = [](const char* option, double value, double low, double high) {
        if (!(value >= low && value <= high)) {
            throw UsageError(option, fmt::format("{} is outside [{}, {}]", value, low, high), "see --help");
        }
    };
    in("--diameter", o.sample.diameter, 1e-6, 10);
    in("--voxel-size", o.voxel_size, 1e-9, o.sample.diameter / 4);
    in("--slice-spacing", o.slice_spacing, 0, o.sample.diameter / 4);
    in("--spread", o.sample.spread, 0, 0.9);
    in("--porosity", o.sample.voids.porosity, 0, 0.9);
    in("--wavelength", o.sample.voids.wavelength, 0.01, 10);
    in("--open", o.sample.voids.open_share, 0, 1);
    in("--wall", o.sample.voids.wall, 0, 0.5);
    in("--sticks", o.sample.sticks, 0, o.sample.grains);
}

void run(Options& o, const cli::Context& context, std::uint64_t seed)
{
    check(o);
    phantom::SampleSpec& spec = o.sample;
    spec.seed = seed;
    spec.voxel_size = {o.voxel_size, o.voxel_size, o.slice_spacing > 0 ? o.slice_spacing : o.voxel_size};
    const phantom::Sample sample = phantom::make_sample(spec);
    const morph::VoxelStack stack = o.is_grey     ? phantom::grey_stack(sample, o.grey, seed)
                                    : o.is_binary ? phantom::binary_stack(sample)
                                                  : sample.labels;
    const bool is_labels = !o.is_grey && !o.is_binary;
    morph::write_tiff(stack, o.output, is_labels && spec.grains > 255 ? 16 : 8);
    if (!o.truth.empty()) phantom::truth_table(sample).write(o.truth);

    nlohmann::ordered_json json;
    json["grains"] = spec.grains;
    json["size"] = {stack.size.x(), stack.size.y(), stack.size.z()};
    json["voxel_size"] = {spec.voxel_size.x(), spec.voxel_size.y(), spec.voxel_size.z()};
    double solid = 0, apparent = 0;
    std::string rows =
        fmt::format("{} x {} x {} voxels of {}\nlabel kind   diameter    sphericity porosity closed voids\n",
                    stack.size.x(), stack.size.y(), stack.size.z(), format_quantity(o.voxel_size, Dimension::length));
    for (std::size_t n = 0; n < sample.grains.size(); ++n) {
        const phantom::Truth& t = sample.grains[n].truth;
        solid += t.volume;
        apparent += t.apparent_volume;
        rows += fmt::format("{:5} {:5} {:7.3f} mm {:13.3f} {:8.3f} {:6.3f} {:5}\n", n + 1,
                            sample.grains[n].stick ? "stick" : "lump", 1e3 * t.equivalent_diameter, t.sphericity,
                            t.intraparticle_porosity, t.closed_void_volume / t.apparent_volume, t.void_count);
    }
    json["intraparticle_porosity"] = 1 - solid / apparent;
    cli::print_summary(context, json,
                       rows + fmt::format("intraparticle porosity of all: {:.3f}\n", 1 - solid / apparent));
}
}  // namespace

int main(int argc, char** argv)
{
    Options options;
    std::uint64_t seed = 1;
    return cli::run_tool(
        argc, argv, "make-sample-ct", "CT stack of random coral-like grains whose true figures are known",
        [&](coral::cli::Options& declared) { declare(declared, options); },
        [&](const cli::Context& context) { run(options, context, seed); }, &seed);
}
