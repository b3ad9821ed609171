#include "light_samples.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace halfshade {
namespace {

/// A uniform number in [0, 1) from an index (Wellons' lowbias32): the same on every machine.
double hash_uniform(std::uint32_t x) {
  x ^= x >> 16;
  x *= 0x7feb352du;
  x ^= x >> 15;
  x *= 0x846ca68bu;
  x ^= x >> 16;
  return x / 4294967296.0;
}

glm::dvec2 concentric(double u, double v) {
  const double a = 2.0 * u - 1.0, b = 2.0 * v - 1.0;
  if (a == 0.0 && b == 0.0) return {0.0, 0.0};
  const double quarter = std::numbers::pi / 4.0;
  const double r = std::abs(a) > std::abs(b) ? a : b;
  const double angle = std::abs(a) > std::abs(b) ? quarter * (b / a) : 2.0 * quarter - quarter * (a / b);
  return {r * std::cos(angle), r * std::sin(angle)};
}

/// As turn_of in kernels/visibility_exact.cl, in the same precision.
float turn_of(float x, float y) {
  const float t = x / std::max(std::abs(x) + std::abs(y), 1e-30f);
  return y >= 0.0f ? 1.0f - t : 3.0f + t;
}

}  // namespace

std::vector<glm::dvec2> disc_samples(unsigned count) {
  const auto side = static_cast<unsigned>(std::lround(std::sqrt(count)));
  std::vector<glm::dvec2> points;
  for (unsigned i = 0; i < side * side; ++i)
    points.push_back(concentric((i % side + hash_uniform(2 * i + 1)) / side, (i / side + hash_uniform(2 * i + 2)) / side));
  return points;
}

SampleTable sample_table(const std::vector<glm::dvec2>& points) {
  struct Sample {
    float x, y, turn;
  };
  std::vector<Sample> sorted;
  for (const glm::dvec2& p : points) {
    const auto x = static_cast<float>(p.x), y = static_cast<float>(p.y);
    sorted.push_back({x, y, turn_of(x, y)});
  }
  std::sort(sorted.begin(), sorted.end(), [](const Sample& a, const Sample& b) { return a.turn < b.turn; });

  SampleTable table;
  for (const Sample& s : sorted) table.samples.push_back(s.x);
  for (const Sample& s : sorted) table.samples.push_back(s.y);
  for (const Sample& s : sorted) table.samples.push_back(s.turn);
  const std::size_t per_turn = 4 * sorted.size();
  table.per_turn = static_cast<float>(per_turn);
  for (std::size_t i = 0; i <= 4 * per_turn; ++i) {
    const float turn = static_cast<float>(i) / table.per_turn;
    const auto below = std::lower_bound(sorted.begin(), sorted.end(), turn, [](const Sample& s, float t) { return s.turn < t; });
    table.rank.push_back(static_cast<std::int32_t>(below - sorted.begin()));
    if (i > 0) table.steps = std::max(table.steps, static_cast<unsigned>(table.rank[i] - table.rank[i - 1]));
  }
  table.samples.insert(table.samples.end(), table.steps + 1, std::numeric_limits<float>::infinity());
  return table;
}

}  // namespace halfshade
