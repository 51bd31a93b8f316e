#include "suffusion/results.h"

#include <gtest/gtest.h>
#include <zlib.h>

#include "core/output_file.h"
#include "suffusion/checkpoint.h"
#include "suffusion/frames.h"
#include "suffusion/scratch.h"

namespace coral::suffusion {
namespace {

using test::Scratch;

Results two_rows()
{
    Results r;
    r.series = {{"time", "s", 1, {0, 0.5}}, {"fines_count", "1", 3, {1, 2, 3, 4, 5, 6}}};
    r.tracked = {0, 7};
    r.trajectories = {{"position", "m", 3, {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11}}, {"speed", "m s-1", 1, {1, 2, 3, 4}}};
    r.fines = {7};
    r.path_length = {0.25};
    r.net_displacement = {0.125};
    r.layer = {2};
    r.eroded = {0};
    r.state = {2};
    r.cloggings = {3};
    r.trapped = {{7, 0, true, 0.25, 1.2e-3}};
    r.performance = {{"seconds_contact", "s", 1.5}};
    r.history = "[]";
    r.case_text = "a = 1\n";
    return r;
}

TEST(Results, come_back_as_they_were_written)
{
    const Scratch scratch;
    write_results(scratch.path() / "results.h5", two_rows());
    const Results r = read_results(scratch.path() / "results.h5");
    ASSERT_EQ(r.rows(), 2u);
    ASSERT_EQ(r.series.size(), 2u);
    EXPECT_EQ(r.series[0].name, "time");
    EXPECT_EQ(r.series[1].width, 3u);
    EXPECT_EQ(r.series[1].values, two_rows().series[1].values);
    EXPECT_EQ(r.series[0].unit, "s");
    ASSERT_EQ(r.trajectories.size(), 2u);
    EXPECT_EQ(r.trajectories[0].width, 3u);
    EXPECT_EQ(r.trajectories[1].width, 1u);
    EXPECT_EQ(r.tracked, two_rows().tracked);
    EXPECT_EQ(r.path_length, two_rows().path_length);
    EXPECT_EQ(r.state, two_rows().state);
    EXPECT_EQ(r.cloggings, two_rows().cloggings);
    ASSERT_EQ(r.trapped.size(), 1u);
    EXPECT_EQ(r.trapped[0].fine, 7);
    EXPECT_TRUE(r.trapped[0].enclosed);
    EXPECT_EQ(r.trapped[0].since, 0.25);
    EXPECT_EQ(r.trapped[0].throat, 1.2e-3);
    EXPECT_EQ(r.performance.at(0).value, 1.5);
    EXPECT_EQ(r.case_text, "a = 1\n");
}

TEST(Results, keep_the_rows_before_a_cut)
{
    Results r = two_rows();
    r.truncate(1);
    EXPECT_EQ(r.rows(), 1u);
    EXPECT_EQ(r.series[1].values, (std::vector<double>{1, 2, 3}));
    EXPECT_EQ(r.trajectories[0].values.size(), 6u);
}

TEST(Results, hold_no_bodies_when_there_are_none)
{
    const Scratch scratch;
    Results r;
    r.series = {{"time", "s", 1, {0}}};
    r.history = "[]";
    r.case_text = "x";
    write_results(scratch.path() / "r.h5", r);
    EXPECT_EQ(read_results(scratch.path() / "r.h5").rows(), 1u);
}

TEST(Checkpoint, comes_back_byte_for_byte)
{
    const Scratch scratch;
    Checkpoint c;
    c.time = 0.1;
    c.rows = 3, c.frames = 2, c.cells = 8, c.bodies = 4;
    for (int i = 0; i < 100000; ++i) c.simulation.push_back(static_cast<std::uint8_t>(i * i));
    c.observer = {1, 2, 3};
    write_checkpoint(scratch.path() / "checkpoint.h5", c);
    const Checkpoint back = read_checkpoint(scratch.path() / "checkpoint.h5");
    EXPECT_EQ(back.time, c.time);
    EXPECT_EQ(back.rows, c.rows);
    EXPECT_EQ(back.simulation, c.simulation);
    EXPECT_EQ(back.observer, c.observer);
}

std::vector<unsigned char> from_base64(const std::string& text)
{
    static const std::string letters = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::vector<unsigned char> bytes;
    std::uint32_t word = 0;
    int bits = 0;
    for (const char c : text) {
        if (c == '=') break;
        word = word << 6 | static_cast<std::uint32_t>(letters.find(c));
        bits += 6;
        if (bits >= 8) bits -= 8, bytes.push_back(static_cast<unsigned char>(word >> bits & 255));
    }
    return bytes;
}

/// A reader of VTK's inline compressed arrays: header of block count, block size, last size, packed sizes; then the blocks.
TEST(Frames, arrays_unpack_to_what_was_packed)
{
    std::vector<float> values(400000);
    for (std::size_t i = 0; i < values.size(); ++i) values[i] = static_cast<float>(i % 1000);
    const std::string text = encode_array(values.data(), values.size() * sizeof(float));
    const std::vector<unsigned char> first = from_base64(text.substr(0, 16));
    std::uint32_t blocks = 0;
    std::memcpy(&blocks, first.data(), 4);
    ASSERT_EQ(blocks, 2u);
    const std::size_t header_bytes = 4 * (3 + blocks), header_text = (header_bytes + 2) / 3 * 4;
    std::vector<std::uint32_t> header(3 + blocks);
    std::memcpy(header.data(), from_base64(text.substr(0, header_text)).data(), header_bytes);
    const std::vector<unsigned char> packed = from_base64(text.substr(header_text));
    std::vector<unsigned char> data(values.size() * sizeof(float));
    std::size_t at = 0, out = 0;
    for (std::uint32_t b = 0; b < blocks; ++b) {
        uLongf room = data.size() - out;
        ASSERT_EQ(uncompress(data.data() + out, &room, packed.data() + at, header[3 + b]), Z_OK);
        at += header[3 + b];
        out += room;
    }
    ASSERT_EQ(out, data.size());
    EXPECT_EQ(std::memcmp(data.data(), values.data(), data.size()), 0);
}

TEST(Frames, image_names_its_grid_and_arrays)
{
    const Scratch scratch;
    const FrameArray array{"pressure", 1, std::vector<float>(24, 1.f)};
    write_image(scratch.path() / "a.vti", {0, 0, 0.5}, 0.25, {2, 3, 4}, std::span(&array, 1));
    const std::string text = read_text_file(scratch.path() / "a.vti");
    EXPECT_NE(text.find("WholeExtent=\"0 2 0 3 0 4\" Origin=\"0 0 0.5\" Spacing=\"0.25 0.25 0.25\""), std::string::npos);
    EXPECT_NE(text.find("Name=\"pressure\" NumberOfComponents=\"1\" format=\"binary\""), std::string::npos);
    EXPECT_EQ(text.find("appended"), std::string::npos);
}

}  // namespace
}  // namespace coral::suffusion
