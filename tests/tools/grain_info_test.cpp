// grain-info on every kind of file of the chain, and on files that are not ours, damaged or newer.
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "core/hdf5.h"
#include "core/output_file.h"
#include "morph/stack_io.h"
#include "pack/sample.h"
#include "sdf/vdb_io.h"
#include "sh/shape_file.h"
#include "sh/tabulate.h"
#include "suffusion/checkpoint.h"
#include "suffusion/results.h"
#include "tools/run_program.h"

namespace coral::test {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

const History made = {{"csct2ls", "0.1.0", {{"spacing", "200 um"}}, {"stack.tif"}}};

class GrainInfo : public testing::Test {
protected:
    fs::path at(const std::string& name) const { return folder.path() / name; }
    Json describe(const std::string& name, const std::string& options = "") const
    {
        const ProgramResult result = run_program("grain-info '" + name + "' --json " + options, folder.path());
        EXPECT_EQ(result.exit_code, 0) << result.err;
        return result.exit_code == 0 ? Json::parse(result.out)["files"][0] : Json();
    }
    std::string human(const std::string& name) const { return run_program("grain-info '" + name + "'", folder.path()).out; }
    void expect_refusal(const std::string& name, const std::string& part, int exit_code = 1) const
    {
        const ProgramResult result = run_program("grain-info '" + name + "'", folder.path());
        EXPECT_EQ(result.exit_code, exit_code) << name << result.out;
        EXPECT_NE(result.err.find(part), std::string::npos) << result.err;
        EXPECT_EQ(std::ranges::count(result.err, '\n'), 1) << result.err;
    }
    void write_grains(const std::string& name) const
    {
        sdf::GrainLevelSet grain;
        grain.id = grain.label = 3;
        grain.solid = sh::tabulate(sh::sphere_surface(5e-3), 5e-4, 4.5e-3, 3e-3);
        for (float& d : grain.solid.distance) d = std::min(d, 4.5e-3f);
        grain.solid.outside_limit = 4.5e-3;
        grain.apparent = grain.solid;
        grain.volume = 4e-7, grain.apparent_volume = 5e-7, grain.equivalent_diameter = 1e-2, grain.intraparticle_porosity = 0.2;
        sdf::write_grains(at(name), std::vector{grain}, made);
    }
    void write_shapes(const std::string& name, const std::string& version) const
    {
        sh::ShapeRecord shape;
        shape.id = 7;
        shape.surface = sh::sphere_surface(1e-3);
        shape.volume = 4.2e-9, shape.equivalent_diameter = 2e-3;
        sh::write_shapes(at(name), std::vector{shape}, {{"ls2sh", version, {{"degree", "10"}}, {"grains.vdb"}}});
    }
    ScratchFolder folder;
};

TEST_F(GrainInfo, tells_of_level_sets_and_of_shapes)
{
    write_grains("grains.vdb");
    const Json grains = describe("grains.vdb");
    EXPECT_EQ(grains["grains"], 1);
    EXPECT_NEAR(grains["spacing"][0].get<double>(), 5e-4, 1e-12);
    EXPECT_NEAR(grains["band"][1].get<double>(), 9, 1e-3);
    EXPECT_NEAR(grains["intraparticle_porosity"].get<double>(), 0.2, 1e-12);
    EXPECT_EQ(grains["each"][0]["id"], 3);
    EXPECT_EQ(grains["history"][0]["tool"], "csct2ls");
    EXPECT_NE(human("grains.vdb").find("500 um"), std::string::npos) << human("grains.vdb");

    write_shapes("grains.sh.h5", "0.1.0");
    const Json shapes = describe("grains.sh.h5");
    EXPECT_EQ(shapes["shapes"], 1);
    EXPECT_EQ(shapes["each"][0]["id"], 7);
    EXPECT_EQ(shapes["each"][0]["degree"], 0);
    EXPECT_EQ(shapes["method"], "sphere");
}

TEST_F(GrainInfo, tells_of_samples_results_and_checkpoints)
{
    pack::Sample sample;
    sample.size = {0.01, 0.01, 0.02};
    sample.shapes = {pack::unit_sphere()};
    sample.materials.push_back({"default", 2780, 2e5, 1e5, 0.7, 0.3});
    pack::Particle grain;
    grain.scale = 4e-3;
    sample.particles.push_back(grain);
    grain.scale = 1e-3;
    grain.role = pack::Role::fine;
    sample.particles.push_back(grain);
    sample.statistics.porosity = 0.41;
    sample.history = made;
    pack::write_sample(sample, at("sample.h5"));
    const Json packed = describe("sample.h5");
    EXPECT_EQ(packed["bodies"], 2);
    EXPECT_NEAR(packed["porosity"].get<double>(), 0.41, 1e-12);
    EXPECT_NEAR(packed["coarse_diameter"][1].get<double>(), 4e-3, 1e-12);

    suffusion::Results results;
    results.series = {{"time", "s", 1, {0, 0.5}}, {"eroded_mass_fraction", "1", 1, {0, 0.125}}};
    results.history = to_json(made);
    suffusion::write_results(at("results.h5"), results);
    const Json run = describe("results.h5");
    EXPECT_EQ(run["rows"], 2);
    EXPECT_EQ(run["series"]["eroded_mass_fraction"]["last"][0], 0.125);

    suffusion::Checkpoint checkpoint;
    checkpoint.time = 0.25;
    checkpoint.cells = 1000;
    checkpoint.simulation = {1, 2, 3};
    checkpoint.observer = {4};
    suffusion::write_checkpoint(at("checkpoint.h5"), checkpoint);
    EXPECT_EQ(describe("checkpoint.h5")["time"], 0.25);
    EXPECT_EQ(describe("checkpoint.h5")["state_bytes"], 4);
}

TEST_F(GrainInfo, tells_of_cases_tables_and_stacks)
{
    fs::create_directory(at("case"));
    write_text(at("case") / "case.toml", "[domain]\nsize = [\"10mm\", \"10mm\", \"10mm\"]\ncell = \"1mm\"\n[[body]]\nshape = { type = \"sphere\", diameter = \"2mm\" }\nposition = [\"5mm\", \"5mm\", \"5mm\"]\n[time]\nduration = \"1s\"\n");
    for (const char* name : {"case", "case/case.toml"}) {
        const Json scene = describe(name);
        EXPECT_EQ(scene["bodies"], 1);
        EXPECT_EQ(scene["fluid"], false);
        EXPECT_EQ(scene["duration"], 1.0);
    }
    write_text(at("t.csv"), "id,degree,method,rms_error\n1,2,radial,0.2\n1,3,radial,0.1\n");
    const Json table = describe("t.csv");
    EXPECT_EQ(table["rows"], 2);
    EXPECT_EQ(table["columns"]["rms_error"][0], 0.1);

    morph::VoxelStack stack;
    stack.size = {4, 3, 2};
    stack.voxel_size = {3e-5, 3e-5, 6e-5};
    std::vector<std::uint32_t> values(24, 0);
    values[5] = 700;
    stack.values = values;
    morph::write_tiff(stack, at("s.tif"), 16);
    const Json voxels = describe("s.tif", "--values");
    EXPECT_EQ(voxels["size"], Json({4, 3, 2}));
    EXPECT_NEAR(voxels["voxel_size"][2].get<double>(), 6e-5, 1e-9);
    EXPECT_EQ(voxels["largest_value"], 700);
    EXPECT_EQ(voxels["distinct_values"], 2);
    EXPECT_EQ(voxels["type"], "u16");
    EXPECT_EQ(describe("s.tif")["type"], "u16");
    EXPECT_EQ(describe("s.tif")["size"], voxels["size"]);
    EXPECT_FALSE(describe("s.tif").contains("largest_value"));
    EXPECT_NE(human("s.tif").find("not read: --values reads all voxels"), std::string::npos);
}

TEST_F(GrainInfo, tells_of_a_stack_larger_than_memory)
{
    write_text(at("huge.nrrd"), "NRRD0004\ntype: uint16\ndimension: 3\nsizes: 20000 20000 5000\nendian: little\nencoding: raw\ndata file: huge.raw\n\n");
    write_text(at("huge.raw"), "");
    std::error_code problem;
    fs::resize_file(at("huge.raw"), std::uintmax_t{4000000000000}, problem);  // a hole: takes no room on the disk
    if (problem) GTEST_SKIP() << "no file of 4 TB here: " << problem.message();
    EXPECT_EQ(describe("huge.nrrd")["size"], Json({20000, 20000, 5000}));
    fs::resize_file(at("huge.raw"), std::uintmax_t{3999999999999});
    expect_refusal("huge.nrrd", "huge.nrrd: asks for 4000000000000 bytes of voxels, but only 3999999999999 bytes follow");
}

TEST_F(GrainInfo, describes_several_files_at_once)
{
    write_shapes("a.sh.h5", "0.1.0");
    write_shapes("b.sh.h5", "0.1.0");
    const ProgramResult result = run_program("grain-info a.sh.h5 b.sh.h5 --json", folder.path());
    ASSERT_EQ(result.exit_code, 0) << result.err;
    EXPECT_EQ(Json::parse(result.out)["files"].size(), 2u);
}

TEST_F(GrainInfo, refuses_what_is_not_ours_in_one_line)
{
    write_text(at("notes.txt"), "shopping list\n");
    write_text(at("empty.vdb"), "");
    write_text(at("other.csv"), "a,b\n1,2\n");
    write_text(at("text.h5"), "this is no HDF5 file at all");
    write_text(at("bad.toml"), "[domain]\nsize = 3\nsell = 4\n");
    H5File other = H5File::create(at("other.h5"));
    other.make_group("/something");
    other.commit();
    expect_refusal("notes.txt", "no file of ours");
    expect_refusal("empty.vdb", "is empty");
    expect_refusal("other.csv", "none of ours");
    expect_refusal("text.h5", "not an HDF5 file");
    expect_refusal("other.h5", "none of ours");
    expect_refusal("bad.toml", "bad.toml");
    expect_refusal("absent.vdb", "absent.vdb", 2);
    fs::create_directory(at("folder"));
    expect_refusal("folder", "folder");
}

TEST_F(GrainInfo, refuses_damaged_files_and_those_of_a_newer_version)
{
    write_grains("grains.vdb");
    const std::string grains = read_text_file(at("grains.vdb"));
    for (const double share : {0.02, 0.3, 0.9}) {
        write_text(at("cut.vdb"), grains.substr(0, std::size_t(share * double(grains.size()))));
        expect_refusal("cut.vdb", "cut.vdb: holds no grains of ours, or is cut short");
    }
    write_shapes("shapes.sh.h5", "0.1.0");
    const std::string shapes = read_text_file(at("shapes.sh.h5"));
    write_text(at("cut.sh.h5"), shapes.substr(0, shapes.size() / 2));
    expect_refusal("cut.sh.h5", "damaged");

    // The number of the format decides, not the version of the tool that wrote it.
    write_shapes("later.sh.h5", "99.0.0");
    EXPECT_EQ(describe("later.sh.h5")["shapes"], 1);
    const auto newer = [&](const std::vector<std::string>& groups, const std::string& content, std::int64_t known) {
        H5File file = H5File::create(at("newer.h5"));
        if (!content.empty()) file.set_attribute("/", "content", content);
        for (const std::string& group : groups) file.make_group(group);
        file.set_format(9);
        file.commit();
        expect_refusal("newer.h5", "newer.h5: was written by a newer version of the tools (format 9, this one reads up to " + std::to_string(known) + "); update the tools");
    };
    newer({"/shapes"}, "coralsand harmonic shapes", 1);
    newer({"/particles"}, "coralsand sample", 2);
    newer({"/simulation", "/observer"}, "", 2);
    newer({"/series/time"}, "", 1);
}

TEST_F(GrainInfo, follows_a_run_back_to_the_files_of_its_shapes)
{
    write_grains("grains.vdb");
    write_shapes("stone.sh.h5", "0.1.0");
    const std::string grain = "[[body]]\nshape = { type = \"level-set\", file = \"grains.vdb\", grid = \"grain_3\" }\n";
    write_text(at("case.toml"), grain + "position = [0, 0, 0]\n" + grain + "position = [0, 0, 0.05]\n[[body]]\nshape = { type = \"sh\", file = \"stone.sh.h5\", id = 7 }\nposition = [0, 0, 0.1]\n[time]\nduration = \"1ms\"\n");
    const ProgramResult run = run_program("suffuse . --until 0.5ms --quiet", folder.path());
    ASSERT_EQ(run.exit_code, 0) << run.err;
    const Json results = describe("results.h5");
    std::vector<std::string> tools;
    for (const Json& step : results["history"]) tools.push_back(step["tool"]);
    EXPECT_EQ(tools, (std::vector<std::string>{"csct2ls", "ls2sh", "suffuse"}));
    EXPECT_EQ(H5File::open(at("checkpoint.h5")).string_attribute("/", "history"), H5File::open(at("results.h5")).string_attribute("/", "history"));
}

}  // namespace
}  // namespace coral::test
