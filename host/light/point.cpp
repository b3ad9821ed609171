// A point light with a size: a sphere of `radius` about `position` that shines in all directions. A receiver sees the disc of
// that radius that faces it. It is drawn as six faces, each a frustum of 90 degrees along an axis of the world.
#include <cmath>
#include <numbers>

#include "light/fit.hpp"
#include "light/light_model.hpp"

namespace halfshade {
namespace {

constexpr LightKey point_keys[] = {
    light_key("position", &Light::position, &is_finite_rule, Presence::required, Motion::animated),
    light_key("radius", &Light::radius, &is_not_negative_rule, Presence::optional, Motion::animated),
};
constexpr LightShape point_shapes[] = {LightShape::disc};
constexpr std::string_view six_faces[] = {"px", "nx", "py", "ny", "pz", "nz"};

/// The radius within which a part of the samples of a unit sphere lies, for a density of 1 / sqrt(1 - r^2).
double sphere_sample_radius(double part) {
  double low = 0.0, high = 1.0;
  for (int i = 0; i < 50; ++i) {
    const double r = (low + high) / 2.0;
    (2.0 / std::numbers::pi * (std::asin(r) - r * std::sqrt(1.0 - r * r)) < part ? low : high) = r;
  }
  return (low + high) / 2.0;
}

class Point final : public LightModel {
 public:
  Point() {
    keys = point_keys;
    shapes = point_shapes;
    faces = six_faces;
    is_sphere = true;
  }

  std::optional<Misfit> misfit(const Light&) const override { return {}; }
  std::vector<Light> drawn_as(const Light& light) const override {
    std::vector<Light> faces_in_order(6, light);
    for (int i = 0; i < 6; ++i) {
      glm::dvec3 axis(0.0);
      axis[i / 2] = i % 2 == 0 ? 1.0 : -1.0;
      Light& face = faces_in_order[i];
      face.target = light.position + axis;
      face.up.reset();
      face.cone_deg = 90.0;
    }
    return faces_in_order;
  }
  glm::dmat4 axes(const Light& face) const override { return look_along(face.position, face.target - face.position, face.up); }
  double radius(const Light& light) const override { return light.radius; }
  glm::dvec4 centre(const Light& light, const glm::dvec3& origin_ws) const override {
    return glm::dvec4(light.position - origin_ws, 1.0);
  }
  glm::dvec3 travel(const Light& light, const glm::dvec3& point_ws) const override { return point_ws - light.position; }
  double tan_half_cone(const Light&) const override { return 0.0; }
  /// Of density 1 / sqrt(R^2 - r^2), whose sum along any line through the sphere is the same: the samples fill its disc evenly
  /// from wherever it is seen.
  Light sample(const Light& light, const LightView&, unsigned index, unsigned count) const override {
    const double golden_angle = std::numbers::pi * (3.0 - std::sqrt(5.0)), angle = golden_angle * index;
    const double height = 1.0 - (2.0 * index + 1.0) / count, width = std::sqrt(1.0 - height * height);
    Light point = light;
    point.position += light.radius * sphere_sample_radius(std::fmod((index + 0.5) * std::numbers::sqrt2, 1.0)) *
                      glm::dvec3(width * std::cos(angle), height, width * std::sin(angle));
    point.radius = 0.0;
    return point;
  }
};

}  // namespace

const LightModel& point_light_model() {
  static const Point model;
  return model;
}

glm::dmat3 world_from_sphere_face(const glm::dvec3& from_light) {
  const glm::dvec3 size = glm::abs(from_light);
  const int major = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
  Light point;
  point.type = LightType::point;
  const Light face = faces_of(point)[2 * major + (from_light[major] < 0.0)];
  return glm::transpose(glm::dmat3(light_axes(face)));
}

}  // namespace halfshade
