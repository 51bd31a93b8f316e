// Distance transform and labels of a whole stack on one thread: the lines that baseline_ct.py compares with scipy and ITK.
#include <cstdio>
#include <ctime>

#include "core/parallel.h"
#include "morph/components.h"
#include "morph/distance_transform.h"
#include "morph/stack_io.h"

namespace {

using namespace coral;

/// CPU seconds of one call.
template <class Work>
double seconds(const Work& work)
{
    const std::clock_t start = std::clock();
    work();
    return double(std::clock() - start) / CLOCKS_PER_SEC;
}

/// Negative in solid: distances between voxel centres, less the half voxel to the face, as ITK and scipy scripts take it.
std::vector<float> signed_distances(const morph::Mask& mask)
{
    std::vector<float> outside = morph::squared_distances(mask.voxels, mask.size, 1, Eigen::Vector3d::Ones());
    const std::vector<float> inside = morph::squared_distances(mask.voxels, mask.size, 0, Eigen::Vector3d::Ones());
    for (std::size_t v = 0; v < outside.size(); ++v)
        outside[v] = mask.voxels[v] ? 0.5F - std::sqrt(inside[v]) : std::sqrt(outside[v]) - 0.5F;
    return outside;
}

}  // namespace

/// ct_kernels STACK: prints `name seconds` lines
int main(int argc, char** argv)
{
    if (argc != 2) {
        std::fprintf(stderr, "usage: ct_kernels STACK\n");
        return 2;
    }
    set_thread_count(1);
    const std::string path = argv[1];
    morph::VoxelStack stack = morph::read_stack({&path, 1});
    morph::Mask mask = morph::make_mask(stack.size, Eigen::Vector3d::Ones());
    for (std::size_t v = 0; v < mask.voxels.size(); ++v) mask.voxels[v] = stack.values[v] != 0;
    stack.values = {};
    std::vector<float> distances;
    std::printf("signed_distance %.3f\n", seconds([&] { distances = signed_distances(mask); }));
    distances = {};
    morph::Components parts;
    std::printf("labels %.3f\n", seconds([&] { parts = morph::connected_components(mask.voxels, mask.size, 1, morph::Connectivity::full); }));
    std::printf("components %zu\n", parts.sizes.size());
}
