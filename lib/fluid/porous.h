#pragma once
/// \file fluid/porous.h
/// Fines in the flow: kernel averages both ways. The force on them is in fluid/fine_force.h. Each particle spreads its volume and its reaction over cells around
/// it, and feels averages of the flow, all with the weights  w_ic = k(2 dist/R) (1 - phi_c) / sum  of Peskin's
/// four-point kernel [Huang et al., eq. 15, with 4 r^2 for the printed 4 r^4], R the support radius. Cells beyond a
/// wall are folded back by reflection, cells in resolved grains (phi_c) take no part, and the weights of each particle
/// sum to 1.
#include <array>
#include <span>
#include <vector>

#include "fluid/flow.h"

namespace coral::fluid {

/// Peskin's four-point kernel along the radius, r >= 0; 0 from r = 2 on.
double peskin_kernel(double r);

/// What a particle feels of itself: its own volume in the void fraction, its own wake and the pressure it makes itself.
/// Drag laws want the flow without it [Evrard et al. 2020, J. Comput. Phys. X 8:100078].
enum class SelfDisturbance {
    removed,         ///< all of it is taken out: bulk_void_fraction(), fine_force()
    volume_removed,  ///< from the void fraction only
    kept,            ///< plain kernel means, as in the paper
};

struct KernelOptions {
    double volume_support =
        2.0;  ///< diameter of the support over the particle diameter, for void fraction and pressure force
    double felt_support = 4.0;      ///< the same for what a particle feels and for its drag reaction
    double smallest_support = 3.0;  ///< lower limit of the volume support [cells]; the felt one keeps its ratio to it
    double smallest_void_fraction = 0.15;
    SelfDisturbance self_disturbance = SelfDisturbance::removed;
    int coupling_cells =
        0;  ///< felt averages work on blocks of this many cells along an edge; 0 chooses (1 when d < 2.8 cells)
};

/// Void fraction of the bed around a particle, from the kernel mean at its centre. The mean counts the particle's own
/// volume, yet the gap that the other particles leave around it makes up for that in a dense bed. What is left over is
/// own_solid S, S the structure factor of hard spheres at long waves, (1 - phi)^4/(1 + 2 phi)^2 [Percus & Yevick 1958;
/// Wertheim 1963], here of the solid fraction phi of the others: all of it for a particle alone, 2 % of it in a dense
/// bed.
/// \param felt  kernel mean of the void fraction \param own_solid  part of 1 - felt that is the particle itself
double bulk_void_fraction(double felt, double own_solid);
/// The factor S above: the part of a particle's own disturbance that its neighbours do not make up for. 1 alone, 0.02 in
/// a dense bed.
double isolation(double felt, double own_solid);

/// What one particle feels.
struct FeltFlow {
    double void_fraction = 1.0;                                   ///< wide kernel, bulk_void_fraction()
    Eigen::Vector3d velocity = Eigen::Vector3d::Zero();           ///< interstitial, wide kernel [m/s]
    Eigen::Vector3d pressure_gradient = Eigen::Vector3d::Zero();  ///< of the kinematic pressure, volume kernel [m/s2]
    /// The same with the wide kernel; the volume kernel's where SelfDisturbance is not `removed` [m/s2].
    Eigen::Vector3d wide_pressure_gradient = Eigen::Vector3d::Zero();
    double isolation = 0.0;       ///< S; 0 where SelfDisturbance is not `removed`
    double own_solid = 0.0;       ///< part of the mean solid fraction of the wide kernel that is the particle itself
    double support_radius = 1.0;  ///< of the wide kernel [m]
};

/// Kernel weights of a set of fines for one step. Call, each flow step:
///     place(positions, diameters, cell_solid); deposit_volume(flow, volumes, velocities); feel(flow, felt);
///     ... force from fluid/fine_force.h: b_i and F_i with F_i' = dF_i/du = b_i ...
///     deposit_drag(flow, b, F); flow.predict(dt); drag_lag(flow, lag) -> F_i + lag_i is the drag the particle really
///     gets.
/// Then fluid + particles exchange momentum to round-off.
class FineCoupling {
public:
    explicit FineCoupling(const GridSpec& grid, const KernelOptions& options = {});

    /// Finds the weights. A particle outside the domain is treated as if on its border.
    /// \param positions [m], \param diameters [m] \param cell_solid  ImmersedBodies::cell_solid_fraction(), or nullptr
    /// without grains
    void place(std::span<const Eigen::Vector3d> positions, std::span<const double> diameters, const Field* cell_solid);

    /// eps_c = 1 - sum_i w_ic V_i / h3 and the solid flux J_s = sum_i w V_i v_i / h3 on faces, given to the flow.
    void deposit_volume(Flow& flow, std::span<const double> volumes, std::span<const Eigen::Vector3d> velocities);

    /// What each particle feels of the last whole step. felt.size() == particles. The pressure force on particle i is
    /// -rho V_i pressure_gradient (as clipped: it closes with the fluid's -eps grad p to round-off).
    void feel(const Flow& flow, std::span<FeltFlow> felt) const;

    /// Spreads the drag: coefficients b_i = dF_i/du [kg/s] and explicit forces F_i on the particles [N].
    void deposit_drag(Flow& flow, std::span<const double> coefficients, std::span<const Eigen::Vector3d> forces);

