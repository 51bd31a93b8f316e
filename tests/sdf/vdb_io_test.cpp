#include "sdf/vdb_io.h"

#include <gtest/gtest.h>
#include <openvdb/io/File.h>
#include <openvdb/openvdb.h>
#include <sys/resource.h>
#include <unistd.h>

#include <csignal>
#include <filesystem>
#include <fstream>
#include <thread>

#include "core/error.h"
#include "core/output_file.h"
#include "sdf/mass_properties.h"
#include "shapes.h"

namespace coral::sdf::test {
namespace {

namespace fs = std::filesystem;

class VdbFile : public ::testing::Test {
protected:
    void SetUp() override
    {
        folder = fs::temp_directory_path() / ("coral_vdb_" + std::to_string(::getpid()) + ::testing::UnitTest::GetInstance()->current_test_info()->name());
        fs::create_directories(folder);
    }
    void TearDown() override { fs::remove_all(folder); }
    fs::path folder;
};

GrainLevelSet hollow_ball(int id, double radius)
{
    const double c = 5e-5;
    const int n = int(2 * radius) + 4;
    const Eigen::Vector3d centre = Eigen::Vector3d::Constant(0.5 * n + 0.2) * c;
    const Mask solid = voxelise(shell(centre, radius * c, 0.5 * radius * c), Eigen::Vector3i::Constant(n), Eigen::Vector3d::Constant(c));
    const Mask filled = voxelise(sphere(centre, radius * c), Eigen::Vector3i::Constant(n), Eigen::Vector3d::Constant(c));
    GrainLevelSet grain = grain_from_masks(solid.view, filled.view, {.spacing = 2 * c});
    grain.id = id;
    grain.label = 4000000000u + std::uint32_t(id);
    return grain;
}

const History chain = {{"make-sample-ct", "1", {{"seed", "3"}}, {}}, {"csct2ls", "1", {{"spacing", "0.0001"}}, {"stack.tif"}}};

void expect_same(const DistanceGrid& a, const DistanceGrid& b)
{
    ASSERT_EQ(a.size, b.size);
    EXPECT_NEAR((a.origin - b.origin).norm(), 0.0, 1e-9 * a.spacing);
    EXPECT_DOUBLE_EQ(a.spacing, b.spacing);
    for (std::size_t n = 0; n < a.distance.size(); ++n) ASSERT_NEAR(a.distance[n], b.distance[n], 1e-6 * a.spacing);
    EXPECT_NEAR(a.outside_limit, b.outside_limit, 1e-6 * a.spacing);
    EXPECT_NEAR(a.inside_limit, b.inside_limit, 1e-6 * a.spacing);
}

// Whole blocks of the tree lie below the band here; they must stay solid.
TEST_F(VdbFile, keeps_the_deep_inside_of_a_large_grain_solid)
{
    write_grains(folder / "grains.vdb", std::vector<GrainLevelSet>{hollow_ball(1, 66)}, chain);
    const GrainLevelSet back = read_grains(folder / "grains.vdb").grains.at(0);
    EXPECT_LT(back.apparent.sample(Eigen::Vector3d::Zero()), 0.0);
    EXPECT_NEAR(solid_volume(back.apparent) / back.apparent_volume, 1.0, 1e-5);
    EXPECT_NEAR(solid_volume(back.solid) / back.volume, 1.0, 1e-5);
}

TEST_F(VdbFile, gives_grains_and_history_back)
{
    const std::vector<GrainLevelSet> grains = {hollow_ball(2, 14), hollow_ball(1, 20)};
    write_grains(folder / "grains.vdb", grains, chain);
    const GrainFile read = read_grains(folder / "grains.vdb");
    ASSERT_EQ(read.grains.size(), 2u);
    EXPECT_EQ(to_json(read.history), to_json(chain));
    for (const GrainLevelSet& grain : grains) {
        const GrainLevelSet& back = read.grains[std::size_t(grain.id - 1)];
        EXPECT_EQ(back.id, grain.id);
        EXPECT_EQ(back.label, grain.label);
        EXPECT_EQ(back.volume, grain.volume);
        EXPECT_EQ(back.apparent_volume, grain.apparent_volume);
        EXPECT_EQ(back.equivalent_diameter, grain.equivalent_diameter);
        EXPECT_EQ(back.intraparticle_porosity, grain.intraparticle_porosity);
        EXPECT_EQ(back.inertia, grain.inertia);
        EXPECT_EQ(back.centre, grain.centre);
        expect_same(back.solid, grain.solid);
        expect_same(back.apparent, grain.apparent);
        EXPECT_GT(back.solid.sample(Eigen::Vector3d::Zero()), 0.0) << "cavity";
        EXPECT_NEAR(solid_volume(back.solid) / grain.volume, 1.0, 1e-6);
        // Every clamped node of the file compares as clamped.
        for (const float d : back.solid.distance) EXPECT_TRUE(d <= float(back.solid.outside_limit) && d >= -float(back.solid.inside_limit));
        EXPECT_EQ(double(back.apparent.distance.front()), back.apparent.outside_limit);
    }
}

TEST_F(VdbFile, has_the_same_bytes_every_time)
{
    const std::vector<GrainLevelSet> grains = {hollow_ball(1, 12)};
    write_grains(folder / "a.vdb", grains, chain);
    write_grains(folder / "b.vdb", grains, chain);
    EXPECT_EQ(read_text_file(folder / "a.vdb"), read_text_file(folder / "b.vdb"));
}

TEST_F(VdbFile, that_is_absent_foreign_or_cut_short_is_an_error)
{
    EXPECT_THROW(read_grains(folder / "absent.vdb"), Error);
    write_text_file(folder / "text.vdb", "this is no level set, but a line of text that is long enough for a header");
    EXPECT_THROW(read_grains(folder / "text.vdb"), Error);
    const std::vector<GrainLevelSet> grains = {hollow_ball(1, 12)};
    write_grains(folder / "grains.vdb", grains, chain);
    const std::string bytes = read_text_file(folder / "grains.vdb");
    for (const double part : {0.001, 0.05, 0.5, 0.95}) {
        write_text_file(folder / "cut.vdb", std::string_view(bytes).substr(0, std::size_t(part * double(bytes.size()))));
        EXPECT_THROW(read_grains(folder / "cut.vdb"), Error) << part;
    }
    try {
        read_grains(folder / "text.vdb");
    } catch (const Error& error) {
        EXPECT_NE(std::string(error.what()).find("text.vdb"), std::string::npos);
        EXPECT_NE(std::string(error.what()).find("csct2ls"), std::string::npos);
    }
}

TEST_F(VdbFile, has_the_same_bytes_whatever_the_order_and_the_threads)
{
    std::vector<GrainLevelSet> grains;
    for (int id = 1; id <= 6; ++id) grains.push_back(hollow_ball(id, 8 + id));
    write_grains(folder / "a.vdb", grains, chain);
    GrainWriter writer(folder / "b.vdb");
    writer.set_history(chain);
    std::vector<std::thread> threads;
    for (int t = 0; t < 3; ++t)
        threads.emplace_back([&, t] {
            for (const int n : {5 - t, t}) writer.add(grains[std::size_t(n)]);
        });
    for (std::thread& thread : threads) thread.join();
    writer.commit();
    EXPECT_EQ(read_text_file(folder / "a.vdb"), read_text_file(folder / "b.vdb"));
}

// The grids are written one by one and joined; what OpenVDB itself would write of them must come out.
TEST_F(VdbFile, is_a_file_of_openvdb_grid_by_grid)
{
    const std::vector<GrainLevelSet> grains = {hollow_ball(3, 20), hollow_ball(1, 12), hollow_ball(10, 9)};
    write_grains(folder / "grains.vdb", grains, chain);
    openvdb::io::File file((folder / "grains.vdb").string());
    file.open();
    EXPECT_EQ(file.getMetadata()->metaValue<std::string>("history"), to_json(chain));
    const auto all = file.getGrids();
    ASSERT_EQ(all->size(), 6U);
    for (const GrainLevelSet& grain : grains)
        for (const bool apparent : {false, true}) {
            const std::string name = "grain_" + std::to_string(grain.id) + (apparent ? "_apparent" : "");
            const auto grid = openvdb::gridPtrCast<openvdb::FloatGrid>(file.readGrid(name));
            ASSERT_TRUE(grid) << name;
            EXPECT_EQ(grid->getName(), name);
            EXPECT_EQ(grid->getGridClass(), openvdb::GRID_LEVEL_SET);
            EXPECT_EQ(grid->metaValue<std::string>("history"), to_json(chain));
            EXPECT_EQ(grid->metaValue<std::int64_t>("label"), std::int64_t(grain.label));
            EXPECT_EQ(grid->activeVoxelCount(), std::uint64_t(grid->metaValue<std::int64_t>("file_voxel_count")));
            const DistanceGrid& dense = apparent ? grain.apparent : grain.solid;
            auto values = grid->getConstAccessor();
            const openvdb::Vec3i first = grid->metaValue<openvdb::Vec3i>("lattice_first");
            for (std::size_t n = 0; n < dense.distance.size(); n += 7) {
                const int nx = dense.size.x(), ny = dense.size.y(), i = int(n) % nx, j = int(n) / nx % ny, k = int(n) / nx / ny;
                ASSERT_NEAR(values.getValue(openvdb::Coord(first[0] + i, first[1] + j, first[2] + k)), 1e3 * double(dense.distance[n]), 1e-6);
            }
        }
}

/// Resident memory of this process now [bytes].
double resident()
{
    std::ifstream statm("/proc/self/statm");
    double all = 0, pages = 0;
    statm >> all >> pages;
    return pages * double(sysconf(_SC_PAGESIZE));
}

TEST_F(VdbFile, does_not_grow_in_memory)
{
#if defined(__SANITIZE_ADDRESS__)
    GTEST_SKIP() << "freed memory is kept";
#endif
    GrainLevelSet grain = hollow_ball(1, 50);
    GrainWriter writer(folder / "grains.vdb");
    for (; grain.id <= 20; ++grain.id) writer.add(grain);  // the allocator has its fill
    const double before = resident();
    for (; grain.id <= 120; ++grain.id) writer.add(grain);
    const double growth = resident() - before;
    writer.commit();
    const double written = double(fs::file_size(folder / "grains.vdb")) * 100 / 120;
    EXPECT_GT(written, 25e6) << "too little to tell";
    EXPECT_LT(growth, 0.3 * written);
}

TEST_F(VdbFile, leaves_nothing_behind_on_a_full_disk)
{
    rlimit before{};
    getrlimit(RLIMIT_FSIZE, &before);
    const auto handler = std::signal(SIGXFSZ, SIG_IGN);
    const GrainLevelSet grain = hollow_ball(1, 20);
    const rlimit full{20000, before.rlim_max};
    setrlimit(RLIMIT_FSIZE, &full);
    std::string complaint;
    try {
        write_grains(folder / "grains.vdb", {&grain, 1}, chain);
    } catch (const Error& error) {
        complaint = error.what();
    }
    setrlimit(RLIMIT_FSIZE, &before);
    std::signal(SIGXFSZ, handler);
    EXPECT_NE(complaint.find("grains.vdb: could not be written; check the space left on the disk"), std::string::npos) << complaint;
    EXPECT_TRUE(fs::is_empty(folder));
}

TEST_F(VdbFile, leaves_nothing_behind_when_not_committed)
{
    {
        GrainWriter writer(folder / "grains.vdb");
        writer.add(hollow_ball(1, 12));
        EXPECT_TRUE(fs::is_empty(folder)) << "nothing has a name yet, so that nothing is left if the program is killed";
        EXPECT_THROW(writer.add(hollow_ball(1, 12)), Error) << "same id twice";
    }
    EXPECT_TRUE(fs::is_empty(folder));
    EXPECT_THROW(GrainWriter(folder / "nowhere" / "grains.vdb"), Error);
}

}  // namespace
}  // namespace coral::sdf::test
