// The first stage of exact, kernels/methods/exact/collect_edges.cl: which side of each face receivers are on, the edges that are
// a silhouette for some point of the disc, and cuts with the light's plane. Against twins in double precision.
#include <random>
#include <tuple>

#include "scene/topology.hpp"
#include "support/exact_stages.hpp"

namespace halfshade {
namespace {

using CollectEdges = ShapedKernelTest;
HS_IN_BOTH_SHAPES(CollectEdges);

constexpr double radius = 0.5;

/// A tetrahedron about `at`.
twins::Triangles tetrahedron(const glm::dvec3& at, double size) {
  twins::Triangles mesh;
  for (const glm::dvec3& p :
       {glm::dvec3(1, 0.9, 0.1), glm::dvec3(-1, 0.3, -0.7), glm::dvec3(0.2, -1, 0.4), glm::dvec3(0.1, 0.2, 1)})
    mesh.positions.push_back(at + size * p);
  mesh.corners = {{0, 1, 2}, {0, 3, 1}, {1, 3, 2}, {2, 3, 0}};
  return mesh;
}

/// Five faces about one edge, whose line goes through the disc, wound either way, and an open triangle.
twins::Triangles fan() {
  twins::Triangles mesh;
  mesh.positions = {{0.3, 0.1, 2}, {0.5, 0.1, 5},   {0.5, 0.9, 2.2},   {0.1, -0.8, 2.4},
                    {1.2, 0.4, 3}, {0.0, 0.3, 3.4}, {-0.9, -0.4, 4.1}, {2, 2, 4}};
  mesh.corners = {{0, 1, 2}, {1, 0, 3}, {0, 1, 4}, {1, 0, 5}, {0, 1, 6}, {2, 7, 4}};
  return mesh;
}

std::vector<twins::Triangles> meshes() {
  std::mt19937 random(31);
  std::uniform_real_distribution<double> place(-1, 1);
  std::vector<twins::Triangles> all = {tetrahedron({0.2, -0.1, 3}, 0.5), tetrahedron({3, 1, 2}, 0.3), fan()};
  for (int i = 0; i < 20; ++i)
    all.push_back(
        tetrahedron({3 * place(random), 3 * place(random), 2 + 1.5 * place(random)}, 0.2 + 0.6 * std::abs(place(random))));
  for (twins::Triangles& mesh : all) mesh = rounded(mesh);
  return all;
}

TEST_P(CollectEdges, FacesKnowTheirSideOfTheDiscOrThatTheyCutIt) {
  int decided[3] = {0, 0, 0};
  for (const twins::Triangles& mesh : meshes()) {
    const kernels::args::DiscFaces oriented = orient_to_disc(runner_, mesh, radius);
    const std::size_t count = mesh.corners.size();
    const auto planes = runner_.read<glm::vec4>(Buffer<cl_float4>(oriented.planes.argument()), count);
    const auto sides = runner_.read<cl_uchar>(Buffer<cl_uchar>(oriented.disc_sides.argument()), count);
    for (std::size_t t = 0; t < count; ++t) {
      const twins::Plane plane = mesh.plane(t);
      for (int c = 0; c < 3; ++c) EXPECT_NEAR(planes[t][c], plane.n[c], 1e-5);
      EXPECT_NEAR(planes[t].w, plane.w, 1e-5);
      const int side = twins::receivers_side(plane, radius);
      EXPECT_EQ(int{sides[t]}, side == 0 ? 2 : side == 1 ? 1 : 0) << "face " << t;
      ++decided[side + 1];
    }
  }
  for (const int count : decided) EXPECT_GT(count, 5);
}

struct Collected {
  std::vector<twins::Edge> edges;
  std::vector<cl_uint> touching;  // faces that are left out
  HsStatus status;
};

Collected collect(const KernelRunner& runner, const twins::Triangles& mesh) {
  const Topology topology = build_topology(mesh_of(mesh));
  const kernels::args::DiscFaces oriented = orient_to_disc(runner, mesh, radius);
  const Buffer<cl_float4> vertices = runner.buffer<cl_float4>(vertices_of(mesh));
  const Blocks edges = blocks_of(runner, static_cast<std::uint32_t>(topology.edges.size()));
  const std::size_t max_records = 3 * topology.edges.size();
  const Buffer<kernels::EdgeBlock> records = store_edges(runner, std::vector<twins::Edge>(max_records));
  const Buffer<HsStatus> status = runner.filled(1, HsStatus{});
  HsDisc disc{};
  disc.radius = static_cast<cl_float>(radius);
  runner.launcher.launch_blocks(edges,
                                kernels::CollectEdges{.blocks = edges.blocks,
                                                      .edge_ends = runner.buffer<cl_uint2>(topology.edges),
                                                      .edge_face_offsets = runner.buffer<cl_uint>(topology.edge_face_offset),
                                                      .edge_faces = runner.buffer<cl_uint>(topology.edge_faces),
                                                      .disc = disc,
                                                      .disc_sides = oriented.disc_sides,
                                                      .planes = oriented.planes,
                                                      .vertices_ls = vertices,
                                                      .edges = records,
                                                      .status = status});
  Collected collected;
  collected.status = runner.read<HsStatus>(status, 1)[0];
  collected.edges = load_edges(runner, records, collected.status.feature_count);
  collected.touching = runner.read<cl_uint>(Buffer<cl_uint>(oriented.touching.argument()), mesh.corners.size() + 1);
  collected.touching.resize(collected.touching[0] + 1);
  collected.touching.erase(collected.touching.begin());
  std::ranges::sort(collected.touching);
  return collected;
}

bool same_place(const glm::dvec3& a, const glm::dvec3& b) {
  return glm::distance(a, b) < 1e-5;
}

/// The records of one edge add up to it: faces in any order, decided ones in m.
void expect_records(const std::vector<twins::Edge>& records, const twins::Edge& edge, const char* what) {
  int m = 0;
  std::vector<twins::Edge::Face> faces;
  for (const twins::Edge& record : records) {
    if (!same_place(record.a, edge.a) || !same_place(record.b, edge.b)) continue;
    m += record.m;
    faces.insert(faces.end(), record.faces.begin(), record.faces.end());
  }
  EXPECT_EQ(m, edge.m) << what;
  ASSERT_EQ(faces.size(), edge.faces.size()) << what;
  for (const twins::Edge::Face& face : edge.faces)
    EXPECT_EQ(std::count_if(faces.begin(), faces.end(),
                            [&](const twins::Edge::Face& other) {
                              return other.o == face.o && glm::distance(other.plane.n, face.plane.n) < 1e-5 &&
                                     std::abs(other.plane.w - face.plane.w) < 1e-5;
                            }),
              1)
        << what;
}

TEST_P(CollectEdges, EdgesAreThoseWithAFaceThatIsUndecidedOrASumThatIsNot0) {
  std::size_t edges = 0, dropped = 0;
  for (const twins::Triangles& mesh : meshes()) {
    const Collected collected = collect(runner_, mesh);
    const auto expected = twins::potential_silhouettes(mesh, radius);
    std::size_t records = 0;
    for (const auto& [ends, edge] : expected) {
      expect_records(collected.edges, edge, "edge");
      records += std::max<std::size_t>(1, (edge.faces.size() + 1) / 2);
    }
    EXPECT_EQ(collected.edges.size(), records) << "two undecided faces a record, and none for other edges";
    EXPECT_EQ(collected.status.silhouette_count, expected.size());
    edges += expected.size();
    dropped += build_topology(mesh_of(mesh)).edges.size() - expected.size();
  }
  EXPECT_GT(edges, 60u);
  EXPECT_GT(dropped, 20u);
}

TEST_P(CollectEdges, MoreThanTwoUndecidedFacesHaveRecordsThatAddUp) {
  // The line of the other one's edge passes beside the disc: four of its faces cut it, and one is decided.
  twins::Triangles beside;
  beside.positions = {{0.9, 0.1, 2}, {1.05, 0.1, 5},   {1.9, 0.2, 2.2}, {-0.1, 0, 2.4},
                      {2.2, 0.3, 3}, {0.95, 1.1, 3.4}, {-0.5, 0.2, 4}};
  beside.corners = {{0, 1, 2}, {1, 0, 3}, {0, 1, 4}, {0, 1, 5}, {1, 0, 6}};
  for (const auto& [unrounded, m, undecided] : {std::tuple{fan(), 0, 5u}, {beside, 1, 4u}}) {
    const twins::Triangles mesh = rounded(unrounded);
    const auto expected = twins::potential_silhouettes(mesh, radius);
    ASSERT_EQ(expected.at({0, 1}).faces.size(), undecided);
    ASSERT_EQ(std::abs(expected.at({0, 1}).m), m);
    expect_records(collect(runner_, mesh).edges, expected.at({0, 1}), "the edge of five faces");
  }
}

TEST_P(CollectEdges, WhatLiesBehindTheLightsPlaneIsCutOffAndFacesThatTouchTheDiscAreLeftOut) {
  // One corner behind the plane, within the disc; one beside it; one far beside it; one tetrahedron wholly behind; one that
  // stands on the disc.
  std::size_t touching = 0, edges = 0;
  for (const twins::Triangles& mesh :
       {rounded(tetrahedron({0.1, 0.05, 0.2}, 0.5)), rounded(tetrahedron({0.6, 0.2, 0.1}, 0.8)),
        rounded(tetrahedron({9, 0, 0.1}, 0.8)), rounded(tetrahedron({0, 0, -2}, 0.5)),
        twins::Triangles{{{-0.1, 0, 0}, {0.1, 0, 0}, {0, 0, 1}, {0, 0.3, 1}}, {{0, 1, 2}, {1, 0, 3}}}}) {
    const Collected collected = collect(runner_, mesh);
    std::vector<cl_uint> expected;
    twins::Triangles others = mesh;
    others.corners.clear();
    for (std::size_t t = 0; t < mesh.corners.size(); ++t) {
      if (twins::touches_disc(mesh, t, radius))
        expected.push_back(static_cast<cl_uint>(t));
      else
        others.corners.push_back(mesh.corners[t]);
    }
    EXPECT_EQ(collected.touching, expected);
    for (const auto& [ends, edge] : twins::potential_silhouettes(others, radius)) expect_records(collected.edges, edge, "edge");
    for (const twins::Edge& edge : collected.edges) EXPECT_GE(std::min(edge.a.z, edge.b.z), 0.0);
    touching += expected.size();
    edges += collected.edges.size();
  }
  EXPECT_GT(touching, 4u);
  EXPECT_GT(edges, 4u);
}

TEST_P(CollectEdges, EveryBlockAppendsItsRecords) {
  twins::Triangles mesh;
  for (unsigned i = 0; i < 400; ++i) {
    const double x = 0.01 * i;
    for (const glm::dvec3& p : {glm::dvec3(x, 0, 2), glm::dvec3(x + 0.005, 0, 2), glm::dvec3(x, 0.1, 2)})
      mesh.positions.push_back(p);
    mesh.corners.emplace_back(3 * i, 3 * i + 1, 3 * i + 2);
  }
  mesh = rounded(mesh);
  const Collected collected = collect(runner_, mesh);
  ASSERT_EQ(collected.edges.size(), 1200u);
  for (const auto& [ends, edge] : twins::potential_silhouettes(mesh, radius)) expect_records(collected.edges, edge, "edge");
}

}  // namespace
}  // namespace halfshade