    /// After predict(): force b_i (u* - u^n) felt by particle i beyond F_i [N], which the fluid has already paid.
    void drag_lag(const Flow& flow, std::span<const double> coefficients, std::span<Eigen::Vector3d> lag) const;

    std::size_t size() const { return count_; }
    /// Blocks of cells used for the felt averages, and stored weights (for the performance report).
    int coupling_cells() const { return block_; }
    std::size_t stored_weights() const;

private:
    /// Neighbouring cells (or blocks) along x, of one particle.
    struct Row {
        std::uint32_t start = 0;            // linear index of the first
        std::int16_t x = 0, y = 0, z = 0;   // of the first
        std::int16_t length = 0;
        /// Weights that a row takes: whole registers. Those beyond its length are zero, for cells beyond the side.
        int lanes() const { return (length + 3) & ~3; }
    };
    /// Weights of a chunk of particles, one after the other.
    struct Weights {
        std::vector<Row> rows;
        std::vector<double> values;  // in use up to the end of the last row
        std::size_t used = 0;
        std::vector<std::size_t> first_row, first_value;  // per particle, one past the end last
        std::vector<std::int32_t> low_plane, high_plane;  // per particle

        void clear();
        double* append(const Row& row);
    };
    /// Grid the weights refer to: the padded cells of the flow, or blocks of cells. Either has room for three more
    /// values at the end of a row.
    struct Target {
        Eigen::Vector3i cells = Eigen::Vector3i::Zero();
        double cell = 0.0;
        Eigen::Matrix<std::ptrdiff_t, 3, 1> stride;
        std::ptrdiff_t offset = 0;
        std::size_t total = 0;
    };
    void sort_particles(std::span<const Eigen::Vector3d> positions);
    void choose_blocks(std::span<const double> diameters);
    double cells_in_block(int i, int j, int k) const;
    void find_open(const Field* cell_solid);
    void find_weights(std::vector<Weights>& chunks, const Target& target, const Field& open, double factor,
                      std::span<const Eigen::Vector3d> positions, std::span<const double> diameters) const;
    void add_particle(Weights& weights, const Target& target, const Field& open, double radius,
                      const Eigen::Vector3d& position) const;
    void add_row(Weights& weights, const Target& target, const Field* open, double radius, double x, double squared,
                 int j, int k) const;
    template <class Value>
    void scatter(const std::vector<Weights>& chunks, const Target& target, std::span<Field, 4> fields,
                 const Value& value) const;
    template <std::size_t count>
    void gather(const std::vector<Weights>& chunks, std::span<const Field, count> fields,
                std::vector<Eigen::Matrix<double, int(count), 1>>& sums) const;
    template <class Real>
    void find_void_fraction();
    template <class Real>
    void deposit_flux(int axis, int k, Real* flux) const;
    void find_own_overlap();
    template <class Real>
    void gather_pressure_gradient(const Flow& flow, std::span<FeltFlow> felt) const;
    template <class Real>
    void average_felt(const Flow& flow, std::span<FeltFlow> felt) const;
    template <class Real>
    void spread_drag(PorousFields& fields) const;
    template <class Real>
    void average_change(const Flow& flow) const;
    double support_radius(double diameter) const;
    template <std::size_t count, class Fill>
    void average_blocks(std::span<Field, count> averages, const Fill& fill) const;
    void cell_row(const Field& blocks, int j, int k, double* row) const;
    std::size_t block_row(int j, int k) const
    {
        return std::size_t((k / block_) * blocks_.stride[2] + (j / block_) * blocks_.stride[1]);
    }

    GridSpec grid_;
    Layout layout_;
    KernelOptions options_;
    std::size_t count_ = 0;
    int block_ = 1;
    Target cells_, blocks_;
    std::vector<std::size_t> order_;  // of the particles in the weights: neighbours follow each other
    std::vector<Weights> volume_, felt_;
    std::vector<double> own_overlap_;  // sum_c w_ic (volume) w_ic (felt): solid fraction felt of itself, per h3
    std::vector<double> own_solid_;    // the same times its volume / h3
    std::vector<double> radius_;       // of the felt support [m]
    Field open_cells_, open_blocks_;   // 1 - phi per cell (padded); its sum per block
    Field share_;                      // of the block that a cell makes up: open / sum of open, all alike in a solid block
    FlowField void_fraction_;          // of the next step; changes places with the flow's
    Field clip_;                       // (1 - eps)/(raw solid fraction)
    std::vector<char> clipped_;        // rows in which it is not 1
    bool any_clipped_ = false;
    std::array<Field, 4> cell_fields_;           // solid fraction and solid flux
    mutable std::array<Field, 7> block_fields_;  // means, or sums of drag coefficient and force
    mutable std::vector<Eigen::Matrix<double, 7, 1>> felt_sums_;
    mutable std::vector<Eigen::Vector4d> plain_sums_;
    mutable std::vector<Eigen::Vector3d> lag_sums_;
    std::array<std::vector<double>, 3> low_share_,
        high_share_;  // per axis: how a cell's reaction divides between its two faces
};

}  // namespace coral::fluid
