#include "core/hdf5.h"

#include <hdf5.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstring>

#include "core/error.h"
#include "core/output_file.h"
#include "core/record.h"

namespace coral {
namespace {

/// Every file is closed by its owner. What HDF5 closes at exit are files that could not be written, on a full disk for instance: it crashes over them.
[[maybe_unused]] const bool closes_nothing_at_exit = H5dont_atexit() >= 0;

/// HDF5 fills in what was never written, so that a damaged size may ask for any amount of memory. Deflate packs 1032 : 1 at best.
constexpr double most_unpacked_per_stored = 1100;
constexpr double always_allowed_bytes = 64 << 20;

/// An HDF5 identifier closed by the function that fits it.
class Id {
public:
    Id(hid_t id, herr_t (*close)(hid_t)) : id_(id), close_(close) {}
    ~Id() { if (id_ >= 0) close_(id_); }
    Id(const Id&) = delete;
    Id& operator=(const Id&) = delete;
    operator hid_t() const { return id_; }
    bool valid() const { return id_ >= 0; }

private:
    hid_t id_;
    herr_t (*close_)(hid_t);
};

Id string_type(std::size_t length)
{
    const hid_t type = H5Tcopy(H5T_C_S1);
    H5Tset_size(type, std::max<std::size_t>(length, 1));
    H5Tset_cset(type, H5T_CSET_UTF8);
    H5Tset_strpad(type, H5T_STR_NULLPAD);
    return {type, H5Tclose};
}

/// Large arrays go in chunks of about 64k elements along the first axis. What is not deflated has checksums, so that damage shows.
Id creation_list(const std::vector<std::size_t>& dims, bool deflate)
{
    const hid_t list = H5Pcreate(H5P_DATASET_CREATE);
    H5Pset_obj_track_times(list, 0);
    std::size_t count = 1;
    for (std::size_t d : dims) count *= d;
    if (count > 4096) {
        std::vector<hsize_t> chunk(dims.begin(), dims.end());
        std::size_t row = count / dims[0];
        chunk[0] = std::clamp<hsize_t>(65536 / std::max<std::size_t>(row, 1), 1, dims[0]);
        H5Pset_chunk(list, static_cast<int>(chunk.size()), chunk.data());
        if (deflate) {
            H5Pset_shuffle(list);
            H5Pset_deflate(list, 4);
        } else {
            H5Pset_fletcher32(list);
        }
    }
    return {list, H5Pclose};
}

bool numeric(const std::string& text)
{
    return !text.empty() && text.size() < 19 && std::ranges::all_of(text, [](unsigned char c) { return std::isdigit(c); });
}

herr_t collect_name(hid_t, const char* name, const H5L_info_t*, void* names)
{
    static_cast<std::vector<std::string>*>(names)->emplace_back(name);
    return 0;
}

}  // namespace

struct H5File::Impl {
    std::filesystem::path path;
    std::unique_ptr<OutputFile> output;  ///< set while a new file is being written
    hid_t file = -1;
    bool deflate = true;

