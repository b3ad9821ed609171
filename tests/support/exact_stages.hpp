// What stages of method exact read and write, as a test writes it down.
#pragma once

#include <cstring>

#include "support/kernel_fixture.hpp"
#include "support/twins.hpp"

namespace halfshade {

/// The faces that a record of EdgeBlock (kernels/methods/exact/edge_block.h) has at most.
constexpr std::size_t faces_per_record = 2;

/// Potential silhouettes as the kernels store them: blocks of as many as there are lanes, a field an array.
inline Buffer<kernels::EdgeBlock> store_edges(const KernelRunner& runner, const std::vector<twins::Edge>& edges) {
  const std::size_t lanes = runner.device->lanes, blocks = edges.size() / lanes + 1;
  std::vector<float> numbers(blocks * HS_EDGE_NUMBERS * lanes, std::nanf(""));  // what is not an edge must not matter
  for (std::size_t i = 0; i < edges.size(); ++i) {
    const twins::Edge& edge = edges[i];
    EXPECT_LE(edge.faces.size(), faces_per_record);
    int field = 0;
    const auto put = [&](float value) {
      numbers[(i / lanes * HS_EDGE_NUMBERS + static_cast<std::size_t>(field++)) * lanes + i % lanes] = value;
    };
    const auto put_int = [&](int value) {
      float bits;
      std::memcpy(&bits, &value, sizeof bits);
      put(bits);
    };
    const auto put_point = [&](const glm::dvec3& p) {
      for (int c = 0; c < 3; ++c) put(static_cast<float>(p[c]));
    };
    put_point(edge.a);
    put_int(edge.m);
    put_point(edge.b);
    int orientations = 0;
    for (std::size_t f = 0; f < faces_per_record; ++f)
      orientations |= ((f < edge.faces.size() ? edge.faces[f].o : 0) + 1) << (2 * f);
    put_int(orientations);
    for (std::size_t f = 0; f < faces_per_record; ++f) {
      const twins::Plane plane = f < edge.faces.size() ? edge.faces[f].plane : twins::Plane{};
      put_point(plane.n);
      put(static_cast<float>(plane.w));
    }
  }
  return runner.buffer<cl_float>(numbers).as<kernels::EdgeBlock>();
}

/// The first `count` of them.
inline std::vector<twins::Edge> load_edges(const KernelRunner& runner, const Buffer<kernels::EdgeBlock>& stored,
                                           std::size_t count) {
  const std::size_t lanes = runner.device->lanes;
  const auto numbers = runner.read<float>(stored, (count + lanes - 1) / lanes * HS_EDGE_NUMBERS * lanes);
  std::vector<twins::Edge> edges;
  for (std::size_t i = 0; i < count; ++i) {
    int field = 0;
    const auto get = [&] {
      return numbers[(i / lanes * HS_EDGE_NUMBERS + static_cast<std::size_t>(field++)) * lanes + i % lanes];
    };
    const auto get_int = [&] {
      const float bits = get();
      int value;
      std::memcpy(&value, &bits, sizeof value);
      return value;
    };
    const auto get_point = [&] {
      const float x = get(), y = get(), z = get();
      return glm::dvec3(x, y, z);
    };
    twins::Edge edge;
    edge.a = get_point();
    edge.m = get_int();
    edge.b = get_point();
    const int orientations = get_int();
    for (std::size_t f = 0; f < faces_per_record; ++f) {
      const glm::dvec3 n = get_point();
      const double w = get();
      if (const int o = (orientations >> (2 * f) & 3) - 1; o != 0) edge.faces.push_back({o, {n, w}});
    }
    edges.push_back(edge);
  }
  return edges;
}

/// Edges with at most two faces each: the others in records that follow, with m = 0, so that the sums add up.
inline std::vector<twins::Edge> in_records(const std::vector<twins::Edge>& edges) {
  std::vector<twins::Edge> records;
  for (const twins::Edge& edge : edges) {
    twins::Edge record = edge;
    for (std::size_t f = 0; f == 0 || f < edge.faces.size(); f += faces_per_record) {
      record.faces.assign(edge.faces.begin() + static_cast<std::ptrdiff_t>(f),
                          edge.faces.begin() + static_cast<std::ptrdiff_t>(std::min(f + faces_per_record, edge.faces.size())));
      records.push_back(record);
      record.m = 0;
    }
  }
  return records;
}

/// As kernels hold them: in single precision.
inline twins::Edge rounded(twins::Edge edge) {
  const auto round = [](glm::dvec3& v) { v = glm::dvec3(glm::vec3(v)); };
  round(edge.a);
  round(edge.b);
  for (twins::Edge::Face& face : edge.faces) {
    round(face.plane.n);
    face.plane.w = static_cast<float>(face.plane.w);
  }
  return edge;
}

/// Vertices as raster/transform.cl leaves them, and triangles.
inline std::vector<cl_float4> vertices_of(const twins::Triangles& mesh) {
  std::vector<cl_float4> vertices;
  for (const glm::dvec3& p : mesh.positions)
    vertices.push_back(
        {{static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z), static_cast<float>(1 / p.z)}});
  return vertices;
}

inline Mesh mesh_of(const twins::Triangles& triangles) {
  Mesh mesh;
  for (const glm::dvec3& p : triangles.positions) mesh.positions.emplace_back(p);
  mesh.triangles = triangles.corners;
  return mesh;
}

/// The faces' planes, their sides of the disc, and which touch it.
inline kernels::args::DiscFaces orient_to_disc(const KernelRunner& runner, const twins::Triangles& mesh, double radius) {
  const auto count = static_cast<std::uint32_t>(mesh.corners.size());
  const Blocks blocks = blocks_of(runner, count);
  const Buffer<cl_float4> planes = runner.filled(count, cl_float4{{9, 9, 9, 9}});
  const Buffer<cl_uchar> sides = runner.filled(count, cl_uchar{9});
  const Buffer<cl_uint> touching = runner.filled(count + 1, cl_uint{0});
  HsDisc disc{};
  disc.radius = static_cast<cl_float>(radius);
  runner.launcher.launch_blocks(blocks, kernels::OrientFacesToDisc{.blocks = blocks.blocks,
                                                                   .triangles = runner.buffer<cl_uint>(mesh.corners),
                                                                   .vertices_ls = runner.buffer<cl_float4>(vertices_of(mesh)),
                                                                   .disc = disc,
                                                                   .radius = static_cast<cl_float>(radius),
                                                                   .planes = planes,
                                                                   .disc_sides = sides,
                                                                   .touching = touching});
  return {.planes = planes, .disc_sides = sides, .touching = touching};
}

/// Triangles with all numbers as kernels hold them.
inline twins::Triangles rounded(twins::Triangles mesh) {
  for (glm::dvec3& p : mesh.positions) p = glm::dvec3(glm::vec3(p));
  return mesh;
}

}  // namespace halfshade
