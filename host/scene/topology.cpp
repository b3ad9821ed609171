#include "scene/topology.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace halfshade {

Topology build_topology(const Mesh& mesh) {
  const std::size_t vertex_count = mesh.positions.size();
  Topology topology;

  // Every side of every face, (y << 32) | (face << 1) | against, in buckets by x, the lower of its two vertices. One counting
  // pass and many tiny sorts: the sides of a bucket are as many as the faces at a vertex.
  const auto for_each_side = [&](auto&& visit) {
    for (std::size_t face = 0; face < mesh.triangles.size(); ++face) {
      for (int corner = 0; corner < 3; ++corner) {
        const std::uint32_t from = mesh.triangles[face][corner], to = mesh.triangles[face][(corner + 1) % 3];
        const bool against = from > to;
        visit(std::min(from, to), std::uint64_t{std::max(from, to)} << 32 | face << 1 | (against ? 1 : 0));
      }
    }
  };
  std::vector<std::uint32_t> bucket_offset(vertex_count + 1, 0);
  for_each_side([&](std::uint32_t x, std::uint64_t) { ++bucket_offset[x + 1]; });
  for (std::size_t v = 0; v < vertex_count; ++v) bucket_offset[v + 1] += bucket_offset[v];
  std::vector<std::uint64_t> sides(3 * mesh.triangles.size());
  std::vector<std::uint32_t> next(bucket_offset.begin(), bucket_offset.end() - 1);
  for_each_side([&](std::uint32_t x, std::uint64_t side) { sides[next[x]++] = side; });

  topology.edge_faces.resize(sides.size());
  topology.edges.reserve(sides.size() / 2);
  topology.edge_face_offset.reserve(sides.size() / 2 + 1);
  for (std::uint32_t x = 0; x < vertex_count; ++x) {
    const std::uint32_t bucket_end = bucket_offset[x + 1];
    std::sort(sides.begin() + bucket_offset[x], sides.begin() + bucket_end);
    for (std::uint32_t begin = bucket_offset[x], end; begin < bucket_end; begin = end) {
      const auto y = static_cast<std::uint32_t>(sides[begin] >> 32);
      for (end = begin; end < bucket_end && sides[end] >> 32 == y; ++end) {
        topology.edge_faces[end] = static_cast<std::uint32_t>(sides[end]);
      }
      topology.edges.emplace_back(x, y);
      topology.edge_face_offset.push_back(begin);
      const std::uint32_t face_count = end - begin;
      topology.boundary_edge_count += face_count == 1;
      topology.nonmanifold_edge_count += face_count > 2;
      topology.inconsistent_edge_count += face_count == 2 && ((sides[begin] ^ sides[begin + 1]) & 1) == 0;
    }
  }
  topology.edge_face_offset.push_back(static_cast<std::uint32_t>(sides.size()));

  topology.vertex_edge_offset.assign(vertex_count + 1, 0);
  for (const glm::uvec2& edge : topology.edges) {
    ++topology.vertex_edge_offset[edge.x + 1];
    ++topology.vertex_edge_offset[edge.y + 1];
  }
  for (std::size_t v = 0; v < vertex_count; ++v) topology.vertex_edge_offset[v + 1] += topology.vertex_edge_offset[v];
  topology.vertex_edges.resize(2 * topology.edges.size());
  next.assign(topology.vertex_edge_offset.begin(), topology.vertex_edge_offset.end() - 1);
  for (std::uint32_t e = 0; e < topology.edges.size(); ++e) {
    topology.vertex_edges[next[topology.edges[e].x]++] = e;
    topology.vertex_edges[next[topology.edges[e].y]++] = e;
  }
  return topology;
}

namespace {

/// Spreads the lowest 21 bits of x to every third bit.
std::uint64_t spread_bits(std::uint64_t x) {
  x = (x | x << 32) & 0x1f00000000ffffull;
  x = (x | x << 16) & 0x1f0000ff0000ffull;
  x = (x | x << 8) & 0x100f00f00f00f00full;
  x = (x | x << 4) & 0x10c30c30c30c30c3ull;
  return (x | x << 2) & 0x1249249249249249ull;
}

}  // namespace

Mesh in_spatial_order(const Mesh& mesh) {
  glm::vec3 low(INFINITY), high(-INFINITY);
  for (const glm::vec3& p : mesh.positions) {
    low = glm::min(low, p);
    high = glm::max(high, p);
  }
  const glm::dvec3 extent = glm::max(glm::dvec3(high) - glm::dvec3(low), glm::dvec3(1e-300));
  std::vector<std::pair<std::uint64_t, std::uint32_t>> order(mesh.triangles.size());
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    const glm::uvec3& corner = mesh.triangles[t];
    const glm::dvec3 centre =
        (glm::dvec3(mesh.positions[corner.x]) + glm::dvec3(mesh.positions[corner.y]) + glm::dvec3(mesh.positions[corner.z])) /
        3.0;
    const glm::dvec3 cell = (centre - glm::dvec3(low)) / extent * 2097151.0;  // Morton code, 21 bits an axis
    order[t] = {spread_bits(static_cast<std::uint64_t>(cell.x)) | spread_bits(static_cast<std::uint64_t>(cell.y)) << 1 |
                    spread_bits(static_cast<std::uint64_t>(cell.z)) << 2,
                t};
  }
  std::sort(order.begin(), order.end());

  Mesh sorted = mesh;
  std::vector<std::uint32_t> new_index(mesh.positions.size(), UINT32_MAX);
  std::uint32_t next = 0;
  for (std::size_t t = 0; t < order.size(); ++t)
    for (int corner = 0; corner < 3; ++corner) {
      const std::uint32_t old = mesh.triangles[order[t].second][corner];
      if (new_index[old] == UINT32_MAX) {
        new_index[old] = next;
        sorted.positions[next++] = mesh.positions[old];
      }
      sorted.triangles[t][corner] = new_index[old];
    }
  sorted.positions.resize(next);
  return sorted;
}

int solid_orientation(const Mesh& mesh, const Topology& topology) {
  if (topology.boundary_edge_count + topology.nonmanifold_edge_count + topology.inconsistent_edge_count > 0) return 0;
  // Connected parts, by union and find over the vertices.
  std::vector<std::uint32_t> parent(mesh.positions.size());
  for (std::uint32_t v = 0; v < parent.size(); ++v) parent[v] = v;
  const auto root = [&](std::uint32_t v) {
    while (parent[v] != v) v = parent[v] = parent[parent[v]];
    return v;
  };
  for (const glm::uvec2& edge : topology.edges) parent[root(edge.x)] = root(edge.y);
  std::vector<double> volume(mesh.positions.size(), 0.0);
  for (const glm::uvec3& t : mesh.triangles)
    volume[root(t.x)] +=
        glm::dot(glm::dvec3(mesh.positions[t.x]), glm::cross(glm::dvec3(mesh.positions[t.y]), glm::dvec3(mesh.positions[t.z])));
  bool outward = true, inward = true;
  for (const glm::uvec3& t : mesh.triangles) {
    const double part = volume[root(t.x)];
    outward = outward && part > 0.0;
    inward = inward && part < 0.0;
  }
  return outward ? 1 : inward ? -1 : 0;
}

}  // namespace halfshade