    ~Impl() { close(); }
    const std::filesystem::path& file_on_disk() const { return output ? output->temporary() : path; }
    void close()
    {
        if (file >= 0) H5Fclose(file);
        file = -1;
    }
    [[noreturn]] void fail(const std::string& object, const std::string& what) const
    {
        throw Error(path.string() + ":" + object, what, output ? "check the space left on the disk" : "is it the right file? make it again with the tool that wrote it");
    }
    /// What an attribute of the file itself is called in a message: "file.h5" rather than "file.h5:/".
    [[noreturn]] void fail_attribute(const std::string& object, const std::string& name, const std::string& what) const
    {
        throw Error(object == "/" ? path.string() : path.string() + ":" + object, "attribute " + name + " " + what,
                    output ? "check the space left on the disk" : "is it the right file? make it again with the tool that wrote it");
    }
    bool exists(const std::string& object) const
    {
        if (object == "/" || object.empty()) return true;
        for (std::size_t i = 1; i <= object.size(); ++i) {
            if (i != object.size() && object[i] != '/') continue;
            if (H5Lexists(file, object.substr(0, i).c_str(), H5P_DEFAULT) <= 0) return false;
        }
        return true;
    }
    /// The group and those on the way, each without time stamps (HDF5's own intermediate groups would carry them).
    void make_groups(const std::string& group)
    {
        for (std::size_t i = 1; i <= group.size(); ++i) {
            if (i != group.size() && group[i] != '/') continue;
            const std::string part = group.substr(0, i);
            if (H5Lexists(file, part.c_str(), H5P_DEFAULT) > 0) continue;
            const Id list(H5Pcreate(H5P_GROUP_CREATE), H5Pclose);
            H5Pset_obj_track_times(list, 0);
            const Id made(H5Gcreate2(file, part.c_str(), H5P_DEFAULT, list, H5P_DEFAULT), H5Gclose);
            if (!made.valid()) fail(part, "could not be written");
        }
    }
    Id open_dataset(const std::string& object) const
    {
        if (!exists(object)) fail(object, "is missing");
        const hid_t id = H5Dopen2(file, object.c_str(), H5P_DEFAULT);
        if (id < 0) fail(object, "is not a dataset");
        return {id, H5Dclose};
    }
    /// Dimensions of a dataset. \throws Error when they, or those of its chunks, ask for far more than the file stores
    std::vector<std::size_t> dims(hid_t dataset, const std::string& object) const
    {
        const Id space(H5Dget_space(dataset), H5Sclose);
        std::vector<hsize_t> sizes(static_cast<std::size_t>(std::max(0, H5Sget_simple_extent_ndims(space))));
        H5Sget_simple_extent_dims(space, sizes.data(), nullptr);
        const Id type(H5Dget_type(dataset), H5Tclose), list(H5Dget_create_plist(dataset), H5Pclose);
        if (!space.valid() || !type.valid() || !list.valid()) fail(object, "is damaged");
        const H5D_layout_t layout = H5Pget_layout(list);
        if (layout != H5D_VIRTUAL && H5Pget_external_count(list) == 0) {
            const double stored = std::min(double(H5Dget_storage_size(dataset)), double(std::filesystem::file_size(file_on_disk())));
            const double most = std::max(always_allowed_bytes, stored * (layout == H5D_CHUNKED ? most_unpacked_per_stored : 1));
            require_bytes(sizes, type, most, stored, object);
            std::vector<hsize_t> chunk(layout == H5D_CHUNKED ? sizes.size() : 0);
            if (!chunk.empty() && H5Pget_chunk(list, int(chunk.size()), chunk.data()) < 0) fail(object, "is damaged");
            if (!chunk.empty()) require_bytes(chunk, type, most, stored, object);
        }
        return {sizes.begin(), sizes.end()};
    }
    void require_bytes(const std::vector<hsize_t>& sizes, hid_t type, double most, double stored, const std::string& object) const
    {
        double bytes = double(H5Tget_size(type));
        for (const hsize_t n : sizes) bytes *= double(n);
        if (bytes > most || (bytes == 0 && std::ranges::any_of(sizes, [](hsize_t n) { return n > hsize_t{1} << 40; })))
            throw Error(path.string() + ":" + object, "announces " + std::to_string(std::uint64_t(std::min(bytes, 1e19))) + " bytes but stores " +
                                                          std::to_string(std::uint64_t(stored)), "the file is damaged; copy it again");
    }
    void write(const std::string& object, const void* data, std::size_t count, hid_t type, const std::vector<std::size_t>& shape)
    {
        std::size_t expected = 1;
        for (std::size_t d : shape) expected *= d;
        if (expected != count) fail(object, "dimensions do not fit the data");
        const std::vector<hsize_t> sizes(shape.begin(), shape.end());
        const Id space(H5Screate_simple(static_cast<int>(sizes.size()), sizes.data(), nullptr), H5Sclose);
        if (const std::size_t slash = object.rfind('/'); slash != std::string::npos) make_groups(object.substr(0, slash));
        const Id list = creation_list(shape, deflate);
        const Id dataset(H5Dcreate2(file, object.c_str(), type, space, H5P_DEFAULT, list, H5P_DEFAULT), H5Dclose);
        if (!dataset.valid() || (count > 0 && H5Dwrite(dataset, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, data) < 0)) fail(object, "could not be written");
    }
    template <class T>
    std::vector<T> read(const std::string& object, hid_t type) const
    {
        const Id dataset = open_dataset(object);
        std::size_t count = 1;
        for (std::size_t d : dims(dataset, object)) count *= d;
        const Id stored(H5Dget_type(dataset), H5Tclose);
        const H5T_class_t kind = H5Tget_class(stored);
        if (kind != H5T_INTEGER && kind != H5T_FLOAT) fail(object, "holds no numbers");
        std::vector<T> values(count);
        if (count > 0 && H5Dread(dataset, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()) < 0) fail(object, "is damaged");
        return values;
    }
    void set_attribute(const std::string& object, const std::string& name, hid_t type, hid_t space, const void* data)
    {
        const Id owner(H5Oopen(file, object.c_str(), H5P_DEFAULT), H5Oclose);
        if (!owner.valid()) fail(object, "is missing");
        if (H5Aexists(owner, name.c_str()) > 0) H5Adelete(owner, name.c_str());
        const Id attribute(H5Acreate2(owner, name.c_str(), type, space, H5P_DEFAULT, H5P_DEFAULT), H5Aclose);
        if (!attribute.valid() || H5Awrite(attribute, type, data) < 0) fail_attribute(object, name, "could not be written");
    }
    Id open_attribute(const std::string& object, const std::string& name) const
    {
        if (!exists(object)) fail(object, "is missing");
        const hid_t id = H5Aopen_by_name(file, object.c_str(), name.c_str(), H5P_DEFAULT, H5P_DEFAULT);
        if (id < 0) fail_attribute(object, name, "is missing");
        return {id, H5Aclose};
    }
};

H5File::H5File(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
H5File::H5File(H5File&&) noexcept = default;
H5File& H5File::operator=(H5File&&) noexcept = default;
H5File::~H5File() = default;

H5File H5File::create(const std::filesystem::path& file)
{
    H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
    auto impl = std::make_unique<Impl>();
    impl->path = file;
    impl->output = std::make_unique<OutputFile>(file);
    const Id access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose);
    H5Pset_libver_bounds(access, H5F_LIBVER_V18, H5F_LIBVER_V110);
    const Id creation(H5Pcreate(H5P_FILE_CREATE), H5Pclose);
    H5Pset_obj_track_times(creation, 0);
    impl->file = H5Fcreate(impl->output->temporary().c_str(), H5F_ACC_TRUNC, creation, access);
    if (impl->file < 0) throw Error(file.string(), "cannot be written", "check the folder's permissions and the space left on the disk");
    return H5File(std::move(impl));
}

H5File H5File::open(const std::filesystem::path& file)
{
    H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
    if (!std::filesystem::is_regular_file(file)) throw Error(file.string(), "no such file", "check the path");
    auto impl = std::make_unique<Impl>();
    impl->path = file;
    const Id access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose);
    impl->file = H5Fopen(file.c_str(), H5F_ACC_RDONLY, access);
    if (impl->file < 0) throw Error(file.string(), "is not an HDF5 file, or is damaged", "make it again with the tool that wrote it, or copy it again");
    return H5File(std::move(impl));
}

