#pragma once
/// \file tools/cli.h
/// What all tools share: --help, --version, --threads, --quiet, --json, --config, exit codes, the record of the run.
#include <CLI/CLI.hpp>
#include <cstdint>
#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "core/record.h"
#include "core/units.h"

namespace coral::cli {

/// What a tool's run() gets besides its own options.
struct Context {
    RecordEntry record;  ///< this run: tool, version, every option with its value in use
    bool json = false;   ///< print one JSON object on stdout instead of the human summary
    bool quiet = false;
};

/// Option that takes a quantity with a unit ("30um"); `value` holds SI and its default is shown in --help.
CLI::Option* add_quantity(CLI::App& app, const std::string& name, double& value, Dimension dimension, const std::string& help);

/// Parses, runs and returns the exit code: 0 done, 1 the work failed, 2 wrong command line or config.
/// \param declare  adds the tool's options to the app
/// \param run      does the work; throws Error or UsageError
/// \param random   whether the tool takes --seed (then *seed is set)
int run_tool(int argc, char** argv, const std::string& name, const std::string& description,
             const std::function<void(CLI::App&)>& declare, const std::function<void(const Context&)>& run,
             std::uint64_t* seed = nullptr);

/// Versions of the libraries in this build, one a line (for --version and bug reports).
std::string library_versions();

/// The summary of a tool: `human` on stdout, or `json` when --json was given; nothing when --quiet without --json.
void print_summary(const Context& context, const nlohmann::ordered_json& json, const std::string& human);

}  // namespace coral::cli
