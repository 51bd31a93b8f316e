// The options of a tool on top of CLI11.
#include <CLI/CLI.hpp>
#include <cmath>

#include "cli.h"
#include "core/error.h"

namespace coral::cli {

Option Option::required() const
{
    option_->required();
    return *this;
}

Option Option::existing_file() const
{
    option_->check(CLI::ExistingFile);
    return *this;
}

Option Option::one_of(const std::vector<std::string>& words) const
{
    option_->check(CLI::IsMember(words));
    return *this;
}

Option Option::between(int low, int high) const
{
    option_->check(CLI::Range(low, high));
    return *this;
}

Option Option::not_negative() const
{
    option_->check(CLI::NonNegativeNumber);
    return *this;
}

Option Option::excludes(Option other) const
{
    option_->excludes(other.option_);
    return *this;
}

bool Option::given() const { return option_->count() > 0; }

Option Options::add(const std::string& name, std::string& value, const std::string& help) { return Option(app_.add_option(name, value, help)); }
Option Options::add(const std::string& name, std::filesystem::path& value, const std::string& help)
{
    return Option(app_.add_option_function<std::string>(name, [&value](const std::string& text) { value = text; }, help)->default_str(value.string()));
}
Option Options::add(const std::string& name, int& value, const std::string& help) { return Option(app_.add_option(name, value, help)); }
Option Options::add(const std::string& name, double& value, const std::string& help) { return Option(app_.add_option(name, value, help)); }
Option Options::add(const std::string& name, std::array<double, 2>& value, const std::string& help) { return Option(app_.add_option(name, value, help)); }
Option Options::add(const std::string& name, std::vector<std::string>& value, const std::string& help)
{
    return Option(app_.add_option(name, value, help));
}

Option Options::add(const std::string& name, std::vector<std::filesystem::path>& value, const std::string& help)
{
    return Option(app_.add_option(name, value, help));
}

Option Options::flag(const std::string& name, bool& value, const std::string& help) { return Option(app_.add_flag(name, value, help)); }

Option Options::quantity(const std::string& name, double& value, Dimension dimension, const std::string& help)
{
    auto* option = app_.add_option_function<std::string>(
        name,
        [&value, dimension, name](const std::string& text) {
            try {
                value = parse_quantity(text, dimension, "");
            } catch (const UsageError& error) {
                throw CLI::ValidationError(name, error.what());
            }
        },
        help);
    option->type_name(std::string("[") + std::string(si_unit(dimension)) + "]");
    if (std::isfinite(value)) option->default_str(format_quantity(value, dimension));
    return Option(option);
}

}  // namespace coral::cli
