#include "pack/checkpoint.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <sstream>

#include "core/error.h"
#include "core/formats.h"
#include "core/hdf5.h"
#include "core/text.h"
#include "core/version.h"
#include "pack/detail/random.h"

namespace coral::pack {
namespace {

const char* const start_anew = "pack without --resume to start anew";

/// Tells contents apart; no protection against someone who means harm. Whole words at a time, since grain files take hundreds of megabytes.
std::string hash_of(const std::filesystem::path& file)
{
    std::ifstream stream(file, std::ios::binary);
    if (!stream) throw Error(file.string(), "cannot be read");
    std::uint64_t hash = 1469598103934665603ull;
    std::vector<char> block(std::size_t{1} << 20);
    while (stream) {
        std::fill(block.begin(), block.end(), '\0');
        stream.read(block.data(), std::streamsize(block.size()));
        const std::size_t size = std::size_t(stream.gcount());
        for (std::size_t at = 0; at < size; at += sizeof(std::uint64_t)) {
            std::uint64_t word;
            std::memcpy(&word, block.data() + at, sizeof word);
            hash = (hash ^ word) * 1099511628211ull;
            hash ^= hash >> 29;
        }
        hash ^= size;
    }
    return std::to_string(hash);
}

/// Number of the first line that differs, from 1.
int first_difference(const std::string& a, const std::string& b)
{
    const auto at = std::mismatch(a.begin(), a.end(), b.begin(), b.end()).first;
    return 1 + int(std::count(a.begin(), at, '\n'));
}

void require_same(const std::string& file, const PackOrigin& stored, const PackOrigin& expected)
{
    if (stored.version != expected.version)
        throw Error(file, "was written by version " + stored.version + ", this is " + expected.version, std::string("resume with that version, or ") + start_anew);
    if (stored.specification != expected.specification)
        throw Error(file, "belongs to another specification: line " + std::to_string(first_difference(expected.specification, stored.specification)) + " has changed since",
                    std::string("put the old specification back, or ") + start_anew);
    if (stored.seed != expected.seed)
        throw Error(file, "belongs to seed " + std::to_string(stored.seed) + ", not " + std::to_string(expected.seed), "add --seed " + std::to_string(stored.seed) + ", or " + start_anew);
    if (stored.scales != expected.scales) throw Error(file, "belongs to a packing with another --scale", std::string("give the same, or ") + start_anew);
    for (const auto& [name, hash] : expected.files) {
        const auto found = stored.files.find(name);
        if (found == stored.files.end()) throw Error(file, "belongs to a packing without the shapes of " + name, std::string("name the file that it began with, or ") + start_anew);
        if (found->second != hash) throw Error(file, "belongs to a packing with other shapes: " + name + " has changed since", std::string("put the old file back, or ") + start_anew);
    }
}

constexpr double PackReport::*times[] = {&PackReport::loading_seconds, &PackReport::pouring_seconds, &PackReport::compression_seconds,
                                         &PackReport::relaxation_seconds, &PackReport::simulated_time};

void write_state(H5File& h5, const PackState& state)
{
    h5.set_attribute("/", "phase", std::int64_t(state.phase));
    h5.set_attribute("/", "batch", std::int64_t(state.batch));
    h5.set_attribute("/", "start", state.start);
    h5.set_attribute("/", "own_friction", std::int64_t(state.own_friction));
    h5.set_attribute("/", "lid_touches", std::int64_t(state.lid_touches));
    std::vector<double> gains;
    for (const ServoGain& gain : state.gains) gains.insert(gains.end(), {gain.share, gain.missing});
    h5.write("/servo", std::span<const double>(gains), {gains.size()});
    const PackReport& r = state.report;
    const std::vector<std::int64_t> counts{r.layers, r.unsettled_layers, r.compressed, r.steps};
    std::vector<double> values;
    for (const auto time : times) values.push_back(r.*time);
    h5.write("/report/counts", std::span<const std::int64_t>(counts), {counts.size()});
    h5.write("/report/times", std::span<const double>(values), {values.size()});
}

PackState read_state(const H5File& h5, const Error& damaged)
{
    PackState state;
    const std::int64_t phase = h5.integer_attribute("/", "phase"), batch = h5.integer_attribute("/", "batch");
    state.start = h5.number_attribute("/", "start");
    state.own_friction = h5.integer_attribute("/", "own_friction") != 0;
    state.lid_touches = h5.integer_attribute("/", "lid_touches") != 0;
    const auto counts = h5.read_integers("/report/counts");
    const auto values = h5.read_doubles("/report/times");
    const auto gains = h5.read_doubles("/servo");
    if (phase < 0 || phase > 2 || batch < 0 || batch > 1'000'000'000 || !std::isfinite(state.start) || counts.size() != 4 || values.size() != std::size(times) || counts[3] < 0 ||
        gains.size() != 2 * state.gains.size())
        throw damaged;
    for (std::size_t axis = 0; axis < state.gains.size(); ++axis) state.gains[axis] = {gains[2 * axis], gains[2 * axis + 1]};
    state.phase = Phase(phase);
    state.batch = int(batch);
    state.report.layers = int(counts[0]);
    state.report.unsettled_layers = int(counts[1]);
    state.report.compressed = counts[2] != 0;
    state.report.steps = counts[3];
    for (std::size_t i = 0; i < std::size(times); ++i) state.report.*times[i] = values[i];
    return state;
}

void write_text(H5File& h5, const std::string& path, const std::string& text)
{
    h5.write(path, std::span(reinterpret_cast<const std::uint8_t*>(text.data()), text.size()), {text.size()});
}

std::string read_text(const H5File& h5, const std::string& path)
{
    const std::vector<std::uint8_t> bytes = h5.read_bytes(path);
    return {bytes.begin(), bytes.end()};
}

}  // namespace

PackOrigin origin_of(const Spec& spec, std::uint64_t seed)
{
    PackOrigin origin{version, spec.text, seed, {}, {}};
    for (const Population& p : spec.populations) {
        origin.scales.push_back(p.scale);
        std::vector<std::filesystem::path> files = p.meshes;
        if (!p.file.empty()) files.push_back(p.file);
        for (const std::filesystem::path& file : files)
            if (const std::string name = file.filename().string(); !origin.files.contains(name)) origin.files[name] = hash_of(file);
    }
    return origin;
}

void write_checkpoint(const std::filesystem::path& file, const PackCheckpoint& checkpoint)
{
    H5File h5 = H5File::create(file);
    h5.set_format(file_format::pack_checkpoint);
    h5.set_attribute("/", "content", "coralsand packing checkpoint");
    h5.set_attribute("/", "version", checkpoint.origin.version);
    write_text(h5, "/origin/specification", checkpoint.origin.specification);
    h5.set_attribute("/origin", "seed", std::to_string(checkpoint.origin.seed));
    h5.write("/origin/scales", std::span<const double>(checkpoint.origin.scales), {checkpoint.origin.scales.size()});
    for (const auto& [name, hash] : checkpoint.origin.files) h5.set_attribute("/origin", "file " + name, hash);
    write_state(h5, checkpoint.state);
    write_text(h5, "/random", checkpoint.state.random);
    h5.write("/world", std::span<const std::uint8_t>(checkpoint.world), {checkpoint.world.size()});
    h5.commit();
}

PackCheckpoint read_checkpoint(const std::filesystem::path& file, const PackOrigin& expected)
{
    const Error damaged(file.string(), "is no checkpoint of a packing, or is damaged", start_anew);
    const H5File h5 = H5File::open(file);
    if (!h5.has_attribute("/", "content") || h5.string_attribute("/", "content") != "coralsand packing checkpoint") throw damaged;
    h5.require_format(file_format::pack_checkpoint);
    for (const char* path : {"/origin/specification", "/origin/scales", "/report/counts", "/report/times", "/random", "/world"})
        if (!h5.exists(path)) throw damaged;
    PackCheckpoint checkpoint;
    PackOrigin& origin = checkpoint.origin;
    origin.version = h5.string_attribute("/", "version");
    origin.specification = read_text(h5, "/origin/specification");
    origin.seed = std::strtoull(h5.string_attribute("/origin", "seed").c_str(), nullptr, 10);
    origin.scales = h5.read_doubles("/origin/scales");
    for (const auto& [name, hash] : expected.files)
        if (h5.has_attribute("/origin", "file " + name)) origin.files[name] = h5.string_attribute("/origin", "file " + name);
    require_same(file.string(), origin, expected);
    checkpoint.state = read_state(h5, damaged);
    checkpoint.state.random = read_text(h5, "/random");
    detail::Random stream;
    if (checkpoint.state.phase == Phase::pouring && !(std::istringstream(checkpoint.state.random) >> stream)) throw damaged;
    checkpoint.world = h5.read_bytes("/world");
    return checkpoint;
}

}  // namespace coral::pack
