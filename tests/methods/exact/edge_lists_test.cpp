// From a tile's blocks of edges to those that a group of receivers may need, and of ever fewer of them:
// kernels/methods/exact/edge_lists.h against what each receiver needs by itself.
#include <random>

#include "support/exact_stages.hpp"

namespace halfshade {
namespace {

using EdgeLists = ShapedKernelTest;
HS_IN_BOTH_SHAPES(EdgeLists);

constexpr double radius = 0.6;
constexpr float px_per_q = 200.0f;

/// Lists a tile's edges for receivers 0 .. count, then narrows that list for receivers from .. to alone; outputs both lists, a
/// listful after the other. kept: 17 numbers an edge, in the order of EdgePool, m, o0 and o1 as floats.
constexpr const char* source = R"(
void output(const EdgePool* pool, int first, int count, __global float* kept, __global int* kept_count) {
  for (int i = first; i < first + count; ++i) {
    __global float* to = kept + 17 * (*kept_count)++;
    const float numbers[17] = {pool->ax[i],  pool->ay[i],  pool->az[i],  pool->bx[i],  pool->by[i],  pool->bz[i],
                               pool->n0x[i], pool->n0y[i], pool->n0z[i], pool->n0w[i], pool->n1x[i], pool->n1y[i],
                               pool->n1z[i], pool->n1w[i], (float)pool->m[i], (float)pool->o0[i], (float)pool->o1[i]};
    for (int k = 0; k < 17; ++k) to[k] = numbers[k];
  }
}

void load(Batch* batch, const HsView light, __global const float4* receivers, int count) {
  for (int i = 0; i < count; ++i) {
    const float4 p = receivers[i];
    batch->x[i] = p.x;
    batch->y[i] = p.y;
    batch->z[i] = p.z;
    batch->u[i] = p.x / p.z * light.px_from_q.x + light.px_from_q.y;
    batch->v[i] = p.y / p.z * light.px_from_q.z + light.px_from_q.w;
  }
}

__kernel void list(const HsView light, const float radius_px, __global const float4* receivers, const int receiver_count,
                   const int some_first, const int some_end, __global const EdgeBlock* edges, const uint edge_count,
                   __global const uint* refs, const uint use_refs, const uint first, const uint end, __global float* listed,
                   __global int* listed_count, __global float* narrowed, __global int* narrowed_count) {
  Batch batch;
  EdgePool pool;
  Region all, some;
  load(&batch, light, receivers, receiver_count);
  bound_region(&batch, 0, receiver_count, &all);
  bound_region(&batch, some_first, some_end, &some);
  const TileEdges tile = {edges, edge_count, use_refs ? refs : 0, first, end};
  for (uint from = first; from < end;) {
    const int count = list_edges(light, radius_px, &all, &tile, &pool, &from);
    output(&pool, 0, count, listed, listed_count);
    const int behind = (count + HS_LANES - 1) / HS_LANES * HS_LANES;
    const int fewer = count > 0 ? narrow_list(light, radius_px, &some, &pool, 0, count, behind) : 0;
    output(&pool, behind, fewer, narrowed, narrowed_count);
  }
})";

struct Lists {
  std::vector<twins::Edge> listed, narrowed;
};

class Tile {
 public:
  explicit Tile(const KernelRunner& runner)
      : runner_(runner),
        kernel_(runner.kernel_with("methods/exact/edge_lists.h", source, "list")),
        view(straight_view(*runner.device, {256, 256}, px_per_q, 0.125f, 50.0f)) {}

  Lists list(const std::vector<twins::Edge>& edges, const std::vector<glm::dvec3>& receivers, int some_first, int some_end,
             const std::vector<cl_uint>& refs = {}) const {
    std::vector<cl_float4> points;
    for (const glm::dvec3& p : receivers) points.push_back({{float(p.x), float(p.y), float(p.z), 0}});
    const auto blocks = static_cast<cl_uint>((edges.size() + runner_.device->lanes - 1) / runner_.device->lanes);
    const Buffer<cl_float> listed = runner_.filled(17 * edges.size() + 17, 0.0f),
                           narrowed = runner_.filled(17 * edges.size() + 17, 0.0f);
    const Buffer<cl_int> listed_count = runner_.filled(1, cl_int{0}), narrowed_count = runner_.filled(1, cl_int{0});
    runner_.run(kernel_, cl::NDRange(1), cl::NDRange(1), view, static_cast<cl_float>(radius * px_per_q),
                runner_.buffer<cl_float4>(points), static_cast<cl_int>(receivers.size()), cl_int{some_first}, cl_int{some_end},
                store_edges(runner_, edges), static_cast<cl_uint>(edges.size()), runner_.buffer<cl_uint>(refs),
                cl_uint{!refs.empty()}, cl_uint{0}, refs.empty() ? blocks : static_cast<cl_uint>(refs.size()), listed,
                listed_count, narrowed, narrowed_count);
    return {kept(listed, listed_count), kept(narrowed, narrowed_count)};
  }

