#include "sh/shape_file.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include "bodies.h"
#include "core/error.h"
#include "core/hdf5.h"
#include "core/output_file.h"

namespace coral::sh::test {
namespace {

namespace fs = std::filesystem;

class ShapeFileTest : public testing::Test {
protected:
    void SetUp() override
    {
        folder = fs::temp_directory_path() / ("coral_sh_" + std::to_string(::getpid()) + testing::UnitTest::GetInstance()->current_test_info()->name());
        fs::create_directories(folder);
    }
    void TearDown() override { fs::remove_all(folder); }
    fs::path folder;
};

ShapeRecord record(int id, int degree)
{
    ShapeRecord shape;
    shape.id = id;
    shape.surface = lump(degree, 0.1, unsigned(id));
    shape.surface.centre = Eigen::Vector3d(1, 2, 3) * 1e-4;
    shape.surface.scale = 1.01;
    shape.volume = body_properties(shape.surface).volume;
    shape.solid_volume = 0.7 * shape.volume;
    shape.equivalent_diameter = 2;
    shape.errors = {0.01, 0.05, 0.002, -0.03, 0.015, 0.001, 0.004};
    return shape;
}

const History chain = {{"csct2ls", "1", {}, {"stack.tif"}}, {"ls2sh", "1", {{"degree", "10"}}, {"grains.vdb"}}};

TEST_F(ShapeFileTest, gives_shapes_errors_and_history_back)
{
    const std::vector<ShapeRecord> shapes = {record(11, 6), record(2, 10)};
    write_shapes(folder / "grains.sh.h5", shapes, chain);
    const ShapeFile back = read_shapes(folder / "grains.sh.h5");
    ASSERT_EQ(back.shapes.size(), 2u);
    EXPECT_EQ(back.shapes[0].id, 2);
    EXPECT_EQ(back.shapes[1].id, 11);
    EXPECT_EQ(back.shapes[1].surface.coefficients, shapes[0].surface.coefficients);
    EXPECT_EQ(back.shapes[1].surface.centre, shapes[0].surface.centre);
    EXPECT_EQ(back.shapes[1].surface.degree, 6);
    EXPECT_EQ(back.shapes[1].surface.scale, 1.01);
    EXPECT_EQ(back.shapes[1].volume, shapes[0].volume);
    EXPECT_EQ(back.shapes[1].errors.inertia_error, 0.015);
    EXPECT_EQ(back.shapes[1].errors.non_star_fraction, 0.004);
    EXPECT_EQ(to_json(back.history), to_json(chain));
}

TEST_F(ShapeFileTest, has_the_same_bytes_every_time)
{
    const std::vector<ShapeRecord> shapes = {record(1, 10)};
    write_shapes(folder / "a.sh.h5", shapes, chain);
    write_shapes(folder / "b.sh.h5", shapes, chain);
    EXPECT_EQ(read_text_file(folder / "a.sh.h5"), read_text_file(folder / "b.sh.h5"));
}

TEST_F(ShapeFileTest, that_does_not_hold_what_it_should_is_an_error)
{
    EXPECT_THROW(read_shapes(folder / "absent.sh.h5"), Error);
    {
        H5File other = H5File::create(folder / "other.h5");
        other.make_group("/something");
        other.commit();
    }
    EXPECT_THROW(read_shapes(folder / "other.h5"), Error);
    ShapeRecord wrong = record(1, 5);
    wrong.surface.degree = 6;
    write_shapes(folder / "wrong.h5", std::vector<ShapeRecord>{wrong}, chain);
    try {
        read_shapes(folder / "wrong.h5");
        FAIL() << "36 coefficients were taken for degree 6";
    } catch (const Error& error) {
        EXPECT_NE(std::string(error.what()).find("36 coefficients do not fit degree 6"), std::string::npos) << error.what();
    }
}

}  // namespace
}  // namespace coral::sh::test
