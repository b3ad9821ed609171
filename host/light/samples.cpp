#include "light/samples.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "light/fit.hpp"
#include "light/light_model.hpp"

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

/// As turn_of in kernels/methods/exact, in the same precision.
float turn_of(float x, float y) {
  const float t = x / std::max(std::abs(x) + std::abs(y), 1e-30f);
  return y >= 0.0f ? 1.0f - t : 3.0f + t;
}

/// Where a coordinate of the unit disc lies in a grid on -1..1.
unsigned cell_along(float x, unsigned cells_across) {
  return std::min(static_cast<unsigned>(std::max(0.0f, 0.5f * (x + 1.0f) * static_cast<float>(cells_across))), cells_across - 1);
}

/// About five samples a cell: those of the few cells of a row that an edge passes over are mostly one vector.
void sort_into_cells(SampleTable& table, std::size_t n) {
  constexpr std::size_t padding = 16;  // a vector may be read from any sample on
  table.cells_across = static_cast<unsigned>(std::max(1.0, std::sqrt(static_cast<double>(n)) / 2.0));
  std::vector<std::vector<std::uint16_t>> cells(std::size_t{table.cells_across} * table.cells_across);
  for (std::size_t i = 0; i < n; ++i)
    cells[std::size_t{cell_along(table.samples[n + i], table.cells_across)} * table.cells_across +
          cell_along(table.samples[i], table.cells_across)]
        .push_back(static_cast<std::uint16_t>(i));
  std::vector<std::uint16_t> order;
  for (const std::vector<std::uint16_t>& cell : cells) {
    table.cells.push_back(static_cast<std::uint16_t>(order.size()));
    order.insert(order.end(), cell.begin(), cell.end());
  }
  table.cells.push_back(static_cast<std::uint16_t>(n));
  table.cells.insert(table.cells.end(), order.begin(), order.end());
  table.cells.insert(table.cells.end(), padding, 0);
  for (const std::size_t first : {std::size_t{0}, n}) {
    for (const std::uint16_t i : order) table.cell_xy.push_back(table.samples[first + i]);
    table.cell_xy.insert(table.cell_xy.end(), padding, 0.0f);
  }
}

/// Few edges pass over more than such a window: they need no loop over cells.
void sort_into_windows(SampleTable& table, std::size_t n) {
  constexpr float beyond = 1e18f;
  const unsigned across = 2 * table.cells_across;
  std::vector<std::uint16_t> cell_x, cell_y;
  for (std::size_t i = 0; i < n; ++i) {
    cell_x.push_back(static_cast<std::uint16_t>(cell_along(table.samples[i], across)));
    cell_y.push_back(static_cast<std::uint16_t>(cell_along(table.samples[n + i], across)));
  }
  for (unsigned y = 0; y < across; ++y)
    for (unsigned x = 0; x < across; ++x) {
      std::vector<std::uint16_t> inside;
      for (std::size_t i = 0; i < n; ++i)
        if (cell_x[i] >= x && cell_x[i] < x + HS_WINDOW_CELLS && cell_y[i] >= y && cell_y[i] < y + HS_WINDOW_CELLS)
          inside.push_back(static_cast<std::uint16_t>(i));
      if (inside.size() > HS_WINDOW_SAMPLES) inside.assign(1, HS_WINDOW_FULL);
      for (const std::size_t first : {std::size_t{0}, n})
        for (unsigned k = 0; k < HS_WINDOW_SAMPLES; ++k)
          table.window_xy.push_back(k < inside.size() && inside[0] != HS_WINDOW_FULL ? table.samples[first + inside[k]] : beyond);
      inside.resize(HS_WINDOW_SAMPLES, 0);
      table.windows.insert(table.windows.end(), inside.begin(), inside.end());
    }
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

std::vector<glm::dvec2> square_samples(unsigned n, std::uint32_t pattern_seed) {
  if (n == 1) return {glm::dvec2(0.5)};
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
      cells.push_back({order, {x, y}});
    }
    first = last;
  }
  std::vector<glm::dvec2> samples(n);
  for (const Cell& cell : cells) samples[cell.order] = cell.sample;
  return samples;
}

