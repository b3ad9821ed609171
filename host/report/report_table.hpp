// What is measured of one light as a table of text.
#pragma once

#include <string>
#include <vector>

#include "halfshade/halfshade.hpp"
#include "report/measure.hpp"

namespace halfshade {

/// One row a measurement, beneath what they have in common. `tree_build_ms` is the time in which the tree for rays was built.
std::string report_table(const Scene& scene, const Light& light, double tree_build_ms, const std::vector<Measurement>& rows);

/// What the columns' names mean.
std::string report_table_legend();

}  // namespace halfshade
