// A packing that is stopped and resumed ends with the bytes of one that was not; checkpoints of others are refused.
#include <gtest/gtest.h>

#include "core/error.h"
#include "core/output_file.h"
#include "core/progress.h"
#include "pack/pack.h"
#include "pack/scratch.h"

using namespace coral::pack;

namespace {

const std::string spheres =
    "[box]\nsize = [\"8mm\", \"8mm\", \"12mm\"]\n"
    "[[population]]\nrole = \"coarse\"\ndiameters = [\"2.5mm\", \"3mm\"]\ncount = 8\n"
    "[[population]]\nrole = \"fine\"\ndiameter = \"1.2mm\"\nmass_fraction = 0.25\n"
    "[material.default]\nnormal_stiffness = 2e4\ntangential_stiffness = 1e4\nfriction = 0.3\n"
    "[dropping]\ntime_limit = \"20ms\"\n";
const std::string pressed = spheres + "[compression]\npressure = \"5kPa\"\nfriction = 0.1\ntolerance = \"5%\"\nunbalanced_ratio = 0.05\nkinetic_ratio = 1e-2\n";
const std::string densified = spheres + "[compression]\nvoid_ratio = 0.9\nwalls = \"top\"\nunbalanced_ratio = 0.05\nkinetic_ratio = 1e-2\n";

Spec spec_of(const std::string& text)
{
    coral::Progress::set_quiet(true);
    coral::write_text_file(scratch("restart.toml"), text);
    return read_spec(scratch("restart.toml"));
}

/// Bytes of the sample, packed in parts of `visits` windows of steps; `parts` says how many.
std::string packed_in_parts(const std::string& text, int visits, int& parts)
{
    const Spec spec = spec_of(text);
    PackReport report;
    PackControl control;
    if (visits > 0) control.checkpoint = scratch("restart.checkpoint");
    control.resume = true;
    int left = 0;
    control.interrupted = [&] { return visits > 0 && left-- == 0; };
    for (parts = 1;; ++parts) {
        left = visits;
        const Sample sample = pack(spec, 7, report, control);
        if (report.interrupted) continue;
        std::filesystem::remove(scratch("restart.checkpoint"));
        write_sample(sample, scratch("restart.h5"));
        return coral::read_text_file(scratch("restart.h5"));
    }
}

void expect_same_in_parts(const std::string& text, int visits, int at_least)
{
    int parts = 0;
    const std::string whole = packed_in_parts(text, 0, parts);
    EXPECT_EQ(parts, 1);
    EXPECT_TRUE(packed_in_parts(text, visits, parts) == whole);
    EXPECT_GT(parts, at_least);
}

/// A checkpoint of the spheres with seed 7, in the pouring.
std::filesystem::path stopped()
{
    PackReport report;
    PackControl control;
    control.checkpoint = scratch("stopped.checkpoint");
    int left = 4;
    control.interrupted = [&] { return left-- == 0; };
    pack(spec_of(pressed), 7, report, control);
    EXPECT_TRUE(report.interrupted);
    return control.checkpoint;
}

std::string refusal(const std::string& text, std::uint64_t seed, const std::filesystem::path& checkpoint)
{
    PackControl control;
    control.checkpoint = checkpoint;
    control.resume = true;
    PackReport report;
    try {
        pack(spec_of(text), seed, report, control);
    } catch (const coral::Error& error) {
        return error.what();
    }
    return "not refused";
}

}  // namespace

TEST(PackRestart, goes_on_bit_for_bit_to_a_pressure) { expect_same_in_parts(pressed, 13, 5); }
TEST(PackRestart, goes_on_bit_for_bit_to_a_void_ratio) { expect_same_in_parts(densified, 29, 5); }

TEST(PackRestart, goes_on_bit_for_bit_in_a_cylinder_and_across_periodic_sides)
{
    const auto in = [](const std::string& enclosure, std::string text) { return text.replace(0, text.find("[[population]]"), enclosure); };
    expect_same_in_parts(in("[cylinder]\ndiameter = \"9mm\"\nheight = \"12mm\"\n", pressed), 13, 5);
    expect_same_in_parts(in("[box]\nsize = [\"8mm\", \"8mm\", \"12mm\"]\nperiodic = [\"x\", \"y\"]\n", densified), 29, 5);
}

TEST(PackRestart, refuses_checkpoints_of_other_packings)
{
    const auto checkpoint = stopped();
    EXPECT_NE(refusal(pressed + "[density]\ne_min = 0.4\ne_max = 1\n", 7, checkpoint).find("belongs to another specification: line 23 has changed"), std::string::npos)
        << refusal(pressed + "[density]\ne_min = 0.4\ne_max = 1\n", 7, checkpoint);
    EXPECT_NE(refusal(pressed, 8, checkpoint).find("belongs to seed 7, not 8; add --seed 7"), std::string::npos) << refusal(pressed, 8, checkpoint);
}

TEST(PackRestart, refuses_damaged_checkpoints)
{
    const auto checkpoint = stopped();
    const std::string bytes = coral::read_text_file(checkpoint);
    coral::write_text_file(scratch("cut.checkpoint"), bytes.substr(0, bytes.size() / 2));
    EXPECT_NE(refusal(pressed, 7, scratch("cut.checkpoint")).find("cut.checkpoint"), std::string::npos) << refusal(pressed, 7, scratch("cut.checkpoint"));
    coral::write_text_file(scratch("text.checkpoint"), "no checkpoint");
    EXPECT_NE(refusal(pressed, 7, scratch("text.checkpoint")).find("is not an HDF5 file"), std::string::npos) << refusal(pressed, 7, scratch("text.checkpoint"));
    int refused = 0;
    for (int part = 1; part < 40; ++part) {
        const std::size_t at = part * bytes.size() / 40;
        std::string flipped = bytes;
        flipped[at] = char(flipped[at] ^ 0x10);
        coral::write_text_file(scratch("flipped.checkpoint"), flipped);
        refused += refusal(pressed, 7, scratch("flipped.checkpoint")).find("flipped.checkpoint") != std::string::npos;
    }
    EXPECT_GT(refused, 15);  // some bits lie in the gaps of the file
}

TEST(PackRestart, refuses_a_checkpoint_when_the_shapes_have_changed)
{
    const std::string text = "[box]\nsize = [0.02, 0.02, 0.03]\n[[population]]\nrole = \"coarse\"\nshape = \"polyhedron\"\nfile = \"stone.ply\"\nunit = \"mm\"\ncount = 4\nsurface_nodes = 200\n";
    const auto tetrahedron = [](const std::string& edge) {
        coral::write_text_file(scratch("stone.ply"), "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\nelement face 4\n"
                                                     "property list uchar int vertex_indices\nend_header\n0 0 0\n" + edge + " 0 0\n0 5 0\n0 0 5\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n");
    };
    tetrahedron("5");
    PackReport report;
    PackControl control;
    control.checkpoint = scratch("stones.checkpoint");
    int left = 3;
    control.interrupted = [&] { return left-- == 0; };
    pack(spec_of(text), 1, report, control);
    ASSERT_TRUE(report.interrupted);
    tetrahedron("6");
    EXPECT_NE(refusal(text, 1, control.checkpoint).find("with other shapes: stone.ply has changed since; put the old file back"), std::string::npos) << refusal(text, 1, control.checkpoint);
}
