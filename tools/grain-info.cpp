// grain-info: what a file of the chain holds, read by the reader that the next tool would use.
#include <filesystem>
#include <fstream>

#include "cli.h"
#include "core/error.h"
#include "core/hdf5.h"
#include "grain-info/describe.h"

using namespace coral;
using namespace coral::grain_info;
namespace fs = std::filesystem;

namespace {

Report describe_hdf5(const fs::path& file)
{
    const H5File h5 = H5File::open(file);
    if (h5.has_attribute("/", "content") && h5.string_attribute("/", "content") == "coralsand harmonic shapes") return describe_shapes(file);
    if (h5.exists("/particles")) return describe_sample(file);
    if (h5.exists("/simulation") && h5.exists("/observer")) return describe_checkpoint(file);
    if (h5.exists("/series/time")) return describe_results(file);
    throw Error(file.string(), "is an HDF5 file, but none of ours", "for a stack write " + file.string() + ":/dataset");
}

/// Whether a folder or a file is a case, by name.
bool is_case(const fs::path& path) { return fs::is_directory(path) ? fs::exists(path / "case.toml") : path.extension() == ".toml"; }

Report describe(const std::string& name, bool values)
{
    const fs::path path = name;
    if (!fs::exists(path)) return describe_stack(name, values);  // "file.h5:/dataset", or no such file
    if (is_case(path)) return describe_case(path);
    if (fs::is_directory(path)) return describe_stack(name, values);
    if (fs::file_size(path) == 0) throw Error(name, "is empty", "make it again with the tool that wrote it");
    const std::string extension = path.extension().string();
    if (extension == ".vdb") return describe_grains(path);
    if (extension == ".csv") return describe_table(path);
    std::string magic(8, '\0');
    std::ifstream(path, std::ios::binary).read(magic.data(), 8);
    if (magic == "\x89HDF\r\n\x1a\n" || extension == ".h5") return describe_hdf5(path);
    try {
        return describe_stack(name, values);
    } catch (const UsageError&) {
        throw Error(name, "is no file of ours and no stack", "known are .vdb, .h5, .csv, case.toml, case folders and stacks (.tif, .nrrd, .mhd, .mha, folders of slices)");
    }
}

void run(const std::vector<std::string>& files, bool values, const cli::Context& context)
{
    Json all = Json::array();
    std::string text;
    for (const std::string& file : files) {
        Report report = [&] {
            try {
                return describe(file, values);
            } catch (const UsageError& error) {
                if (!fs::exists(file) && file.find(".h5:") == file.npos) throw;
                throw Error("", error.what());  // the file is wrong, not the command line
            }
        }();
        Json json = {{"file", fs::path(file).lexically_normal().string()}};
        json.update(report.json());
        all.push_back(std::move(json));
        text += file + "\n" + report.text();
    }
    cli::print_summary(context, {{"files", all}}, text);
}

}  // namespace

int main(int argc, char** argv)
{
    std::vector<std::string> files;
    bool values = false;
    return cli::run_tool(
        argc, argv, "grain-info", "What a file of the chain holds",
        [&](cli::Options& options) {
            options.add("files", files, "Files: .vdb, .sh.h5, sample.h5, results.h5, checkpoint.h5, case folder or case.toml, tables, stacks").required();
            options.flag("--values", values, "Read all voxels of stacks too, and tell what they hold");
        },
        [&](const cli::Context& context) { run(files, values, context); });
}
