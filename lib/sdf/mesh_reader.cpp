#include "sdf/mesh_reader.h"

#include <zlib.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstring>
#include <numeric>
#include <string>
#include <string_view>

#include "core/error.h"
#include "core/text.h"

namespace coral::sdf {
namespace {

constexpr const char* damaged_hint = "the file is truncated or damaged; copy or export it again";

/// Whole content; zlib hands files that are not gzipped through as they are.
std::string content_of(const std::filesystem::path& file)
{
    const gzFile in = gzopen(file.c_str(), "rb");
    if (!in) throw Error(file.string(), "cannot be opened", "check that it may be read");
    gzbuffer(in, 1U << 18);
    std::string text, piece(std::size_t{1} << 20, '\0');
    int got = 0;
    while ((got = gzread(in, piece.data(), unsigned(piece.size()))) > 0) text.append(piece, 0, std::size_t(got));
    if (gzclose(in) != Z_OK || got < 0) throw Error(file.string(), "breaks off after " + std::to_string(text.size()) + " unpacked bytes", damaged_hint);
    return text;
}

/// Walks over words or binary numbers and knows when the file ends.
class Cursor {
public:
    Cursor(std::string_view text, std::string where) : text_(text), where_(std::move(where)) {}

    std::size_t left() const { return text_.size(); }
    [[noreturn]] void fail(const std::string& what) const { throw Error(where_, what, damaged_hint); }

    std::string_view line()
    {
        if (text_.empty()) fail("ends inside its header");
        const std::size_t end = std::min(text_.find('\n'), text_.size());
        std::string_view found = text_.substr(0, end);
        text_.remove_prefix(std::min(end + 1, text_.size()));
        if (!found.empty() && found.back() == '\r') found.remove_suffix(1);
        return found;
    }
    std::string_view word()
    {
        const std::size_t begin = text_.find_first_not_of(" \t\r\n");
        if (begin == std::string_view::npos) return {};
        text_.remove_prefix(begin);
        const std::string_view found = text_.substr(0, text_.find_first_of(" \t\r\n"));
        text_.remove_prefix(found.size());
        return found;
    }
    double number(const std::string& of)
    {
        std::string_view text = word();
        if (text.empty()) fail("ends at " + of);
        if (text.front() == '+') text.remove_prefix(1);
        double value = 0;
        const auto [end, problem] = std::from_chars(text.data(), text.data() + text.size(), value);
        if (problem == std::errc::invalid_argument || end != text.data() + text.size()) fail(of + ": '" + std::string(text.substr(0, 40)) + "' is no number");
        return value;
    }
    template <class T>
    double binary(const std::string& of)
    {
        if (text_.size() < sizeof(T)) fail("ends at " + of);
        T value;
        std::memcpy(&value, text_.data(), sizeof value);
        text_.remove_prefix(sizeof value);
        return double(value);
    }

private:
    std::string_view text_;
    std::string where_;
};

Eigen::Vector3d checked(const Eigen::Vector3d& vertex, const Cursor& in, const std::string& of)
{
    if (!vertex.allFinite()) in.fail(of + " has a coordinate that is no number");
    return vertex;
}

void append_triangle(TriangleMesh& mesh, const std::array<Eigen::Vector3d, 3>& corners)
{
    const int first = int(mesh.vertices.size());
    mesh.vertices.insert(mesh.vertices.end(), corners.begin(), corners.end());
    mesh.triangles.emplace_back(first, first + 1, first + 2);
}

TriangleMesh read_binary_stl(std::string_view text, const std::string& where)
{
    Cursor in(text.substr(80), where);
    const double announced = in.binary<std::uint32_t>("its number of triangles");
    if (double(in.left()) < 50.0 * announced)
        in.fail("has " + std::to_string(text.size()) + " bytes where its " + to_text(announced) + " triangles need " + to_text(84 + 50 * announced));
    TriangleMesh mesh;
    for (double t = 0; t < announced; ++t) {
        const std::string of = "triangle " + to_text(t + 1);
        std::array<float, 12> n{};
        for (float& value : n) value = float(in.binary<float>(of));
        in.binary<std::uint16_t>(of);
        std::array<Eigen::Vector3d, 3> corners;
        for (std::size_t c = 0; c < 3; ++c) corners[c] = checked(Eigen::Vector3d(n[3 + 3 * c], n[4 + 3 * c], n[5 + 3 * c]), in, of);
        append_triangle(mesh, corners);
    }
    return mesh;
}

TriangleMesh read_ascii_stl(std::string_view text, const std::string& where)
{
    Cursor in(text, where);
    TriangleMesh mesh;
    std::array<Eigen::Vector3d, 3> corners;
    std::size_t corner = 0;
    bool ended = false;
    for (std::string_view word = in.word(); !word.empty(); word = in.word()) {
        ended = word == "endsolid" || (ended && word != "facet");
        if (word == "endfacet" && corner != 3) in.fail("triangle " + std::to_string(mesh.triangles.size() + 1) + " has " + std::to_string(corner) + " corners");
        if (word == "endfacet") append_triangle(mesh, corners), corner = 0;
        if (word != "vertex") continue;
        const std::string of = "triangle " + std::to_string(mesh.triangles.size() + 1);
        if (corner == 3) in.fail(of + " has more than three corners");
        Eigen::Vector3d& v = corners[corner++];
        for (int a = 0; a < 3; ++a) v[a] = in.number(of);
        checked(v, in, of);
    }
    if (!ended || corner != 0) in.fail("ends before 'endsolid', after " + std::to_string(mesh.triangles.size()) + " triangles");
    return mesh;
}

/// A property of a PLY element; `count` is the type of the length of a list, empty for a single number.
struct Property {
    std::string name, type, count;
};

struct Element {
    std::string name;
    std::size_t count = 0;
    std::vector<Property> properties;
};

class PlyReader {
public:
    PlyReader(std::string_view text, const std::string& where) : in_(text, where) {}

