// A light as rays are aimed at it: which point of the world a sample of the pattern is, for each receiver.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <numbers>

#include "light/light_model.hpp"
#include "light/samples.hpp"

namespace halfshade {

/// A light's disc, in single precision for the rival and in double for the truth: a point of it is centre + x right + y up, where
/// x, y is of the unit disc. Of a directional light (w = 0) these are directions, to where it comes from. A sphere light
/// (sphere_radius > 0) shows each receiver a disc of its own.
template <class Real>
struct RayDisc {
  glm::vec<3, Real> centre, right, up;
  Real w, sphere_radius;
};

/// Along the disc's right and up, as one receiver sees it.
template <class Real>
struct DiscAxes {
  glm::vec<3, Real> x, y;
};

/// A light's disc in coordinates (world - origin_ws) / unit.
template <class Real>
RayDisc<Real> disc_of(const Light& light, const glm::dvec3& origin_ws, double unit) {
  using Vector = glm::vec<3, Real>;
  const LightModel& model = model_of(light.type);
  const glm::dvec4 centre = model.centre(light, origin_ws);
  if (centre.w == 0.0) unit = 1.0;  // directions
  const double radius = disc_radius(light) / unit;
  const glm::dvec3 place = glm::dvec3(centre) / unit;
  if (model.is_sphere) return {Vector(place), Vector(0), Vector(0), Real(1), Real(radius)};
  const glm::dmat4 light_from_world = light_axes(light);
  const auto axis = [&](int i) { return glm::dvec3(light_from_world[0][i], light_from_world[1][i], light_from_world[2][i]); };
  return {Vector(place), Vector(axis(0) * radius), Vector(axis(1) * radius), Real(centre.w), Real(0)};
}

/// The axes of the disc that a receiver sees.
template <class Real>
DiscAxes<Real> axes_of(const RayDisc<Real>& disc, const glm::vec<3, Real>& receiver) {
  if (disc.sphere_radius == Real(0)) return {disc.right, disc.up};
  // The axes of the light's face that the receiver lies in, turned as little as brings the face's axis to it.
  const glm::dvec3 from_light(receiver - disc.centre);
  const glm::dmat3 world_from_face = world_from_sphere_face(from_light);
  const glm::dvec3 axis = world_from_face[2], towards = glm::normalize(from_light);
  const auto turned = [&](const glm::dvec3& v) {
    return glm::vec<3, Real>(double{disc.sphere_radius} *
                             (v - glm::dot(v, towards) / (1.0 + glm::dot(axis, towards)) * (axis + towards)));
  };
  return {turned(world_from_face[0]), turned(world_from_face[1])};
}

/// The angle by which a pattern is turned at a pixel, so that its error is noise.
inline double turn_of(std::uint32_t pixel, std::uint32_t seed) {
  return 2.0 * std::numbers::pi * unit_of(hash_of(pixel ^ hash_of(seed)));
}

}  // namespace halfshade
