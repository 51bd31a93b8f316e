#pragma once
/// \file report/pool.h
/// Runs that repeat one case with other packings, taken together: mean and spread.
#include <vector>

#include "report/case_data.h"

namespace coral::report {

/// One case for each label, in order of first appearance; cases without a label, or alone with theirs, stay as they are.
/// Of several: series become the mean over the runs at each output time, `low` and `high` the least and the greatest (at the times that all
/// runs have; a run that stopped early shortens the whole); migration and trapped fines of all runs are put together and counted in
/// units of one run; sample, tracks, criteria and set-up are those of the first run. A value that is not finite in one run is left out of the mean.
/// \throws Error when runs of one label have different output times
std::vector<CaseData> pool_repeats(const std::vector<CaseData>& cases);

}  // namespace coral::report
