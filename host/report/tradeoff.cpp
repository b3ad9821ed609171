#include "report/tradeoff.hpp"

#include <algorithm>
#include <cmath>

namespace halfshade {

std::vector<bool> pareto_front(std::span<const Tradeoff> points) {
  std::vector<bool> on_front;
  for (const Tradeoff& point : points) {
    on_front.push_back(std::none_of(points.begin(), points.end(), [&](const Tradeoff& other) {
      return other.time_ms <= point.time_ms && other.error <= point.error &&
             (other.time_ms < point.time_ms || other.error < point.error);
    }));
  }
  return on_front;
}

std::optional<double> rays_time_at_error(std::span<const Tradeoff> rays, double error) {
  std::vector<Tradeoff> front;
  const std::vector<bool> on_front = pareto_front(rays);
  for (std::size_t i = 0; i < rays.size(); ++i)
    if (on_front[i]) front.push_back(rays[i]);
  std::sort(front.begin(), front.end(), [](const Tradeoff& a, const Tradeoff& b) { return a.time_ms < b.time_ms; });
  for (std::size_t i = 0; i < front.size(); ++i) {
    if (front[i].error > error) continue;
    if (i == 0 || front[i].error <= 0.0 || front[i].error == error) return front[i].time_ms;
    const Tradeoff &slower = front[i], &faster = front[i - 1];
    const double t = std::log(faster.error / error) / std::log(faster.error / slower.error);
    return faster.time_ms * std::pow(slower.time_ms / faster.time_ms, t);
  }
  return {};
}

}  // namespace halfshade
