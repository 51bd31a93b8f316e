#include "cli.h"

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>
#include <toml++/toml.h>

#ifdef __GLIBC__
#include <malloc.h>
#endif

#include <csignal>
#include <filesystem>
#include <new>

#include "core/error.h"
#include "core/parallel.h"
#include "core/progress.h"
#include "core/text.h"
#include "core/version.h"

namespace coral::cli {
namespace {

volatile std::sig_atomic_t stop_signal = 0;

struct CommonOptions {
    int threads = 0;
    bool quiet = false, json = false;
    std::string config;
};

/// One value of a config file as the words the command line would hold.
std::vector<std::string> words_of(const toml::node& node)
{
    if (const auto text = node.value_exact<std::string>()) return {*text};
    if (const auto integer = node.value_exact<std::int64_t>()) return {std::to_string(*integer)};
    if (const auto number = node.value_exact<double>()) return {to_text(*number)};
    if (const auto flag = node.value_exact<bool>()) return {*flag ? "true" : "false"};
    std::vector<std::string> words;
    if (const toml::array* array = node.as_array())
        for (const toml::node& item : *array)
            for (std::string& word : words_of(item)) words.push_back(std::move(word));
    return words;
}

std::vector<std::string> long_names(const CLI::App& app)
{
    std::vector<std::string> names;
    for (const CLI::Option* option : app.get_options())
        for (const std::string& name : option->get_lnames()) names.push_back(name);
    for (const CLI::Option* option : app.get_options())
        if (option->get_positional()) names.push_back(option->get_single_name());
    return names;
}

bool given(const std::vector<std::string>& arguments, const CLI::Option& option)
{
    for (const std::string& argument : arguments) {
        for (const std::string& name : option.get_lnames())
            if (argument == "--" + name || argument.starts_with("--" + name + "=")) return true;
        for (const std::string& name : option.get_snames())
            if (argument == "-" + name) return true;
    }
    return false;
}

/// Words to put in front of the command line, one option per key of the file. Reports every bad key and value at once.
std::vector<std::string> config_arguments(CLI::App& app, const std::string& file, const std::vector<std::string>& arguments)
{
    if (!std::filesystem::is_regular_file(file)) throw UsageError("--config " + file, "no such file");
    toml::table content;
    try {
        content = toml::parse_file(file);
    } catch (const toml::parse_error& error) {
        throw UsageError(fmt::format("{}:{}:{}", file, error.source().begin.line, error.source().begin.column), std::string(error.description()));
    }
    const std::vector<std::string> names = long_names(app);
    std::vector<std::pair<toml::source_position, std::string>> problems;
    std::vector<std::string> words;
    for (const auto& [key, node] : content) {
        const std::string name(key.str());
        CLI::Option* option = app.get_option_no_throw("--" + name);
        if (!option) option = app.get_option_no_throw(name);
        if (!option || name == "config" || name == "help" || name == "version") {
            const std::string hint = did_you_mean(name, names);
            problems.emplace_back(key.source().begin, "unknown key '" + name + "'" + (hint.empty() ? "" : "; " + hint));
            continue;
        }
        const std::vector<std::string> values = words_of(node);
        try {
            option->clear();
            for (const std::string& value : values) option->add_result(value);
            option->run_callback();
        } catch (const std::exception& error) {
            problems.emplace_back(node.source().begin, "key '" + name + "' is wrong: " + error.what());
        }
        option->clear();
        if (given(arguments, *option)) continue;
        if (option->get_positional() && option->get_lnames().empty()) {
            words.insert(words.end(), values.begin(), values.end());
        } else if (option->get_items_expected_max() == 0) {
            if (values.size() == 1 && values[0] == "true") words.push_back("--" + name);
        } else {
            words.push_back("--" + name);
            words.insert(words.end(), values.begin(), values.end());
        }
    }
    if (problems.empty()) return words;
    std::ranges::stable_sort(problems, [](const auto& a, const auto& b) { return a.first < b.first; });
    std::string all;
    for (const auto& [position, text] : problems) all += fmt::format("{}{}:{}:{}: {}", all.empty() ? "" : "\n", file, position.line, position.column, text);
    throw UsageError("", all);
}

std::string config_file(const std::vector<std::string>& arguments)
{
    for (std::size_t i = 0; i < arguments.size(); ++i) {
        if (arguments[i] == "--config" && i + 1 < arguments.size()) return arguments[i + 1];
        if (arguments[i].starts_with("--config=")) return arguments[i].substr(9);
    }
    return {};
}

/// CLI11's message, or the nearest option for a misspelt one: that comes first, since CLI11 would name a missing option instead.
std::string parse_problem(const CLI::App& app, const CLI::ParseError& error, const std::vector<std::string>& arguments)
{
    const bool extra = dynamic_cast<const CLI::ExtrasError*>(&error) != nullptr;
    const std::vector<std::string> names = long_names(app);
    for (const std::string& argument : arguments) {
        if (!argument.starts_with(extra ? "-" : "--") || argument == "-" || argument == "--") continue;
        const std::string name = argument.substr(argument.find_first_not_of('-'), argument.find('=') - argument.find_first_not_of('-'));
        if (app.get_option_no_throw(argument.starts_with("--") ? "--" + name : "-" + name.substr(0, 1))) continue;
        const std::string hint = did_you_mean(name, names);
        return "unknown option " + argument + "; " + (hint.empty() ? "see --help" : hint);
    }
    std::string text = error.what();
    std::ranges::replace(text, '\n', ' ');
    return text + "; see --help";
}

/// Every option with the value in use, for the history. Those that cannot change results, or name files, are left out.
std::map<std::string, std::string> options_in_use(const CLI::App& app)
{
    static const std::vector<std::string> silent{"help", "version", "threads", "quiet", "json", "config", "table", "voids", "mesh", "mesh-format", "convergence", "resume", "until"};
    std::map<std::string, std::string> options;
    for (const CLI::Option* option : app.get_options()) {
        if (option->get_lnames().empty()) continue;
        const std::string& name = option->get_lnames().front();
        if (std::ranges::find(silent, name) != silent.end() || name == "output") continue;
        std::string value;
        for (const std::string& word : option->results()) value.append(value.empty() ? "" : ",").append(word);
        if (option->count() == 0) value = option->get_default_str();
        if (!value.empty()) options[name] = value;
    }
    return options;
}

/// File names given as positional arguments, without folders.
std::vector<std::string> inputs_in_use(const CLI::App& app)
{
    std::vector<std::string> inputs;
    for (const CLI::Option* option : app.get_options())
        if (option->get_positional() && option->get_lnames().empty())
            for (const std::string& word : option->results()) {
                const std::filesystem::path path = std::filesystem::path(word).lexically_normal();
                inputs.push_back((path.has_filename() ? path : path.parent_path()).filename().string());
            }
    return inputs;
}

void send_messages_to_stderr(bool quiet)
{
    auto logger = spdlog::stderr_color_mt("coralsand");
    logger->set_pattern("%^%l%$: %v");
    logger->set_level(quiet ? spdlog::level::warn : spdlog::level::info);
    spdlog::set_default_logger(logger);
    Progress::set_quiet(quiet);
}

int report(const std::string& tool, const std::string& message, int code)
{
    fmt::print(stderr, "{}: {}\n", tool, message);
    return code;
}

/// Arrays of megabytes go back to the system when they are freed. The C library would keep those that it has once seen freed: a third of
/// what a coupled run holds.
void return_large_memory()
{
#ifdef __GLIBC__
    mallopt(M_MMAP_THRESHOLD, 4 << 20);
#endif
}

}  // namespace

int run_tool(int argc, char** argv, const std::string& name, const std::string& description,
             const std::function<void(Options&)>& declare, const std::function<void(const Context&)>& run, std::uint64_t* seed)
{
    return_large_memory();
    CLI::App app(description, name);
    app.option_defaults()->always_capture_default();
    CommonOptions common;
    std::vector<std::string> arguments(argv + 1, argv + argc);
    try {
        Options options(app);
        declare(options);
        if (seed) app.add_option("--seed", *seed, "Seed of the random numbers")->check(CLI::NonNegativeNumber);
        app.add_option("--threads", common.threads, "Threads; 0 takes all cores")->check(CLI::Range(0, 1024));
        app.add_flag("--quiet", common.quiet, "No progress and no summary");
        app.add_flag("--json", common.json, "Summary as one JSON object on stdout");
        app.add_option("--config", common.config, "TOML file with any of these options as keys");
        app.set_version_flag("--version", [&] { return fmt::format("{} {}\n{}", name, version, library_versions()); });
        if (const std::string file = config_file(arguments); !file.empty()) {
            const auto words = config_arguments(app, file, arguments);
            arguments.insert(arguments.begin(), words.begin(), words.end());
        }
        std::vector<std::string> reversed(arguments.rbegin(), arguments.rend());
        app.parse(std::move(reversed));
    } catch (const CLI::CallForHelp&) {
        fmt::print("{}", app.help());
        return 0;
    } catch (const CLI::CallForVersion& answer) {
        fmt::print("{}\n", answer.what());
        return 0;
    } catch (const CLI::ParseError& error) {
        return report(name, parse_problem(app, error, arguments), 2);
    } catch (const UsageError& error) {
        return report(name, error.what(), 2);
    }
    try {
        set_thread_count(common.threads);
        send_messages_to_stderr(common.quiet);
        Context context;
        context.record = {name, version, options_in_use(app), inputs_in_use(app)};
        context.json = common.json;
        context.quiet = common.quiet;
        run(context);
        return 0;
    } catch (const UsageError& error) {
        return report(name, error.what(), 2);
    } catch (const std::bad_alloc&) {
        return report(name, "not enough memory; use a coarser spacing or a smaller stack", 1);
    } catch (const std::exception& error) {
        return report(name, error.what(), 1);
    }
}

void catch_stop_signals()
{
    std::signal(SIGINT, [](int) { stop_signal = 1; });
    std::signal(SIGTERM, [](int) { stop_signal = 1; });
}

bool stop_asked() { return stop_signal != 0; }

void print_summary(const Context& context, const nlohmann::ordered_json& json, const std::string& human)
{
    if (context.json) {
        fmt::print("{}\n", json.dump(2));
    } else if (!context.quiet) {
        fmt::print("{}{}", human, human.ends_with('\n') ? "" : "\n");
    }
}

}  // namespace coral::cli
