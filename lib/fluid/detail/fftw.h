#pragma once
/// \file fluid/detail/fftw.h
/// FFTW in double and in single precision under one name.
#include <fftw3.h>

#include <mutex>

namespace coral::fluid::detail {

/// FFTW's planner keeps global state: hold this while a plan is made or destroyed.
std::mutex& planner_mutex();

template <class Real>
struct Fftw;

template <>
struct Fftw<double> {
    using Plan = fftw_plan;
    using Complex = fftw_complex;
    static constexpr auto plan_r2r_2d = fftw_plan_r2r_2d;
    static constexpr auto plan_many_r2r = fftw_plan_many_r2r;
    static constexpr auto plan_many_dft = fftw_plan_many_dft;
    static constexpr auto execute_r2r = fftw_execute_r2r;
    static constexpr auto execute_dft = fftw_execute_dft;
    static constexpr auto destroy = fftw_destroy_plan;
};

template <>
struct Fftw<float> {
    using Plan = fftwf_plan;
    using Complex = fftwf_complex;
    static constexpr auto plan_r2r_2d = fftwf_plan_r2r_2d;
    static constexpr auto plan_many_r2r = fftwf_plan_many_r2r;
    static constexpr auto plan_many_dft = fftwf_plan_many_dft;
    static constexpr auto execute_r2r = fftwf_execute_r2r;
    static constexpr auto execute_dft = fftwf_execute_dft;
    static constexpr auto destroy = fftwf_destroy_plan;
};

/// Destroys the plan with it.
template <class Real>
struct PlanOf {
    typename Fftw<Real>::Plan plan = nullptr;
    PlanOf() = default;
    PlanOf(const PlanOf&) = delete;
    PlanOf& operator=(const PlanOf&) = delete;
    ~PlanOf()
    {
        const std::lock_guard lock(planner_mutex());
        if (plan) Fftw<Real>::destroy(plan);
    }
};

}  // namespace coral::fluid::detail
