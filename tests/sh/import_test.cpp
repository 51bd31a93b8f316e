#include "sh/import.h"

#include <gtest/gtest.h>

#include "bodies.h"
#include "core/error.h"
#include "core/output_file.h"
#include "sh/quadrature.h"
#include "tools/run_program.h"

namespace coral::sh::test {
namespace {

namespace fs = std::filesystem;
using coral::test::ScratchFolder;

const fs::path shared = fs::path(CORAL_SOURCE_DIR) / "../shared/data";

class Import : public testing::Test {
protected:
    fs::path file(const std::string& name, const std::string& text) const
    {
        write_text_file(folder.path() / name, text);
        return folder.path() / name;
    }
    /// The message that reading the text as coefficients ends with.
    std::string complaint(const std::string& text) const
    {
        try {
            read_tsquare(file("bad.dat", text), 1.0);
        } catch (const Error& error) {
            return error.what();
        }
        return "no error";
    }
    ScratchFolder folder;
};

TEST_F(Import, turns_complex_coefficients_with_condon_shortley_phase_into_ours)
{
    // Y_1^1 = -sqrt(3/8pi) (x + iy), Y_1^-1 = sqrt(3/8pi) (x - iy): a_11 = p + iq gives r = ... - 2 sqrt(3/8pi) (p x - q y).
    const fs::path text = file("a.dat", "0 0 10 0\n1 1 0.3 0.2\n1 0 0.5 0\n1 -1 -0.3 0.2\n");
    const Evaluator r(read_tsquare(text, 2.0));
    const double pi = std::numbers::pi, base = 10 * std::sqrt(0.25 / pi), slope = 2 * std::sqrt(3 / (8 * pi));
    EXPECT_NEAR(r.radius(Eigen::Vector3d::UnitX()), 2 * (base - slope * 0.3), 1e-12);
    EXPECT_NEAR(r.radius(Eigen::Vector3d::UnitY()), 2 * (base + slope * 0.2), 1e-12);
    EXPECT_NEAR(r.radius(Eigen::Vector3d::UnitZ()), 2 * (base + 0.5 * std::sqrt(0.75 / pi)), 1e-12);
}

TEST_F(Import, names_file_line_and_what_it_expected_of_malformed_coefficients)
{
    const auto says = [&](const std::string& text, const std::string& part) { EXPECT_NE(complaint(text).find(part), std::string::npos) << complaint(text); };
    says("0 0 1 0\n1 1 0.1\n", "bad.dat:2: expected four numbers 'n m Re(a_nm) Im(a_nm)', found '1 1 0.1'");
    says("0 0 1 0\n1 1 x 0\n", "bad.dat:2: expected four numbers");
    says("0 0 1 0\n1 1 nan 0\n", "bad.dat:2: expected four numbers");
    says("0 0 1 0\n\n1 2 0 0\n", "bad.dat:3: expected an order m of -n to n");
    says("0 0 1 0\n900 2 0 0\n", "bad.dat:2: expected a degree n of 0 to 200");
    says("0 0 1 0\n0 0 1 0\n", "bad.dat:2: this harmonic was given before");
    says("0 0 1 0\n1 1 0 0\n1 0 0 0\n", "the harmonic n = 1, m = -1 is missing");
    says("0 0 1 0\n1 1 0.3 0.2\n1 0 0 0\n1 -1 0.3 0.2\n", "not conjugate");
    says("0 0 -1 0\n", "a_00 greater than zero");
    says("", "empty");
}

TEST_F(Import, tells_what_a_file_is_by_its_content)
{
    EXPECT_EQ(published_format(file("a", "  0  0  31.4  0\n")), PublishedFormat::tsquare_coefficients);
    EXPECT_EQ(published_format(file("b", "Name xlow xhi ylow yhi\n")), PublishedFormat::tsquare_table);
    EXPECT_EQ(published_format(file("c", "Particle ID,Volume\n")), PublishedFormat::sand_atlas_table);
    EXPECT_THROW(published_format(file("d", "{}")), Error);
    try {
        published_format(file("e", "Xsize: 115\n"));
        FAIL() << "voxels were taken for coefficients";
    } catch (const Error& error) {
        EXPECT_NE(std::string(error.what()).find("csct2ls"), std::string::npos) << error.what();
    }
}

TEST_F(Import, never_guesses_a_unit)
{
    const fs::path set = file("a.dat", "0 0 10 0\n");
    EXPECT_THROW(import_shapes({set}, {}), UsageError);
    EXPECT_NEAR(import_shapes({set}, {.unit = 1e-3}).shapes[0].record.equivalent_diameter, 2e-2 * std::sqrt(0.25 / std::numbers::pi), 1e-15);
    EXPECT_NEAR(import_shapes({set}, {.scale_to = 5e-3}).shapes[0].record.equivalent_diameter, 5e-3, 1e-15);
    const fs::path table = file("t.dat", "Name xlow xhi ylow yhi zlow zhi volume surf_area norm deq trace Nnn curvature length(mm)\na.dat -1 1 -1 1 -1 1 4 12 1 1 1 0 1 2\n");
    EXPECT_NEAR(import_shapes({set, table}, {}).shapes[0].figures.volume, 4e-9, 1e-20);
    EXPECT_THROW(import_shapes({set, table}, {.unit = 1e-6}), UsageError);
    EXPECT_THROW(import_shapes({table}, {}), Error);
    const fs::path other = file("other.dat", "0 0 10 0\n");
    EXPECT_THROW(import_shapes({set, table, other}, {}), UsageError) << "the table speaks of a.dat only";
}

TEST_F(Import, ellipsoid_has_the_volume_and_inertia_of_its_axes)
{
    const Eigen::Vector3d axes(3, 1.2, 1);
    const BodyProperties body = body_properties(ellipsoid_surface(axes, 20));
    const double volume = 4.0 / 3.0 * std::numbers::pi * axes.prod();
    EXPECT_NEAR(body.volume / volume, 1.0, 1e-12);
    EXPECT_NEAR(body.inertia(0, 0) / (0.2 * volume * (1.44 + 1.0)), 1.0, 5e-3);
    EXPECT_NEAR(body.inertia(2, 2) / (0.2 * volume * (9.0 + 1.44)), 1.0, 5e-3);
}

TEST_F(Import, survives_rows_without_size_and_names_the_line_of_a_bad_cell)
{
    const std::string head = "Particle ID,Volume (µm³),Major Axis Length (µm),Middle Axis Length (µm),Minor Axis Length (µm),True Sphericity (-)\n";
    const AxesTable table = read_sand_atlas(file("s.csv", head + "1,3375,0,0,0,\n2,inf,1,1,1,1\n3,,1,1,1,1\n4,523.6,10,10,10,1\n"), 4);
    EXPECT_EQ(table.left_out, 3u);
    ASSERT_EQ(table.shapes.size(), 1u);
    EXPECT_EQ(table.shapes[0].name, "s.csv 4");
    EXPECT_NEAR(body_properties(table.shapes[0].surface).volume, std::numbers::pi / 6 * 1e-15, 1e-21);
    try {
        read_sand_atlas(file("s.csv", head + "1,1,1,1,1,1\n2,big,1,1,1,1\n"), 4);
        FAIL() << "a word was taken for a volume";
    } catch (const Error& error) {
        EXPECT_NE(std::string(error.what()).find("s.csv:3: expected a number in column 'Volume"), std::string::npos) << error.what();
    }
    EXPECT_THROW(read_sand_atlas(file("s.csv", head + "1,0,0,0,0,\n"), 4), Error);
}

TEST_F(Import, gives_the_published_volume_area_and_box_of_95_real_stones)
{
    if (!fs::exists(shared / "sh-fdot57")) GTEST_SKIP() << "needs the shared data set sh-fdot57";
    const ImportedSet set = import_shapes({shared / "sh-fdot57"}, {});
    ASSERT_EQ(set.shapes.size(), 95u);
    EXPECT_EQ(set.without_unit, std::vector<std::string>{"cement-anm.dat"}) << "the table does not name it: its unit is not known";
    double volume = 0, area = 0, box = 0;
    int renamed = 0;
    for (const ImportedShape& shape : set.shapes) {
        renamed += shape.figures.degree != shape.figures.named_degree;
        volume = std::max(volume, std::abs(shape.record.errors.volume_error));
        area = std::max(area, std::abs(shape.record.errors.area_error));
        Eigen::Vector3d lower = Eigen::Vector3d::Zero(), upper = lower;
        const Evaluator evaluator(shape.record.surface);
        for (const Eigen::Vector3d& u : sphere_quadrature(60, 120).directions) {
            lower = lower.cwiseMin(evaluator.point(u));
            upper = upper.cwiseMax(evaluator.point(u));
        }
        // A wrong phase would turn the shape by half a turn about z and swap the sides.
        const double off = std::max((lower - shape.figures.lower).cwiseAbs().maxCoeff(), (upper - shape.figures.upper).cwiseAbs().maxCoeff());
        box = std::max(box, off / shape.record.equivalent_diameter);
    }
    std::printf("largest error against the published figures: volume %.2e, area %.2e, box %.2e of the diameter\n", volume, area, box);
    EXPECT_LE(volume, 5e-3);
    EXPECT_LE(area, 5e-3);
    EXPECT_LE(box, 2e-2);
    EXPECT_EQ(renamed, 4) << "rows whose figures belong to a lower degree than they name";
}

TEST_F(Import, gives_the_published_volume_of_every_row_of_the_sand_atlas)
{
    if (!fs::exists(shared / "sand-atlas-shapes")) GTEST_SKIP() << "needs the shared data set sand-atlas-shapes";
    double worst = 0;
    std::size_t rows = 0, left_out = 0;
    for (const char* name : {"LECA-0000006.csv", "alveolinella-0000010.csv", "caicos-0000001.csv", "hostun-0000005.csv", "operculina-0000007.csv"}) {
        const ImportedSet set = import_shapes({shared / "sand-atlas-shapes" / name}, {.degree = 8});
        rows += set.shapes.size();
        for (const ImportedShape& shape : set.shapes) worst = std::max(worst, std::abs(shape.record.errors.volume_error));
        left_out += set.left_out;
    }
    EXPECT_GT(left_out, 0u) << "Operculina holds one-voxel particles without axes";
    std::printf("%zu rows, largest volume error %.2e\n", rows, worst);
    EXPECT_GT(rows, 700u);
    EXPECT_LE(worst, 5e-3);
}

}  // namespace
}  // namespace coral::sh::test
