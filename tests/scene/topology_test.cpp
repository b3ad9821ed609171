#include "scene/topology.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <map>
#include <random>
#include <set>

#include "halfshade/halfshade.hpp"

namespace {

using halfshade::build_topology;
using halfshade::Mesh;
using halfshade::Topology;

/// A mesh whose vertices are at different places, in the given order.
Mesh mesh_of(std::size_t vertex_count, std::vector<glm::uvec3> triangles) {
  Mesh mesh;
  for (std::size_t i = 0; i < vertex_count; ++i) mesh.positions.emplace_back(i, i * i, i % 7);
  mesh.triangles = std::move(triangles);
  return mesh;
}

/// A grid of size x size squares that closes on itself both ways.
Mesh torus_of(std::uint32_t size) {
  std::vector<glm::uvec3> triangles;
  const auto at = [size](std::uint32_t x, std::uint32_t y) { return x % size + y % size * size; };
  for (std::uint32_t y = 0; y < size; ++y) {
    for (std::uint32_t x = 0; x < size; ++x) {
      triangles.emplace_back(at(x, y), at(x + 1, y), at(x + 1, y + 1));
      triangles.emplace_back(at(x, y), at(x + 1, y + 1), at(x, y + 1));
    }
  }
  return mesh_of(size * size, std::move(triangles));
}

const std::vector<glm::uvec3> tetrahedron{{0, 1, 2}, {0, 3, 1}, {1, 3, 2}, {2, 3, 0}};

std::vector<std::uint32_t> faces_of(const Topology& topology, glm::uvec2 edge) {
  const auto found = std::find(topology.edges.begin(), topology.edges.end(), edge);
  EXPECT_NE(found, topology.edges.end());
  const auto e = found - topology.edges.begin();
  return {topology.edge_faces.begin() + topology.edge_face_offset[e],
          topology.edge_faces.begin() + topology.edge_face_offset[e + 1]};
}

/// Checks everything the header promises against the mesh, the slow and plain way.
void expect_describes(const Topology& topology, const Mesh& mesh) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::vector<std::uint32_t>> expected;
  for (std::uint32_t f = 0; f < mesh.triangles.size(); ++f) {
    for (int i = 0; i < 3; ++i) {
      const auto from = mesh.triangles[f][i], to = mesh.triangles[f][(i + 1) % 3];
      expected[std::minmax(from, to)].push_back(f << 1 | (from > to));
    }
  }
  std::size_t boundary = 0, nonmanifold = 0, inconsistent = 0;
  ASSERT_EQ(topology.edges.size(), expected.size());
  ASSERT_EQ(topology.edge_face_offset.size(), expected.size() + 1);
  std::size_t e = 0;
  for (const auto& [edge, faces] : expected) {
    EXPECT_EQ(topology.edges[e], glm::uvec2(edge.first, edge.second));
    const auto begin = topology.edge_face_offset[e], end = topology.edge_face_offset[e + 1];
    EXPECT_EQ(std::vector(topology.edge_faces.begin() + begin, topology.edge_faces.begin() + end), faces);
    boundary += faces.size() == 1;
    nonmanifold += faces.size() > 2;
    inconsistent += faces.size() == 2 && (faces[0] & 1) == (faces[1] & 1);
    ++e;
  }
  EXPECT_EQ(topology.edge_face_offset.back(), topology.edge_faces.size());
  EXPECT_EQ(topology.boundary_edge_count, boundary);
  EXPECT_EQ(topology.nonmanifold_edge_count, nonmanifold);
  EXPECT_EQ(topology.inconsistent_edge_count, inconsistent);

  ASSERT_EQ(topology.vertex_edge_offset.size(), mesh.positions.size() + 1);
  EXPECT_EQ(topology.vertex_edge_offset.back(), topology.vertex_edges.size());
  for (std::uint32_t v = 0; v < mesh.positions.size(); ++v) {
    std::vector<std::uint32_t> edges;
    for (std::uint32_t i = 0; i < topology.edges.size(); ++i) {
      if (topology.edges[i].x == v || topology.edges[i].y == v) edges.push_back(i);
    }
    const auto begin = topology.vertex_edge_offset[v], end = topology.vertex_edge_offset[v + 1];
    EXPECT_EQ(std::vector(topology.vertex_edges.begin() + begin, topology.vertex_edges.begin() + end), edges);
  }
}

