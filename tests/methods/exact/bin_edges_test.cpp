// Blocks of potential silhouettes to tiles, kernels/methods/exact/bin_edges.cl: every tile lists those that some receiver in it
// may have before its disc, each once, and none that are far from that.
#include <random>

#include "support/exact_stages.hpp"

namespace halfshade {
namespace {

using BinEdges = ShapedKernelTest;
HS_IN_BOTH_SHAPES(BinEdges);

constexpr float zfar = 40.0f;
constexpr unsigned tiles_x = 7, tiles_y = 5;

/// A map of q within 1.75 and 1.25.
HsView view_of(const KernelRunner& runner, float znear = 0.125f) {
  const unsigned tile_px = runner.device->tile_px;
  return straight_view(*runner.device, glm::uvec2(tiles_x, tiles_y) * tile_px, 2.0f * static_cast<float>(tile_px), znear, zfar);
}

struct Binned {
  std::vector<cl_uint> offsets, refs;
};

Binned bin(const KernelRunner& runner, const HsView& view, const std::vector<twins::Edge>& edges, float radius_px,
           std::vector<float> tile_far, cl_uint capacity = 1u << 16) {
  const cl_uint tiles = tiles_of(view), copies = runner.launcher.one_lane() ? 1 : 3;
  tile_far.resize(tiles + runner.device->lanes, 0.0f);  // whole vectors are read
  const Buffer<cl_uint> counts = runner.filled(std::size_t{tiles} * copies, cl_uint{0}),
                        offsets = runner.filled(tiles + 1, ~cl_uint{0}),
                        refs = runner.filled(std::max(capacity, 1u) + 64, ~cl_uint{0});
  const Buffer<kernels::EdgeBlock> stored = store_edges(runner, edges);
  const Buffer<HsStatus> status = runner.filled(1, HsStatus{0, static_cast<cl_uint>(edges.size()), 0, 0});
  const Buffer<cl_float> far = runner.buffer<cl_float>(tile_far);
  const auto launch = [&](const auto& kernel) {
    if (runner.launcher.one_lane())
      runner.launcher.launch_strided(kernel);
    else
      runner.launcher.launch(kernel, cl::NDRange(copies), cl::NDRange(1));
  };
  launch(kernels::CountEdges{.view = view,
                             .radius_px = radius_px,
                             .status = status,
                             .edges = stored,
                             .tile_far = far,
                             .tile_counts = counts,
                             .copies = copies});
  scan_tiles(runner, tiles, copies, counts, offsets);
  launch(kernels::FillEdges{.view = view,
                            .radius_px = radius_px,
                            .status = status,
                            .edges = stored,
                            .tile_far = far,
                            .tile_cursors = counts,
                            .copies = copies,
                            .refs = refs,
                            .capacity = capacity});
  return {runner.read<cl_uint>(offsets, tiles + 1), runner.read<cl_uint>(refs, std::max(capacity, 1u) + 64)};
}

twins::MapEdge in_map(const HsView& view, const twins::Edge& edge) {
  const auto px = [&](const glm::dvec3& p) {
    return glm::dvec2(p.x / p.z * view.px_from_q.s[0] + view.px_from_q.s[1],
                      p.y / p.z * view.px_from_q.s[2] + view.px_from_q.s[3]);
  };
  return {px(edge.a), px(edge.b), 1 / edge.a.z, 1 / edge.b.z};
}

/// Edges from anywhere to `size` farther on, in space.
std::vector<twins::Edge> random_edges(std::size_t count, double size, std::mt19937& random) {
  std::uniform_real_distribution<double> unit(-1, 1);
  std::vector<twins::Edge> edges;
  for (std::size_t i = 0; i < count; ++i) {
    const double z = 5.5 + 4 * unit(random);
    twins::Edge edge;
    edge.a = {z * 1.6 * unit(random), z * 1.2 * unit(random), z};
    edge.b = edge.a + size * glm::dvec3{unit(random), unit(random), unit(random)};
    edge.m = 1;
    edges.push_back(rounded(edge));
  }
  return edges;
}

/// `radius`: of the light, in units of space.
void expect_bins(const KernelRunner& runner, const std::vector<twins::Edge>& edges, float radius, std::size_t min_needed) {
  const unsigned tile_px = runner.device->tile_px, lanes = runner.device->lanes;
  const HsView view = view_of(runner);
  const float radius_px = radius * view.px_from_q.s[0];
  std::mt19937 random(5);
  std::uniform_real_distribution<float> depth(3, 30);
  std::vector<float> tile_far(tiles_x * tiles_y);
  for (std::size_t tile = 0; tile < tile_far.size(); ++tile) tile_far[tile] = tile % 4 == 3 ? 0.0f : depth(random);
  const Binned binned = bin(runner, view, edges, radius_px, tile_far);

  const std::size_t blocks = (edges.size() + lanes - 1) / lanes;
  std::size_t needed = 0, listed_count = 0;
  for (std::size_t tile = 0; tile < tile_far.size(); ++tile) {
    std::vector<cl_uint> listed(binned.refs.begin() + binned.offsets[tile], binned.refs.begin() + binned.offsets[tile + 1]);
    std::sort(listed.begin(), listed.end());
    ASSERT_TRUE(std::adjacent_find(listed.begin(), listed.end()) == listed.end()) << "a block is listed once";
    ASSERT_TRUE(listed.empty() || listed.back() < blocks);
    if (tile_far[tile] == 0.0f) {
      EXPECT_TRUE(listed.empty()) << "no receivers in tile " << tile;
      continue;
    }
    const glm::dvec2 low = glm::dvec2(tile % tiles_x, tile / tiles_x) * double(tile_px), high = low + double(tile_px);
    const double d_far = 1.0 / tile_far[tile];
    for (std::size_t block = 0; block < blocks; ++block) {
      double gap = std::numeric_limits<double>::infinity(), distance = gap, reach = 0.0;
      for (std::size_t i = block * lanes; i < std::min((block + 1) * lanes, edges.size()); ++i) {
        const twins::MapEdge edge = in_map(view, edges[i]);
        gap = std::min(gap, twins::gap_to_square(edge, low, high, radius_px, d_far));
        distance = std::min(distance, twins::gap_to_square(edge, low, high, 0.0, 0.0));
        reach = std::max(reach, radius_px * (std::max(edge.da, edge.db) - d_far));
      }
      const bool is_listed = std::binary_search(listed.begin(), listed.end(), static_cast<cl_uint>(block));
      if (gap <= 0.0) {
        ASSERT_TRUE(is_listed) << "tile " << tile << " needs block " << block;
        ++needed;
      }
      // Not by more than the corners of boxes, and a margin for edges that come near in the map.
      if (is_listed) {
        EXPECT_LE(distance, 1.8 * (std::max(reach, 0.0) + HS_NEAR_PX + 1.0)) << "tile " << tile << ", block " << block;
        ++listed_count;
      }
    }
  }
  EXPECT_GT(needed, min_needed);
  EXPECT_LT(listed_count, blocks * tile_far.size() / 2) << "nearly everything is listed everywhere";
}

TEST_P(BinEdges, TilesListTheBlocksThatTheirReceiversMayHaveBeforeTheDisc) {
  std::mt19937 random(3);
  for (const float radius : {0.1f, 1.0f}) {
    SCOPED_TRACE(radius);
    // One after another in the map, as on a mesh: blocks are small.
    std::vector<twins::Edge> edges = random_edges(8, 0.1, random);
    for (std::size_t i = 0; edges.size() < 300; ++i) {
      twins::Edge next = edges[edges.size() % 16 == 0 ? i % 8 : edges.size() - 1];
      next.a = next.b;
      next.b += glm::dvec3(0.02, 0.01, -0.01);
      edges.push_back(rounded(next));
    }
    expect_bins(runner_, edges, radius, 20);
  }
}

TEST_P(BinEdges, LongEdgesAreListedWhereTheyPassNotInTheirWholeBox) {
  // A block's edges lie in a bundle across the map.
  std::vector<twins::Edge> edges;
  for (int i = 0; i < 16; ++i) {
    twins::Edge edge;
    edge.a = {-5.0 + 0.01 * i, -4.0, 4.0};
    edge.b = {5.0 + 0.01 * i, 4.0, 4.5};
    edge.m = 1;
    edges.push_back(rounded(edge));
  }
  expect_bins(runner_, edges, 0.05f, 5);
}

TEST_P(BinEdges, EdgesThatComeToTheLightsPlaneAreListedWhereverReceiversAre) {
  const HsView view = view_of(runner_, 0.5f);
  twins::Edge edge;
  edge.a = {0.1, 0.1, 0.0};
  edge.b = {0.2, 0.1, 3.0};
  edge.m = 1;
  std::vector<float> tile_far(tiles_x * tiles_y, 20.0f);
  tile_far[9] = 0.0f;
  const Binned binned = bin(runner_, view, {edge}, 8.0f, tile_far);
  for (std::size_t tile = 0; tile < tile_far.size(); ++tile)
    EXPECT_EQ(binned.offsets[tile + 1] - binned.offsets[tile], tile_far[tile] > 0.0f ? 1u : 0u) << tile;
}

TEST_P(BinEdges, NothingIsWrittenBeyondTheCapacityAndTheTotalIsStillRight) {
  const HsView view = view_of(runner_);
  std::mt19937 random(9);
  const std::vector<twins::Edge> edges = random_edges(200, 0.5, random);
  const std::vector<float> tile_far(tiles_x * tiles_y, 25.0f);
  const Binned whole = bin(runner_, view, edges, 40.0f, tile_far), cut = bin(runner_, view, edges, 40.0f, tile_far, 50);
  ASSERT_GT(whole.offsets.back(), 50u);
  EXPECT_EQ(cut.offsets, whole.offsets);
  for (std::size_t i = 50; i < cut.refs.size(); ++i) EXPECT_EQ(cut.refs[i], ~cl_uint{0});
}

}  // namespace
}  // namespace halfshade
