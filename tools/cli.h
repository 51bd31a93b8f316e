#pragma once
/// \file tools/cli.h
/// What all tools share: --help, --version, --threads, --quiet, --json, --config, exit codes, the record of the run.
/// CLI11 stays in cli*.cpp: its templates take longer to compile than all a tool does.
#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "core/record.h"
#include "core/units.h"

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace coral::cli {

/// An option as it is declared: what it must obey is chained on.
class Option {
public:
    explicit Option(CLI::Option* option = nullptr) : option_(option) {}
    Option required() const;
    Option existing_file() const;
    Option one_of(const std::vector<std::string>& words) const;
    Option between(int low, int high) const;
    Option not_negative() const;
    Option excludes(Option other) const;
    bool given() const;  ///< on the command line or in the config file, once parsed

private:
    CLI::Option* option_;
};

/// The options of a tool. A name without dashes is a positional argument. The value that the variable holds when it is
/// declared is the default that --help shows.
class Options {
public:
    explicit Options(CLI::App& app) : app_(app) {}
    Option add(const std::string& name, std::string& value, const std::string& help);
    Option add(const std::string& name, std::filesystem::path& value, const std::string& help);
    Option add(const std::string& name, int& value, const std::string& help);
    Option add(const std::string& name, double& value, const std::string& help);
    Option add(const std::string& name, std::array<double, 2>& value, const std::string& help);
    Option add(const std::string& name, std::vector<std::string>& value, const std::string& help);
    Option add(const std::string& name, std::vector<std::filesystem::path>& value, const std::string& help);
    /// "!--no-x" sets the variable to false.
    Option flag(const std::string& name, bool& value, const std::string& help);
    /// Takes a quantity with a unit ("30um"); `value` holds SI.
    Option quantity(const std::string& name, double& value, Dimension dimension, const std::string& help);

private:
    CLI::App& app_;
};

/// What a tool's run() gets besides its own options.
struct Context {
    RecordEntry record;  ///< this run: tool, version, every option with its value in use
    bool json = false;   ///< print one JSON object on stdout instead of the human summary
    bool quiet = false;
};

/// Parses, runs and returns the exit code: 0 done, 1 the work failed, 2 wrong command line or config.
/// \param declare  adds the tool's options
/// \param run      does the work; throws Error or UsageError
/// \param seed     where the value of --seed goes; null: the tool takes none
int run_tool(int argc, char** argv, const std::string& name, const std::string& description, const std::function<void(Options&)>& declare,
             const std::function<void(const Context&)>& run, std::uint64_t* seed = nullptr);

/// From now on SIGINT and SIGTERM only make stop_asked() true, so that a long run can write a checkpoint and end by itself.
void catch_stop_signals();
bool stop_asked();

/// Versions of the libraries in this build, one a line (for --version and bug reports).
std::string library_versions();

/// The summary of a tool: `human` on stdout, or `json` when --json was given; nothing when --quiet without --json.
void print_summary(const Context& context, const nlohmann::ordered_json& json, const std::string& human);

}  // namespace coral::cli
