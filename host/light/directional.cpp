// A directional light: from everywhere it is seen as the same cone of directions, of `angular_radius_deg` about `direction`. The
// sun is one.
//
// It is drawn as the disc of a light at the origin of a space that is a projective image of the world:
// p' = (x, y, unit) / (horizon - z), where x, y and z are along the light's axes. That takes lines and planes to lines and
// planes, the points at infinity in direction (sx, sy, -1), from which the light comes, to (sx, sy, 0), and keeps what hides
// what: the cone of directions is a disc of radius tan(angular radius) facing +z. In its light map q = (x, y) / unit, and the
// depth key 1/z' is (horizon - z) / unit, so that the penumbra's half-width R (1/Lb' - 1/Lr') is tan(angular radius) (Lr - Lb).
// Everything that casts or receives must lie before z = horizon.
#include <algorithm>
#include <cmath>

#include "light/fit.hpp"
#include "light/light_model.hpp"

namespace halfshade {
namespace {

constexpr LightKey directional_keys[] = {
    light_key("direction", &Light::direction, &is_finite_rule, Presence::required, Motion::animated),
    light_key<std::optional<glm::dvec3>>("up", &Light::up, nullptr, Presence::optional, Motion::fixed),
    light_key("angular_radius_deg", &Light::angular_radius_deg, &is_angular_radius_rule, Presence::optional, Motion::animated),
};
constexpr LightShape directional_shapes[] = {LightShape::disc};
constexpr std::string_view one_face[] = {""};

Frustum directional_frustum(const Light& light, double horizon, double unit) {
  glm::dmat4 project(0.0);  // columns of (x, y, unit) / (horizon - z), both divided by the unit
  project[0][0] = project[1][1] = 1.0 / unit;
  project[3][2] = 1.0;
  project[2][3] = -1.0 / unit;
  project[3][3] = horizon / unit;
  return {project * light_axes(light), everywhere, everywhere};
}

class Directional final : public LightModel {
 public:
  Directional() {
    keys = directional_keys;
    shapes = directional_shapes;
    faces = one_face;
    is_projective = true;
  }

  std::optional<Misfit> misfit(const Light& light) const override {
    const double length = glm::length(light.direction);
    if (!std::isfinite(length) || length <= 0.0) return Misfit{"direction", "a direction, not 0, and not out of reach"};
    return light.up ? misfit_of_axes(light.direction, *light.up, "the light's direction") : std::nullopt;
  }
  std::vector<Light> drawn_as(const Light& light) const override { return {light}; }
  glm::dmat4 axes(const Light& light) const override { return look_along(glm::dvec3(0.0), light.direction, light.up); }
  double radius(const Light& light) const override { return std::tan(glm::radians(light.angular_radius_deg)); }
  glm::dvec4 centre(const Light& light, const glm::dvec3&) const override {
    return glm::dvec4(-row_of(light_axes(light), 2), 0.0);
  }
  glm::dvec3 travel(const Light& light, const glm::dvec3&) const override { return light.direction; }
  double tan_half_cone(const Light&) const override { return 0.0; }
  Light sample(const Light& light, const LightView& fitted, unsigned index, unsigned count) const override {
    return disc_sample(light, fitted, index, count);
  }
};

}  // namespace

void place_parallel_light(const Light& light, double low, double high, LightView& fitted) {
  // As deep again behind all that as it is deep, so that 1/z' changes no more than twofold over it. Its unit is a power of two:
  // the texel grid stays where it is as things move.
  const double depth = std::max(high - low, 1e-6 * std::max({std::abs(high), std::abs(low), 1e-30}));
  fitted.horizon = high + depth;
  fitted.unit = std::exp2(std::ceil(std::log2(2.0 * depth)));
  fitted.frustum = directional_frustum(light, fitted.horizon, fitted.unit);
}

const LightModel& directional_light_model() {
  static const Directional model;
  return model;
}

}  // namespace halfshade
