#pragma once
/// \file pack/criteria.h
/// Gradation curves and the geometric criteria of internal stability.
/// A gradation is a list of points with rising size and rising passing; between two points passing is linear in log(size), and two
/// points of one size make a step. Below the first point nothing passes, above the last everything does.
#include <limits>
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

/// Burenkova 1993: with h' = d90/d60 and h'' = d90/d15 a soil does not suffuse in the band 0.76 lg h'' + 1 < h' < 1.86 lg h'' + 1.
/// Returned is the distance from the middle of the band in half-widths; stable if < 1:
///     |k - 1.31| / 0.55,   k = (h' - 1)/lg h''      [k = 0.76 and 1.86 are the borders]
/// NaN for a soil of one size, where h'' = 1.
double burenkova_distance(const Psd& psd);

/// Stress-reduction factor alpha of Skempton and Brogan 1994, measured as Shire et al. 2014 do: mean stress of the fines over that of all
/// grains, from the contact forces f on a grain and the branch vectors b from its centre of mass to the contact, walls included,
///     alpha = (sum_fine p V / sum_fine V) / (sum_all p V / sum_all V),   p V = -1/3 sum_contacts f . b   (compression positive)
/// with V the volume of the apparent shape. 0: the fines lie loose in the pores; 1: they carry as much as the coarse grains.
/// NaN without contacts, without one of the two fractions, or when the grains as a whole are not compressed.
double fines_stress_ratio(const Sample& sample);

/// Relative density (e_max - e)/(e_max - e_min) of void ratios; 0 at the loosest, 1 at the densest state. \pre e_max != e_min
double relative_density(double void_ratio, double e_min, double e_max);

/// All criteria with values, thresholds and verdicts: "kezdi", "kenney-lau", "kenney-lau-1985", "mao", "istomina", "burenkova",
/// "skempton-brogan".
/// highest_f is 0.3 where the coarse fraction is narrow (D60/D10 <= 3), else 0.2, and is raised to the fines content when that lies
/// within 0.02 of it (a mass fraction of 30 % drawn grain by grain comes out as 0.301).
/// \param fines_content  0 or 1 makes those that compare two fractions "not applicable"
/// \param porosity       n of Mao: pores between and inside grains / total volume [-]
/// \param stress_ratio   alpha of Skempton and Brogan; NaN: "not applicable"
std::vector<Criterion> stability_criteria(const Psd& psd, double fines_content, double porosity,
                                          double stress_ratio = std::numeric_limits<double>::quiet_NaN());

}  // namespace coral::pack
