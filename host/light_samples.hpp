// Points of a light that stand for all of it.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

namespace halfshade {

/// `count` (a power of 4) stratified points of the unit disc, always the same: one in each cell of a jittered grid, mapped by
/// Shirley & Chiu's concentric map (A Low Distortion Map Between Disk and Square, 1997), which keeps areas.
std::vector<glm::dvec2> disc_samples(unsigned count);

/// Samples as kernels/visibility_exact.cl reads them.
struct SampleTable {
  std::vector<float> samples;     ///< x of all, y of all, turns of all (ascending), then infinities for the last search steps
  std::vector<std::int32_t> rank; ///< rank[i]: samples with a turn below i / per_turn; the search goes on from there
  float per_turn = 0.0f;          ///< table entries a quarter turn
  unsigned steps = 0;             ///< the most samples between two entries
};

/// Sorts points by angle and builds the table that finds an angle's rank among them.
SampleTable sample_table(const std::vector<glm::dvec2>& points);

}  // namespace halfshade
