#pragma once
/// \file pack/criteria.h
/// Gradation curves and the geometric criteria of internal stability.
/// A gradation is a list of points with rising size and rising passing; between two points passing is linear in log(size), and two
/// points of one size make a step. Below the first point nothing passes, above the last everything does.
#include <span>
#include <vector>

#include "pack/sample.h"

namespace coral::pack {

/// Exact (stepped) gradation of single grains. \param diameters [m], masses [kg] of the same length
Psd gradation(std::span<const double> diameters, std::span<const double> masses);

/// Mass fraction of grains not larger than `size` [m]; the upper end of a step. \pre psd not empty
double passing_at(const Psd& psd, double size);

/// Smallest size [m] that the mass fraction `passing` does not exceed; the inverse of passing_at. \pre psd not empty
double size_at(const Psd& psd, double passing);

/// Gradation of a part of the mass: the points between two passings, stretched to 0..1.
Psd between(const Psd& psd, double lowest_passing, double highest_passing);

/// Coefficient of uniformity D60/D10.
double uniformity(const Psd& psd);

/// Kezdi 1979: D15c/d85f, the size at 15 % of the coarse fraction over that at 85 % of the fine fraction; stable if <= 4.
/// The soil is divided once, at its gap, that is at `fines_content`; the fine fraction has to be held by the coarse one as by a filter.
double kezdi_ratio(const Psd& psd, double fines_content);

/// Kenney and Lau 1985/1986: the least H/F, with F = passing(d) and H = passing(4 d) - passing(d), over all d with
/// 0 < F <= highest_f. A continuous gradation is stable if >= 1 (1986; 1.3 in 1985).
/// The minimum lies where d or 4 d is a point of the curve, and only those are visited.
double kenney_lau_ratio(const Psd& psd, double highest_f);

/// Mao 2005: 4 F_c (1 - n), with the mass fraction of fines and the porosity; stable if >= 1.
double mao_number(double fines_content, double porosity);

/// All criteria with values, thresholds and verdicts: "kezdi", "kenney-lau", "kenney-lau-1985", "mao", "istomina".
/// highest_f is 0.3 where the coarse fraction is narrow (D60/D10 <= 3), else 0.2, and is raised to the fines content when that lies
/// within 0.02 of it (a mass fraction of 30 % drawn grain by grain comes out as 0.301).
/// \param fines_content  0 or 1 makes those that compare two fractions "not applicable"
/// \param porosity       n of Mao: pores between and inside grains / total volume [-]
std::vector<Criterion> stability_criteria(const Psd& psd, double fines_content, double porosity);

}  // namespace coral::pack
