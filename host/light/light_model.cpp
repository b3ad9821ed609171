#include "light/light_model.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>

#include "scene/limits.hpp"

namespace halfshade {

// A kind that is named in the public header and has no file of its own is named by the linker.
#define HALFSHADE_DECLARE(kind) const LightModel& kind##_light_model();
HALFSHADE_LIGHT_TYPES(HALFSHADE_DECLARE)
#undef HALFSHADE_DECLARE
#define HALFSHADE_DECLARE(shape) const ShapeModel& shape##_shape_model();
HALFSHADE_LIGHT_SHAPES(HALFSHADE_DECLARE)
#undef HALFSHADE_DECLARE

namespace {

constexpr double max_angle_deg = 175.0;
constexpr double max_angular_radius_deg = 45.0;

bool is_not_negative(double value) {
  return std::isfinite(value) && value >= 0.0;
}

constexpr Rule<glm::vec3> is_color_rule{[](const glm::vec3& v) {
                                          return glm::all(glm::greaterThanEqual(v, glm::vec3(0.0f))) &&
                                                 glm::all(glm::lessThanEqual(v, glm::vec3(limits::light_color)));
                                        },
                                        "finite numbers of at least 0 and at most 1e9"};
static_assert(limits::light_color == 1e9 && limits::intensity == 1e9, "as the rules say");
constexpr Rule<double> is_intensity_rule{[](const double& v) { return v >= 0.0 && v <= limits::intensity; },
                                         "a finite number of at least 0 and at most 1e9"};

constexpr LightKey common_keys[] = {
    light_key("color", &Light::color, &is_color_rule, Presence::optional, Motion::fixed),
    light_key("intensity", &Light::intensity, &is_intensity_rule, Presence::optional, Motion::animated),
};

template <class Enum>
[[noreturn]] void fail_unknown(std::string_view what, Enum value) {
  throw InputError(fmt::format("{}: expected one that is declared (found number {})", what, static_cast<int>(value)));
}

}  // namespace

const Rule<glm::dvec3> is_finite_rule{
    [](const glm::dvec3& v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }, "finite numbers"};
const Rule<double> is_not_negative_rule{[](const double& v) { return is_not_negative(v); }, "a finite number of at least 0"};
const Rule<double> is_full_angle_rule{[](const double& v) { return v > 0.0 && v < max_angle_deg; },
                                      "an angle above 0 and below 175 degrees"};
const Rule<double> is_angular_radius_rule{[](const double& v) { return v >= 0.0 && v < max_angular_radius_deg; },
                                          "an angle from 0 to below 45 degrees"};
const Rule<glm::dvec2> is_size_rule{[](const glm::dvec2& v) { return is_not_negative(v.x) && is_not_negative(v.y); },
                                    "two finite numbers of at least 0"};

std::span<const LightKey> common_light_keys() {
  return common_keys;
}

#define HALFSHADE_CASE(name) \
  case LightType::name:      \
    return name##_light_model();
const LightModel& model_of(LightType type) {
  switch (type) { HALFSHADE_LIGHT_TYPES(HALFSHADE_CASE) }
  fail_unknown("light type", type);
}
#undef HALFSHADE_CASE

#define HALFSHADE_CASE(name) \
  case LightType::name:      \
    return #name;
std::string_view name_of(LightType type) {
  switch (type) { HALFSHADE_LIGHT_TYPES(HALFSHADE_CASE) }
  fail_unknown("light type", type);
}
#undef HALFSHADE_CASE

#define HALFSHADE_CASE(name) \
  case LightShape::name:     \
    return name##_shape_model();
const ShapeModel& model_of(LightShape shape) {
  switch (shape) { HALFSHADE_LIGHT_SHAPES(HALFSHADE_CASE) }
  fail_unknown("light shape", shape);
}
#undef HALFSHADE_CASE

#define HALFSHADE_CASE(name) \
  case LightShape::name:     \
    return #name;
std::string_view name_of(LightShape shape) {
  switch (shape) { HALFSHADE_LIGHT_SHAPES(HALFSHADE_CASE) }
  fail_unknown("light shape", shape);
}
#undef HALFSHADE_CASE

std::span<const LightType> light_types() {
#define HALFSHADE_ITEM(name) LightType::name,
  static constexpr LightType all[] = {HALFSHADE_LIGHT_TYPES(HALFSHADE_ITEM)};
#undef HALFSHADE_ITEM
  return all;
}

std::span<const LightShape> light_shapes() {
#define HALFSHADE_ITEM(name) LightShape::name,
  static constexpr LightShape all[] = {HALFSHADE_LIGHT_SHAPES(HALFSHADE_ITEM)};
#undef HALFSHADE_ITEM
  return all;
}

std::vector<LightKey> keys_of(const Light& light) {
  const LightModel& model = model_of(light.type);
  std::vector<LightKey> keys(common_light_keys().begin(), common_light_keys().end());
  keys.insert(keys.end(), model.keys.begin(), model.keys.end());
  if (model.has_shape_key) {
    const ShapeModel& shape = model_of(light.shape);
    keys.insert(keys.end(), shape.keys.begin(), shape.keys.end());
  }
  return keys;
}

std::vector<Light> faces_of(const Light& light) {
  return model_of(light.type).drawn_as(light);
}

glm::dmat4 light_axes(const Light& light) {
  return model_of(light.type).axes(light);
}

Frustum light_frustum(const Light& light) {
  const double tan_half = std::tan(glm::radians(light.cone_deg) / 2);
  return {light_axes(light), tan_half, tan_half};
}

double disc_radius(const Light& light) {
  return model_of(light.type).radius(light);
}

}  // namespace halfshade