void H5File::commit()
{
    if (H5Fflush(impl_->file, H5F_SCOPE_GLOBAL) < 0) impl_->fail("/", "could not be written");
    impl_->close();
    impl_->output->commit();
}

const std::filesystem::path& H5File::path() const { return impl_->path; }

bool H5File::exists(const std::string& path) const { return impl_->exists(path); }

std::vector<std::string> H5File::members(const std::string& group) const
{
    std::vector<std::string> names;
    if (!impl_->exists(group)) return names;
    const Id id(H5Gopen2(impl_->file, group.c_str(), H5P_DEFAULT), H5Gclose);
    if (!id.valid()) return names;
    H5Literate(id, H5_INDEX_NAME, H5_ITER_INC, nullptr, collect_name, &names);
    if (std::ranges::all_of(names, numeric)) std::ranges::sort(names, {}, [](const std::string& n) { return std::stoull(n); });
    return names;
}

void H5File::make_group(const std::string& path)
{
    if (!impl_->exists(path)) impl_->make_groups(path);
}

void H5File::set_deflate(bool deflate) { impl_->deflate = deflate; }
void H5File::write(const std::string& path, std::span<const double> data, std::vector<std::size_t> dims) { impl_->write(path, data.data(), data.size(), H5T_NATIVE_DOUBLE, dims); }
void H5File::write(const std::string& path, std::span<const float> data, std::vector<std::size_t> dims) { impl_->write(path, data.data(), data.size(), H5T_NATIVE_FLOAT, dims); }
void H5File::write(const std::string& path, std::span<const std::int64_t> data, std::vector<std::size_t> dims) { impl_->write(path, data.data(), data.size(), H5T_NATIVE_INT64, dims); }
void H5File::write(const std::string& path, std::span<const std::int32_t> data, std::vector<std::size_t> dims) { impl_->write(path, data.data(), data.size(), H5T_NATIVE_INT32, dims); }
void H5File::write(const std::string& path, std::span<const std::uint8_t> data, std::vector<std::size_t> dims) { impl_->write(path, data.data(), data.size(), H5T_NATIVE_UINT8, dims); }

