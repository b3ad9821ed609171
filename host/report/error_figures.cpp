#include "report/error_figures.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "light/light_model.hpp"

namespace halfshade {

std::vector<PixelKind> pixel_kinds(std::span<const glm::dvec3> position_ws, std::span<const glm::vec4> normal_ws,
                                   const Light& light) {
  if (position_ws.size() != normal_ws.size())
    throw InputError(fmt::format("pixel_kinds: {} positions, {} normals; they must agree", position_ws.size(), normal_ws.size()));
  std::vector<PixelKind> kinds(position_ws.size(), PixelKind::ignored);
  const LightModel& model = model_of(light.type);
  if (!model.has_cone) {
    for (std::size_t i = 0; i < kinds.size(); ++i) {
      if (!(normal_ws[i].w > 0.0f)) continue;
      kinds[i] =
          glm::dot(glm::dvec3(normal_ws[i]), model.travel(light, position_ws[i])) < 0.0 ? PixelKind::counted : PixelKind::away;
    }
    return kinds;
  }
  // The light's axes by their definition, not by the code under test.
  const glm::dvec3 axis = glm::normalize(light.target - light.position);
  const bool along_y = std::abs(axis.y) > std::cos(glm::radians(8.0));
  const glm::dvec3 up = light.up ? *light.up : along_y ? glm::dvec3(0, 0, 1) : glm::dvec3(0, 1, 0);
  const glm::dvec3 right = glm::normalize(glm::cross(axis, up)), above = glm::cross(right, axis);
  const double tan_half_cone = std::tan(glm::radians(light.cone_deg) / 2.0);

  for (std::size_t i = 0; i < kinds.size(); ++i) {
    if (!(normal_ws[i].w > 0.0f)) continue;
    const glm::dvec3 from_light = position_ws[i] - light.position;
    const double z = glm::dot(axis, from_light);
    const double reach = z * tan_half_cone;
    if (!(z > 0.0 && std::abs(glm::dot(right, from_light)) <= reach && std::abs(glm::dot(above, from_light)) <= reach)) continue;
    kinds[i] = glm::dot(glm::dvec3(normal_ws[i]), from_light) < 0.0 ? PixelKind::counted : PixelKind::away;
  }
  return kinds;
}

ErrorFigures compare_visibility(std::span<const float> visibility, std::span<const float> truth,
                                std::span<const PixelKind> kinds) {
  if (visibility.size() != truth.size() || truth.size() != kinds.size())
    throw InputError(fmt::format("compare_visibility: planes of {}, {} and {} pixels; they must agree", visibility.size(),
                                 truth.size(), kinds.size()));
  ErrorFigures figures;
  std::vector<double> absolute;
  double squares = 0.0, penumbra_squares = 0.0, penumbra_sum = 0.0;
  std::size_t penumbra_signed = 0, bad = 0;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    const bool finite = std::isfinite(visibility[i]);
    if (!finite) ++figures.nonfinite;
    if (kinds[i] != PixelKind::counted) continue;
    if (!std::isfinite(truth[i])) throw InputError(fmt::format("the truth at pixel {} is {}; expected 0 to 1", i, truth[i]));
    const double reference = truth[i], error = finite ? visibility[i] - reference : 1.0, size = std::abs(error);
    absolute.push_back(size);
    squares += error * error;
    if (size > 0.1) ++bad;
    if (reference > 0.002 && reference < 0.998) {
      ++figures.penumbra_pixels;
      penumbra_squares += error * error;
      if (finite) {
        penumbra_sum += error;
        ++penumbra_signed;
      }
    }
    if (reference == 0.0 && visibility[i] > 0.5f) ++figures.false_lit;
    if (reference == 1.0 && visibility[i] < 0.5f) ++figures.false_umbra;
  }
  figures.counted_pixels = absolute.size();
  if (absolute.empty()) return figures;
  const auto count = static_cast<double>(absolute.size());
  figures.rmse = std::sqrt(squares / count);
  figures.bad_fraction = static_cast<double>(bad) / count;
  if (figures.penumbra_pixels > 0)
    figures.penumbra_rmse = std::sqrt(penumbra_squares / static_cast<double>(figures.penumbra_pixels));
  if (penumbra_signed > 0) figures.bias = penumbra_sum / static_cast<double>(penumbra_signed);
  figures.max_error = *std::max_element(absolute.begin(), absolute.end());
  // ceil(0.999 n) in whole numbers: 999/1000 has no exact double.
  const std::size_t rank = (absolute.size() * 999 + 999) / 1000;
  const auto at_rank = absolute.begin() + static_cast<std::ptrdiff_t>(rank - 1);
  std::nth_element(absolute.begin(), at_rank, absolute.end());
  figures.p999_error = *at_rank;
  return figures;
}

std::vector<NamedFigure> named_figures(const ErrorFigures& f) {
  const auto count = [](std::size_t n) { return static_cast<double>(n); };
  return {{"rmse", f.rmse, false},
          {"penumbra_rmse", f.penumbra_rmse, false},
          {"bias", f.bias, false},
          {"max_error", f.max_error, false},
          {"p999_error", f.p999_error, false},
          {"bad_fraction", f.bad_fraction, false},
          {"false_lit", count(f.false_lit), true},
          {"false_umbra", count(f.false_umbra), true},
          {"nonfinite", count(f.nonfinite), true},
          {"counted_pixels", count(f.counted_pixels), true},
          {"penumbra_pixels", count(f.penumbra_pixels), true}};
}

}  // namespace halfshade
