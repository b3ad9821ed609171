// The smoothie buffer against a plain evaluation of Chan & Durand 2003: alpha = delta / t (§3 step 3), alpha' = alpha / (1 -
// Lb/Lr) (Eq. 1), in double, from the outlines of convex casters.
#include <algorithm>

#include "support/view_passes.hpp"

namespace halfshade {
namespace {

using Fins = ShapedKernelTest;
HS_IN_BOTH_SHAPES(Fins);

struct OutlinePoint {
  glm::dvec2 px;
  double d;  // 1/z
};
using Outline = std::vector<OutlinePoint>;

double cross2(const glm::dvec2& a, const glm::dvec2& b) {
  return a.x * b.y - a.y * b.x;
}

/// The convex outline of projected vertices: as a light sees a convex caster.
Outline hull_of(Outline points) {
  std::sort(points.begin(), points.end(), [](const OutlinePoint& a, const OutlinePoint& b) {
    return a.px.x < b.px.x || (a.px.x == b.px.x && a.px.y < b.px.y);
  });
  Outline hull;
  for (int half = 0; half < 2; ++half) {
    const std::size_t begin = hull.size();
    for (const OutlinePoint& p : points) {
      while (hull.size() >= begin + 2 && cross2(hull.back().px - hull[hull.size() - 2].px, p.px - hull.back().px) <= 0)
        hull.pop_back();
      hull.push_back(p);
    }
    hull.pop_back();
    std::reverse(points.begin(), points.end());
  }
  return hull;
}

struct Nearest {
  double distance_px;  // < 0 inside
  double d;            // 1/Lb there, linear along a projected edge
};

Nearest nearest_on(const Outline& outline, const glm::dvec2& p) {
  Nearest best{1e300, 0};
  bool inside = true;
  for (std::size_t i = 0; i < outline.size(); ++i) {
    const OutlinePoint &a = outline[i], &b = outline[(i + 1) % outline.size()];
    const glm::dvec2 along = b.px - a.px;
    const double s = std::clamp(glm::dot(p - a.px, along) / glm::dot(along, along), 0.0, 1.0);
    const double distance = glm::distance(p, a.px + s * along);
    if (distance < best.distance_px) best = {distance, a.d + s * (b.d - a.d)};
    inside &= cross2(along, p - a.px) >= 0;
  }
  if (inside) best.distance_px = -best.distance_px;
  return best;
}

/// How wide a smoothie is: the light's radius (in units of space), or a fixed t in light map units. One of them is 0.
struct Width {
  double radius, t;
};

/// Casts convex meshes on a far plane and compares every texel. Returns how many lie in a penumbra.
std::size_t expect_fins(const KernelRunner& runner, const std::vector<Mesh>& casters, const Width& width) {
  const float px_per_q = 80.0f;
  const HsView view = straight_view(*runner.device, {150, 130}, px_per_q, 0.25f, 12.0f);
  Mesh scene;
  for (const Mesh& caster : casters) {
    const auto first = static_cast<std::uint32_t>(scene.positions.size());
    scene.positions.insert(scene.positions.end(), caster.positions.begin(), caster.positions.end());
    for (const glm::uvec3& t : caster.triangles) scene.triangles.push_back(t + first);
  }
  // A tilted receiver, its border far outside the map.
  const auto last = static_cast<std::uint32_t>(scene.positions.size());
  for (const glm::vec3& p : {glm::vec3(-60, -60, 8), glm::vec3(60, -60, 10), glm::vec3(0, 120, 9)}) scene.positions.push_back(p);
  scene.triangles.emplace_back(last, last + 1, last + 2);

  ViewPasses passes(runner, view, scene);
  const HsFinShape shape = fin_shape(static_cast<float>(width.radius * px_per_q), static_cast<float>(width.t * px_per_q));
  const std::vector<float> map = passes.shadow_map();
  passes.classify();
  passes.build_features(shape);
  const auto fins = passes.fins(shape);

  const auto vertices = runner.read<cl_int4>(passes.vertices_px, scene.positions.size());
  std::vector<Outline> outlines;
  std::size_t vertex = 0;
  for (const Mesh& caster : casters) {
    Outline points;
    for (std::size_t i = 0; i < caster.positions.size(); ++i, ++vertex)
      points.push_back(
          {glm::dvec2(vertices[vertex].s[0], vertices[vertex].s[1]) / 256.0 + glm::dvec2(view.mid_x_px, view.mid_y_px),
           1.0 / scene.positions[vertex].z});
    outlines.push_back(hull_of(points));
  }

  std::size_t penumbra = 0;
  for (std::size_t i = 0; i < map.size(); ++i) {
    const glm::dvec2 centre(i % view.width_px + 0.5, i / view.width_px + 0.5);
    const double lr = map[i];
    double alpha = 1.0, fin_z = HS_EMPTY_Z;
    bool open = false;  // too near a border of something for rounding not to matter
    for (const Outline& outline : outlines) {
      const Nearest nearest = nearest_on(outline, centre);
      open |= std::abs(nearest.distance_px) < 0.01;
      const double lb = 1.0 / nearest.d;
      if (nearest.distance_px < 0 || lb >= lr) continue;
      // docs/design.md, "The methods": auto makes the remapped width w(Lb, Lr) = R (1/Lb - 1/Lr).
      const double delta = nearest.distance_px / px_per_q, t = width.t > 0 ? width.t : width.radius / lb;
      const double remapped = delta / t / (1.0 - lb / lr);
      open |= std::abs(remapped - 1.0) < 1e-4;
      if (remapped >= 1.0) continue;
      alpha = std::min(alpha, remapped);
      fin_z = std::min(fin_z, lb);
    }
    if (open) continue;
    const float got_alpha = fins.written[i] ? fins.alpha[i] : 1.0f, got_z = fins.written[i] ? fins.depth[i] : HS_EMPTY_Z;
    EXPECT_NEAR(got_alpha, alpha, 2e-4) << "texel " << centre.x << " " << centre.y;
    EXPECT_NEAR(got_z / fin_z, 1.0, 1e-5) << "texel " << centre.x << " " << centre.y;
    if (testing::Test::HasFailure()) return 0;
    penumbra += alpha < 1.0;
  }
  return penumbra;
}

Mesh triangle() {
  Mesh mesh;
  mesh.positions = {{-1.2f, 0.9f, 3}, {1.1f, 1.3f, 5}, {-0.4f, -0.8f, 2}};
  mesh.triangles = {{0, 1, 2}};
  return mesh;
}

Mesh box(const glm::vec3& centre, float size) {
  Mesh mesh;
  const glm::mat3 turn = glm::mat3(glm::vec3(0.8f, 0.36f, 0.48f), glm::vec3(-0.6f, 0.48f, 0.64f), glm::vec3(0, -0.8f, 0.6f));
  for (int i = 0; i < 8; ++i)
    mesh.positions.push_back(centre + size * (turn * glm::vec3((i & 1) * 2 - 1, (i & 2) - 1, (i & 4) / 2 - 1)));
  mesh.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                    {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  return mesh;
}

TEST_P(Fins, ATrianglesSmoothiesFollowEquation1WithTheLightsRadius) {
  EXPECT_GT(expect_fins(runner_, {triangle()}, {.radius = 0.5, .t = 0}), 1500u);
}

TEST_P(Fins, ATrianglesSmoothiesFollowEquation1WithAFixedWidth) {
  EXPECT_GT(expect_fins(runner_, {triangle()}, {.radius = 0, .t = 0.15}), 1000u);
}

TEST_P(Fins, ABoxHasTheSmoothiesOfItsOutline) {
  EXPECT_GT(expect_fins(runner_, {box({0.3f, -0.2f, 4}, 0.7f)}, {.radius = 0.6, .t = 0}), 1000u);
  EXPECT_GT(expect_fins(runner_, {box({0.3f, -0.2f, 4}, 0.7f)}, {.radius = 0, .t = 0.1}), 300u);
}

TEST_P(Fins, ATinyLightHasThinSmoothies) {
  EXPECT_GT(expect_fins(runner_, {triangle()}, {.radius = 0.03, .t = 0}), 20u);
}

TEST_P(Fins, WhereSmoothiesOverlapTheNearestDepthAndTheLeastAlphaStand) {
  EXPECT_GT(
      expect_fins(runner_, {box({-0.6f, -0.3f, 3}, 0.35f), box({0.7f, 0.2f, 5.5f}, 0.6f), triangle()}, {.radius = 0.5, .t = 0}),
      1500u);
}

TEST_P(Fins, TilesBesideSmoothiesAreWrittenAndMarked) {
  // A 2x2 footprint that begins in a tile reaches into the next: every tile from which a footprint may meet a fin texel is
  // flagged.
  const HsView view = straight_view(*runner_.device, {150, 130}, 80.0f, 0.25f, 12.0f);
  ViewPasses passes(runner_, view, box({0.3f, -0.2f, 4}, 0.4f));
  const HsFinShape shape = fin_shape(16.0f);
  passes.shadow_map();
  passes.classify();
  passes.build_features(shape);
  const auto fins = passes.fins(shape);
  const int tile = static_cast<int>(runner_.device->tile_px);
  std::size_t met = 0;
  for (int y = 0; y < 130; ++y)
    for (int x = 0; x < 150; ++x) {
      bool meets = false;
      for (int v = y; v < std::min(y + 2, 130); ++v)
        for (int u = x; u < std::min(x + 2, 150); ++u) meets |= fins.written[v * 150 + u] && fins.alpha[v * 150 + u] < 1.0f;
      const bool marked = fins.tile_near_fins[y / tile * view.tiles_x + x / tile] != 0;
      EXPECT_TRUE(marked || !meets) << x << " " << y;
      for (int v = y; v < std::min(y + 2, 130); ++v)
        for (int u = x; u < std::min(x + 2, 150); ++u) EXPECT_TRUE(fins.written[v * 150 + u] || !marked) << u << " " << v;
      met += meets;
    }
  EXPECT_GT(met, 200u);
  EXPECT_GT(std::count(fins.tile_near_fins.begin(), fins.tile_near_fins.end(), 0), 0);
}

}  // namespace
}  // namespace halfshade
