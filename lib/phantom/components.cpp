#include "phantom/components.h"

namespace coral::phantom {

std::vector<std::size_t> label_pieces(std::span<const std::uint8_t> state, std::uint8_t wanted,
                                      const Eigen::Vector3i& size, bool corners, std::vector<std::int32_t>& piece)
{
    std::vector<Eigen::Vector3i> neighbours;
    for (int dz = -1; dz <= 1; ++dz) {
        for (int dy = -1; dy <= 1; ++dy) {
            for (int dx = -1; dx <= 1; ++dx) {
                const int steps = std::abs(dx) + std::abs(dy) + std::abs(dz);
                if (steps == 1 || (corners && steps > 1)) neighbours.emplace_back(dx, dy, dz);
            }
        }
    }
    const auto index = [&](const Eigen::Vector3i& p) {
        return (static_cast<std::size_t>(p.z()) * size.y() + p.y()) * size.x() + p.x();
    };
    piece.assign(state.size(), 0);
    std::vector<std::size_t> counts{0};
    std::vector<Eigen::Vector3i> front;
    for (std::size_t start = 0; start < state.size(); ++start) {
        if (state[start] != wanted || piece[start] != 0) continue;
        const auto number = static_cast<std::int32_t>(counts.size());
        counts.push_back(1);
        piece[start] = number;
        const std::size_t row = start / size.x();
        front.assign(1, Eigen::Vector3i(start % size.x(), row % size.y(), row / size.y()));
        while (!front.empty()) {
            const Eigen::Vector3i p = front.back();
            front.pop_back();
            for (const auto& step : neighbours) {
                const Eigen::Vector3i n = p + step;
                if ((n.array() < 0).any() || (n.array() >= size.array()).any()) continue;
                const std::size_t at = index(n);
                if (state[at] != wanted || piece[at] != 0) continue;
                piece[at] = number;
                ++counts.back();
                front.push_back(n);
            }
        }
    }
    return counts;
}

}  // namespace coral::phantom