void H5File::write(const std::string& path, std::span<const std::string> data)
{
    std::size_t length = 1;
    for (const std::string& text : data) length = std::max(length, text.size());
    std::vector<char> packed(length * data.size(), '\0');
    for (std::size_t i = 0; i < data.size(); ++i) std::memcpy(packed.data() + i * length, data[i].data(), data[i].size());
    const Id type = string_type(length);
    impl_->write(path, packed.data(), data.size(), type, {data.size()});
}

std::vector<std::size_t> H5File::dims(const std::string& path) const { return impl_->dims(impl_->open_dataset(path), path); }

std::string H5File::number_type(const std::string& path) const
{
    const Id dataset = impl_->open_dataset(path);
    const Id type(H5Dget_type(dataset), H5Tclose);
    const H5T_class_t kind = H5Tget_class(type);
    if (kind != H5T_INTEGER && kind != H5T_FLOAT) impl_->fail(path, "holds no numbers");
    return (kind == H5T_FLOAT ? "f" : H5Tget_sign(type) == H5T_SGN_NONE ? "u" : "i") + std::to_string(8 * H5Tget_size(type));
}

std::vector<double> H5File::read_doubles(const std::string& path) const { return impl_->read<double>(path, H5T_NATIVE_DOUBLE); }

std::vector<double> H5File::read_doubles(const std::string& path, std::size_t first, std::size_t count) const
{
    const Id dataset = impl_->open_dataset(path);
    const std::vector<std::size_t> dims = impl_->dims(dataset, path);
    if (dims.empty() || first + count > dims[0]) impl_->fail(path, "is shorter than asked for");
    std::vector<hsize_t> start(dims.size(), 0), block(dims.begin(), dims.end());
    start[0] = first;
    block[0] = count;
    std::size_t total = 1;
    for (hsize_t n : block) total *= n;
    const Id in_file(H5Dget_space(dataset), H5Sclose), in_memory(H5Screate_simple(int(block.size()), block.data(), nullptr), H5Sclose);
    std::vector<double> values(total);
    if (H5Sselect_hyperslab(in_file, H5S_SELECT_SET, start.data(), nullptr, block.data(), nullptr) < 0 ||
        (total > 0 && H5Dread(dataset, H5T_NATIVE_DOUBLE, in_memory, in_file, H5P_DEFAULT, values.data()) < 0))
        impl_->fail(path, "is damaged or holds no numbers");
    return values;
}

std::vector<float> H5File::read_floats(const std::string& path) const { return impl_->read<float>(path, H5T_NATIVE_FLOAT); }
std::vector<std::int64_t> H5File::read_integers(const std::string& path) const { return impl_->read<std::int64_t>(path, H5T_NATIVE_INT64); }
std::vector<std::uint8_t> H5File::read_bytes(const std::string& path) const { return impl_->read<std::uint8_t>(path, H5T_NATIVE_UINT8); }

std::vector<std::string> H5File::read_strings(const std::string& path) const
{
    const Id dataset = impl_->open_dataset(path);
    const Id type(H5Dget_type(dataset), H5Tclose);
    if (H5Tget_class(type) != H5T_STRING || H5Tis_variable_str(type) > 0) impl_->fail(path, "holds no fixed-length strings");
    const std::size_t length = H5Tget_size(type);
    std::size_t count = 1;
    for (std::size_t d : impl_->dims(dataset, path)) count *= d;
    std::vector<char> packed(length * count);
    if (count > 0 && H5Dread(dataset, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, packed.data()) < 0) impl_->fail(path, "is damaged");
    std::vector<std::string> texts;
    for (std::size_t i = 0; i < count; ++i) {
        const char* begin = packed.data() + i * length;
        texts.emplace_back(begin, std::find(begin, begin + length, '\0'));
    }
    return texts;
}

