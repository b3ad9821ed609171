#include "cli/mesh_report.hpp"

#include <algorithm>
#include <limits>
#include <numeric>
#include <vector>

namespace halfshade {
namespace {

std::size_t count_components(const Mesh& mesh, const Topology& topology) {
  // Union-find over vertices: each edge that joins two parts leaves one fewer.
  std::vector<std::uint32_t> parent(mesh.positions.size());
  std::iota(parent.begin(), parent.end(), 0u);
  const auto root_of = [&](std::uint32_t v) {
    while (parent[v] != v) v = parent[v] = parent[parent[v]];
    return v;
  };
  std::size_t count = parent.size();
  for (const glm::uvec2& edge : topology.edges) {
    const std::uint32_t a = root_of(edge.x), b = root_of(edge.y);
    if (a == b) continue;
    parent[std::max(a, b)] = std::min(a, b);
    --count;
  }
  return count;
}

/// Whether at every edge as many faces run one way as the other.
bool is_evenly_wound(const Topology& topology) {
  for (std::size_t e = 0; e < topology.edges.size(); ++e) {
    int sum = 0;
    for (std::uint32_t i = topology.edge_face_offset[e]; i < topology.edge_face_offset[e + 1]; ++i) {
      sum += (topology.edge_faces[i] & 1) != 0 ? -1 : 1;
    }
    if (sum != 0) return false;
  }
  return true;
}

}  // namespace

MeshReport inspect_mesh(const Mesh& mesh, const Topology& topology) {
  MeshReport report;
  report.source_vertices = mesh.source_vertex_count;
  report.vertices = mesh.positions.size();
  report.triangles = mesh.triangles.size();
  report.collapsed_triangles = mesh.collapsed_count;
  report.edges = topology.edges.size();
  report.boundary_edges = topology.boundary_edge_count;
  report.nonmanifold_edges = topology.nonmanifold_edge_count;
  report.inconsistent_edges = topology.inconsistent_edge_count;
  report.components = count_components(mesh, topology);

  double six_volumes = 0.0;
  for (const glm::uvec3& t : mesh.triangles) {
    const glm::dvec3 a(mesh.positions[t.x]), b(mesh.positions[t.y]), c(mesh.positions[t.z]);
    six_volumes += glm::dot(a, glm::cross(b, c));
    report.zero_area_triangles += glm::cross(b - a, c - a) == glm::dvec3(0.0);
  }
  report.signed_volume = six_volumes / 6.0;

  if (!report.closed()) {
    report.orientation = Orientation::open;
  } else if (!is_evenly_wound(topology)) {
    report.orientation = Orientation::mixed;
  } else if (report.signed_volume == 0.0) {
    report.orientation = Orientation::flat;
  } else {
    report.orientation = report.signed_volume > 0.0 ? Orientation::outward : Orientation::inward;
  }

  glm::vec3 low(std::numeric_limits<float>::infinity()), high(-std::numeric_limits<float>::infinity());
  for (const glm::vec3& p : mesh.positions) {
    low = glm::min(low, p);
    high = glm::max(high, p);
  }
  report.low = mesh.origin + glm::dvec3(low);
  report.high = mesh.origin + glm::dvec3(high);
  return report;
}

}  // namespace halfshade
