// Edge classification by multiplicity (docs/design.md, "Silhouettes"): m(e) = sum over the edge's faces of o(e,f) side(f).
#include <map>
#include <random>

#include "support/view_passes.hpp"

namespace halfshade {
namespace {

using Silhouette = KernelTest;

/// The multiplicity of each edge, for sides given face by face (1: towards the light), and the compacted list.
struct Classified {
  std::map<std::pair<unsigned, unsigned>, int> multiplicity;
  std::vector<std::pair<unsigned, unsigned>> silhouettes;
};

Classified classify(const KernelRunner& runner, std::size_t vertex_count, std::vector<glm::uvec3> triangles,
                    const std::vector<cl_uchar>& sides) {
  Mesh mesh;
  mesh.positions.resize(vertex_count);
  mesh.triangles = std::move(triangles);
  const Topology topology = build_topology(mesh);
  const std::size_t count = topology.edges.size();
  const Blocks blocks = blocks_of(runner, static_cast<std::uint32_t>(count));
  const Buffer<cl_char> multiplicities = runner.filled(count, cl_char{9});
  const Buffer<cl_uint> silhouettes = runner.filled(count, ~cl_uint{0});
  const Buffer<HsStatus> status = runner.filled(1, HsStatus{});
  runner.launcher.launch_blocks(blocks,
                                kernels::ClassifyEdges{.blocks = blocks.blocks,
                                                       .edge_face_offsets = runner.buffer<cl_uint>(topology.edge_face_offset),
                                                       .edge_faces = runner.buffer<cl_uint>(topology.edge_faces),
                                                       .sides = runner.buffer<cl_uchar>(sides),
                                                       .multiplicities = multiplicities,
                                                       .silhouettes = silhouettes,
                                                       .status = status});
  Classified out;
  const auto m = runner.read<cl_char>(multiplicities, count);
  for (std::size_t e = 0; e < count; ++e) out.multiplicity[{topology.edges[e].x, topology.edges[e].y}] = m[e];
  for (const cl_uint e : runner.read<cl_uint>(silhouettes, runner.read<HsStatus>(status, 1)[0].silhouette_count))
    out.silhouettes.emplace_back(topology.edges.at(e).x, topology.edges.at(e).y);
  std::sort(out.silhouettes.begin(), out.silhouettes.end());
  return out;
}

const std::vector<glm::uvec3> tetrahedron{{0, 1, 2}, {0, 3, 1}, {1, 3, 2}, {2, 3, 0}};

TEST_F(Silhouette, OneLitFaceOfATetrahedronIsItsOutline) {
  const Classified c = classify(runner_, 4, tetrahedron, {1, 0, 0, 0});
  // Face 0 runs 0 -> 1 -> 2 -> 0: along the stored direction but for the last.
  EXPECT_EQ(c.multiplicity, (std::map<std::pair<unsigned, unsigned>, int>{
                                {{0, 1}, 2}, {{1, 2}, 2}, {{0, 2}, -2}, {{0, 3}, 0}, {{1, 3}, 0}, {{2, 3}, 0}}));
  EXPECT_EQ(c.silhouettes, (std::vector<std::pair<unsigned, unsigned>>{{0, 1}, {0, 2}, {1, 2}}));
}

TEST_F(Silhouette, AllFacesOnOneSideHaveNone) {
  for (const cl_uchar side : {0, 1}) EXPECT_TRUE(classify(runner_, 4, tetrahedron, {side, side, side, side}).silhouettes.empty());
}

TEST_F(Silhouette, BoundaryEdgesAlwaysAreOne) {
  const std::vector<glm::uvec3> square = {{0, 1, 2}, {0, 2, 3}};
  for (const cl_uchar side : {0, 1}) {
    const int s = side ? 1 : -1;
    const Classified c = classify(runner_, 4, square, {side, side});
    EXPECT_EQ(c.multiplicity,
              (std::map<std::pair<unsigned, unsigned>, int>{{{0, 1}, s}, {{1, 2}, s}, {{2, 3}, s}, {{0, 3}, -s}, {{0, 2}, 0}}));
    EXPECT_EQ(c.silhouettes.size(), 4u);
  }
  EXPECT_EQ(classify(runner_, 4, square, {1, 0}).multiplicity.at({0, 2}), -2);
}

TEST_F(Silhouette, ThreeFacesOnAnEdgeSayHowManySheetsBeginThere) {
  const std::vector<glm::uvec3> book = {{0, 1, 2}, {1, 0, 3}, {0, 1, 4}};  // o = +1, -1, +1 along (0,1)
  const auto m = [&](std::vector<cl_uchar> sides) { return classify(runner_, 5, book, sides).multiplicity.at({0, 1}); };
  EXPECT_EQ(m({1, 1, 1}), 1);
  EXPECT_EQ(m({0, 0, 0}), -1);
  EXPECT_EQ(m({1, 0, 1}), 3);
  EXPECT_EQ(m({0, 1, 0}), -3);
  EXPECT_EQ(m({1, 1, 0}), -1);
}

TEST_F(Silhouette, InconsistentWindingCancelsOut) {
  // A flat square whose second triangle is wound the other way: the light sees its other side.
  const Classified c = classify(runner_, 4, {{0, 1, 2}, {0, 3, 2}}, {1, 0});
  EXPECT_EQ(c.multiplicity.at({0, 2}), 0);
  EXPECT_EQ(c.silhouettes.size(), 4u);
}

TEST_F(Silhouette, EdgesBeyondOneBlockAreClassifiedToo) {
  std::vector<glm::uvec3> triangles;
  for (unsigned i = 0; i < 400; ++i) triangles.emplace_back(3 * i, 3 * i + 1, 3 * i + 2);
  const Classified c = classify(runner_, 1200, triangles, std::vector<cl_uchar>(400, 1));
  EXPECT_EQ(c.silhouettes.size(), 1200u);
  EXPECT_TRUE(std::adjacent_find(c.silhouettes.begin(), c.silhouettes.end()) == c.silhouettes.end());
}

// ----------------------------------------------------------------------------------------------------------- closed loops

/// A light looking from `position` to the origin.
glm::dmat4 light_from_mesh(const glm::dvec3& position, const Mesh& mesh) {
  Light light;
  light.position = position;
  light.target = position == glm::dvec3(0) ? glm::dvec3(1, 0, 0) : glm::dvec3(0);
  SceneMesh placed;
  placed.mesh = std::make_shared<Mesh>(mesh);
  return light_frustum(light).view_from_world * world_from_local(placed);
}

/// At every vertex as many silhouette sheets begin as end: the silhouette is a set of closed loops. Returns the number of edges.
std::size_t expect_closed_loops(const KernelRunner& runner, const Mesh& mesh, const glm::dvec3& light) {
  ViewPasses passes(runner, straight_view(*runner.device, {64, 64}, 32.0f), mesh, light_from_mesh(light, mesh));
  passes.classify();
  const auto m = runner.read<cl_char>(passes.multiplicities, passes.topology().edges.size());
  std::vector<int> balance(mesh.positions.size(), 0);
  std::size_t count = 0;
  for (std::size_t e = 0; e < m.size(); ++e) {
    balance[passes.topology().edges[e].x] += m[e];
    balance[passes.topology().edges[e].y] -= m[e];
    count += m[e] != 0;
    EXPECT_EQ(m[e] % 2, 0) << "edge " << e << " of a closed mesh";
  }
  for (std::size_t v = 0; v < balance.size(); ++v) EXPECT_EQ(balance[v], 0) << mesh.name << ", vertex " << v;
  return count;
}

Mesh data_mesh(const std::string& name) {
  return load_obj(std::string(HALFSHADE_DATA_DIR) + "/meshes/" + name + ".obj");
}

TEST_F(Silhouette, ClosedMeshesHaveClosedLoopsForAnyLight) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> coordinate(-3, 3);
  for (const char* name : {"box", "cone", "cylinder", "icosahedron", "sphere", "star", "torus", "wedge"}) {
    const Mesh mesh = data_mesh(name);
    for (int i = 0; i < 8; ++i)
      expect_closed_loops(runner_, mesh, glm::dvec3{coordinate(random), coordinate(random), coordinate(random)});
    EXPECT_GT(expect_closed_loops(runner_, mesh, {3, 7, 5}), 2u) << name;
  }
}

TEST_F(Silhouette, LoopsCloseForLightsInOrNearlyInThePlanesOfFaces) {
  std::mt19937 random(4);
  std::uniform_real_distribution<double> coordinate(-1, 1);
  for (const char* name : {"box", "cylinder", "sphere", "torus"}) {
    const Mesh mesh = data_mesh(name);
    for (int i = 0; i < 12; ++i) {
      const glm::uvec3 corner = mesh.triangles[random() % mesh.triangles.size()];
      const glm::dvec3 a(mesh.positions[corner.x]), b(mesh.positions[corner.y]), c(mesh.positions[corner.z]);
      glm::dvec3 light = a + 5.0 * coordinate(random) * (b - a) + 5.0 * coordinate(random) * (c - a);
      if (i % 3 == 1) light += 1e-7 * glm::dvec3{coordinate(random), coordinate(random), coordinate(random)};
      if (i % 3 == 2) light = a;  // at a vertex: in the plane of all its faces
      expect_closed_loops(runner_, mesh, mesh.origin + light);
    }
  }
}

}  // namespace
}  // namespace halfshade
