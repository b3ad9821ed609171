// Time against error: which measurements are on the Pareto front, and what ray tracing needs for the same error.
#pragma once

#include <optional>
#include <span>
#include <vector>

namespace halfshade {

/// Time and error of one measurement.
struct Tradeoff {
  double time_ms, error;
};

/// Which points are on the Pareto front: no other point is at most as slow and at most as wrong, and better in one of the two.
std::vector<bool> pareto_front(std::span<const Tradeoff> points);

/// The time in which `rays` reach `error`: interpolated linearly in log time and log error along the rays' own Pareto front. The
/// fastest of them where even that has no more than `error`; nothing where none reaches it.
std::optional<double> rays_time_at_error(std::span<const Tradeoff> rays, double error);

}  // namespace halfshade
