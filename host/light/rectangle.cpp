// A rectangle of `size` along the light's right and up, which may show a picture.
#include <algorithm>
#include <cmath>

#include "light/light_model.hpp"

namespace halfshade {
namespace {

constexpr LightKey rectangle_keys[] = {
    light_key("size", &Light::size, &is_size_rule, Presence::required, Motion::animated),
};

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

/// Moves points of the unit square to where the texture is bright, so that each stands for as much luminance: by rows, then along
/// them. Returns what each adds to each channel of the colour, 1 on average.
std::vector<glm::vec3> spread_by_luminance(const LightTexture& texture, std::vector<glm::dvec2>& points) {
  std::vector<Steps> columns;
  std::vector<double> totals, row(texture.resolution.x);
  for (unsigned y = 0; y < texture.resolution.y; ++y) {
    for (unsigned x = 0; x < texture.resolution.x; ++x)
      row[x] = luminance(texture.texels[std::size_t{y} * texture.resolution.x + x]);
    columns.emplace_back(row);
    totals.push_back(columns.back().total());
  }
  const Steps rows(totals);
  std::vector<glm::vec3> weights;
  glm::dvec3 sum(0.0);
  for (glm::dvec2& point : points) {
    std::size_t x = 0, y = 0;
    const double down = rows.place(point.y, y), along = columns[y].place(point.x, x);
    const glm::vec3 color = texture.texels[y * texture.resolution.x + x];
    weights.push_back(color / static_cast<float>(luminance(color)));
    sum += glm::dvec3(weights.back());
    point = {along, 1.0 - down};
  }
  const auto n = static_cast<unsigned>(points.size());
  for (glm::vec3& weight : weights)
    for (int c = 0; c < 3; ++c) weight[c] = sum[c] > 0.0 ? static_cast<float>(weight[c] * n / sum[c]) : 0.0f;
  return weights;
}

double rectangle_radius(const Light& light) {
  return glm::length(light.size) / 2.0;
}

LightPoints rectangle_points(const Light& light, unsigned n, std::uint32_t seed) {
  const double radius = rectangle_radius(light);
  const glm::dvec2 half_size = radius > 0.0 ? light.size / (2.0 * radius) : glm::dvec2(0.0);
  LightPoints result{square_samples(n, seed), {}};
  if (light.texture) result.weights = spread_by_luminance(*light.texture, result.points);
  for (glm::dvec2& point : result.points) point = (2.0 * point - 1.0) * half_size;
  return result;
}

}  // namespace

const ShapeModel& rectangle_shape_model() {
  static constexpr ShapeModel model{.keys = rectangle_keys,
                                    .has_texture = true,
                                    .is_round = false,
                                    .other_keys_expected = "no radius of a rectangle",
                                    .other_keys_remedy = "; leave it out, it has a \"size\"",
                                    .radius = rectangle_radius,
                                    .points = rectangle_points};
  return model;
}

}  // namespace halfshade