    TriangleMesh run()
    {
        header();
        for (const Element& element : elements_) {
            if (!element.properties.empty() && element.count > in_.left()) in_.fail("ends before its " + std::to_string(element.count) + " elements '" + element.name + "'");
            for (std::size_t n = 0; n < element.count && !element.properties.empty(); ++n) read(element, element.name + " " + std::to_string(n + 1));
        }
        const double vertices = double(mesh_.vertices.size());
        for (const std::vector<double>& face : faces_)
            for (std::size_t n = 0; n < face.size(); ++n) {
                if (!(face[n] >= 0 && face[n] < vertices)) in_.fail("a face names vertex " + to_text(face[n]) + " of " + to_text(vertices));
                if (n >= 2) mesh_.triangles.emplace_back(int(face[0]), int(face[n - 1]), int(face[n]));
            }
        return std::move(mesh_);
    }

private:
    void header()
    {
        if (in_.line() != "ply") in_.fail("does not begin with 'ply'");
        std::string format;
        for (std::string_view line = in_.line(); line != "end_header"; line = in_.line()) {
            Cursor words(line, "");
            const std::string key(words.word());
            if (key == "format") format = words.word();
            if (key == "element") {
                Element element{std::string(words.word()), 0, {}};
                const std::string count(words.word());
                if (std::from_chars(count.data(), count.data() + count.size(), element.count).ec != std::errc{}) in_.fail("element " + element.name + " has the count '" + count + "'");
                elements_.push_back(element);
            }
            if (key != "property") continue;
            if (elements_.empty()) in_.fail("names a property before any element");
            Property property;
            property.type = words.word();
            if (property.type == "list") property.count = words.word(), property.type = words.word();
            property.name = words.word();
            elements_.back().properties.push_back(property);
        }
        if (format != "ascii" && format != "binary_little_endian")
            in_.fail("has the format '" + format + "' where ascii or binary_little_endian is needed");
        ascii_ = format == "ascii";
    }

    double number(const std::string& type, const std::string& of)
    {
        if (ascii_) return in_.number(of);
        if (type == "float" || type == "float32") return in_.binary<float>(of);
        if (type == "double" || type == "float64") return in_.binary<double>(of);
        if (type == "uchar" || type == "uint8") return in_.binary<std::uint8_t>(of);
        if (type == "char" || type == "int8") return in_.binary<std::int8_t>(of);
        if (type == "ushort" || type == "uint16") return in_.binary<std::uint16_t>(of);
        if (type == "short" || type == "int16") return in_.binary<std::int16_t>(of);
        if (type == "uint" || type == "uint32") return in_.binary<std::uint32_t>(of);
        if (type == "int" || type == "int32") return in_.binary<std::int32_t>(of);
        in_.fail("has a property of the unknown type '" + type + "'");
    }

