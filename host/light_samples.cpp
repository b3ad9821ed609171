#include "light_samples.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "light_view.hpp"

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

/// n stratified points of the unit square, in the order that disc_samples tells of.
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

double luminance(const glm::vec3& color) {  // Rec. 709
  return 0.2126 * color.r + 0.7152 * color.g + 0.0722 * color.b;
}

/// A distribution that is constant on equal steps of 0..1.
class Steps {
 public:
  explicit Steps(const std::vector<double>& densities) {
    for (const double density : densities) sums_.push_back(sums_.back() + density);
  }
  double total() const { return sums_.back(); }
  /// Takes equal parts of 0..1 to parts of equal weight. `step` is where it lands, never one of density 0.
  double place(double x, std::size_t& step) const {
    const double at = x * total();
    step = static_cast<std::size_t>(std::upper_bound(sums_.begin() + 1, sums_.end() - 1, at) - sums_.begin()) - 1;
    while (step > 0 && sums_[step + 1] == sums_[step]) --step;
    const double width = sums_[step + 1] - sums_[step];
    return (static_cast<double>(step) + std::clamp((at - sums_[step]) / width, 0.0, 1.0)) / static_cast<double>(sums_.size() - 1);
  }

 private:
  std::vector<double> sums_{0.0};
};

/// As turn_of in kernels/visibility_exact.cl, in the same precision.
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

std::vector<glm::dvec2> disc_samples(unsigned n, std::uint32_t pattern_seed) {
  std::vector<glm::dvec2> samples = square_samples(n, pattern_seed);
  for (glm::dvec2& sample : samples) sample = disc_of_square(sample.x, sample.y);
  return samples;
}

LightPoints light_points(const Light& light, unsigned n, std::uint32_t seed) {
  if (light.shape == LightShape::disc) return {disc_samples(n, seed), {}};
  const double radius = disc_radius(light);
  const glm::dvec2 half_size = radius > 0.0 ? light.size / (2.0 * radius) : glm::dvec2(0.0);
  LightPoints result{square_samples(n, seed), {}};
  if (light.texture) {
    const LightTexture& texture = *light.texture;
    std::vector<Steps> columns;
    std::vector<double> totals, row(texture.resolution.x);
    for (unsigned y = 0; y < texture.resolution.y; ++y) {
      for (unsigned x = 0; x < texture.resolution.x; ++x)
        row[x] = luminance(texture.texels[std::size_t{y} * texture.resolution.x + x]);
      columns.emplace_back(row);
      totals.push_back(columns.back().total());
    }
    const Steps rows(totals);
    glm::dvec3 sum(0.0);
    for (glm::dvec2& point : result.points) {
      std::size_t x = 0, y = 0;
      const double down = rows.place(point.y, y), along = columns[y].place(point.x, x);
      const glm::vec3 color = texture.texels[y * texture.resolution.x + x];
      result.weights.push_back(color / static_cast<float>(luminance(color)));
      sum += glm::dvec3(result.weights.back());
      point = {along, 1.0 - down};
    }
    for (glm::vec3& weight : result.weights)
      for (int c = 0; c < 3; ++c) weight[c] = sum[c] > 0.0 ? static_cast<float>(weight[c] * n / sum[c]) : 0.0f;
  }
  for (glm::dvec2& point : result.points) point = (2.0 * point - 1.0) * half_size;
  return result;
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

}  // namespace halfshade
