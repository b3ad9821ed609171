#include "topology.hpp"

#include <algorithm>

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

}  // namespace halfshade
