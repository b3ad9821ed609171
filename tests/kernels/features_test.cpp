// Silhouette edges to quads and sectors in the light map.
#include <algorithm>
#include <random>

#include "support/view_passes.hpp"

namespace halfshade {
namespace {

using Features = KernelTest;

struct Built {
  std::vector<HsFeature> edges, corners;
  std::vector<cl_ushort4> edge_rects, corner_rects;
};

Built build(const KernelRunner& runner, const HsView& view, const Mesh& mesh, const HsFinShape& shape) {
  ViewPasses passes(runner, view, mesh);
  passes.classify();
  const auto list = passes.build_features(shape);
  Built built;
  for (std::size_t i = 0; i < list.features.size(); ++i) {
    const bool edge = list.features[i].kind_and_layer == HS_FEATURE_EDGE;
    (edge ? built.edges : built.corners).push_back(list.features[i]);
    (edge ? built.edge_rects : built.corner_rects).push_back(list.rects[i]);
  }
  return built;
}

/// Flat polygon about the first point, at depth 2; texels of a 64 x 64 map with 32 texels a unit of q.
Mesh polygon(const std::vector<glm::vec2>& px) {
  Mesh mesh;
  for (const glm::vec2& p : px) mesh.positions.emplace_back((p.x - 32) / 16, -(p.y - 32) / 16, 2);
  for (std::uint32_t i = 2; i < px.size(); ++i) mesh.triangles.emplace_back(0, i - 1, i);
  return mesh;
}

glm::vec2 outward_of(const HsFeature& edge) {
  const glm::vec2 t = glm::normalize(glm::vec2(edge.bx - edge.ax, edge.by - edge.ay));
  return {t.y, -t.x};
}

bool in_sector(const HsFeature& corner, glm::vec2 direction) {
  return glm::dot(direction, glm::vec2(corner.bx, corner.by)) >= 0 && glm::dot(direction, glm::vec2(corner.bd, corner.c)) >= 0;
}

const HsFeature* corner_at(const Built& built, glm::vec2 p) {
  for (const HsFeature& corner : built.corners)
    if (glm::distance(glm::vec2(corner.ax, corner.ay), p) < 1e-4f) return &corner;
  return nullptr;
}

TEST_F(Features, ATriangleHasThreeEdgesAndThreeConvexCornersWhicheverWayItIsWound) {
  const HsView view = straight_view(*runner_.device, {64, 64}, 32.0f);
  const std::vector<glm::vec2> px = {{16, 16}, {48, 16}, {16, 40}};
  for (const bool reversed : {false, true}) {
    Mesh mesh = polygon(px);
    if (reversed) std::swap(mesh.triangles[0].y, mesh.triangles[0].z);
    const Built built = build(runner_, view, mesh, fin_shape(10));
    ASSERT_EQ(built.edges.size(), 3u);
    ASSERT_EQ(built.corners.size(), 3u);
    const glm::vec2 middle(26, 24);
    for (const HsFeature& edge : built.edges) {
      EXPECT_LT(glm::dot(outward_of(edge), middle - glm::vec2(edge.ax, edge.ay)), 0) << "outward is away from the surface";
      EXPECT_EQ(edge.ad, 0.5f);
      EXPECT_EQ(edge.bd, 0.5f);
    }
    // At the right angle (16, 16): outward normals are up and left.
    const HsFeature* corner = corner_at(built, {16, 16});
    ASSERT_NE(corner, nullptr);
    EXPECT_TRUE(in_sector(*corner, {-1, -1}));
    EXPECT_TRUE(in_sector(*corner, {-1, -0.01f}));
    EXPECT_FALSE(in_sector(*corner, {-1, 0.01f}));
    EXPECT_FALSE(in_sector(*corner, {0.01f, -1}));
    EXPECT_FALSE(in_sector(*corner, {1, 1}));
  }
}

TEST_F(Features, AConcaveCornerHasNoSector) {
  const HsView view = straight_view(*runner_.device, {64, 64}, 32.0f);
  // An arrow head: a fan about its notch (32, 32).
  const Built built = build(runner_, view, polygon({{32, 32}, {16, 48}, {32, 8}, {48, 48}}), fin_shape(10));
  EXPECT_EQ(built.edges.size(), 4u);
  EXPECT_EQ(built.corners.size(), 3u);
  EXPECT_EQ(corner_at(built, {32, 32}), nullptr);
  EXPECT_NE(corner_at(built, {32, 8}), nullptr);
}

TEST_F(Features, StraightOnTwoEdgesNeedNoSector) {
  const HsView view = straight_view(*runner_.device, {64, 64}, 32.0f);
  const Built built = build(runner_, view, polygon({{16, 40}, {16, 16}, {32, 16}, {48, 16}}), fin_shape(10));
  EXPECT_EQ(built.edges.size(), 4u);
  EXPECT_EQ(corner_at(built, {32, 16}), nullptr);
}

TEST_F(Features, AVertexWithFourSilhouetteEdgesHasASectorForEach) {
  const HsView view = straight_view(*runner_.device, {64, 64}, 32.0f);
  Mesh mesh = polygon({{32, 32}, {16, 24}, {16, 40}});
  mesh.positions.emplace_back(1, 0.5f, 2);
  mesh.positions.emplace_back(1, -0.5f, 2);
  mesh.triangles.emplace_back(0, 4, 3);  // two triangles that touch in a point
  const Built built = build(runner_, view, mesh, fin_shape(10));
  EXPECT_EQ(built.edges.size(), 6u);
  const auto at_middle = std::count_if(built.corners.begin(), built.corners.end(),
                                       [](const HsFeature& c) { return std::abs(c.ax - 32) + std::abs(c.ay - 32) < 1e-4f; });
  EXPECT_EQ(at_middle, 4);
  EXPECT_EQ(built.corners.size(), 8u);
}

TEST_F(Features, RectanglesHoldAllThatAFeatureCanShadow) {
  // Far distance 4, edge at 2: w = R (1/2 - 1/4) = R/4 texels at the farthest receiver.
  const unsigned tile = runner_.device->tile_px;
  const float t = static_cast<float>(tile);
  const HsView view = straight_view(*runner_.device, {4 * tile, 4 * tile}, 64.0f, 0.125f, 4.0f);
  Mesh mesh;
  const auto at = [&](float x, float y) { return glm::vec3((x - 2 * t) / 32, -(y - 2 * t) / 32, 2); };
  mesh.positions = {at(t + 4, t + 4), at(2 * t - 4, t + 4), at(t + 4, 2 * t - 4)};
  mesh.triangles = {{0, 1, 2}};
  const auto spans = [](const std::vector<cl_ushort4>& rects) {
    cl_ushort4 all{{99, 99, 0, 0}};
    for (const cl_ushort4& r : rects)
      all = {{std::min(all.s[0], r.s[0]), std::min(all.s[1], r.s[1]), std::max(all.s[2], r.s[2]), std::max(all.s[3], r.s[3])}};
    return std::array<int, 4>{all.s[0], all.s[1], all.s[2], all.s[3]};
  };
  using Rect = std::array<int, 4>;
  const Built narrow = build(runner_, view, mesh, fin_shape(8));  // reaches 2 texels
  EXPECT_EQ(spans(narrow.edge_rects), (Rect{1, 1, 2, 2}));
  EXPECT_EQ(spans(narrow.corner_rects), (Rect{1, 1, 2, 2}));
  const Built wide = build(runner_, view, mesh, fin_shape(40));  // reaches 10
  EXPECT_EQ(spans(wide.edge_rects), (Rect{0, 0, 3, 3}));
  EXPECT_EQ(spans(wide.corner_rects), (Rect{0, 0, 3, 3}));
  // A fixed width t is scaled by 1 - Lb/Lr = 1/2 at the farthest.
  EXPECT_EQ(spans(build(runner_, view, mesh, fin_shape(0.0f, 4)).corner_rects), (Rect{1, 1, 2, 2}));
  EXPECT_EQ(spans(build(runner_, view, mesh, fin_shape(0.0f, 20)).corner_rects), (Rect{0, 0, 3, 3}));
}

TEST_F(Features, FeaturesOutsideTheMapAreNotBuilt) {
  const HsView view = straight_view(*runner_.device, {64, 64}, 32.0f);
  const Built built = build(runner_, view, polygon({{-90, 16}, {-50, 16}, {-50, 40}}), fin_shape(10));
  EXPECT_TRUE(built.edges.empty());
  EXPECT_TRUE(built.corners.empty());
}

TEST_F(Features, EdgesThroughTheNearPlaneBeginThere) {
  const HsView view = straight_view(*runner_.device, {64, 64}, 32.0f, 0.5f);
  Mesh mesh;
  mesh.positions = {{0, 0, 2}, {0.25f, 0, -1}, {0, 0.5f, 2}};
  mesh.triangles = {{0, 1, 2}};
  const Built built = build(runner_, view, mesh, fin_shape(10));
  ASSERT_EQ(built.edges.size(), 3u);
  ASSERT_EQ(built.corners.size(), 2u) << "none at the vertex behind";
  int cut = 0;
  for (const HsFeature& edge : built.edges) {
    for (const float d : {edge.ad, edge.bd}) {
      EXPECT_LE(d, 2.0f);
      cut += d == 2.0f;
    }
  }
  EXPECT_EQ(cut, 2);
}

TEST_F(Features, FinsAtVerticesWithManyEdgesDoNotDependOnTheOrderOfVertices) {
  const HsView view = straight_view(*runner_.device, {64, 64}, 32.0f);
  // Four thin blades that meet in a point at different tilts: the shared normal is a sum of eight.
  std::mt19937 random(13);
  std::uniform_real_distribution<float> somewhere(-0.5f, 0.5f);
  Mesh mesh;
  mesh.positions.emplace_back(0.01f, 0.02f, 2);
  for (int i = 0; i < 8; ++i) {
    const float angle = 0.3f + 0.785f * static_cast<float>(i);
    mesh.positions.emplace_back(std::cos(angle), std::sin(angle), 2 + somewhere(random));
  }
  for (std::uint32_t i = 0; i < 8; i += 2) mesh.triangles.emplace_back(0, i + 1, i + 2);
  ViewPasses::FinPlanes first;
  for (int trial = 0; trial < 8; ++trial) {
    Mesh other = mesh;
    if (trial > 0) {
      std::vector<std::uint32_t> place(9);
      for (std::uint32_t v = 0; v < 9; ++v) place[v] = v;
      std::shuffle(place.begin(), place.end(), random);
      for (std::uint32_t v = 0; v < 9; ++v) other.positions[place[v]] = mesh.positions[v];
      for (glm::uvec3& t : other.triangles) t = {place[t.x], place[t.y], place[t.z]};
      std::shuffle(other.triangles.begin(), other.triangles.end(), random);
    }
    ViewPasses passes(runner_, view, other);
    passes.shadow_map();
    passes.classify();
    passes.build_features(fin_shape(30));
    const auto fins = passes.fins(fin_shape(30));
    if (trial == 0) first = fins;
    EXPECT_EQ(fins.depth, first.depth) << trial;
    EXPECT_EQ(fins.alpha, first.alpha) << trial;
  }
}

TEST_F(Features, EdgesThatComeNearTheLightsPlaneStayNearTheMap) {
  // With a near plane next to the light, a vertex there lies a thousand million texels away.
  const HsView view = straight_view(*runner_.device, {64, 64}, 32.0f, 1e-9f);
  Mesh mesh;
  mesh.positions = {{0.2f, 0, 2}, {0.5f, 0.1f, 2}, {0.4f, 0.3f, 1e-8f}};
  mesh.triangles = {{0, 1, 2}};
  const Built built = build(runner_, view, mesh, fin_shape(10));
  ASSERT_EQ(built.edges.size(), 3u);
  for (const HsFeature& edge : built.edges)
    for (const float px : {edge.ax, edge.ay, edge.bx, edge.by}) EXPECT_LE(std::abs(px), 5.0f * HS_GUARD_PX);
  for (const HsFeature& corner : built.corners) EXPECT_LE(std::abs(corner.ax), 5.0f * HS_GUARD_PX);
}

}  // namespace
}  // namespace halfshade
