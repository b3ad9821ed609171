#include "light_samples.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace halfshade {
namespace {

/// Shirley & Chiu 1997, "A low distortion map between disk and square".
glm::dvec2 disc_of_square(double x, double y) {
  const double a = 2.0 * x - 1.0, b = 2.0 * y - 1.0;
  if (a == 0.0 && b == 0.0) return glm::dvec2(0.0);
  const double quarter = std::numbers::pi / 4.0;
  if (std::abs(a) > std::abs(b)) {
    const double angle = quarter * (b / a);
    return a * glm::dvec2(std::cos(angle), std::sin(angle));
  }
  const double angle = 2.0 * quarter - quarter * (a / b);
  return b * glm::dvec2(std::cos(angle), std::sin(angle));
}

/// As turn_of in kernels/visibility_exact.cl, in the same precision.
float turn_of(float x, float y) {
  const float t = x / std::max(std::abs(x) + std::abs(y), 1e-30f);
  return y >= 0.0f ? 1.0f - t : 3.0f + t;
}

}  // namespace

std::uint32_t hash_of(std::uint32_t x) {
  x = x * 747796405u + 2891336453u;
  x = ((x >> ((x >> 28u) + 4u)) ^ x) * 277803737u;
  return (x >> 22u) ^ x;
}

double unit_of(std::uint32_t hash) {
  return (hash + 0.5) * 0x1p-32;
}

std::vector<glm::dvec2> disc_samples(unsigned n, std::uint32_t pattern_seed) {
  if (n == 1) return {glm::dvec2(0.0)};
  // Rows as high as they hold cells, so that every cell has the same area whatever n.
  const auto rows = static_cast<unsigned>(std::sqrt(static_cast<double>(n)));
  struct Cell {
    unsigned order;
    glm::dvec2 sample;
  };
  std::vector<Cell> cells;
  const bool in_blocks = rows * rows == n && rows % 4 == 0;
  for (unsigned row = 0, first = 0; row < rows; ++row) {
    const unsigned last = n * (row + 1) / rows, columns = last - first;
    for (unsigned column = 0; column < columns; ++column) {
      const std::uint32_t seed = hash_of((first + column + 0x9e3779b9u * n) ^ hash_of(pattern_seed));
      const double x = (column + unit_of(hash_of(seed))) / columns;
      const double y = (first + unit_of(hash_of(seed ^ 0x85ebca6bu)) * columns) / n;
      const unsigned order = in_blocks ? ((row / 4 * rows / 4 + column / 4) * 4 + row % 4) * 4 + column % 4 : first + column;
      cells.push_back({order, disc_of_square(x, y)});
    }
    first = last;
  }
  std::vector<glm::dvec2> samples(n);
  for (const Cell& cell : cells) samples[cell.order] = cell.sample;
  return samples;
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
  const std::size_t per_turn = 8 * sorted.size();
  table.per_turn = static_cast<float>(per_turn);
  for (std::size_t i = 0; i <= 4 * per_turn; ++i) {
    const float turn = static_cast<float>(i) / table.per_turn;
    const auto below = std::lower_bound(sorted.begin(), sorted.end(), turn, [](const Sample& s, float t) { return s.turn < t; });
    table.rank.push_back(static_cast<std::uint16_t>(below - sorted.begin()));
  }
  table.samples.push_back(std::numeric_limits<float>::infinity());
  return table;
}

}  // namespace halfshade
