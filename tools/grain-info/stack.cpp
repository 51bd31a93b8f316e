// Stacks of voxels.
#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "grain-info/describe.h"
#include "morph/stack_io.h"

namespace coral::grain_info {

namespace {

void add_values(Report& report, const morph::VoxelStack& stack)
{
    if (!stack.reals.empty()) {
        const auto [low, high] = std::ranges::minmax(stack.reals);
        report.add("values", {low, high}, fmt::format("real grey values from {:g} to {:g}", low, high));
        return;
    }
    constexpr std::size_t most = 1000;  // more are grey values or many grains: the number does not matter
    std::set<std::uint32_t> distinct;
    for (const std::uint32_t value : stack.values)
        if (distinct.size() <= most) distinct.insert(value);
    report.add("largest_value", std::size_t(stack.values.largest()));
    report.add("distinct_values", distinct.size(), distinct.size() > most ? fmt::format("more than {}", most) : std::to_string(distinct.size()));
}

}  // namespace

Report describe_stack(const std::string& path, bool values)
{
    const morph::StackHeader stack = morph::read_stack_header(std::vector{path});
    Report report("stack of voxels");
    report.add("size", {stack.size.x(), stack.size.y(), stack.size.z()}, fmt::format("{} x {} x {} voxels (x, y, z)", stack.size.x(), stack.size.y(), stack.size.z()));
    const Eigen::Vector3d& edge = stack.voxel_size;
    if (edge.minCoeff() > 0) report.add("voxel_size", {edge.x(), edge.y(), edge.z()}, fmt::format("{} x {} x {}", metres(edge.x()), metres(edge.y()), metres(edge.z())));
    else report.add("voxel_size", nullptr, "not in the file: give --voxel-size to csct2ls");
    report.add("type", stack.type);
    if (values) add_values(report, morph::read_stack(std::vector{path}));
    else report.add("values", nullptr, "not read: --values reads all voxels");
    return report;
}

}  // namespace coral::grain_info
