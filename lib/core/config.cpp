#include "core/config.h"

#include <algorithm>
#include <map>
#include <set>
#include <toml++/toml.h>

#include "core/error.h"
#include "core/output_file.h"
#include "core/text.h"

namespace coral {

struct Config::Document {
    struct Problem {
        toml::source_position position;
        std::string key;  ///< dotted; a key is reported once, by what was found first
        std::string text;
    };

    std::string name;
    toml::table content;
    std::vector<Problem> problems;
    std::vector<std::shared_ptr<ConfigTable::Node>> nodes;  ///< every table handed out, for the unknown-key check

    std::string at(const toml::source_position& position) const
    {
        return name + ":" + std::to_string(position.line) + ":" + std::to_string(position.column);
    }
};

struct ConfigTable::Node {
    Config::Document* document;
    const toml::table* content;  ///< null when the table is absent
    std::string path;            ///< dotted prefix, "" or "domain."
    std::set<std::string, std::less<>> known;

    const toml::node* find(std::string_view key)
    {
        known.emplace(key);
        return content ? content->get(key) : nullptr;
    }
    toml::source_position position(std::string_view key) const
    {
        if (content) {
            for (const auto& [name, node] : *content)
                if (name.str() == key) return name.source().begin;
            if (content->source().begin) return content->source().begin;
        }
        return {1, 1};
    }
    void problem(std::string_view key, std::string_view what, std::string_view how_to_fix)
    {
        std::string full = path + std::string(key);
        const toml::source_position place = position(key);
        // A value that could not be read stands as zero, so that later checks of it would only say so again.
        if (std::ranges::any_of(document->problems, [&](const Config::Document::Problem& p) { return p.key == full && p.position == place; })) return;
        std::string text = "key '" + full + "' " + std::string(what);
        if (!how_to_fix.empty()) text.append("; ").append(how_to_fix);
        document->problems.push_back({place, std::move(full), std::move(text)});
    }
    void missing(std::string_view key) { problem(key, "is missing", "add it"); }
};

namespace {

std::string unit_hint(Dimension dimension)
{
    return dimension == Dimension::number ? "expected a number" : "expected a number in " + std::string(si_unit(dimension)) + " or a string with a unit";
}

/// Value of one node in SI, or nothing with the reason in `problem`.
std::optional<double> quantity_of(const toml::node& node, Dimension dimension, std::string& problem)
{
    if (const auto number = node.value<double>(); number && node.is_number()) return *number;
    if (const auto text = node.value<std::string>(); text && node.is_string()) {
        try {
            return parse_quantity(*text, dimension, "");
        } catch (const UsageError& error) {
            problem = error.what();
            return {};
        }
    }
    problem = unit_hint(dimension);
    return {};
}

}  // namespace

bool ConfigTable::has(std::string_view key) const { return node_->find(key) != nullptr; }

bool ConfigTable::is_string(std::string_view key) const
{
    const auto* node = node_->find(key);
    return node && node->is_string();
}

bool ConfigTable::is_array(std::string_view key) const
{
    const auto* node = node_->find(key);
    return node && node->is_array();
}

double ConfigTable::quantity(std::string_view key, Dimension dimension, std::optional<double> fallback) const
{
    const auto* node = node_->find(key);
    if (!node) {
        if (!fallback) node_->missing(key);
        return fallback.value_or(0);
    }
    std::string problem;
    const auto value = quantity_of(*node, dimension, problem);
    if (!value) node_->problem(key, "is wrong: " + problem, "");
    return value.value_or(fallback.value_or(0));
}

std::int64_t ConfigTable::integer(std::string_view key, std::optional<std::int64_t> fallback) const
{
    const auto* node = node_->find(key);
    if (!node) {
        if (!fallback) node_->missing(key);
        return fallback.value_or(0);
    }
    if (const auto value = node->value_exact<std::int64_t>()) return *value;
    node_->problem(key, "is wrong: expected a whole number", "");
    return fallback.value_or(0);
}

bool ConfigTable::boolean(std::string_view key, std::optional<bool> fallback) const
{
    const auto* node = node_->find(key);
    if (!node) {
        if (!fallback) node_->missing(key);
        return fallback.value_or(false);
    }
    if (const auto value = node->value_exact<bool>()) return *value;
    node_->problem(key, "is wrong: expected true or false", "");
    return fallback.value_or(false);
}

std::string ConfigTable::string(std::string_view key, std::optional<std::string> fallback) const
{
    const auto* node = node_->find(key);
    if (!node) {
        if (!fallback) node_->missing(key);
        return fallback.value_or("");
    }
    if (const auto value = node->value_exact<std::string>()) return *value;
    node_->problem(key, "is wrong: expected a text in quotes", "");
    return fallback.value_or("");
}

std::string ConfigTable::choice(std::string_view key, std::span<const std::string> allowed, std::optional<std::string> fallback) const
{
    const std::size_t problems = node_->document->problems.size();
    const std::string value = string(key, fallback);
    if (node_->document->problems.size() != problems) return fallback.value_or(allowed.empty() ? "" : allowed.front());
    if (std::ranges::find(allowed, value) != allowed.end()) return value;
    std::string list;
    for (const auto& word : allowed) list.append(list.empty() ? "" : ", ").append(word);
    node_->problem(key, "= '" + value + "' is not one of: " + list, did_you_mean(value, allowed));
    return fallback.value_or(allowed.front());
}

std::vector<double> ConfigTable::quantities(std::string_view key, Dimension dimension, std::optional<std::vector<double>> fallback) const
{
    const auto* node = node_->find(key);
    if (!node) {
        if (!fallback) node_->missing(key);
        return fallback.value_or(std::vector<double>{});
    }
    const toml::array* array = node->as_array();
    if (!array) {
        node_->problem(key, "is wrong: expected an array", "");
        return fallback.value_or(std::vector<double>{});
    }
    std::vector<double> values;
    for (const toml::node& item : *array) {
        std::string problem;
        const auto value = quantity_of(item, dimension, problem);
        if (!value) {
            node_->problem(key, "is wrong: " + problem, "");
            return fallback.value_or(std::vector<double>{});
        }
        values.push_back(*value);
    }
    return values;
}

Eigen::Vector3d ConfigTable::vector(std::string_view key, Dimension dimension, std::optional<Eigen::Vector3d> fallback) const
{
    const Eigen::Vector3d otherwise = fallback.value_or(Eigen::Vector3d::Zero());
    if (!has(key)) {
        if (!fallback) node_->missing(key);
        return otherwise;
    }
    const std::size_t problems = node_->document->problems.size();
    const std::vector<double> values = quantities(key, dimension);
    if (node_->document->problems.size() != problems) return otherwise;
    if (values.size() == 3) return {values[0], values[1], values[2]};
    node_->problem(key, "has " + std::to_string(values.size()) + " values", "expected three, [x, y, z]");
    return otherwise;
}

std::vector<Eigen::Vector3d> ConfigTable::vectors(std::string_view key, Dimension dimension) const
{
    std::vector<Eigen::Vector3d> values;
    const auto* node = node_->find(key);
    if (!node) {
        node_->missing(key);
        return values;
    }
    const toml::array* rows = node->as_array();
    if (!rows) {
        node_->problem(key, "is wrong: expected an array of [x, y, z]", "");
        return values;
    }
    for (const toml::node& item : *rows) {
        const toml::array* row = item.as_array();
        if (!row || row->size() != 3) {
            node_->problem(key, "is wrong at entry " + std::to_string(values.size() + 1) + ": expected [x, y, z]", "");
            return {};
        }
        Eigen::Vector3d v;
        for (std::size_t axis = 0; axis < 3; ++axis) {
            std::string problem;
            const auto value = quantity_of(*row->get(axis), dimension, problem);
            if (!value) {
                node_->problem(key, "is wrong at entry " + std::to_string(values.size() + 1) + ": " + problem, "");
                return {};
            }
            v[Eigen::Index(axis)] = *value;
        }
        values.push_back(v);
    }
    return values;
}

std::vector<std::string> ConfigTable::strings(std::string_view key, std::optional<std::vector<std::string>> fallback) const
{
    const auto* node = node_->find(key);
    if (!node) {
        if (!fallback) node_->missing(key);
        return fallback.value_or(std::vector<std::string>{});
    }
    std::vector<std::string> values;
    if (const toml::array* array = node->as_array()) {
        for (const toml::node& item : *array)
            if (const auto value = item.value_exact<std::string>()) values.push_back(*value);
        if (values.size() == array->size()) return values;
    }
    node_->problem(key, "is wrong: expected an array of texts", "");
    return fallback.value_or(std::vector<std::string>{});
}

std::vector<std::int64_t> ConfigTable::integers(std::string_view key, std::optional<std::vector<std::int64_t>> fallback) const
{
    const auto* node = node_->find(key);
    if (!node) {
        if (!fallback) node_->missing(key);
        return fallback.value_or(std::vector<std::int64_t>{});
    }
    std::vector<std::int64_t> values;
    if (const toml::array* array = node->as_array()) {
        for (const toml::node& item : *array)
            if (const auto value = item.value_exact<std::int64_t>()) values.push_back(*value);
        if (values.size() == array->size()) return values;
    }
    node_->problem(key, "is wrong: expected an array of whole numbers", "");
    return fallback.value_or(std::vector<std::int64_t>{});
}

ConfigTable ConfigTable::table(std::string_view key) const
{
    const auto* node = node_->find(key);
    if (node && !node->is_table()) node_->problem(key, "is wrong: expected a table", "");
    ConfigTable child;
    child.node_ = std::make_shared<Node>(Node{node_->document, node ? node->as_table() : nullptr, node_->path + std::string(key) + ".", {}});
    node_->document->nodes.push_back(child.node_);
    return child;
}

std::vector<ConfigTable> ConfigTable::tables(std::string_view key) const
{
    std::vector<ConfigTable> children;
    const auto* node = node_->find(key);
    if (!node) return children;
    const toml::array* array = node->as_array();
    if (!array || std::ranges::any_of(*array, [](const toml::node& item) { return !item.is_table(); })) {
        node_->problem(key, "is wrong: expected an array of tables", "write [[" + node_->path + std::string(key) + "]]");
        return children;
    }
    for (const toml::node& item : *array) {
        ConfigTable child;
        child.node_ = std::make_shared<Node>(Node{node_->document, item.as_table(), node_->path + std::string(key) + ".", {}});
        node_->document->nodes.push_back(child.node_);
        children.push_back(child);
    }
    return children;
}

std::vector<std::string> ConfigTable::keys() const
{
    std::vector<std::pair<toml::source_position, std::string>> found;
    if (node_->content)
        for (const auto& [name, value] : *node_->content) found.emplace_back(name.source().begin, name.str());
    std::ranges::sort(found, [](const auto& a, const auto& b) { return a.first < b.first; });
    std::vector<std::string> names;
    for (auto& [position, name] : found) {
        node_->known.insert(name);
        names.push_back(std::move(name));
    }
    return names;
}

void ConfigTable::error(std::string_view key, std::string_view what, std::string_view how_to_fix) const { node_->problem(key, what, how_to_fix); }

std::string ConfigTable::location(std::string_view key) const { return node_->document->at(node_->position(key)); }

Config Config::from_text(const std::string& text, const std::string& name)
{
    Config config;
    config.document_ = std::make_shared<Document>();
    config.document_->name = name;
    try {
        config.document_->content = toml::parse(text, name);
    } catch (const toml::parse_error& error) {
        throw UsageError(config.document_->at(error.source().begin), std::string(error.description()), "mend the TOML syntax there");
    }
    config.root_.node_ = std::make_shared<ConfigTable::Node>(ConfigTable::Node{config.document_.get(), &config.document_->content, "", {}});
    config.document_->nodes.push_back(config.root_.node_);
    return config;
}

Config Config::from_file(const std::filesystem::path& file)
{
    if (!std::filesystem::is_regular_file(file)) throw UsageError(file.string(), "no such file", "give the path of a TOML file");
    const std::string text = read_text_file(file);
    if (text.find('\0') != std::string::npos) throw UsageError(file.string(), "is no text", "give the path of a TOML file");
    return from_text(text, file.string());
}

void Config::finish() const
{
    std::vector<Document::Problem> problems = document_->problems;
    // A table may be asked for twice: its keys are known when any of the readers knew them.
    std::map<const toml::table*, std::set<std::string>> known;
    for (const auto& node : document_->nodes)
        if (node->content) known[node->content].insert(node->known.begin(), node->known.end());
    std::set<const toml::table*> visited;
    for (const auto& node : document_->nodes) {
        if (!node->content || !visited.insert(node->content).second) continue;
        const std::vector<std::string> candidates(known[node->content].begin(), known[node->content].end());
        for (const auto& [name, value] : *node->content) {
            if (known[node->content].contains(std::string(name.str()))) continue;
            const std::string full = node->path + std::string(name.str());
            std::string text = "unknown key '" + full + "'";
            if (const std::string hint = did_you_mean(name.str(), candidates); !hint.empty()) text += "; " + hint;
            problems.push_back({name.source().begin, full, std::move(text)});
        }
    }
    if (problems.empty()) return;
    std::ranges::stable_sort(problems, [](const auto& a, const auto& b) { return a.position < b.position; });
    std::string all;
    for (const auto& problem : problems) all.append(all.empty() ? "" : "\n").append(document_->at(problem.position) + ": " + problem.text);
    throw UsageError("", all);
}

}  // namespace coral
