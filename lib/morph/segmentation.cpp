#include "morph/segmentation.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <functional>
#include <optional>
#include <unordered_set>

#include "core/error.h"
#include "core/parallel.h"
#include "core/text.h"

namespace coral::morph {
namespace {

/// Distinct values, rising; counting stops beyond `limit` of them.
template <class T>
std::vector<T> distinct_values(std::span<const T> values, std::size_t limit)
{
    std::unordered_set<T> seen;
    for (std::size_t v = 0; v < values.size() && seen.size() <= limit; ++v)
        if (v == 0 || values[v] != values[v - 1]) seen.insert(values[v]);
    std::vector<T> out(seen.begin(), seen.end());
    std::sort(out.begin(), out.end());
    return out;
}

/// Share of neighbouring voxels along x, both not zero, that differ. Labels differ only where grains touch.
double roughness(const VoxelStack& stack)
{
    std::size_t pairs = 0, unequal = 0;
    stack.values.visit([&](auto values) {
        for (std::size_t v = 1; v < values.size(); ++v) {
            if (v % std::size_t(stack.size.x()) == 0 || values[v] == 0 || values[v - 1] == 0) continue;
            ++pairs;
            unequal += values[v] != values[v - 1];
        }
    });
    return pairs ? double(unequal) / double(pairs) : 0.0;
}

std::optional<double> number(const std::string& text)
{
    double value = 0;
    const auto [end, code] = std::from_chars(text.data(), text.data() + text.size(), value);
    return code == std::errc{} && end == text.data() + text.size() ? std::optional<double>(value) : std::nullopt;
}

Mask mask_where(const VoxelStack& stack, const std::function<bool(double)>& is_solid)
{
    Mask mask = make_mask(stack.size, stack.voxel_size);
    parallel_blocks(mask.voxels.size(), 1 << 16, [&](std::size_t begin, std::size_t end) {
        for (std::size_t v = begin; v < end; ++v) mask.voxels[v] = is_solid(stack.reals.empty() ? double(stack.values[v]) : double(stack.reals[v]));
    });
    return mask;
}

/// Values of a stack in few words: "0, 128 and 255".
std::string listed(const std::vector<std::uint32_t>& values)
{
    std::string text;
    for (std::size_t i = 0; i < std::min<std::size_t>(values.size(), 4); ++i) text += (i ? ", " : "") + std::to_string(values[i]);
    return text + (values.size() > 4 ? ", ..." : "");
}

std::string share(const Mask& mask)
{
    const double percent = 100.0 * double(solid_count(mask)) / double(mask.count());
    return to_text(std::round(percent * 100.0) / 100.0) + " % of the voxels";
}

Segmentation by_threshold(const VoxelStack& stack, const SegmentationOptions& options)
{
    if (options.solid != "bright" && options.solid != "dark") throw UsageError("--solid " + options.solid, "goes not with --threshold", "use bright or dark");
    double threshold = 0;
    if (options.threshold == "otsu") threshold = otsu_threshold(stack);
    else if (const auto value = number(options.threshold)) threshold = *value;
    else throw UsageError("--threshold " + options.threshold, "is neither a number nor 'otsu'");
    const bool bright = options.solid == "bright";
    Segmentation out;
    out.binary = true;
    out.solid = mask_where(stack, [=](double v) { return (v > threshold) == bright; });
    out.decision = std::string("grey values ") + (bright ? "above " : "up to ") + to_text(threshold) + " are solid, " + share(out.solid);
    return out;
}

Segmentation by_value(const VoxelStack& stack, std::uint32_t solid, const std::string& of)
{
    Segmentation out;
    out.binary = true;
    out.solid = mask_where(stack, [=](double v) { return v == double(solid); });
    out.decision = "binary stack of " + of + "; " + std::to_string(solid) + " is solid, " + share(out.solid);
    return out;
}

}  // namespace

double otsu_threshold(const VoxelStack& stack)
{
    const auto value = [&](std::size_t v) { return stack.reals.empty() ? double(stack.values[v]) : double(stack.reals[v]); };
    double low = value(0), high = low;
    for (std::size_t v = 0; v < stack.count(); ++v) {
        low = std::min(low, value(v));
        high = std::max(high, value(v));
    }
    const bool few_integers = stack.reals.empty() && high - low < 65536;
    const std::size_t classes = few_integers ? std::size_t(high - low) + 1 : 256;
    const double width = few_integers ? 1.0 : (high - low) / double(classes);
    std::vector<std::size_t> histogram(classes, 0);
    for (std::size_t v = 0; v < stack.count(); ++v) ++histogram[std::min(std::size_t((value(v) - low) / width), classes - 1)];
    double total = double(stack.count()), sum = 0;
    for (std::size_t c = 0; c < classes; ++c) sum += double(c) * double(histogram[c]);
    double below = 0, sum_below = 0, best = -1;
    std::size_t first_best = 0, last_best = 0;  // equal variances (an empty valley) share the middle
    for (std::size_t c = 0; c + 1 < classes; ++c) {
        below += double(histogram[c]);
        sum_below += double(c) * double(histogram[c]);
        if (below == 0 || below == total) continue;
        const double difference = sum_below / below - (sum - sum_below) / (total - below);
        const double variance = below * (total - below) * difference * difference;
        if (variance > best) {
            best = variance;
            first_best = c;
        }
        if (variance == best) last_best = c;
    }
    const double middle = 0.5 * double(first_best + last_best);
    return few_integers ? low + std::floor(middle) : low + (middle + 1.0) * width;
}

Segmentation segment(VoxelStack&& stack, const SegmentationOptions& options)
{
    constexpr std::size_t level_limit = 1 << 20;
    const std::vector<std::uint32_t> values = stack.values.visit([](auto all) {
        const auto distinct = distinct_values(all, level_limit);
        return std::vector<std::uint32_t>(distinct.begin(), distinct.end());
    });
    const std::size_t levels = stack.reals.empty() ? values.size() : distinct_values(std::span<const float>(stack.reals), level_limit).size();
    if (levels < 2)
        throw Error(stack.name, "every voxel is " + (stack.reals.empty() ? std::to_string(values.at(0)) : to_text(stack.reals.at(0))) + ": there are no grains",
                    "check the export of the stack");
    Segmentation out;
    const auto grey_error = [&] {
        return UsageError(stack.name, "holds grey values (" + std::to_string(levels) + (levels > level_limit ? " or more" : "") + " levels)",
                          "pass --threshold otsu or a value, or --labels labels if they are labels");
    };
    const bool polarity = options.solid == "bright" || options.solid == "dark";
    if (!options.threshold.empty()) {
        if (options.mode == LabelMode::labels) throw UsageError("--threshold", "goes not with --labels labels");
        out = by_threshold(stack, options);
    } else if (!stack.reals.empty()) {
        throw grey_error();
    } else if (!polarity) {
        if (options.mode == LabelMode::labels) throw UsageError("--solid " + options.solid, "goes not with --labels labels");
        const auto solid = number(options.solid);
        if (!solid || *solid < 0 || *solid != std::floor(*solid)) throw UsageError("--solid " + options.solid, "is neither bright, dark nor a grey value");
        if (!std::binary_search(values.begin(), values.end(), std::uint32_t(*solid)))
            throw UsageError("--solid " + options.solid, "no voxel has this value; the stack holds " + listed(values));
        out = by_value(stack, std::uint32_t(*solid), listed(values));
    } else if (options.mode == LabelMode::binary || (options.mode == LabelMode::automatic && levels == 2)) {
        if (levels > 2) throw grey_error();
        out = by_value(stack, options.solid == "bright" ? values.back() : values.front(), listed(values));
    } else {
        if (options.mode == LabelMode::automatic && roughness(stack) > 0.3) throw grey_error();
        if (options.solid == "dark") throw UsageError("--solid dark", "goes not with labels, where 0 is void", "use --labels binary or --threshold");
        const std::size_t grains = levels - (values.front() == 0 ? 1 : 0);
        out.labels = std::move(stack.values);
        out.decision = std::to_string(grains) + " labels; 0 is void";
    }
    if (out.binary) {
        stack.values = {};
        stack.reals = {};
        const std::size_t solid = solid_count(out.solid);
        if (solid == 0 || solid == out.solid.count())
            throw Error(stack.name, solid == 0 ? "no voxel is solid (" + out.decision + ")" : "every voxel is solid (" + out.decision + ")",
                        "check --threshold and --solid");
    }
    return out;
}

}  // namespace coral::morph
