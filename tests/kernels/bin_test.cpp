// Tile lists: count, scan, fill; and the path without lists.
#include <algorithm>
#include <random>

#include "support/view_passes.hpp"

namespace halfshade {
namespace {

using Bins = ShapedKernelTest;
HS_IN_BOTH_SHAPES(Bins);

struct Lists {
  std::vector<cl_uint> offsets;
  std::vector<cl_uint> refs;
};

/// Scan and fill for rectangles whose counts the host takes.
Lists fill(const KernelRunner& runner, const HsView& view, const std::vector<cl_ushort4>& rects, cl_uint capacity) {
  const cl_uint tiles = view.tiles_x * view.tiles_y;
  std::vector<cl_uint> counts(tiles, 0);
  for (const cl_ushort4& r : rects)
    for (cl_uint y = r.s[1]; y < r.s[3]; ++y)
      for (cl_uint x = r.s[0]; x < r.s[2]; ++x) ++counts[y * view.tiles_x + x];
  const Buffer<cl_uint> cursors = runner.buffer<cl_uint>(counts), offsets = runner.filled(tiles + 1, ~cl_uint{0});
  const Buffer<cl_uint> refs = runner.filled(capacity + 64, ~cl_uint{0});
  scan_tiles(runner, tiles, 1, cursors, offsets);
  HsFinShape shape{};
  shape.tiles_x = view.tiles_x;
  shape.tiles_y = view.tiles_y;
  runner.launcher.launch(kernels::FillFeatures{.shape = shape,
                                               .status = runner.filled(1, HsStatus{0, static_cast<cl_uint>(rects.size()), 0, 0}),
                                               .features = runner.filled(rects.size() + 1, HsFeature{}),
                                               .rects = runner.buffer<cl_ushort4>(rects),
                                               .tile_cursors = cursors,
                                               .refs = refs,
                                               .capacity = capacity},
                         cl::NDRange(1024), cl::NDRange(64));
  Lists lists{runner.read<cl_uint>(offsets, tiles + 1), runner.read<cl_uint>(refs, capacity + 64)};
  cl_uint before = 0;
  for (cl_uint t = 0; t < tiles; ++t) {
    EXPECT_EQ(lists.offsets[t], before) << "tile " << t;
    before += counts[t];
  }
  EXPECT_EQ(lists.offsets[tiles], before);
  return lists;
}

std::vector<cl_ushort4> random_rects(const HsView& view, std::size_t count) {
  std::mt19937 random(5);
  std::vector<cl_ushort4> rects(count);
  for (cl_ushort4& r : rects) {
    const auto one = [&](cl_uint n) { return static_cast<cl_ushort>(random() % (n + 1)); };
    const cl_ushort x0 = one(view.tiles_x), x1 = one(view.tiles_x), y0 = one(view.tiles_y), y1 = one(view.tiles_y);
    if (x0 != x1 && y0 != y1) r = {{std::min(x0, x1), std::min(y0, y1), std::max(x0, x1), std::max(y0, y1)}};
  }
  return rects;
}

TEST_P(Bins, EveryTileOfARectangleListsItOnceAndNoOtherDoes) {
  // Tile counts around the scan's run length and beyond it.
  for (const glm::uvec2 tiles : {glm::uvec2(1, 1), glm::uvec2(3, 2), glm::uvec2(8, 8), glm::uvec2(13, 5), glm::uvec2(31, 17)}) {
    const HsView view = straight_view(*runner_.device, tiles * runner_.device->tile_px, 1.0f);
    const std::vector<cl_ushort4> rects = random_rects(view, 500);
    const Lists lists = fill(runner_, view, rects, 500 * tiles.x * tiles.y);
    for (cl_uint t = 0; t < tiles.x * tiles.y; ++t) {
      std::vector<cl_uint> expected, listed(lists.refs.begin() + lists.offsets[t], lists.refs.begin() + lists.offsets[t + 1]);
      for (cl_uint i = 0; i < rects.size(); ++i) {
        const auto& r = rects[i].s;
        if (t % tiles.x >= r[0] && t % tiles.x < r[2] && t / tiles.x >= r[1] && t / tiles.x < r[3]) expected.push_back(i);
      }
      std::sort(listed.begin(), listed.end());
      ASSERT_EQ(listed, expected) << "tile " << t;
    }
    EXPECT_EQ(lists.refs[lists.offsets.back()], ~cl_uint{0});
  }
}

TEST_P(Bins, CopiesOfATilesCountHaveTheirOwnPartOfItsList) {
  std::mt19937 random(9);
  for (const cl_uint tiles : {1u, 63u, 64u, 200u}) {
    const cl_uint copies = 3;
    std::vector<cl_uint> counts(tiles * copies);
    for (cl_uint& count : counts) count = random() % 5;
    const Buffer<cl_uint> cursors = runner_.buffer<cl_uint>(counts), offsets = runner_.filled(tiles + 1, ~cl_uint{0});
    scan_tiles(runner_, tiles, copies, cursors, offsets);
    const auto begins = runner_.read<cl_uint>(cursors, counts.size()), tile_begins = runner_.read<cl_uint>(offsets, tiles + 1);
    cl_uint before = 0;
    for (cl_uint t = 0; t < tiles; ++t) {
      ASSERT_EQ(tile_begins[t], before);
      for (cl_uint copy = 0; copy < copies; ++copy) {
        ASSERT_EQ(begins[copy * tiles + t], before);
        before += counts[copy * tiles + t];
      }
    }
    EXPECT_EQ(tile_begins[tiles], before);
  }
}

TEST_P(Bins, NothingIsWrittenBeyondTheCapacity) {
  const HsView view = straight_view(*runner_.device, glm::uvec2(8, 8) * runner_.device->tile_px, 1.0f);
  const Lists lists = fill(runner_, view, random_rects(view, 500), 100);
  EXPECT_GT(lists.offsets.back(), 100u);  // the true total is still reported
  for (std::size_t i = 100; i < lists.refs.size(); ++i) EXPECT_EQ(lists.refs[i], ~cl_uint{0});
}

/// A triangle in texels, one unit before the viewer.
Mesh triangle_of(const HsView& view, glm::vec2 a, glm::vec2 b, glm::vec2 c) {
  Mesh mesh;
  for (const glm::vec2& p : {a, b, c})
    mesh.positions.emplace_back((p.x - view.px_from_q.s[1]) / view.px_from_q.s[0],
                                (p.y - view.px_from_q.s[3]) / view.px_from_q.s[2], 1);
  mesh.triangles = {{0, 1, 2}};
  return mesh;
}

TEST_P(Bins, TrianglesGoToTheTilesWhoseTexelCentresTheirBoundsHold) {
  const unsigned tile = runner_.device->tile_px;
  const float t = static_cast<float>(tile);
  const HsView view = straight_view(*runner_.device, {4 * tile, 3 * tile}, 64.0f);
  const auto rect = [&](glm::vec2 a, glm::vec2 b, glm::vec2 c) {
    ViewPasses passes(runner_, view, triangle_of(view, a, b, c));
    const cl_ushort4 r = runner_.read<cl_ushort4>(passes.rects, 1)[0];
    const auto counts = runner_.read<cl_uint>(passes.offsets, passes.tile_count() + 1);
    EXPECT_EQ(counts.back(), cl_uint(r.s[2] - r.s[0]) * (r.s[3] - r.s[1]));
    return std::array<int, 4>{r.s[0], r.s[1], r.s[2], r.s[3]};
  };
  using Rect = std::array<int, 4>;
  EXPECT_EQ(rect({t + 1, t + 1}, {t + 4, t + 1}, {t + 1, t + 4}), (Rect{1, 1, 2, 2}));
  EXPECT_EQ(rect({t - 1, t - 1}, {t + 1, t - 1}, {t - 1, t + 1}), (Rect{0, 0, 2, 2}));
  EXPECT_EQ(rect({t + 0.25f, 2}, {t + 3, 2}, {t + 3, 5}), (Rect{1, 0, 2, 1}));    // starts left of the first centre
  EXPECT_EQ(rect({t - 0.25f, 2}, {t + 3, 2}, {t + 3, 5}), (Rect{1, 0, 2, 1}));    // reaches no centre of the tile before
  EXPECT_EQ(rect({t - 0.5f, 2}, {t + 3, 2}, {t + 3, 5}), (Rect{0, 0, 2, 1}));     // exactly on the last centre of it
  EXPECT_EQ(rect({5.6f, 5.6f}, {6.4f, 5.6f}, {5.6f, 6.4f}), (Rect{0, 0, 0, 0}));  // between centres
  EXPECT_EQ(rect({-9, 2}, {-2, 2}, {-2, 5}), (Rect{0, 0, 0, 0}));                 // left of the map
  EXPECT_EQ(rect({-1e5f, -1e5f}, {1e5f, -1e5f}, {0, 1e5f}), (Rect{0, 0, 4, 3}));  // beyond the guard band
  EXPECT_EQ(rect({4 * t - 1, 3 * t - 1}, {9 * t, 3 * t - 1}, {9 * t, 9 * t}), (Rect{3, 2, 4, 3}));
}

// --------------------------------------------------------------------------------------------------- without tile lists

TEST_P(Bins, WithoutCapacityForListsTheMapsAreTheSame) {
  const Mesh mesh = load_obj(std::string(HALFSHADE_DATA_DIR) + "/meshes/torus.obj");
  const HsView view = straight_view(*runner_.device, {150, 117}, 150.0f);
  glm::dmat4 placed(1.0);
  placed[3] = {0.1, -0.05, 2.5, 1};
  const HsFinShape shape = fin_shape(60.0f);
  ViewPasses with(runner_, view, mesh, placed), without(runner_, view, mesh, placed, RefCapacity::none);

  EXPECT_EQ(with.shadow_map(), without.shadow_map());
  const auto a = with.gbuffer(), b = without.gbuffer();
  EXPECT_EQ(a.depth, b.depth);
  EXPECT_EQ(a.normal, b.normal);
  EXPECT_EQ(a.face, b.face);

  with.classify();
  without.classify();
  EXPECT_GT(with.build_features(shape).features.size(), 20u);
  without.build_features(shape);
  const auto fins = with.fins(shape), plain = without.fins(shape);
  EXPECT_EQ(fins.written, plain.written);
  EXPECT_EQ(fins.depth, plain.depth);
  EXPECT_EQ(fins.alpha, plain.alpha);
  EXPECT_EQ(fins.tile_near_fins, plain.tile_near_fins);
  EXPECT_GT(std::count_if(fins.alpha.begin(), fins.alpha.end(), [](float x) { return x > 0.0f && x < 1.0f; }), 100);
}

}  // namespace
}  // namespace halfshade
