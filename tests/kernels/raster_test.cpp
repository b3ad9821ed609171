// Triangles to texels: coverage, depth, and what the G-buffer holds.
#include <algorithm>
#include <numeric>
#include <random>

#include "support/view_passes.hpp"

namespace halfshade {
namespace {

using Raster = ShapedKernelTest;
HS_IN_BOTH_SHAPES(Raster);

/// Where a fixed-point position (1/256 texel) lies at depth z. Exact for powers of two.
glm::vec3 at_fixed(const HsView& view, glm::ivec2 fixed, float z) {
  const glm::vec2 from_mid = glm::vec2(fixed) / 256.0f - glm::vec2(view.mid_x_px, view.mid_y_px);
  return glm::vec3(from_mid.x / view.px_from_q.s[0] * z, from_mid.y / view.px_from_q.s[2] * z, z);
}

/// q = (x/z, y/z) at a texel's centre.
glm::dvec2 q_of(const HsView& view, std::size_t texel) {
  const glm::dvec2 px(texel % view.width_px + 0.5, texel / view.width_px + 0.5);
  return {(px.x - view.px_from_q.s[1]) / view.px_from_q.s[0], (px.y - view.px_from_q.s[3]) / view.px_from_q.s[2]};
}

bool is_empty(float z) {
  return z == HS_EMPTY_Z;
}

// ---------------------------------------------------------------------------------------------------------------- depth

TEST_P(Raster, DepthIsThatOfThePlaneAtTheTexelsCentre) {
  const HsView view = straight_view(*runner_.device, {100, 70}, 64.0f);
  Mesh mesh;  // a tilted square, larger than the map: every texel sees it
  mesh.positions = {at_fixed(view, {-20 * 256, -30 * 256}, 2), at_fixed(view, {140 * 256, -30 * 256}, 4),
                    at_fixed(view, {-20 * 256, 120 * 256}, 8)};
  mesh.positions.push_back(at_fixed(view, {400 * 256, 400 * 256}, 4));
  mesh.triangles = {{0, 1, 2}, {1, 3, 2}};
  ViewPasses passes(runner_, view, mesh);
  const std::vector<float> map = passes.shadow_map();
  const std::vector<float> camera = passes.gbuffer().depth;
  const glm::dvec3 a(mesh.positions[0]), b(mesh.positions[1]), c(mesh.positions[2]), d(mesh.positions[3]);
  std::size_t first = 0;
  for (std::size_t i = 0; i < map.size(); ++i) {
    const glm::dvec3 ray(q_of(view, i), 1);
    const auto hit = [&](const glm::dvec3& p, const glm::dvec3& q, const glm::dvec3& r) {
      const glm::dvec3 n = glm::cross(q - p, r - p);
      return glm::dot(n, p) / glm::dot(n, ray);
    };
    const glm::dvec2 px(i % view.width_px + 0.5, i / view.width_px + 0.5);
    const double side = (px.x - 140) * (120.0 - -30.0) - (px.y - -30) * (-20.0 - 140.0);  // < 0: in the first triangle
    const double expected = side < 0 ? hit(a, b, c) : hit(b, d, c);
    first += side < 0;
    ASSERT_NEAR(map[i] / expected, 1.0, 2e-6) << i;
    ASSERT_EQ(map[i], camera[i]);
  }
  EXPECT_GT(first, map.size() / 4);
  EXPECT_LT(first, map.size());
}

TEST_P(Raster, TheNearestOfManyWins) {
  const HsView view = straight_view(*runner_.device, {40, 40}, 64.0f);
  Mesh mesh;
  std::vector<float> depths = {8, 2, 4, 1, 16};
  for (const float z : depths) {
    const std::uint32_t v = static_cast<std::uint32_t>(mesh.positions.size());
    for (const glm::ivec2 corner : {glm::ivec2(0, 0), glm::ivec2(40, 0), glm::ivec2(0, 40)})
      mesh.positions.push_back(at_fixed(view, corner * 256 * (z == 1 ? 1 : 4) / 4, z));  // the nearest is smaller
    mesh.triangles.emplace_back(v, v + 1, v + 2);
  }
  mesh.positions[9] = at_fixed(view, {0, 0}, 1), mesh.positions[10] = at_fixed(view, {10 * 256, 0}, 1),
  mesh.positions[11] = at_fixed(view, {0, 10 * 256}, 1);
  const std::vector<float> map = ViewPasses(runner_, view, mesh).shadow_map();
  EXPECT_EQ(map[0], 1.0f);
  EXPECT_EQ(map[9], 2.0f);
  EXPECT_EQ(map[9 * 40], 2.0f);
  EXPECT_EQ(map[20], 2.0f);
  EXPECT_TRUE(is_empty(map[39 * 40 + 39]));
}

TEST_P(Raster, EmptyTexelsHoldTheBackground) {
  const HsView view = straight_view(*runner_.device, {37, 41}, 64.0f);
  Mesh mesh;
  mesh.positions = {at_fixed(view, {256, 256}, 2), at_fixed(view, {4 * 256, 256}, 2), at_fixed(view, {256, 4 * 256}, 2)};
  mesh.triangles = {{0, 1, 2}};
  ViewPasses passes(runner_, view, mesh);
  const std::vector<float> map = passes.shadow_map();
  const auto planes = passes.gbuffer(0.0f);
  for (std::size_t i = 0; i < map.size(); ++i) {
    // The texels whose centres lie in x, y >= 1, x + y <= 5, the long edge excluded: it runs along centres.
    const std::size_t x = i % 37, y = i / 37;
    if (x >= 1 && y >= 1 && x + y + 1 < 5) {
      EXPECT_EQ(map[i], 2.0f);
      EXPECT_EQ(planes.depth[i], 2.0f);
      EXPECT_EQ(planes.normal[i], glm::vec4(0, 0, -1, 0));
      EXPECT_EQ(planes.face[i], 0u);
    } else {
      EXPECT_TRUE(is_empty(map[i])) << x << " " << y;
      EXPECT_EQ(planes.depth[i], 0.0f);
      EXPECT_EQ(planes.normal[i], glm::vec4(0));
      EXPECT_EQ(planes.face[i], ~0u);
    }
  }
}

TEST_P(Raster, BeyondTheFarDistanceTheCameraSeesNothing) {
  const HsView view = straight_view(*runner_.device, {8, 8}, 8.0f, 0.125f, 4.0f);
  Mesh mesh;
  mesh.positions = {{-9, -9, 4.5f}, {9, -9, 4.5f}, {0, 18, 4.5f}};
  mesh.triangles = {{0, 1, 2}};
  EXPECT_EQ(ViewPasses(runner_, view, mesh).gbuffer().depth, std::vector<float>(64, 0.0f));
}

TEST_P(Raster, TrianglesWithoutAreaCoverNothing) {
  const HsView view = straight_view(*runner_.device, {32, 32}, 32.0f);
  Mesh mesh;
  mesh.positions = {at_fixed(view, {0, 0}, 1),
                    at_fixed(view, {16 * 256, 16 * 256}, 1),
                    at_fixed(view, {32 * 256, 32 * 256}, 1),
                    {-1, 0, -1},
                    {1, 0, -1},
                    {0, 1, -2}};
  mesh.triangles = {{0, 1, 2}, {3, 4, 5}};  // a line along texel centres; one behind the viewer
  for (const float z : ViewPasses(runner_, view, mesh).shadow_map()) EXPECT_TRUE(is_empty(z));
}

// ------------------------------------------------------------------------------------------------------------ fill rule

/// How many of the mesh's triangles cover each texel, each drawn alone.
std::vector<int> coverage(ViewPasses& passes, std::size_t triangles) {
  std::vector<int> count(passes.texel_count(), 0);
  for (std::uint32_t t = 0; t < triangles; ++t) {
    const std::vector<float> map = passes.shadow_map_of(t);
    for (std::size_t i = 0; i < map.size(); ++i) count[i] += !is_empty(map[i]);
  }
  return count;
}

using Corners = std::vector<glm::ivec3>;
std::int64_t doubled_area(glm::ivec2 a, glm::ivec2 b, glm::ivec2 c) {
  return std::int64_t{b.x - a.x} * (c.y - a.y) - std::int64_t{b.y - a.y} * (c.x - a.x);
}

/// Adds a point to a triangulation, exactly: into the triangles that hold it, on a shared edge into both.
void insert_point(std::vector<glm::ivec2>& points, Corners& triangles, glm::ivec2 p) {
  if (std::find(points.begin(), points.end(), p) != points.end()) return;
  const int index = static_cast<int>(points.size());
  points.push_back(p);
  Corners kept;
  for (const glm::ivec3& t : triangles) {
    bool inside = true;
    for (int i = 0; i < 3; ++i) inside &= doubled_area(points[t[i]], points[t[(i + 1) % 3]], p) >= 0;
    if (!inside) {
      kept.push_back(t);
      continue;
    }
    for (int i = 0; i < 3; ++i)
      if (doubled_area(points[t[i]], points[t[(i + 1) % 3]], p) > 0) kept.emplace_back(t[i], t[(i + 1) % 3], index);
  }
  triangles = kept;
}

TEST_P(Raster, ATriangulatedRectangleCoversEachTexelOnce) {
  const HsView view = straight_view(*runner_.device, {61, 45}, 64.0f);
  std::mt19937 random(6);
  for (int trial = 0; trial < 6; ++trial) {
    // Sides on texel centres, on texel borders, and anywhere on the fixed-point grid.
    const int snap = trial % 3 == 0 ? 256 : trial % 3 == 1 ? 128 : 1;
    const auto coordinate = [&](int low, int high, int to) { return low + static_cast<int>(random() % (high - low)) / to * to; };
    const glm::ivec2 low(coordinate(0, 8 * 256, snap), coordinate(0, 8 * 256, snap));
    const glm::ivec2 high(coordinate(40 * 256, 70 * 256, snap), coordinate(30 * 256, 50 * 256, snap));
    std::vector<glm::ivec2> points = {low, {high.x, low.y}, high, {low.x, high.y}};
    Corners triangles = {{0, 1, 2}, {0, 2, 3}};
    for (int i = 0; i < 40; ++i) {
      glm::ivec2 p{low.x + random() % (high.x - low.x + 1), low.y + random() % (high.y - low.y + 1)};
      if (i % 2) p = glm::clamp(p / 256 * 256 + 128, low, high);  // a texel's centre
      insert_point(points, triangles, p);
    }
    Mesh mesh;
    for (const glm::ivec2& p : points) mesh.positions.push_back(at_fixed(view, p, std::ldexp(1.0f, random() % 4)));
    for (const glm::ivec3& t : triangles) {
      const glm::ivec3 c = random() % 2 ? t : glm::ivec3(t.y, t.x, t.z);  // winding does not matter
      mesh.triangles.emplace_back(c);
    }
    ViewPasses passes(runner_, view, mesh);
    const std::vector<int> count = coverage(passes, mesh.triangles.size());
    for (std::size_t i = 0; i < count.size(); ++i) {
      const glm::ivec2 centre = glm::ivec2(i % view.width_px, i / view.width_px) * 256 + 128;
      const bool inside = centre.x >= low.x && centre.x < high.x && centre.y >= low.y && centre.y < high.y;
      ASSERT_EQ(count[i], inside ? 1 : 0) << "trial " << trial << ", texel " << i % view.width_px << " " << i / view.width_px;
    }
  }
}

/// A grid in the plane z = 0 of its own space, `extent` to each side, its inner vertices moved about.
Mesh jittered_grid(unsigned cells, float extent, std::mt19937& random) {
  Mesh mesh;
  std::uniform_real_distribution<float> jitter(-0.3f, 0.3f);
  for (unsigned y = 0; y <= cells; ++y)
    for (unsigned x = 0; x <= cells; ++x) {
      const bool inner = x > 0 && y > 0 && x < cells && y < cells;
      const glm::vec2 p{x + (inner ? jitter(random) : 0.0f), y + (inner ? jitter(random) : 0.0f)};
      mesh.positions.emplace_back((p * 2.0f / float(cells) - 1.0f) * extent, 0.0f);
    }
  for (unsigned y = 0; y < cells; ++y)
    for (unsigned x = 0; x < cells; ++x) {
      const unsigned v = y * (cells + 1) + x;
      mesh.triangles.emplace_back(v, v + 1, v + cells + 2);
      mesh.triangles.emplace_back(v, v + cells + 2, v + cells + 1);
    }
  return mesh;
}

glm::dmat4 random_placement(std::mt19937& random, const glm::dvec3& translation) {
  std::normal_distribution<double> normal;
  const glm::dvec3 x = glm::normalize(glm::dvec3{normal(random), normal(random), normal(random)});
  const glm::dvec3 y = glm::normalize(glm::cross(x, glm::dvec3{normal(random), normal(random), normal(random)}));
  return glm::dmat4(glm::dvec4(x, 0), glm::dvec4(y, 0), glm::dvec4(glm::cross(x, y), 0), glm::dvec4(translation, 1));
}

/// Checks that no texel is covered twice, and those that see the grid well inside its border and beyond the near plane once.
void expect_watertight(const KernelRunner& runner, const HsView& view, const Mesh& mesh, const glm::dmat4& placed, double extent,
                       std::size_t* seen) {
  ViewPasses passes(runner, view, mesh, placed);
  const std::vector<int> count = coverage(passes, mesh.triangles.size());
  const glm::dmat4 grid_from_view = glm::inverse(placed);
  for (std::size_t i = 0; i < count.size(); ++i) {
    const glm::dvec3 origin = grid_from_view[3], ray = glm::dmat3(grid_from_view) * glm::dvec3(q_of(view, i), 1);
    const double z = -origin.z / ray.z;
    const glm::dvec3 hit = origin + z * ray;
    // A texel's footprint on the plane, about; less than that from the border is left open.
    const double footprint = 2.0 * z * std::abs(z / origin.z) / view.px_from_q.s[0];
    const bool inside = z > view.znear * 1.05 && std::max(std::abs(hit.x), std::abs(hit.y)) < extent - footprint;
    if (inside) {
      ++*seen;
      ASSERT_EQ(count[i], 1) << "texel " << i % view.width_px << " " << i / view.width_px << " z " << z;
    } else {
      ASSERT_LE(count[i], 1) << "texel " << i % view.width_px << " " << i / view.width_px << " z " << z;
    }
  }
}

TEST_P(Raster, SharedEdgesAreWatertightUnderRandomTransforms) {
  const HsView view = straight_view(*runner_.device, {64, 64}, 60.0f);
  std::mt19937 random(7);
  std::size_t seen = 0;
  for (int trial = 0; trial < 8; ++trial)
    expect_watertight(runner_, view, jittered_grid(6, 1, random), random_placement(random, {0.1, -0.2, 2.5}), 1, &seen);
  EXPECT_GT(seen, 3000u);
}

TEST_P(Raster, SharedEdgesAreWatertightAcrossTheNearPlaneAndTheGuardBand) {
  const HsView view = straight_view(*runner_.device, {64, 64}, 60.0f);
  std::mt19937 random(8);
  std::size_t seen = 0;
  for (int trial = 0; trial < 8; ++trial) {
    const glm::dvec3 near_by(0.3, -0.4, 0.8);
    const float extent = trial % 2 ? 5.0f : 3000.0f;  // through the near plane; and far beyond the guard band
    expect_watertight(runner_, view, jittered_grid(5, extent, random), random_placement(random, near_by), extent, &seen);
  }
  EXPECT_GT(seen, 3000u);
}

TEST_P(Raster, ClippingLeavesCornersThatItKeepsWhereTheyAre) {
  // A triangle that is clipped and its neighbour that is not must agree about the vertices they share.
  const cl::Kernel clip = runner_.kernel_with("raster/clip.h", R"(
    __kernel void clip(const HsView view, __global const float4* vertices_vs, __global int4* polygons, __global int* counts) {
      const uint i = get_global_id(0);
      int4 polygon[HS_CLIP_VERTICES];
      counts[i] = clip_triangle(view, vertices_vs[3 * i].xyz, vertices_vs[3 * i + 1].xyz, vertices_vs[3 * i + 2].xyz, polygon);
      for (int k = 0; k < HS_CLIP_VERTICES; ++k) polygons[HS_CLIP_VERTICES * i + k] = polygon[k];
    })",
                                              "clip");
  HsView view = straight_view(*runner_.device, {4000, 3000}, 3333.0f);
  view.px_from_q.s[1] += 411.37f;  // a light map's middle is not on the axis
  view.px_from_q.s[3] -= 97.71f;
  std::mt19937 random(9);
  std::uniform_real_distribution<float> q(-0.8f, 0.8f), z(0.2f, 40.0f);
  const std::size_t triangles = 4096;
  Mesh mesh;
  for (std::uint32_t i = 0; i < triangles; ++i) {
    for (int k = 0; k < 3; ++k) {
      const float depth = k == 2 ? -z(random) : z(random);
      mesh.positions.push_back(glm::vec3{q(random) * depth, q(random) * depth, depth});
    }
    mesh.triangles.emplace_back(3 * i, 3 * i + 1, 3 * i + 2);
  }
  ViewPasses passes(runner_, view, mesh);
  const Buffer<cl_int4> polygons = runner_.filled(8 * triangles, cl_int4{});
  const Buffer<cl_int> counts = runner_.filled(triangles, cl_int{0});
  runner_.run(clip, cl::NDRange(triangles), cl::NDRange(64), view, passes.vertices_vs, polygons, counts);
  const auto vertices = runner_.read<cl_int4>(passes.vertices_px, 3 * triangles);
  const auto clipped = runner_.read<cl_int4>(polygons, 8 * triangles);
  const auto sizes = runner_.read<int>(counts, triangles);
  std::size_t moved = 0;
  for (std::size_t i = 0; i < triangles; ++i) {
    EXPECT_GE(sizes[i], 4);
    for (std::size_t v = 3 * i; v < 3 * i + 2; ++v) {
      EXPECT_EQ(vertices[v].s[3], 0);
      bool found = false;
      for (int k = 0; k < sizes[i]; ++k) found |= std::equal(vertices[v].s, vertices[v].s + 3, clipped[8 * i + k].s);
      moved += !found;
    }
  }
  EXPECT_EQ(moved, 0u);
}

// --------------------------------------------------------------------------------------------------------- hidden faces

TEST_P(Raster, LeavingOutTheHiddenFacesOfASolidLeavesNoHole) {
  const HsView view = straight_view(*runner_.device, {90, 80}, 80.0f);
  glm::dmat4 view_from_world(1.0);  // left-handed, as views are: z forward
  view_from_world[2][2] = -1.0;
  std::mt19937 random(18);
  for (const char* name : {"torus", "star", "box", "cylinder"}) {
    SCOPED_TRACE(name);
    const Mesh mesh = load_obj(std::string(HALFSHADE_DATA_DIR) + "/meshes/" + name + ".obj");
    for (int i = 0; i < 4; ++i) {
      PlacedMesh placed;
      placed.world_from_local = random_placement(random, {0, 0, -3});
      if (i % 2) placed.world_from_local[0] *= -1.0;  // mirrored
      placed.bounds = {glm::dvec3(-1), glm::dvec3(1)};
      placed.orientation = solid_orientation(mesh, build_topology(mesh));
      ASSERT_EQ(placed.orientation, 1);
      const cl_uint cull = hidden_faces(placed, view_from_world, view.znear);
      ASSERT_NE(cull, HS_CULL_NONE);
      const glm::dmat4 view_from_mesh = view_from_world * placed.world_from_local;
      ViewPasses all(runner_, view, mesh, view_from_mesh);
      ViewPasses some(runner_, view, mesh, view_from_mesh, RefCapacity::enough, cull);
      const auto refs = [&](ViewPasses& passes) { return runner_.read<cl_uint>(passes.offsets, passes.tile_count() + 1).back(); };
      EXPECT_LT(refs(some), refs(all));
      const std::vector<float> a = all.shadow_map(), b = some.shadow_map();
      const auto normals = all.gbuffer().normal, other_normals = some.gbuffer().normal;
      std::size_t off = 0;
      for (std::size_t t = 0; t < a.size(); ++t) {
        ASSERT_EQ(is_empty(a[t]), is_empty(b[t])) << t;
        // Vertices are snapped: on the very outline a face seen edge-on may come before or behind its neighbour.
        ASSERT_NEAR(b[t] / a[t], 1.0f, 0.02f) << t;
        off += std::abs(b[t] / a[t] - 1.0f) > 1e-5f || normals[t] != other_normals[t];
      }
      EXPECT_LE(off, a.size() / 500);
    }
  }
}

TEST_P(Raster, NothingIsLeftOutOfASolidThatMayHoldTheViewer) {
  PlacedMesh placed;
  placed.bounds = {glm::dvec3(-1), glm::dvec3(1)};
  placed.orientation = 1;
  placed.world_from_local[3] = {0, 0, 1.05, 1};
  EXPECT_EQ(hidden_faces(placed, glm::dmat4(1.0), 0.1), HS_CULL_NONE);
  placed.world_from_local[3].z = 1.2;
  EXPECT_EQ(hidden_faces(placed, glm::dmat4(1.0), 0.1), HS_CULL_POSITIVE);
  placed.orientation = -1;
  EXPECT_EQ(hidden_faces(placed, glm::dmat4(1.0), 0.1), HS_CULL_NEGATIVE);
  placed.orientation = 0;
  EXPECT_EQ(hidden_faces(placed, glm::dmat4(1.0), 0.1), HS_CULL_NONE);
}

// ---------------------------------------------------------------------------------------------------- order independence

/// The same mesh: triangles shuffled, their corners rotated, vertices renumbered.
Mesh shuffled(const Mesh& mesh, std::mt19937& random) {
  std::vector<std::uint32_t> place(mesh.positions.size());
  std::iota(place.begin(), place.end(), 0u);
  std::shuffle(place.begin(), place.end(), random);
  Mesh out;
  out.positions.resize(mesh.positions.size());
  for (std::size_t v = 0; v < place.size(); ++v) out.positions[place[v]] = mesh.positions[v];
  for (glm::uvec3 t : mesh.triangles) {
    for (unsigned turn = random() % 3; turn > 0; --turn) t = {t.y, t.z, t.x};
    out.triangles.emplace_back(place[t.x], place[t.y], place[t.z]);
  }
  std::shuffle(out.triangles.begin(), out.triangles.end(), random);
  return out;
}

void expect_order_independent(const KernelRunner& runner, const HsView& view, const Mesh& mesh, const glm::dmat4& placed) {
  std::mt19937 random(10);
  const HsFinShape shape = fin_shape(40.0f);
  ViewPasses passes(runner, view, mesh, placed);
  const std::vector<float> map = passes.shadow_map(), depth = passes.gbuffer().depth;
  passes.classify();
  passes.build_features(shape);
  const auto fins = passes.fins(shape);
  for (int i = 0; i < 4; ++i) {
    ViewPasses other(runner, view, shuffled(mesh, random), placed);
    EXPECT_EQ(other.shadow_map(), map);
    EXPECT_EQ(other.gbuffer().depth, depth);
    other.classify();
    other.build_features(shape);
    const auto other_fins = other.fins(shape);
    EXPECT_EQ(other_fins.written, fins.written);
    EXPECT_EQ(other_fins.depth, fins.depth);
    EXPECT_EQ(other_fins.alpha, fins.alpha);
    EXPECT_EQ(other_fins.tile_near_fins, fins.tile_near_fins);
  }
}

TEST_P(Raster, MapsDoNotDependOnTheOrderOfTrianglesCornersAndVertices) {
  const HsView view = straight_view(*runner_.device, {90, 80}, 80.0f);
  std::mt19937 random(11);
  for (const char* name : {"torus", "star", "pillars", "cone"}) {
    SCOPED_TRACE(name);
    const Mesh mesh = load_obj(std::string(HALFSHADE_DATA_DIR) + "/meshes/" + name + ".obj");
    expect_order_independent(runner_, view, mesh, random_placement(random, {0, 0, 3}));
  }
}

TEST_P(Raster, NorDoTheyWhereTrianglesAreClipped) {
  const HsView view = straight_view(*runner_.device, {90, 80}, 80.0f);
  std::mt19937 random(12);
  for (const char* name : {"torus", "star", "box"}) {
    SCOPED_TRACE(name);
    const Mesh mesh = load_obj(std::string(HALFSHADE_DATA_DIR) + "/meshes/" + name + ".obj");
    for (int i = 0; i < 4; ++i) expect_order_independent(runner_, view, mesh, random_placement(random, {0.3, 0.2, 0.1}));
  }
}

}  // namespace
}  // namespace halfshade