TEST(Topology, TetrahedronHasSixEdgesWithTwoOpposedFacesEach) {
  const Mesh mesh = mesh_of(4, tetrahedron);
  const Topology topology = build_topology(mesh);
  EXPECT_EQ(topology.edges.size(), 6u);
  EXPECT_EQ(topology.boundary_edge_count + topology.nonmanifold_edge_count + topology.inconsistent_edge_count, 0u);
  EXPECT_EQ(faces_of(topology, {0, 1}), (std::vector<std::uint32_t>{0 << 1 | 0, 1 << 1 | 1}));
  EXPECT_EQ(faces_of(topology, {2, 3}), (std::vector<std::uint32_t>{2 << 1 | 1, 3 << 1 | 0}));
  expect_describes(topology, mesh);
}

TEST(Topology, OpenMeshHasBoundaryEdges) {
  const Mesh mesh = mesh_of(4, {{0, 1, 2}, {0, 2, 3}});
  const Topology topology = build_topology(mesh);
  EXPECT_EQ(topology.edges.size(), 5u);
  EXPECT_EQ(topology.boundary_edge_count, 4u);
  expect_describes(topology, mesh);
}

TEST(Topology, FacesThatRunTheSameWayAlongAnEdgeAreInconsistent) {
  const Mesh mesh = mesh_of(4, {{0, 1, 2}, {0, 3, 2}});
  const Topology topology = build_topology(mesh);
  EXPECT_EQ(topology.inconsistent_edge_count, 1u);
  EXPECT_EQ(faces_of(topology, {0, 2}), (std::vector<std::uint32_t>{0 << 1 | 1, 1 << 1 | 1}));
  expect_describes(topology, mesh);
}

TEST(Topology, ManyFacesMayShareAnEdge) {
  const Mesh mesh = mesh_of(6, {{0, 1, 2}, {1, 0, 3}, {0, 1, 4}, {5, 1, 0}});
  const Topology topology = build_topology(mesh);
  EXPECT_EQ(topology.nonmanifold_edge_count, 1u);
  EXPECT_EQ(topology.inconsistent_edge_count, 0u);
  EXPECT_EQ(faces_of(topology, {0, 1}), (std::vector<std::uint32_t>{0, 1 << 1 | 1, 2 << 1, 3 << 1 | 1}));
  expect_describes(topology, mesh);
}

TEST(Topology, DuplicateFacesAreKept) {
  const Mesh mesh = mesh_of(3, {{0, 1, 2}, {0, 1, 2}, {2, 1, 0}});
  const Topology topology = build_topology(mesh);
  EXPECT_EQ(topology.edges.size(), 3u);
  EXPECT_EQ(topology.nonmanifold_edge_count, 3u);
  expect_describes(topology, mesh);
}

TEST(Topology, ClosedSurfaceObeysEuler) {
  const Mesh mesh = torus_of(24);
  const Topology topology = build_topology(mesh);
  EXPECT_EQ(mesh.positions.size() + mesh.triangles.size(), topology.edges.size());
  EXPECT_EQ(topology.boundary_edge_count + topology.nonmanifold_edge_count + topology.inconsistent_edge_count, 0u);
  expect_describes(topology, mesh);
}

TEST(Topology, DescribesRandomTriangleSoup) {
  std::mt19937 random(7);
  for (int round = 0; round < 20; ++round) {
    const std::uint32_t vertex_count = 3 + random() % 30;
    std::vector<glm::uvec3> triangles;
    while (triangles.size() < 60) {
      const glm::uvec3 t{random() % vertex_count, random() % vertex_count, random() % vertex_count};
      if (t.x != t.y && t.y != t.z && t.z != t.x) triangles.push_back(t);
    }
    const Mesh mesh = mesh_of(vertex_count, std::move(triangles));
    expect_describes(build_topology(mesh), mesh);
  }
}