 private:
  std::vector<twins::Edge> kept(const Buffer<cl_float>& from, const Buffer<cl_int>& count) const {
    const auto n = static_cast<std::size_t>(runner_.read<cl_int>(count, 1)[0]);
    const std::vector<float> numbers = runner_.read<float>(from, 17 * n);
    std::vector<twins::Edge> edges;
    for (std::size_t i = 0; i < n; ++i) {
      const float* k = &numbers[17 * i];
      twins::Edge edge;
      edge.a = {k[0], k[1], k[2]};
      edge.b = {k[3], k[4], k[5]};
      edge.m = static_cast<int>(k[14]);
      for (int f = 0; f < 2; ++f)
        if (k[15 + f] != 0.0f)
          edge.faces.push_back({static_cast<int>(k[15 + f]), {{k[6 + 4 * f], k[7 + 4 * f], k[8 + 4 * f]}, k[9 + 4 * f]}});
      edges.push_back(edge);
    }
    return edges;
  }

  const KernelRunner& runner_;
  cl::Kernel kernel_;

 public:
  const HsView view;
};

/// Edges of small triangles that lean in any direction, before and beside receivers about (0, 0, 10).
std::vector<twins::Edge> random_edges(std::size_t count) {
  std::mt19937 random(12);
  std::uniform_real_distribution<double> unit(-1, 1);
  std::vector<twins::Edge> edges;
  for (std::size_t i = 0; i < count; ++i) {
    const double z = 6 + 5 * unit(random);
    twins::Edge edge;
    edge.a = {0.9 * unit(random), 0.9 * unit(random), z};
    edge.b = edge.a + 0.3 * glm::dvec3{unit(random), unit(random), unit(random)};
    edge.m = static_cast<int>(random() % 3) - 1;
    for (unsigned f = 0; f < random() % 3; ++f) {
      const glm::dvec3 c = edge.a + glm::dvec3{unit(random), unit(random), unit(random)};
      edge.faces.push_back({random() % 2 ? 1 : -1, twins::plane_of(edge.a, edge.b, c)});
    }
    edges.push_back(rounded(edge));
  }
  return edges;
}

bool same_place(const twins::Edge& a, const twins::Edge& b) {
  return a.a == b.a && a.b == b.b;
}

glm::dvec2 in_map(const HsView& view, const glm::dvec3& p) {
  return {p.x / p.z * view.px_from_q.s[0] + view.px_from_q.s[1], p.y / p.z * view.px_from_q.s[2] + view.px_from_q.s[3]};
}

/// What is needed is kept, once, with its multiplicity as each receiver sees it; what no receiver can need is not.
void expect_kept(const HsView& view, const std::vector<twins::Edge>& kept, const std::vector<twins::Edge>& edges,
                 const std::vector<glm::dvec3>& receivers) {
  glm::dvec3 low(1e9), high(-1e9);
  glm::dvec2 low_px(1e9), high_px(-1e9);
  for (const glm::dvec3& p : receivers) {
    low = glm::min(low, p);
    high = glm::max(high, p);
    low_px = glm::min(low_px, in_map(view, p));
    high_px = glm::max(high_px, in_map(view, p));
  }
  std::size_t needed = 0, dropped = 0;
  for (const twins::Edge& edge : edges) {
    const auto found = std::find_if(kept.begin(), kept.end(), [&](const twins::Edge& other) { return same_place(other, edge); });
    const auto count = std::count_if(kept.begin(), kept.end(), [&](const twins::Edge& other) { return same_place(other, edge); });
    ASSERT_LE(count, 1);
    bool needs = false, decided = true;
    for (const glm::dvec3& p : receivers) needs |= twins::hides_some(edge, p, radius);
    if (needs) {
      ASSERT_EQ(count, 1) << "a receiver needs it";
      ++needed;
    }
    // A face's side is decided where all corners of the receivers' box are clearly on it.
    int sum = edge.m;
    for (const twins::Edge::Face& face : edge.faces) {
      int sides[2] = {0, 0};
      for (int i = 0; i < 8; ++i) {
        const glm::dvec3 corner(i & 1 ? low.x : high.x, i & 2 ? low.y : high.y, i & 4 ? low.z : high.z);
        if (std::abs(face.plane.value_at(corner)) < 1e-4) decided = false;
        ++sides[face.plane.side_of(corner) > 0];
      }
      decided &= sides[0] == 0 || sides[1] == 0;
      sum += face.o * (sides[1] > 0 ? 1 : -1);
    }
    // Far in the map from where penumbrae can reach, or behind all.
    const twins::MapEdge projected{in_map(view, edge.a), in_map(view, edge.b), 1 / edge.a.z, 1 / edge.b.z};
    const double reach = radius * px_per_q * std::max(0.0, std::max(projected.da, projected.db) - 1 / high.z);
    const bool far = twins::gap_to_square(projected, low_px, high_px, 0.0, 0.0) > 1.8 * (reach + HS_NEAR_PX + 1) ||
                     std::min(edge.a.z, edge.b.z) > 1.001 * high.z;
    if ((decided && sum == 0) || far) {
      EXPECT_EQ(count, 0) << (far ? "it is far from all discs" : "no receiver sees it as a silhouette");
      ++dropped;
    }
    if (found == kept.end()) continue;
    for (const glm::dvec3& p : receivers) {
      bool near_plane = false;
      for (const twins::Edge::Face& face : edge.faces) near_plane |= std::abs(face.plane.value_at(p)) < 1e-4;
      if (!near_plane) {
        ASSERT_EQ(twins::multiplicity(*found, p), twins::multiplicity(edge, p));
      }
    }
  }
  EXPECT_GT(needed, 10u);
  EXPECT_GT(dropped, 10u);
  for (const twins::Edge& edge : kept)
    EXPECT_TRUE(std::any_of(edges.begin(), edges.end(), [&](const twins::Edge& other) { return same_place(other, edge); }))
        << "what is no edge is kept";
}

std::vector<glm::dvec3> receivers_about(const glm::dvec3& middle, double size, std::size_t count) {
  std::mt19937 random(13);
  std::uniform_real_distribution<double> unit(-0.5, 0.5);
  std::vector<glm::dvec3> receivers;
  for (std::size_t i = 0; i < count; ++i)
    receivers.push_back(glm::dvec3(glm::vec3(middle + size * glm::dvec3{unit(random), unit(random), unit(random)})));
  return receivers;
}

TEST_P(EdgeLists, HoldWhatReceiversNeedAndLittleElse) {
  const Tile tile(runner_);
  const std::vector<twins::Edge> edges = random_edges(400);
  for (const double size : {0.02, 0.5}) {
    // On GPUs receivers count alone.
    const std::size_t count = runner_.device->lanes == 1 ? 1 : 50;
    const std::vector<glm::dvec3> receivers = receivers_about({0.1, -0.1, 10}, size, count);
    const auto some = static_cast<int>((count + 4) / 5);
    const Lists lists = tile.list(edges, receivers, 0, some);
    SCOPED_TRACE(size);
    {
      SCOPED_TRACE("list_edges");
      expect_kept(tile.view, lists.listed, edges, receivers);
    }
    SCOPED_TRACE("narrow_list");
    expect_kept(tile.view, lists.narrowed, edges, {receivers.begin(), receivers.begin() + some});
    EXPECT_LE(lists.narrowed.size(), lists.listed.size());
  }
}

TEST_P(EdgeLists, ATilesBlocksAreThoseItRefersTo) {
  const Tile tile(runner_);
  const auto lanes = static_cast<cl_uint>(runner_.device->lanes);
  std::vector<twins::Edge> edges;
  for (cl_uint i = 0; i < 6 * lanes + 1; ++i) {  // the last block is not full
    twins::Edge edge;
    edge.a = {-0.01 - 0.001 * i, 0.001 * i, 5};
    edge.b = {0.01, 0.002 * i, 5};
    edge.m = 1;
    edges.push_back(rounded(edge));
  }
  const std::vector<glm::dvec3> receivers = {{0.0, 0.0, 10.0}};
  EXPECT_EQ(tile.list(edges, receivers, 0, 1).listed.size(), edges.size());
  const std::vector<cl_uint> refs = {5, 0, 6};
  const Lists lists = tile.list(edges, receivers, 0, 1, refs);
  ASSERT_EQ(lists.listed.size(), 2 * lanes + 1);
  for (std::size_t i = 0; i < lists.listed.size(); ++i)
    EXPECT_TRUE(same_place(lists.listed[i], edges[refs[i / lanes] * lanes + i % lanes])) << i;
}

}  // namespace
}  // namespace halfshade
