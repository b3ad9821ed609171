// A spot light: a flat disc or rectangle at `position` that faces `target`, shining into a square frustum of `cone_deg`.
#include <cmath>

#include "light/fit.hpp"
#include "light/light_model.hpp"

namespace halfshade {
namespace {

constexpr LightKey spot_keys[] = {
    light_key("position", &Light::position, &is_finite_rule, Presence::required, Motion::animated),
    light_key("target", &Light::target, &is_finite_rule, Presence::required, Motion::animated),
    light_key<std::optional<glm::dvec3>>("up", &Light::up, nullptr, Presence::optional, Motion::fixed),
    light_key("cone_deg", &Light::cone_deg, &is_full_angle_rule, Presence::optional, Motion::fixed),
};
constexpr LightShape spot_shapes[] = {LightShape::disc, LightShape::rectangle};
constexpr std::string_view one_face[] = {""};

class Spot final : public LightModel {
 public:
  Spot() {
    keys = spot_keys;
    shapes = spot_shapes;
    has_shape_key = true;
    faces = one_face;
    has_cone = true;
  }

  std::optional<Misfit> misfit(const Light& light) const override {
    return misfit_of_look(light.position, light.target, light.up);
  }
  std::vector<Light> drawn_as(const Light& light) const override { return {light}; }
  glm::dmat4 axes(const Light& light) const override {
    return look_along(light.position, light.target - light.position, light.up);
  }
  double radius(const Light& light) const override { return model_of(light.shape).radius(light); }
  glm::dvec4 centre(const Light& light, const glm::dvec3& origin_ws) const override {
    return glm::dvec4(light.position - origin_ws, 1.0);
  }
  glm::dvec3 travel(const Light& light, const glm::dvec3& point_ws) const override { return point_ws - light.position; }
  double tan_half_cone(const Light& light) const override { return std::tan(glm::radians(light.cone_deg) / 2); }
  Light sample(const Light& light, const LightView& fitted, unsigned index, unsigned count) const override {
    return disc_sample(light, fitted, index, count);
  }
};

}  // namespace

const LightModel& spot_light_model() {
  static const Spot model;
  return model;
}

}  // namespace halfshade
