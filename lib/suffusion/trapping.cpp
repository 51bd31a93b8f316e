#include "suffusion/trapping.h"

#include <algorithm>
#include <cmath>

namespace coral::suffusion {

using Eigen::Vector3d;

namespace {

/// Whether the sphere around a point of the shape's frame lies in the apparent shape, by 26 points of it.
bool encloses(const ApparentShape& apparent, const Vector3d& centre, double radius)
{
    for (int k = -1; k <= 1; ++k)
        for (int j = -1; j <= 1; ++j)
            for (int i = -1; i <= 1; ++i) {
                if (i == 0 && j == 0 && k == 0) continue;
                if (!apparent.contains(centre + radius * Vector3d(i, j, k).normalized())) return false;
            }
    return true;
}

}  // namespace

std::vector<Trapped> find_trapped(const Scene& scene, const std::vector<std::int64_t>& fines, double time, const std::vector<Trapped>& before, ThroatLibrary& throats)
{
    std::vector<std::size_t> hollow;
    for (std::size_t g = 0; g < scene.bodies.size(); ++g)
        if (scene.bodies[g].apparent && scene.world.active(static_cast<int>(g))) hollow.push_back(g);
    std::vector<Trapped> now;
    for (const std::int64_t fine : fines) {
        const Vector3d& x = scene.world.position(static_cast<int>(fine));
        for (const std::size_t g : hollow) {
            const int body = static_cast<int>(g);
            const Vector3d r = scene.nearest_image(x - scene.world.position(body));
            if (r.squaredNorm() > std::pow(scene.world.bounding_radius(body), 2)) continue;
            const double scale = scene.world.scale(body);
            const Vector3d local = scene.world.orientation(body).conjugate() * r / scale;
            const ApparentShape& apparent = *scene.bodies[g].apparent;
            if (!apparent.contains(local)) continue;
            const double radius = 0.5 * scene.bodies[static_cast<std::size_t>(fine)].diameter;
            Trapped trapped{fine, static_cast<std::int64_t>(g), encloses(apparent, local, radius / scale), time, throats.width(scene.world, body, r, radius)};
            const auto known = std::ranges::find_if(before, [&](const Trapped& t) { return t.fine == trapped.fine && t.grain == trapped.grain; });
            if (known != before.end()) trapped.since = known->since;
            now.push_back(trapped);
            break;
        }
    }
    return now;
}

}  // namespace coral::suffusion
