#include "sdf/mesh_reader.h"

#include <gtest/gtest.h>
#include <unistd.h>
#include <zlib.h>

#include <fstream>
#include <sstream>

#include "core/error.h"
#include "meshes.h"

namespace coral::sdf::test {
namespace {

namespace fs = std::filesystem;

class MeshReader : public testing::Test {
protected:
    MeshReader() { fs::create_directories(folder_); }
    ~MeshReader() override { fs::remove_all(folder_); }

    fs::path write(const std::string& name, const std::string& text) const
    {
        std::ofstream(folder_ / name, std::ios::binary) << text;
        return folder_ / name;
    }
    fs::path gzip(const fs::path& file) const
    {
        std::ostringstream text;
        text << std::ifstream(file, std::ios::binary).rdbuf();
        const fs::path packed = file.string() + ".gz";
        const gzFile out = gzopen(packed.c_str(), "wb");
        gzwrite(out, text.str().data(), unsigned(text.str().size()));
        gzclose(out);
        return packed;
    }
    static std::string message(const fs::path& file)
    {
        try {
            read_mesh(file, 1.0);
        } catch (const Error& error) {
            return error.what();
        }
        return "no error";
    }

    fs::path folder_ = fs::temp_directory_path() / ("coral_mesh_reader_" + std::to_string(::getpid()));
    TriangleMesh ball_ = ball_mesh({0.5, 0.25, 0.125}, 1.0, 2);
};

const char* tetrahedron_ply =
    "ply\nformat ascii 1.0\ncomment a tetrahedron\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\nproperty uchar red\n"
    "element face 4\nproperty list uchar int vertex_indices\nend_header\n0 0 0 255\n1 0 0 0\n0 1 0 0\n0 0 1 9\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n";

TEST_F(MeshReader, reads_what_is_written_in_either_format_gzipped_or_not)
{
    write_ply(ball_, folder_ / "ball.ply");
    write_stl(ball_, folder_ / "ball.stl");
    for (const fs::path& file : {folder_ / "ball.ply", folder_ / "ball.stl", gzip(folder_ / "ball.ply"), gzip(folder_ / "ball.stl")}) {
        const TriangleMesh mesh = read_mesh(file, 1e-3);
        EXPECT_EQ(mesh.vertices.size(), ball_.vertices.size()) << file << ": the corners of STL triangles are joined";
        EXPECT_EQ(mesh.triangles.size(), ball_.triangles.size());
        EXPECT_NEAR(enclosed_volume(mesh) / enclosed_volume(ball_), 1e-9, 1e-15);
    }
}

TEST_F(MeshReader, reads_text_files)
{
    const TriangleMesh ply = read_mesh(write("tetrahedron.ply", tetrahedron_ply), 2.0);
    EXPECT_EQ(ply.vertices.size(), 4U);
    EXPECT_NEAR(enclosed_volume(ply), 8.0 / 6.0, 1e-12);
    std::string stl = "solid of four\n";
    for (const Eigen::Vector3i& t : ply.triangles) {
        stl += "facet normal 0 0 0\n outer loop\n";
        for (int c = 0; c < 3; ++c) {
            const Eigen::Vector3d v = ply.vertices[std::size_t(t[c])] / 2.0;
            stl += "  vertex " + std::to_string(v.x()) + " " + std::to_string(v.y()) + " +" + std::to_string(v.z()) + "e0\n";
        }
        stl += " endloop\nendfacet\n";
    }
    EXPECT_NEAR(enclosed_volume(read_mesh(write("tetrahedron.STL", stl + "endsolid of four\n"), 1.0)), 1.0 / 6.0, 1e-12);
    EXPECT_NE(message(write("cut.stl", stl)).find("ends before 'endsolid', after 4 triangles"), std::string::npos);
}

TEST_F(MeshReader, reads_a_binary_stl_that_calls_itself_solid)
{
    write_stl(ball_, folder_ / "ball.stl");
    std::fstream file(folder_ / "ball.stl", std::ios::in | std::ios::out | std::ios::binary);
    file << "solid";
    file.close();
    EXPECT_EQ(read_mesh(folder_ / "ball.stl", 1.0).triangles.size(), ball_.triangles.size());
}

TEST_F(MeshReader, leaves_out_triangles_without_size_and_makes_fans_of_polygons)
{
    const TriangleMesh mesh = read_mesh(write("square.ply", "ply\nformat ascii 1.0\nelement vertex 5\nproperty float x\nproperty float y\nproperty float z\nelement face 2\n"
                                                            "property list uchar int vertex_index\nend_header\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n0 0 0\n4 0 1 2 3\n3 0 4 1\n"), 1.0);
    EXPECT_EQ(mesh.triangles.size(), 2U);
    EXPECT_NEAR(surface_area(mesh), 1.0, 1e-12);
}

TEST_F(MeshReader, names_the_place_of_what_is_damaged)
{
    write_stl(ball_, folder_ / "cut.stl");
    fs::resize_file(folder_ / "cut.stl", 1000);
    EXPECT_NE(message(folder_ / "cut.stl").find("has 1000 bytes where its 128 triangles need 6484"), std::string::npos) << message(folder_ / "cut.stl");
    write_ply(ball_, folder_ / "cut.ply");
    fs::resize_file(folder_ / "cut.ply", fs::file_size(folder_ / "cut.ply") / 2);
    EXPECT_NE(message(folder_ / "cut.ply").find("cut.ply: ends "), std::string::npos) << message(folder_ / "cut.ply");
    const fs::path packed = gzip(folder_ / "cut.stl");
    fs::resize_file(packed, fs::file_size(packed) / 2);
    EXPECT_NE(message(packed).find("breaks off after"), std::string::npos) << message(packed);

    const std::string text = tetrahedron_ply;
    const auto changed = [&](const std::string& from, const std::string& to) {
        std::string copy = text;
        return message(write("bad.ply", copy.replace(copy.find(from), from.size(), to)));
    };
    EXPECT_NE(changed("3 1 2 3", "3 1 2 7").find("names vertex 7 of 4"), std::string::npos);
    EXPECT_NE(changed("1 0 0 0", "1 o 0 0").find("vertex 2: 'o' is no number"), std::string::npos) << changed("1 0 0 0", "1 o 0 0");
    EXPECT_NE(changed("1 0 0 0", "1 nan 0 0").find("vertex 2 has a coordinate that is no number"), std::string::npos);
    EXPECT_NE(changed("element vertex 4", "element vertex 4000000000").find("ends before its 4000000000 elements"), std::string::npos);
    EXPECT_NE(changed("format ascii", "format binary_big_endian").find("binary_big_endian"), std::string::npos);
    EXPECT_NE(changed("property float x", "property float w").find("vertex 1 has a coordinate"), std::string::npos);
    EXPECT_NE(message(write("empty.stl", "")).find("0 bytes, too few"), std::string::npos);
    EXPECT_THROW(read_mesh(folder_ / "absent.stl", 1.0), UsageError);
    EXPECT_THROW(read_mesh(write("mesh.obj", "v 0 0 0"), 1.0), UsageError);
}

}  // namespace
}  // namespace coral::sdf::test
