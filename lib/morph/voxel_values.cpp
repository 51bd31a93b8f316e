#include "morph/voxel_values.h"

#include <algorithm>

namespace coral::morph {
namespace {

template <class T>
std::uint32_t largest_of(std::span<const T> values)
{
    T largest = 0;
    for (const T v : values) largest = std::max(largest, v);
    return largest;
}

}  // namespace

VoxelValues::VoxelValues(std::size_t count, std::uint32_t value)
{
    widen(value);
    std::visit([&](auto& values) { values.assign(count, static_cast<typename std::decay_t<decltype(values)>::value_type>(value)); }, values_);
}

VoxelValues::VoxelValues(const std::vector<std::uint32_t>& values) { append(std::span(values)); }

void VoxelValues::widen(std::uint32_t largest)
{
    const auto change = [&]<class Wide>(Wide wide) {
        std::visit(
            [&](auto& narrow) {
                wide.reserve(std::max(narrow.size(), narrow.capacity()));
                wide.insert(wide.end(), narrow.begin(), narrow.end());
            },
            values_);
        values_ = std::move(wide);
    };
    if (largest > 65535 && values_.index() < 2) change(std::vector<std::uint32_t>{});
    else if (largest > 255 && values_.index() < 1) change(std::vector<std::uint16_t>{});
}

void VoxelValues::reserve(std::size_t count, int bytes)
{
    if (empty() && bytes == 2) values_ = std::vector<std::uint16_t>{};
    if (empty() && bytes == 4) values_ = std::vector<std::uint32_t>{};
    std::visit([&](auto& values) { values.reserve(count); }, values_);
}

template <class T>
void VoxelValues::append_narrow(std::span<const T> values)
{
    widen(largest_of(values));
    std::visit([&](auto& mine) { mine.insert(mine.end(), values.begin(), values.end()); }, values_);
}

void VoxelValues::append(std::span<const std::uint8_t> values) { append_narrow(values); }
void VoxelValues::append(std::span<const std::uint16_t> values) { append_narrow(values); }
void VoxelValues::append(std::span<const std::uint32_t> values) { append_narrow(values); }
void VoxelValues::append(const VoxelValues& values)
{
    values.visit([&](auto theirs) { append_narrow(theirs); });
}

void VoxelValues::set(std::size_t at, std::uint32_t value)
{
    widen(value);
    std::visit([&](auto& values) { values[at] = static_cast<typename std::decay_t<decltype(values)>::value_type>(value); }, values_);
}

std::size_t VoxelValues::size() const
{
    return visit([](auto values) { return values.size(); });
}

int VoxelValues::bytes() const { return 1 << values_.index(); }

void VoxelValues::read(std::size_t first, std::span<std::uint32_t> out) const
{
    visit([&](auto values) { std::copy_n(values.begin() + std::ptrdiff_t(first), out.size(), out.begin()); });
}

std::uint32_t VoxelValues::largest() const
{
    return visit([](auto values) { return largest_of(values); });
}

bool operator==(const VoxelValues& a, const VoxelValues& b)
{
    return a.visit([&](auto mine) { return b.visit([&](auto theirs) { return std::ranges::equal(mine, theirs); }); });
}

}  // namespace coral::morph
