// What is measured as JSON: the content of report.json, and back.
#pragma once

#include <vector>

#include "report/figures_json.hpp"
#include "report/measure.hpp"

namespace halfshade {

/// Rows with what follows from all of them together: which are on the Pareto front of time and penumbra error, and in what time
/// rays reach the same error.
Json results_of(const std::vector<Measurement>& rows);

/// Takes over what an interrupted run has measured of this row: `result` is one of results_of. Throws Json::exception where it is
/// not.
void restore(Measurement& row, const Json& result);

}  // namespace halfshade
