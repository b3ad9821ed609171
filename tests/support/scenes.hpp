// Small scenes made in memory.
#pragma once

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>

#include "halfshade/halfshade.hpp"

namespace halfshade {

inline std::shared_ptr<const Mesh> box_mesh() {
  std::vector<glm::dvec3> corners;
  for (int i = 0; i < 8; ++i) corners.emplace_back((i & 1) - 0.5, (i >> 1 & 1) - 0.5, (i >> 2 & 1) - 0.5);
  const std::vector<glm::uvec3> triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                                             {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  return std::make_shared<Mesh>(make_mesh("box", corners, triangles));
}

/// A square in the plane y = 0, from -1/2 to 1/2.
inline std::shared_ptr<const Mesh> ground_mesh() {
  const std::vector<glm::dvec3> corners = {{-0.5, 0, -0.5}, {0.5, 0, -0.5}, {0.5, 0, 0.5}, {-0.5, 0, 0.5}};
  const std::vector<glm::uvec3> triangles = {{0, 2, 1}, {0, 3, 2}};
  return std::make_shared<Mesh>(make_mesh("ground", corners, triangles));
}

/// A disc of radius 1 in the plane y = 0.
inline std::shared_ptr<const Mesh> disc_mesh() {
  constexpr unsigned corners = 720;
  std::vector<glm::dvec3> rim{{0, 0, 0}};
  std::vector<glm::uvec3> fan;
  for (unsigned i = 0; i < corners; ++i) {
    const double angle = 2 * std::numbers::pi * i / corners;
    rim.emplace_back(std::cos(angle), 0, std::sin(angle));
    fan.emplace_back(0, 1 + i, 1 + (i + 1) % corners);
  }
  return std::make_shared<Mesh>(make_mesh("disc", rim, fan));
}

inline SceneMesh placed(std::string name, std::shared_ptr<const Mesh> mesh, const glm::dvec3& translation,
                        const glm::dvec3& scale, const glm::dvec3& rotation_deg = glm::dvec3(0)) {
  SceneMesh out;
  out.name = std::move(name);
  out.mesh = std::move(mesh);
  out.world_from_mesh = matrix_of({.translation = translation, .rotation_deg = rotation_deg, .scale = scale});
  return out;
}

/// The world's place of a mesh's own origin.
inline glm::dvec3 place_of(const SceneMesh& mesh) {
  return glm::dvec3(mesh.world_from_mesh[3]);
}

/// Moves a mesh in the world.
inline void move_by(SceneMesh& mesh, const glm::dvec3& offset) {
  mesh.world_from_mesh[3] += glm::dvec4(offset, 0.0);
}

/// Mirrors a placed mesh in the plane x = 0.
inline void mirror_in_x(SceneMesh& mesh) {
  for (int column = 0; column < 4; ++column) mesh.world_from_mesh[column].x = -mesh.world_from_mesh[column].x;
}

/// A turned box over a floor, a light of radius 0.3 above to the side, a camera that sees all of the shadow.
inline Scene box_over_floor(glm::uvec2 resolution = {96, 80}) {
  Scene scene;
  scene.name = "box-over-floor";
  scene.meshes = {placed("floor", ground_mesh(), {0, 0, 0}, glm::dvec3(10)),
                  placed("box", box_mesh(), {0, 1.2, 0}, glm::dvec3(1), {20, 30, 10})};
  scene.camera = {.position = {0.5, 6, 4.5}, .target = {-0.4, 0.4, 0}, .yfov_deg = 40, .resolution = resolution};
  scene.lights = {{.name = "key", .position = {2, 6, 1}, .target = {0, 0.5, 0}, .up = {}, .radius = 0.3, .cone_deg = 80}};
  scene.ambient = {0.1f, 0.1f, 0.1f};
  return scene;
}

}  // namespace halfshade