    void read(const Element& element, const std::string& of)
    {
        Eigen::Vector3d vertex = Eigen::Vector3d::Constant(std::nan(""));
        for (const Property& property : element.properties) {
            if (property.count.empty()) {
                const double value = number(property.type, of);
                for (int a = 0; a < 3; ++a)
                    if (property.name == std::string(1, char('x' + a))) vertex[a] = value;
                continue;
            }
            const double length = number(property.count, of);
            if (!(length >= 0 && length <= double(in_.left()))) in_.fail(of + " has a list of " + to_text(length) + " numbers");
            std::vector<double> list;
            for (double n = 0; n < length; ++n) list.push_back(number(property.type, of));
            if (element.name == "face" && (property.name == "vertex_indices" || property.name == "vertex_index")) faces_.push_back(std::move(list));
        }
        if (element.name == "vertex") mesh_.vertices.push_back(checked(vertex, in_, of));
    }

    Cursor in_;
    bool ascii_ = false;
    std::vector<Element> elements_;
    std::vector<std::vector<double>> faces_;
    TriangleMesh mesh_;
};

/// Joins vertices with equal coordinates and leaves out triangles that lose a side by it.
TriangleMesh joined(const TriangleMesh& mesh)
{
    std::vector<int> order(mesh.vertices.size()), number(mesh.vertices.size());
    std::iota(order.begin(), order.end(), 0);
    const auto key = [&](int v) {
        const Eigen::Vector3d& p = mesh.vertices[std::size_t(v)];
        return std::array{p.x(), p.y(), p.z()};
    };
    std::ranges::stable_sort(order, [&](int a, int b) { return key(a) < key(b); });
    for (std::size_t n = 0; n < order.size(); ++n) {
        const bool same = n > 0 && key(order[n]) == key(order[n - 1]);
        number[std::size_t(order[n])] = same ? number[std::size_t(order[n - 1])] : order[n];
    }
    TriangleMesh out;  // the first of equal vertices stays, in the order of the file
    std::vector<int> place(mesh.vertices.size(), -1);
    for (std::size_t v = 0; v < number.size(); ++v)
        if (number[v] == int(v)) {
            place[v] = int(out.vertices.size());
            out.vertices.push_back(mesh.vertices[v]);
        }
    for (const Eigen::Vector3i& t : mesh.triangles) {
        Eigen::Vector3i u;
        for (int c = 0; c < 3; ++c) u[c] = place[std::size_t(number[std::size_t(t[c])])];
        if (u[0] != u[1] && u[1] != u[2] && u[2] != u[0]) out.triangles.push_back(u);
    }
    return out;
}

std::string kind_of(std::filesystem::path file)
{
    const auto lower = [](std::string text) {
        std::ranges::transform(text, text.begin(), [](unsigned char c) { return char(std::tolower(c)); });
        return text;
    };
    if (lower(file.extension().string()) == ".gz") file = file.stem();
    return lower(file.extension().string());
}

}  // namespace

TriangleMesh read_mesh(const std::filesystem::path& file, double unit)
{
    const std::string where = file.string(), kind = kind_of(file);
    if (!std::filesystem::is_regular_file(file)) throw UsageError(where, "no such file");
    if (kind != ".stl" && kind != ".ply") throw UsageError(where, "is no mesh file by its name", "give .stl, .ply, .stl.gz or .ply.gz");
    const std::string text = content_of(file);
    TriangleMesh mesh;
    if (kind == ".ply") {
        mesh = PlyReader(text, where).run();
    } else {
        std::uint32_t announced = 0;
        if (text.size() >= 84) std::memcpy(&announced, text.data() + 80, sizeof announced);
        // Binary files may begin with "solid" too: their length tells.
        const bool ascii = text.starts_with("solid") && text.size() != 84 + 50 * std::size_t(announced);
        if (!ascii && text.size() < 84) throw Error(where, "has " + std::to_string(text.size()) + " bytes, too few for an STL file", damaged_hint);
        mesh = ascii ? read_ascii_stl(text, where) : read_binary_stl(text, where);
    }
    if (mesh.triangles.empty()) throw Error(where, "holds no triangle", "give the closed surface of a grain");
    for (Eigen::Vector3d& vertex : mesh.vertices) vertex *= unit;
    mesh = joined(mesh);
    if (mesh.triangles.empty()) throw Error(where, "holds no triangle of any size", "give the closed surface of a grain");
    return mesh;
}

}  // namespace coral::sdf
