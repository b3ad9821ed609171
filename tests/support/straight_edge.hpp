// A straight edge across the light: what penumbra methods draw of it is known in closed form.
#pragma once

#include "support/closed_forms.hpp"
#include "support/scenes.hpp"

namespace halfshade {

namespace straight_edge {
constexpr double light_y = 6.0, plate_y = 2.0, radius = 0.8;

/// The penumbra's half-width w = R (1/Lb - 1/Lr) on the floor.
inline double half_width(double height = plate_y, double light_radius = radius) {
  return light_radius * (1 / (light_y - height) - 1 / light_y);
}

/// u = delta / w for a floor point, with delta = x / Lr.
inline double u_of(const glm::vec4& position_ws) {
  return position_ws.x / light_y / half_width();
}

/// A plate over x < 0 with its edge below the light, the floor beneath, both parallel to the light's plane; the camera between
/// them. The penumbra is over 100 texels wide.
inline Scene scene() {
  Scene scene;
  scene.name = "straight-edge";
  scene.meshes = {placed("floor", ground_mesh(), {0, 0, 0}, glm::dvec3(40)),
                  placed("plate", ground_mesh(), {-10, plate_y, 0}, glm::dvec3(20)),
                  placed("basement", ground_mesh(), {0, -4, 0}, glm::dvec3(60))};
  scene.camera = {.position = {0, 1.5, 0}, .target = {0, 0, 0}, .up = {0, 0, 1}, .yfov_deg = 20, .resolution = {256, 64}};
  scene.lights = {{.name = "key", .position = {0, light_y, 0}, .target = {0, 0, 0}, .up = {}, .radius = radius, .cone_deg = 60}};
  return scene;
}

/// The part of a disc above a line at u radii below its centre.
inline double disc_above(double u) {
  return disc_beyond(-u);
}
}  // namespace straight_edge

}  // namespace halfshade