std::vector<glm::dvec2> disc_samples(unsigned n, std::uint32_t pattern_seed) {
  std::vector<glm::dvec2> samples = square_samples(n, pattern_seed);
  for (glm::dvec2& sample : samples) sample = disc_of_square(sample.x, sample.y);
  return samples;
}

LightPoints light_points(const Light& light, unsigned n, std::uint32_t seed) {
  return model_of(light.shape).points(light, n, seed);
}

glm::dvec3 mean_color(const Light& light) {
  if (!light.texture) return glm::dvec3(1.0);
  glm::dvec3 sum(0.0);
  for (const glm::vec3& texel : light.texture->texels) sum += glm::dvec3(texel);
  return sum / static_cast<double>(light.texture->texels.size());
}

SampleTable sample_table(const LightPoints& points) {
  struct Sample {
    float x, y, turn;
    glm::vec3 weight;
  };
  std::vector<Sample> sorted;
  for (std::size_t i = 0; i < points.points.size(); ++i) {
    const auto x = static_cast<float>(points.points[i].x), y = static_cast<float>(points.points[i].y);
    sorted.push_back({x, y, turn_of(x, y), points.weights.empty() ? glm::vec3(1.0f) : points.weights[i]});
  }
  std::sort(sorted.begin(), sorted.end(), [](const Sample& a, const Sample& b) { return a.turn < b.turn; });

  SampleTable table;
  for (const Sample& s : sorted) table.samples.push_back(s.x);
  for (const Sample& s : sorted) table.samples.push_back(s.y);
  for (const Sample& s : sorted) table.samples.push_back(s.turn);
  const std::size_t per_turn = 8 * sorted.size();
  table.per_turn = static_cast<float>(per_turn);
  for (std::size_t i = 0; i <= 4 * per_turn + 1; ++i) {
    const float turn = static_cast<float>(i) / table.per_turn;
    const auto below = std::lower_bound(sorted.begin(), sorted.end(), turn, [](const Sample& s, float t) { return s.turn < t; });
    table.below.push_back(static_cast<std::uint16_t>(below - sorted.begin()));
  }
  sort_into_cells(table, sorted.size());
  sort_into_windows(table, sorted.size());
  if (!points.weights.empty())
    for (int c = 0; c < 3; ++c)
      for (const Sample& s : sorted) table.weights.push_back(s.weight[c]);
  return table;
}

Light light_sample(const Light& light, const LightView& fitted, unsigned index, unsigned count) {
  return model_of(light.type).sample(light, fitted, index, count);
}

Light disc_sample(const Light& light, const LightView& fitted, unsigned index, unsigned count) {
  const double golden_angle = std::numbers::pi * (3.0 - std::sqrt(5.0)), angle = golden_angle * index;
  return light_at_point(light, fitted, std::sqrt((index + 0.5) / count) * glm::dvec2(std::cos(angle), std::sin(angle)));
}

Light light_at_point(const Light& light, const LightView& fitted, const glm::dvec2& at) {
  const double radius = disc_radius(light);
  const glm::dmat4 light_from_world = light_axes(light);
  const glm::dvec3 up = row_of(light_from_world, 1);
  const glm::dvec3 offset = radius * (row_of(light_from_world, 0) * at.x + up * at.y);
  Light point = light;
  // A point s of a directional light's disc is where direction -(s, -1) leads.
  point.direction = row_of(light_from_world, 2) - offset;
  point.angular_radius_deg = 0.0;
  point.position += offset;
  point.target += offset;
  point.up = up;
  point.radius = 0.0;
  point.shape = LightShape::disc;
  point.texture.reset();
  point.cone_deg = 2.0 * glm::degrees(std::atan(fitted.frustum.tan_half_x +
                                                fitted.radius / std::max(fitted.nearest_receiver, 1e-3 * fitted.radius)));
  return point;
}

}  // namespace halfshade