void H5File::set_attribute(const std::string& path, const std::string& name, const std::string& value)
{
    const Id type = string_type(value.size());
    const Id space(H5Screate(H5S_SCALAR), H5Sclose);
    // A long text (a history) does not fit the 64 kB of compact attribute storage in the oldest format; V18 bounds lift that.
    impl_->set_attribute(path, name, type, space, value.empty() ? "" : value.data());
}
void H5File::set_attribute(const std::string& path, const std::string& name, const char* value) { set_attribute(path, name, std::string(value)); }
void H5File::set_attribute(const std::string& path, const std::string& name, double value)
{
    const Id space(H5Screate(H5S_SCALAR), H5Sclose);
    impl_->set_attribute(path, name, H5T_NATIVE_DOUBLE, space, &value);
}
void H5File::set_attribute(const std::string& path, const std::string& name, std::int64_t value)
{
    const Id space(H5Screate(H5S_SCALAR), H5Sclose);
    impl_->set_attribute(path, name, H5T_NATIVE_INT64, space, &value);
}
void H5File::set_attribute(const std::string& path, const std::string& name, std::span<const double> values)
{
    const hsize_t size = values.size();
    const Id space(H5Screate_simple(1, &size, nullptr), H5Sclose);
    impl_->set_attribute(path, name, H5T_NATIVE_DOUBLE, space, values.data());
}

bool H5File::has_attribute(const std::string& path, const std::string& name) const
{
    return impl_->exists(path) && H5Aexists_by_name(impl_->file, path.c_str(), name.c_str(), H5P_DEFAULT) > 0;
}

std::string H5File::string_attribute(const std::string& path, const std::string& name) const
{
    const Id attribute = impl_->open_attribute(path, name);
    const Id type(H5Aget_type(attribute), H5Tclose), space(H5Aget_space(attribute), H5Sclose);
    if (H5Tget_class(type) != H5T_STRING || H5Tis_variable_str(type) > 0 || H5Sget_simple_extent_npoints(space) != 1) impl_->fail_attribute(path, name, "is no text");
    if (H5Tget_size(type) > std::filesystem::file_size(impl_->file_on_disk())) impl_->fail_attribute(path, name, "is longer than the file");
    std::string value(H5Tget_size(type), '\0');
    if (H5Aread(attribute, type, value.data()) < 0) impl_->fail_attribute(path, name, "is damaged");
    value.resize(std::min(value.find('\0'), value.size()));
    return value;
}

double H5File::number_attribute(const std::string& path, const std::string& name) const
{
    const auto values = numbers_attribute(path, name);
    if (values.size() != 1) impl_->fail_attribute(path, name, "is not one number");
    return values[0];
}

std::int64_t H5File::integer_attribute(const std::string& path, const std::string& name) const
{
    const double value = number_attribute(path, name);
    if (!(std::abs(value) < 1e15) || value != std::floor(value)) impl_->fail_attribute(path, name, "is no whole number");
    return std::int64_t(value);
}

std::vector<double> H5File::numbers_attribute(const std::string& path, const std::string& name) const
{
    const Id attribute = impl_->open_attribute(path, name);
    const Id space(H5Aget_space(attribute), H5Sclose), type(H5Aget_type(attribute), H5Tclose);
    const hssize_t count = H5Sget_simple_extent_npoints(space);
    const H5T_class_t kind = H5Tget_class(type);
    if (count < 0 || (kind != H5T_INTEGER && kind != H5T_FLOAT)) impl_->fail_attribute(path, name, "holds no numbers");
    if (double(count) * double(H5Tget_size(type)) > double(std::filesystem::file_size(impl_->file_on_disk()))) impl_->fail_attribute(path, name, "is longer than the file");
    std::vector<double> values(static_cast<std::size_t>(count));
    if (count > 0 && H5Aread(attribute, H5T_NATIVE_DOUBLE, values.data()) < 0) impl_->fail_attribute(path, name, "holds no numbers");
    return values;
}

void H5File::set_format(std::int64_t number) { set_attribute("/", "format", number); }

void H5File::require_format(std::int64_t known) const
{
    if (!has_attribute("/", "format")) return;
    const Id attribute = impl_->open_attribute("/", "format");
    const Id type(H5Aget_type(attribute), H5Tclose);
    if (H5Tget_class(type) != H5T_STRING) require_known_format(integer_attribute("/", "format"), known, impl_->path.string());
}

}  // namespace coral
