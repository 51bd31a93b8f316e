#include "sdf/vdb_io.h"

#include <openvdb/io/File.h>
#include <openvdb/openvdb.h>
#include <openvdb/tools/Dense.h>
#include <openvdb/tools/Prune.h>

#include <array>
#include <charconv>
#include <map>
#include <mutex>
#include <optional>
#include <sstream>

#include "core/error.h"
#include "core/formats.h"
#include "core/output_file.h"
#include "core/text.h"
#include "sdf/detail/grid_spill.h"
#include "sdf/detail/vdb_seal.h"

namespace coral::sdf {
namespace {

constexpr double millimetres = 1e3;  // of one metre; the only place where lengths are not in metres

using openvdb::FloatGrid;

std::string grid_name(int id, bool apparent) { return "grain_" + std::to_string(id) + (apparent ? "_apparent" : ""); }

/// Id of "grain_<id>" or "grain_<id>_apparent", 0 for any other name.
int id_of(const std::string& name)
{
    if (name.rfind("grain_", 0) != 0) return 0;
    int id = 0;
    const char* end = name.data() + name.size();
    const auto [rest, problem] = std::from_chars(name.data() + 6, end, id);
    return problem == std::errc() && (rest == end || std::string(rest, end) == "_apparent") ? id : 0;
}

openvdb::Coord lattice_offset(const DistanceGrid& grid, const Eigen::Vector3d& origin)
{
    const Eigen::Vector3d steps = (grid.origin - origin) / grid.spacing;
    return {int(std::lround(steps.x())), int(std::lround(steps.y())), int(std::lround(steps.z()))};
}

/// \param origin  of the lattice both grids of a grain share
FloatGrid::Ptr to_vdb(const DistanceGrid& grid, const Eigen::Vector3d& origin, const std::string& name)
{
    if (!std::isfinite(grid.outside_limit) || !std::isfinite(grid.inside_limit)) throw Error(name, "its band has no limits; only clamped grids are stored");
    const float outside = float(grid.outside_limit * millimetres), inside = float(grid.inside_limit * millimetres);
    FloatGrid::Ptr vdb = FloatGrid::create(outside);
    auto values = vdb->getAccessor();
    const openvdb::Coord first = lattice_offset(grid, origin);
    std::size_t n = 0;
    for (int k = 0; k < grid.size.z(); ++k)
        for (int j = 0; j < grid.size.y(); ++j)
            for (int i = 0; i < grid.size.x(); ++i, ++n) {
                const float d = float(grid.distance[n] * millimetres);
                if (d >= outside) continue;
                const openvdb::Coord at(first.x() + i, first.y() + j, first.z() + k);
                if (d <= -inside) values.setValueOff(at, -inside);
                else values.setValueOn(at, d);
            }
    // Not pruneInactive: it would give the deep inside the value of the outside.
    openvdb::tools::pruneLevelSet(vdb->tree(), outside, -inside);
    auto transform = openvdb::math::Transform::createLinearTransform(grid.spacing * millimetres);
    transform->postTranslate(openvdb::Vec3d(origin.x(), origin.y(), origin.z()) * millimetres);
    vdb->setTransform(transform);
    vdb->setName(name);
    vdb->setGridClass(openvdb::GRID_LEVEL_SET);
    vdb->insertMeta("lattice_first", openvdb::Vec3IMetadata(openvdb::Vec3i(first.x(), first.y(), first.z())));
    vdb->insertMeta("lattice_size", openvdb::Vec3IMetadata(openvdb::Vec3i(grid.size.x(), grid.size.y(), grid.size.z())));
    vdb->insertMeta("inside_limit", openvdb::DoubleMetadata(grid.inside_limit));
    vdb->insertMeta("outside_limit", openvdb::DoubleMetadata(grid.outside_limit));
    return vdb;
}

void describe(FloatGrid& vdb, const GrainLevelSet& grain)
{
    std::string inertia;
    for (int n = 0; n < 9; ++n) inertia += (n ? " " : "") + to_text(grain.inertia(n / 3, n % 3));
    vdb.insertMeta("world_unit", openvdb::StringMetadata("mm"));
    vdb.insertMeta("sign", openvdb::StringMetadata("negative in solid"));
    vdb.insertMeta("label", openvdb::Int64Metadata(grain.label));
    vdb.insertMeta("spacing", openvdb::DoubleMetadata(grain.solid.spacing));
    vdb.insertMeta("volume", openvdb::DoubleMetadata(grain.volume));
    vdb.insertMeta("apparent_volume", openvdb::DoubleMetadata(grain.apparent_volume));
    vdb.insertMeta("equivalent_diameter", openvdb::DoubleMetadata(grain.equivalent_diameter));
    vdb.insertMeta("intraparticle_porosity", openvdb::DoubleMetadata(grain.intraparticle_porosity));
    vdb.insertMeta("inertia", openvdb::StringMetadata(inertia));
    vdb.insertMeta("centre", openvdb::Vec3DMetadata(openvdb::Vec3d(grain.centre.x(), grain.centre.y(), grain.centre.z())));
}

/// A lattice holds more bytes than the tree it comes from, but a grain of 10,000 nodes across not a thousand times more.
constexpr double most_lattice_per_stored = 4096, always_allowed_bytes = 64 << 20;

/// \throws Error when the lattice is not one that a file of so many bytes can hold
void require_lattice(const FloatGrid& vdb, const openvdb::Vec3i& first, const openvdb::Vec3i& size, double file_bytes)
{
    constexpr int far = 1 << 24;
    double bytes = sizeof(float);
    bool good = true;
    for (int a = 0; a < 3; ++a) {
        good = good && size[a] >= 2 && size[a] < far && first[a] > -far && first[a] < far;
        bytes *= size[a];
    }
    const double spacing = vdb.metaValue<double>("spacing");
    if (!good || bytes > std::max(always_allowed_bytes, most_lattice_per_stored * file_bytes) || !(spacing > 0 && spacing < 1))
        throw Error(vdb.getName(), "its lattice is out of range", "make the file again with csct2ls");
}

DistanceGrid to_dense(const FloatGrid& vdb, double file_bytes)
{
    DistanceGrid grid;
    const openvdb::Vec3i first = vdb.metaValue<openvdb::Vec3i>("lattice_first"), size = vdb.metaValue<openvdb::Vec3i>("lattice_size");
    require_lattice(vdb, first, size, file_bytes);
    grid.size = Eigen::Vector3i(size[0], size[1], size[2]);
    grid.spacing = vdb.metaValue<double>("spacing");
    const openvdb::Vec3d origin = vdb.indexToWorld(openvdb::Coord(first[0], first[1], first[2])) / millimetres;
    grid.origin = Eigen::Vector3d(origin[0], origin[1], origin[2]);
    grid.distance.resize(grid.node_count());
    const openvdb::Coord low(first[0], first[1], first[2]);
    const openvdb::CoordBBox box(low, low.offsetBy(size[0] - 1, size[1] - 1, size[2] - 1));
    openvdb::tools::Dense<float, openvdb::tools::LayoutXYZ> dense(box, grid.distance.data());
    openvdb::tools::copyToDense(vdb, dense, /*serial=*/true);
    grid.outside_limit = vdb.metaValue<double>("outside_limit");
    grid.inside_limit = vdb.metaValue<double>("inside_limit");
    for (float& d : grid.distance) d = float(d / millimetres);
    // A clamped value must compare as clamped after the two roundings.
    grid.outside_limit = std::min(grid.outside_limit, double(*std::max_element(grid.distance.begin(), grid.distance.end())));
    const double deepest = -double(*std::min_element(grid.distance.begin(), grid.distance.end()));
    if (std::abs(deepest - grid.inside_limit) < 1e-6 * grid.inside_limit) grid.inside_limit = std::min(grid.inside_limit, deepest);
    return grid;
}

Eigen::Matrix3d read_inertia(const FloatGrid& vdb)
{
    Eigen::Matrix3d inertia;
    std::istringstream text(vdb.metaValue<std::string>("inertia"));
    for (int n = 0; n < 9; ++n)
        if (!(text >> inertia(n / 3, n % 3))) throw Error(vdb.getName(), "metadata inertia does not hold nine numbers", "make the file again with csct2ls");
    return inertia;
}

/// Runs `read` and turns any complaint of OpenVDB into an Error about the file.
template <class Read>
auto guarded(const std::filesystem::path& file, const Read& read)
{
    try {
        return read();
    } catch (const Error&) {
        throw;
    } catch (const std::exception& problem) {
        throw Error(file.string(), std::string("no readable file of grains (") + problem.what() + ")", "make it with csct2ls, or copy it again");
    }
}

}  // namespace

struct GrainWriter::Impl {
    using Place = detail::GridSpill::Place;
    OutputFile output;
    std::string history = to_json(History{});
    std::mutex lock;  // of what follows
    std::optional<detail::GridSpill> spill;
    std::map<int, std::array<Place, 2>> grids;

