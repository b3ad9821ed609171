// Whether a segment meets a triangle, by going through all of them in double precision: settles what a tree in single precision
// and a method disagree about.
#pragma once

#include <cmath>
#include <glm/glm.hpp>
#include <vector>

#include "halfshade/halfshade.hpp"
#include "scene/placement.hpp"

namespace halfshade {

class BruteForce {
 public:
  explicit BruteForce(const Scene& scene) {
    for (const SceneMesh& mesh : scene.meshes) {
      if (!mesh.casts_shadow) continue;
      const glm::dmat4 to_world = world_from_local(mesh);
      const auto corner = [&](unsigned i) { return glm::dvec3(to_world * glm::dvec4(mesh.mesh->positions[i], 1.0)); };
      for (const glm::uvec3& t : mesh.mesh->triangles) triangles_.push_back({corner(t.x), corner(t.y), corner(t.z)});
    }
  }

  /// True where the open segment from a to b crosses a triangle, its border included. By the volumes that the segment spans with
  /// the triangle's edges: neighbours decide alike about the edge they share.
  bool occluded(const glm::dvec3& a, const glm::dvec3& b) const {
    const glm::dvec3 along = b - a;
    for (const Triangle& t : triangles_) {
      const glm::dvec3 p = t.p - a, q = t.q - a, r = t.r - a;
      const double u = glm::dot(glm::cross(r, q), along), v = glm::dot(glm::cross(p, r), along),
                   w = glm::dot(glm::cross(q, p), along);
      if ((u < 0 || v < 0 || w < 0) && (u > 0 || v > 0 || w > 0)) continue;
      const double sum = u + v + w;
      if (sum == 0.0) continue;  // edge-on
      const glm::dvec3 normal = glm::cross(t.q - t.p, t.r - t.p);
      const double at = glm::dot(normal, p) / glm::dot(normal, along);
      if (at > 0.0 && at < 1.0) return true;
    }
    return false;
  }

 private:
  struct Triangle {
    glm::dvec3 p, q, r;
  };
  std::vector<Triangle> triangles_;
};

}  // namespace halfshade
