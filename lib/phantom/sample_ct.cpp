#include "phantom/sample_ct.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/parallel.h"
#include "core/progress.h"
#include "core/text.h"

namespace coral::phantom {

namespace {
using Eigen::Vector3i;

GrainSpec grain_spec(const SampleSpec& spec, int number, RandomSource& random)
{
    GrainSpec grain;
    grain.stick = number >= spec.grains - spec.sticks;
    const auto& sphericity = grain.stick ? spec.stick_sphericity : spec.lump_sphericity;
    grain.outline.equivalent_diameter = spec.diameter * random.uniform(1 - spec.spread, 1 + spec.spread);
    grain.outline.sphericity = random.uniform(sphericity[0], sphericity[1]);
    grain.outline.stretch = grain.stick ? spec.stick_stretch : 1.0;
    grain.outline.degree = spec.degree;
    grain.voids = spec.voids;
    return grain;
}

/// Stack under construction: which voxels lie inside any outline.
struct Canvas {
    Vector3i size;
    std::vector<std::uint8_t> taken;

    std::size_t index(int i, int j, int k) const { return (static_cast<std::size_t>(k) * size.y() + j) * size.x() + i; }
    bool collides(const GrainImage& image, const Vector3i& corner) const
    {
        std::size_t n = 0;
        for (int k = 0; k < image.size.z(); ++k) {
            for (int j = 0; j < image.size.y(); ++j) {
                for (int i = 0; i < image.size.x(); ++i, ++n) {
                    if (image.apparent[n] && taken[index(corner.x() + i, corner.y() + j, corner.z() + k)]) return true;
                }
            }
        }
        return false;
    }
    void take(const GrainImage& image, const Vector3i& corner)
    {
        std::size_t n = 0;
        for (int k = 0; k < image.size.z(); ++k) {
            for (int j = 0; j < image.size.y(); ++j) {
                for (int i = 0; i < image.size.x(); ++i, ++n) {
                    if (image.apparent[n]) taken[index(corner.x() + i, corner.y() + j, corner.z() + k)] = 1;
                }
            }
        }
    }
};

/// Slots along x, y, z: few empty ones, and near to a cube.
Vector3i arrangement(int count)
{
    Vector3i best(count, 1, 1);
    for (int nz = 1; nz * nz * nz <= count; ++nz) {
        for (int ny = nz; ny * ny * nz <= count + ny * nz; ++ny) {
            const Vector3i slots((count + ny * nz - 1) / (ny * nz), ny, nz);
            if (slots.prod() + slots.sum() < best.prod() + best.sum()) best = slots;
        }
    }
    return best;
}

/// Corners of the grains' boxes on a near-cubic arrangement of equal slots; `size` becomes that of the stack.
std::vector<Vector3i> place(const std::vector<GrainImage>& images, int gap, bool touching, Vector3i& size)
{
    Vector3i slot = Vector3i::Zero();
    for (const auto& image : images) slot = slot.cwiseMax(image.size);
    const int count = static_cast<int>(images.size());
    const Vector3i slots = arrangement(count);
    size = slots.cwiseProduct(slot + Vector3i::Constant(gap)) + Vector3i::Constant(gap);

    Canvas canvas{size, std::vector<std::uint8_t>(touching ? static_cast<std::size_t>(size.prod()) : 0, 0)};
    std::vector<Vector3i> corners;
    for (int n = 0; n < count; ++n) {
        const Vector3i at(n % slots.x(), (n / slots.x()) % slots.y(), n / (slots.x() * slots.y()));
        Vector3i corner =
            at.cwiseProduct(slot + Vector3i::Constant(gap)) + Vector3i::Constant(gap) + (slot - images[n].size) / 2;
        if (touching) {
            // Slide towards the grains already placed: along x within a row, y between rows, z between layers.
            for (int axis = 0; axis < 3; ++axis) {
                if (at[axis] == 0) continue;
                for (;;) {
                    --corner[axis];
                    if (corner[axis] >= gap && !canvas.collides(images[n], corner)) continue;
                    ++corner[axis];
                    break;
                }
            }
            canvas.take(images[n], corner);
        }
        corners.push_back(corner);
    }
    if (touching) {  // the stack shrinks to what is used
        size.setZero();
        for (int n = 0; n < count; ++n) size = size.cwiseMax(corners[n] + images[n].size + Vector3i::Constant(gap));
    }
    return corners;
}

std::string joined(const std::vector<double>& values)
{
    std::string text;
    for (const double v : values) text += (text.empty() ? "" : ";") + to_text(v);
    return text;
}
}  // namespace

Sample make_sample(const SampleSpec& spec)
{
    if (spec.supersample < 1 || spec.supersample % 2 == 0) {
        throw UsageError("--supersample", to_text(spec.supersample) + " is not odd",
                         "use 1, 3 or 5: a voxel takes the value at its centre");
    }
    Progress progress("grains", spec.grains);
    std::vector<GrainImage> images;
    Sample sample;
    for (int n = 0; n < spec.grains; ++n) {
        RandomSource random(spec.seed, n);
        const GrainSpec grain = grain_spec(spec, n, random);
        images.push_back(Grain(grain, random).image(spec.voxel_size, spec.supersample));
        sample.grains.push_back({grain.stick, Eigen::Vector3d::Zero(), images.back().truth});
        progress.update(n + 1);
    }
    progress.finish();

    morph::VoxelStack& labels = sample.labels;
    const auto corners = place(images, static_cast<int>(std::ceil(spec.gap)), spec.touching, labels.size);
    labels.voxel_size = spec.voxel_size;
    labels.name = "phantom";
    labels.values = morph::VoxelValues(labels.count(), 0);
    sample.fraction.assign(labels.count(), 0.0f);
    for (int n = 0; n < spec.grains; ++n) {
        const GrainImage& image = images[n];
        sample.grains[n].centre = image.centre + corners[n].cast<double>().cwiseProduct(spec.voxel_size);
        std::size_t from = 0;
        for (int k = 0; k < image.size.z(); ++k) {
            for (int j = 0; j < image.size.y(); ++j) {
                for (int i = 0; i < image.size.x(); ++i, ++from) {
                    const std::size_t to = labels.index(corners[n].x() + i, corners[n].y() + j, corners[n].z() + k);
                    if (image.solid[from]) labels.values.set(to, static_cast<std::uint32_t>(n + 1));
                    sample.fraction[to] = std::min(1.0f, sample.fraction[to] + image.fraction[from]);
                }
            }
        }
    }
    return sample;
}

Table truth_table(const Sample& sample)
{
    Table table;
    table.columns = {"label",
                     "kind",
                     "volume",
                     "apparent_volume",
                     "equivalent_diameter",
                     "surface_area",
                     "sphericity",
                     "intraparticle_porosity",
                     "open_void_volume",
                     "closed_void_volume",
                     "void_count",
                     "open_void_count",
                     "closed_void_count",
                     "throat_diameters",
                     "chamber_radii",
                     "x",
                     "y",
                     "z"};
    for (std::size_t n = 0; n < sample.grains.size(); ++n) {
        const PlacedGrain& grain = sample.grains[n];
        const Truth& t = grain.truth;
        const auto count = [](int value) { return static_cast<long long>(value); };
        table.add({count(static_cast<int>(n) + 1), std::string(grain.stick ? "stick" : "lump"), t.volume,
                   t.apparent_volume, t.equivalent_diameter, t.surface_area, t.sphericity, t.intraparticle_porosity,
                   t.open_void_volume, t.closed_void_volume, count(t.void_count), count(t.open_void_count),
                   count(t.closed_void_count), joined(t.throat_diameters), joined(t.chamber_radii), grain.centre.x(),
                   grain.centre.y(), grain.centre.z()});
    }
    return table;
}

morph::VoxelStack binary_stack(const Sample& sample)
{
    morph::VoxelStack stack = sample.labels;
    for (std::size_t v = 0; v < stack.count(); ++v) stack.values.set(v, stack.values[v] ? 255 : 0);
    return stack;
}

morph::VoxelStack grey_stack(const Sample& sample, const GreySpec& spec, std::uint64_t seed)
{
    morph::VoxelStack stack = sample.labels;
    const std::size_t slice = static_cast<std::size_t>(stack.size.x()) * stack.size.y();
    parallel_blocks(stack.count(), slice, [&](std::size_t begin, std::size_t end) {
        RandomSource random(seed, 1'000'000 + begin / slice);  // a stream per slice, away from those of the grains
        for (std::size_t n = begin; n < end; ++n) {
            const double grey =
                spec.void_grey + (spec.solid_grey - spec.void_grey) * sample.fraction[n] + spec.noise * random.normal();
            stack.values.set(n, static_cast<std::uint32_t>(std::clamp(std::lround(grey), 0L, 255L)));
        }
    });
    return stack;
}

}  // namespace coral::phantom