    explicit Impl(const std::filesystem::path& file) : output(file) {}
    void open_spill() { spill.emplace(output.temporary().string() + ".grids"); }

    /// Runs `write` and turns a failure of streams or of OpenVDB into an Error about the file.
    template <class Write>
    void guarded(const Write& write) const
    {
        constexpr const char* hint = "check the space left on the disk";
        try {
            write();
        } catch (const Error&) {
            throw;
        } catch (const std::ios_base::failure&) {
            throw Error(output.target().string(), "could not be written", hint);
        } catch (const std::exception& problem) {
            throw Error(output.target().string(), std::string("could not be written (") + problem.what() + ")", hint);
        }
    }
};

GrainWriter::GrainWriter(const std::filesystem::path& file) : impl_(new Impl(file)) { openvdb::initialize(); }
GrainWriter::~GrainWriter() = default;

void GrainWriter::set_history(const History& history) { impl_->history = to_json(history); }

void GrainWriter::add(const GrainLevelSet& grain)
{
    const std::string name = grid_name(grain.id, false);
    if (grain.id < 1) throw Error(name, "ids must be positive");
    impl_->guarded([&] {
        const auto stored = [&](const DistanceGrid& grid, bool apparent) {
            const FloatGrid::Ptr vdb = to_vdb(grid, grain.solid.origin, grid_name(grain.id, apparent));
            describe(*vdb, grain);
            vdb->insertMeta("history", openvdb::StringMetadata(impl_->history));
            return detail::store(vdb);
        };
        const detail::StoredGrid solid = stored(grain.solid, false), apparent = stored(grain.apparent, true);
        const std::lock_guard guard(impl_->lock);
        if (impl_->grids.count(grain.id)) throw Error(name, "ids must differ");
        if (!impl_->spill) impl_->open_spill();
        const Impl::Place first = impl_->spill->add(solid), second = impl_->spill->add(apparent);
        impl_->grids[grain.id] = {first, second};
    });
}

void GrainWriter::commit()
{
    openvdb::MetaMap metadata;
    metadata.insertMeta("history", openvdb::StringMetadata(impl_->history));
    metadata.insertMeta("content", openvdb::StringMetadata("coralsand grains"));
    metadata.insertMeta("format_version", openvdb::Int32Metadata(std::int32_t(file_format::grains)));
    std::vector<Impl::Place> all;
    for (const auto& [id, pair] : impl_->grids) all.insert(all.end(), pair.begin(), pair.end());
    impl_->guarded([&] {
        if (!impl_->spill) impl_->open_spill();
        impl_->spill->join(impl_->output.temporary(), all, metadata);
    });
    detail::seal(impl_->output.temporary());
    impl_->output.commit();
}

struct GrainReader::Impl {
    std::filesystem::path file;
    std::vector<int> ids;
    History history;
};

GrainReader::GrainReader(const std::filesystem::path& file) : impl_(new Impl{file, {}, {}})
{
    openvdb::initialize();
    if (!std::filesystem::is_regular_file(file)) throw Error(file.string(), "no such file", "check the path");
    detail::require_sealed(file);
    guarded(file, [&] {
        openvdb::io::File vdb(file.string());
        vdb.open(false);
        for (auto name = vdb.beginName(); name != vdb.endName(); ++name)
            if (const int id = id_of(name.gridName()); id > 0 && name.gridName() == grid_name(id, false)) impl_->ids.push_back(id);
        const auto metadata = vdb.getMetadata();
        const auto content = metadata->getMetadata<openvdb::StringMetadata>("content");
        if (!content || content->value() != "coralsand grains") throw Error(file.string(), "holds no grains of ours", "make it with csct2ls");
        const auto version = metadata->getMetadata<openvdb::Int32Metadata>("format_version");
        if (version) require_known_format(version->value(), file_format::grains, file.string());
        impl_->history = history_from_json(metadata->metaValue<std::string>("history"), file.string());
    });
    std::sort(impl_->ids.begin(), impl_->ids.end());
}
GrainReader::~GrainReader() = default;

const std::vector<int>& GrainReader::ids() const { return impl_->ids; }
const History& GrainReader::history() const { return impl_->history; }

GrainLevelSet GrainReader::read(int id) const
{
    if (!std::binary_search(impl_->ids.begin(), impl_->ids.end(), id))
        throw Error(impl_->file.string(), "no grid " + grid_name(id, false), "it holds " + std::to_string(impl_->ids.size()) + " grains");
    return guarded(impl_->file, [&] {
        openvdb::io::File vdb(impl_->file.string());  // one per call: a File is not thread-safe
        vdb.open(false);
        std::array<FloatGrid::Ptr, 2> pair;
        for (int twin = 0; twin < 2; ++twin) {
            if (!vdb.hasGrid(grid_name(id, twin == 1))) throw Error(impl_->file.string(), "no grid " + grid_name(id, twin == 1), "make it with csct2ls");
            pair[std::size_t(twin)] = openvdb::gridPtrCast<FloatGrid>(vdb.readGrid(grid_name(id, twin == 1)));
            if (!pair[std::size_t(twin)]) throw Error(impl_->file.string(), grid_name(id, twin == 1) + " is no grid of floats", "make it with csct2ls");
        }
        GrainLevelSet grain;
        const FloatGrid& solid = *pair[0];
        grain.id = id;
        grain.label = std::uint32_t(solid.metaValue<std::int64_t>("label"));
        const double file_bytes = double(std::filesystem::file_size(impl_->file));
        grain.solid = to_dense(solid, file_bytes);
        grain.apparent = to_dense(*pair[1], file_bytes);
        grain.volume = solid.metaValue<double>("volume");
        grain.apparent_volume = solid.metaValue<double>("apparent_volume");
        grain.equivalent_diameter = solid.metaValue<double>("equivalent_diameter");
        grain.intraparticle_porosity = solid.metaValue<double>("intraparticle_porosity");
        grain.inertia = read_inertia(solid);
        const openvdb::Vec3d centre = solid.metaValue<openvdb::Vec3d>("centre");
        grain.centre = Eigen::Vector3d(centre[0], centre[1], centre[2]);
        return grain;
    });
}

void write_grains(const std::filesystem::path& file, std::span<const GrainLevelSet> grains, const History& history)
{
    GrainWriter writer(file);
    writer.set_history(history);
    for (const GrainLevelSet& grain : grains) writer.add(grain);
    writer.commit();
}

GrainFile read_grains(const std::filesystem::path& file)
{
    const GrainReader reader(file);
    GrainFile result{{}, reader.history()};
    for (const int id : reader.ids()) result.grains.push_back(reader.read(id));
    return result;
}

}  // namespace coral::sdf