TEST(Topology, EdgesDoNotDependOnTheOrderOfTriangles) {
  Mesh mesh = torus_of(9);
  const Topology before = build_topology(mesh);
  std::shuffle(mesh.triangles.begin(), mesh.triangles.end(), std::mt19937(3));
  const Topology after = build_topology(mesh);
  EXPECT_EQ(after.edges, before.edges);
  EXPECT_EQ(after.vertex_edges, before.vertex_edges);
}

/// A box about `centre`, counter-clockwise seen from outside, or turned inside out.
void add_box(Mesh& mesh, glm::vec3 centre, float size, bool inwards = false) {
  const auto first = static_cast<std::uint32_t>(mesh.positions.size());
  for (int i = 0; i < 8; ++i) mesh.positions.push_back(centre + size * glm::vec3(i & 1, i >> 1 & 1, i >> 2 & 1));
  for (glm::uvec3 t : {glm::uvec3(0, 2, 1), glm::uvec3(1, 2, 3), glm::uvec3(4, 5, 6), glm::uvec3(5, 7, 6), glm::uvec3(0, 1, 4),
                       glm::uvec3(1, 5, 4), glm::uvec3(2, 6, 3), glm::uvec3(3, 6, 7), glm::uvec3(0, 4, 2), glm::uvec3(2, 4, 6),
                       glm::uvec3(1, 3, 5), glm::uvec3(3, 7, 5)}) {
    if (inwards) std::swap(t.y, t.z);
    mesh.triangles.push_back(t + first);
  }
}

int orientation(const Mesh& mesh) {
  return halfshade::solid_orientation(mesh, build_topology(mesh));
}

TEST(Topology, SolidsAreTurnedOutwardsOrInwards) {
  Mesh mesh;
  add_box(mesh, {5, -3, 2}, 1);
  EXPECT_EQ(orientation(mesh), 1);
  add_box(mesh, {-9, 0, 0}, 0.25f);
  EXPECT_EQ(orientation(mesh), 1) << "two apart";
  Mesh reversed;
  add_box(reversed, {5, -3, 2}, 1, true);
  EXPECT_EQ(orientation(reversed), -1);
}

TEST(Topology, WhatIsNoSolidHasNoOrientation) {
  Mesh mesh;
  add_box(mesh, {0, 0, 0}, 1);
  Mesh open = mesh;
  open.triangles.pop_back();
  EXPECT_EQ(orientation(open), 0);
  Mesh mixed = mesh;
  std::swap(mixed.triangles[3].x, mixed.triangles[3].y);
  EXPECT_EQ(orientation(mixed), 0);
  Mesh disagreeing = mesh;
  add_box(disagreeing, {3, 0, 0}, 1, true);
  EXPECT_EQ(orientation(disagreeing), 0);
  Mesh doubled = mesh;  // every face twice
  doubled.triangles.insert(doubled.triangles.end(), mesh.triangles.begin(), mesh.triangles.end());
  EXPECT_EQ(orientation(doubled), 0);
}

TEST(Topology, SpatialOrderKeepsEveryTriangleAndItsWinding) {
  std::mt19937 random(20);
  Mesh mesh;
  for (int i = 0; i < 40; ++i) add_box(mesh, {random() % 100, random() % 100, random() % 100}, 1);
  std::shuffle(mesh.triangles.begin(), mesh.triangles.end(), random);
  const Mesh ordered = halfshade::in_spatial_order(mesh);
  const auto corners = [](const Mesh& m) {
    std::multiset<std::vector<float>> all;
    for (const glm::uvec3& t : m.triangles) {
      std::array<std::vector<float>, 3> p;
      for (int k = 0; k < 3; ++k) p[k] = {m.positions[t[k]].x, m.positions[t[k]].y, m.positions[t[k]].z};
      std::rotate(p.begin(), std::min_element(p.begin(), p.end()), p.end());  // wherever the list begins
      std::vector<float> flat;
      for (const auto& q : p) flat.insert(flat.end(), q.begin(), q.end());
      all.insert(flat);
    }
    return all;
  };
  EXPECT_EQ(ordered.positions.size(), mesh.positions.size());
  EXPECT_EQ(corners(ordered), corners(mesh));
}

}  // namespace
