// From what one receiver of a group sees to what the others do, kernels/methods/exact/swept_edges.h: depth complexity at each of
// them, sample by sample, against the number of triangles that each segment crosses. Kernels of GPU devices have no groups.
#include <random>

#include "light/samples.hpp"
#include "passes/light_points.hpp"
#include "support/exact_stages.hpp"

namespace halfshade {
namespace {

constexpr double radius = 0.4;
constexpr unsigned sample_count = 64;

/// The stages in the order of propagate_in_group (count_samples.cl). base: D of the first receiver. counts: D of each receiver,
/// sample by sample; order: which receiver of the group each is; accepted: by find_swept, find_crossed and sum_deltas.
constexpr const char* source = R"(
typedef struct {
  Batch batch;
  EdgePool pool;
  Sweep sweep;
  NearFaces near_faces;
  v_short base[HS_MAX_SAMPLES / HS_LANES], counts[HS_MAX_SAMPLES / HS_LANES];
} Workspace;

__kernel void propagate(const HsDisc disc, __global const float4* receivers, const int count, __global const EdgeBlock* edges,
                        const int edge_count, __global const uint* triangles, const int triangle_count,
                        __global const float4* vertices_ls, __global const float4* planes, __global const uchar* disc_sides,
                        HS_ARGS_SAMPLES, const int max_pairs, __global const short* base, __global short* counts_out,
                        __global int* order, __global float* seen_out, __global int* accepted) {
  Workspace w;
  const SampleSet set = {samples, below, weights, cell_xy, cells, window_xy, windows};
  const int n = (int)disc.sample_count;
  for (int i = 0; i < count; ++i) {
    w.batch.x[i] = receivers[i].x;
    w.batch.y[i] = receivers[i].y;
    w.batch.z[i] = receivers[i].z;
    w.batch.u[i] = w.batch.v[i] = 0.0f;
  }
  Region region;
  bound_region(&w.batch, 0, count, &region);
  for (int i = 0; i < edge_count; ++i) {
    __global const EdgeBlock* block = edges + i / HS_LANES;
    const int lane = i % HS_LANES;
    w.pool.ax[i] = block->ax[lane]; w.pool.ay[i] = block->ay[lane]; w.pool.az[i] = block->az[lane];
    w.pool.bx[i] = block->bx[lane]; w.pool.by[i] = block->by[lane]; w.pool.bz[i] = block->bz[lane];
    w.pool.n0x[i] = block->n0x[lane]; w.pool.n0y[i] = block->n0y[lane]; w.pool.n0z[i] = block->n0z[lane];
    w.pool.n0w[i] = block->n0w[lane];
    w.pool.n1x[i] = block->n1x[lane]; w.pool.n1y[i] = block->n1y[lane]; w.pool.n1z[i] = block->n1z[lane];
    w.pool.n1w[i] = block->n1w[lane];
    w.pool.m[i] = block->m[lane];
    w.pool.o0[i] = (block->orientations[lane] & 3) - 1;
    w.pool.o1[i] = (block->orientations[lane] >> 2) - 1;
  }
  pad_list(&w.pool, 0, edge_count);
  for (int i = 0; i < triangle_count; ++i) {
    const uint3 corner = vload3(i, triangles);
    const float3 a = vertices_ls[corner.x].xyz, b = vertices_ls[corner.y].xyz, c = vertices_ls[corner.z].xyz;
    const float3 low = min(a, min(b, c)), high = max(a, max(b, c));
    w.near_faces.low_x[i] = low.x; w.near_faces.low_y[i] = low.y; w.near_faces.low_z[i] = low.z;
    w.near_faces.high_x[i] = high.x; w.near_faces.high_y[i] = high.y; w.near_faces.high_z[i] = high.z;
    w.near_faces.triangle[i] = i;
  }
  w.near_faces.count = triangle_count;
  w.near_faces.first = 0;
  w.near_faces.end = count;

  accepted[0] = find_swept(disc, &set, &region, &w.pool, 0, edge_count, max_pairs, &w.sweep);
  if (!accepted[0]) return;
  load_swept(&w.batch, &region, 0, count, &w.sweep);
  accepted[1] = find_crossed(&region, &w.near_faces, triangles, vertices_ls, planes, disc_sides, &w.sweep);
  accepted[2] = sum_deltas(disc, &set, &region, &w.pool, 0, &w.sweep);
  if (!accepted[1] || !accepted[2]) return;
  for (int k = 0; k < n; ++k) ((short*)w.base)[k] = base[k];
  float seen[HS_GROUP];
  int negative[HS_GROUP];
  see_by_sweep(disc, &w.sweep, w.base, seen, negative);
  for (int i = 0; i < count; ++i) {
    order[i] = w.sweep.order[i];
    seen_out[2 * i] = w.sweep.crossed_count[i] > 0 ? -1.0f : seen[i];
    seen_out[2 * i + 1] = negative[i];
    counts_by_sweep(disc, &set, &w.sweep, w.base, planes, i, w.counts);
    for (int k = 0; k < n; ++k) counts_out[i * n + k] = ((const short*)w.counts)[k];
  }
})";

class SweptEdges : public testing::Test {
 protected:
  Watchdog watchdog_;
  KernelRunner runner_{"wide"};
  LightPointBuffer points_ = LightPointBuffers().of(*runner_.device, Light{}, sample_count);
  std::vector<glm::dvec3> samples_ = [] {
    const SampleTable table = sample_table(light_points(Light{}, sample_count));
    std::vector<glm::dvec3> samples;
    for (unsigned i = 0; i < sample_count; ++i)
      samples.push_back(radius * glm::dvec3(table.samples[i], table.samples[sample_count + i], 0.0));
    return samples;
  }();

  struct Result {
    std::vector<std::vector<int>> counts;  // a receiver
    std::vector<float> seen;               // -1 where faces that cut the disc change it
    std::vector<int> negative, accepted;
  };
  /// `edges_come_near`: else they are not listed.
  Result propagate(const twins::Triangles& mesh, const std::vector<glm::dvec3>& receivers, const std::vector<cl_short>& base,
                   bool edges_come_near = true, int max_pairs = 8000) const {
    HsDisc disc{};
    disc.radius = static_cast<float>(radius);
    disc.reach2 = disc.radius * disc.radius * 1.001f;
    disc.table_per_turn = points_.per_turn;
    disc.sample_count = sample_count;
    disc.cells_across = points_.cells_across;
    std::vector<twins::Edge> edges;
    if (edges_come_near)
      for (const auto& [ends, edge] : twins::potential_silhouettes(mesh, radius)) edges.push_back(edge);
    edges = in_records(edges);
    std::vector<cl_float4> points;
    for (const glm::dvec3& p : receivers) points.push_back({{float(p.x), float(p.y), float(p.z), 0}});
    const kernels::args::DiscFaces faces = orient_to_disc(runner_, mesh, radius);
    const Buffer<cl_short> counts = runner_.filled(receivers.size() * sample_count, cl_short{-99});
    const Buffer<cl_int> order = runner_.filled(receivers.size(), cl_int{-1}), accepted = runner_.filled(3, cl_int{0});
    const Buffer<cl_float> seen = runner_.filled(2 * receivers.size(), -9.0f);
    runner_.run(runner_.kernel_with("methods/exact/swept_edges.h", source, "propagate"), cl::NDRange(1), cl::NDRange(1), disc,
                runner_.buffer<cl_float4>(points), static_cast<cl_int>(points.size()), store_edges(runner_, edges),
                static_cast<cl_int>(edges.size()), runner_.buffer<cl_uint>(mesh.corners),
                static_cast<cl_int>(mesh.corners.size()), runner_.buffer<cl_float4>(vertices_of(mesh)), faces.planes.argument(),
                faces.disc_sides.argument(), points_.samples, points_.below, points_.weights, points_.cell_xy, points_.cells,
                points_.window_xy, points_.windows, cl_int{max_pairs}, runner_.buffer<cl_short>(base), counts, order, seen,
                accepted);
    Result result;
    result.accepted = runner_.read<cl_int>(accepted, 3);
    const auto at = runner_.read<cl_int>(order, receivers.size());
    const auto numbers = runner_.read<cl_short>(counts, receivers.size() * sample_count);
    const auto fractions = runner_.read<cl_float>(seen, 2 * receivers.size());
    result.counts.resize(receivers.size());
    result.seen.resize(receivers.size());
    result.negative.resize(receivers.size());
    for (std::size_t i = 0; i < receivers.size() && at[i] >= 0; ++i) {
      const auto to = static_cast<std::size_t>(at[i]);
      result.counts[to].assign(numbers.begin() + static_cast<std::ptrdiff_t>(i * sample_count),
                               numbers.begin() + static_cast<std::ptrdiff_t>((i + 1) * sample_count));
      result.seen[to] = fractions[2 * i];
      result.negative[to] = fractions[2 * i + 1] != 0.0f;
    }
    return result;
  }

  /// Compares with the twin; returns how many samples changed from the first receiver to another.
  std::size_t expect_twin(const twins::Triangles& mesh, std::vector<glm::dvec3> receivers, bool edges_come_near = true) const {
    std::vector<std::vector<twins::Count>> expected;
    for (const glm::dvec3& p : receivers) {
      expected.emplace_back();
      for (const glm::dvec3& s : samples_) expected.back().push_back(twins::surfaces_between(mesh, p, s));
    }
    // The first receiver is one about which there is no doubt.
    const auto is_certain = [](const std::vector<twins::Count>& counts) {
      return std::ranges::all_of(counts, [](const twins::Count& count) { return count.margin >= 1e-5; });
    };
    const auto first = std::ranges::find_if(expected, is_certain) - expected.begin();
    if (first == std::ssize(expected)) {
      ADD_FAILURE() << "no receiver's count is certain";
      return 0;
    }
    std::swap(receivers[0], receivers[static_cast<std::size_t>(first)]);
    std::swap(expected[0], expected[static_cast<std::size_t>(first)]);
    std::vector<cl_short> base;
    for (const twins::Count& count : expected[0]) base.push_back(static_cast<cl_short>(count.value));
    const Result result = propagate(mesh, receivers, base, edges_come_near);
    EXPECT_EQ(result.accepted, (std::vector<int>{1, 1, 1}));
    if (result.accepted != std::vector<int>{1, 1, 1}) return 0;
    std::size_t changed = 0, fractions = 0;
    for (std::size_t i = 0; i < receivers.size(); ++i) {
      std::size_t seen = 0;
      bool certain = true;
      for (unsigned s = 0; s < sample_count; ++s) {
        seen += expected[i][s].value == 0;
        if (expected[i][s].margin < 1e-5) {
          certain = false;
          continue;
        }
        EXPECT_EQ(result.counts[i][s], expected[i][s].value) << "receiver " << i << ", sample " << s;
        changed += expected[i][s].value != expected[0][s].value;
      }
      if (!certain) continue;
      fractions += result.seen[i] >= 0.0f;
      EXPECT_EQ(result.negative[i], 0) << i;
      if (result.seen[i] >= 0.0f) {
        EXPECT_FLOAT_EQ(result.seen[i], static_cast<float>(seen) / sample_count) << i;
      }
      if (testing::Test::HasFailure()) return 0;
    }
    EXPECT_GT(fractions, 5u);
    return changed;
  }

  /// A grid on the floor z = 10 about (x, y), or on one that leans.
  static std::vector<glm::dvec3> receivers_at(double x, double y, double step, double lean = 0.0) {
    std::vector<glm::dvec3> receivers;
    for (int row = 0; row < 8; ++row)
      for (int column = 0; column < 12; ++column)
        receivers.push_back(glm::dvec3(glm::vec3(x + step * column, y + step * row, 10 + lean * (column + 0.5 * row) * step)));
    return receivers;
  }
};

/// A tetrahedron.
void add_solid(twins::Triangles& mesh, const glm::dvec3& at, double size, double turn) {
  const auto first = static_cast<unsigned>(mesh.positions.size());
  for (int i = 0; i < 4; ++i) {
    const double angle = turn + 2.1 * i;
    mesh.positions.push_back(at +
                             size * (i == 3 ? glm::dvec3(0.1, 0.1, -1) : glm::dvec3(std::cos(angle), std::sin(angle), 0.3 * i)));
  }
  for (const glm::uvec3& t : {glm::uvec3(0, 1, 2), glm::uvec3(0, 3, 1), glm::uvec3(1, 3, 2), glm::uvec3(2, 3, 0)})
    mesh.corners.push_back(t + first);
}

/// A spike towards the light: planes of its faces cut the disc.
void add_spike(twins::Triangles& mesh, const glm::dvec3& at, double size, double height, double turn) {
  const auto first = static_cast<unsigned>(mesh.positions.size());
  for (int i = 0; i < 3; ++i)
    mesh.positions.push_back(at + size * glm::dvec3(std::cos(turn + 2.1 * i), std::sin(turn + 2.1 * i), 0));
  mesh.positions.push_back(at - glm::dvec3(0.1 * size, 0.2 * size, height));
  for (const glm::uvec3& t : {glm::uvec3(0, 1, 2), glm::uvec3(0, 3, 1), glm::uvec3(1, 3, 2), glm::uvec3(2, 3, 0)})
    mesh.corners.push_back(t + first);
}

TEST_F(SweptEdges, FacesWhosePlanesCutTheDiscHaveASideForEachSample) {
  twins::Triangles mesh;
  add_spike(mesh, {0.1, 0.0, 7}, 0.25, 4, 0.3);
  std::size_t undecided = 0;
  for (const auto& [ends, edge] : twins::potential_silhouettes(rounded(mesh), radius)) undecided += edge.faces.size() > 1;
  EXPECT_GT(undecided, 1u);
  EXPECT_GT(expect_twin(rounded(mesh), receivers_at(-0.2, -0.2, 0.04)), 1000u);
  add_spike(mesh, {0.1, 0.2, 5}, 0.1, 3, 1.7);
  EXPECT_GT(expect_twin(rounded(mesh), receivers_at(-0.1, -0.1, 0.05, 0.4)), 1000u);
}

TEST_F(SweptEdges, WhatPassesOverASampleChangesItsCount) {
  // One solid at half depth: its shadow's borders go through the group. Then several, some below others.
  std::size_t changed = 0;
  twins::Triangles mesh;
  add_solid(mesh, {0.2, 0.1, 5}, 0.3, 0.2);
  changed += expect_twin(rounded(mesh), receivers_at(-0.3, -0.2, 0.04));
  changed += expect_twin(rounded(mesh), receivers_at(0.2, 0.1, 0.06, 0.7));
  add_solid(mesh, {0.0, 0.2, 3}, 0.15, 1.0);
  add_solid(mesh, {0.3, -0.1, 7}, 0.3, 2.0);
  changed += expect_twin(rounded(mesh), receivers_at(-0.1, -0.2, 0.05));
  EXPECT_GT(changed, 2000u);
}

TEST_F(SweptEdges, EdgesWithoutAFaceBehindThemCountToo) {
  twins::Triangles sheet;
  sheet.positions = {{-0.4, -0.5, 4}, {0.6, -0.2, 5}, {0.1, 0.7, 6}};
  sheet.corners = {{0, 1, 2}};
  EXPECT_GT(expect_twin(rounded(sheet), receivers_at(0.0, 0.0, 0.06)), 500u);
}

TEST_F(SweptEdges, ASegmentThroughAFaceChangesSamplesOnItsSides) {
  // Receivers on both sides of a wall that reaches to the floor: the disc lies on both sides of its plane. And of a lid between
  // receivers at different depths, all of the disc on one side.
  twins::Triangles wall;
  wall.positions = {{0.2, -3, 3}, {0.2, 3, 3}, {0.23, 0, 13}};
  wall.corners = {{0, 1, 2}};
  ASSERT_EQ(twins::receivers_side(rounded(wall).plane(0), radius), 0);
  EXPECT_GT(expect_twin(rounded(wall), receivers_at(0.0, -0.2, 0.05)), 1000u);
  twins::Triangles lid;
  lid.positions = {{-60, -60, 10.16}, {61, -60, 10.2}, {0.1, 80, 10.18}};  // its border is far from the disc
  lid.corners = {{0, 1, 2}};
  ASSERT_NE(twins::receivers_side(rounded(lid).plane(0), radius), 0);
  EXPECT_GT(expect_twin(rounded(lid), receivers_at(-0.2, -0.2, 0.05, 0.5), /*edges_come_near=*/false), 1000u);
}

TEST_F(SweptEdges, AnEdgeBetweenTheReceiversIsPassedBehindOrBefore) {
  // A sheet whose border stands among the receivers: some segments between them pass before it, some behind.
  twins::Triangles sheet;
  sheet.positions = {{-1, -1, 10.1}, {0.11, -1, 10.12}, {0.13, 1.2, 10.1}, {-1, 1, 10.13}};
  sheet.corners = {{0, 1, 2}, {0, 2, 3}};
  EXPECT_GT(expect_twin(rounded(sheet), receivers_at(-0.15, -0.2, 0.05, 0.7)), 200u);
}

TEST_F(SweptEdges, TooManyPairsAreRejected) {
  twins::Triangles mesh;
  for (int i = 0; i < 30; ++i) add_solid(mesh, {0.05 * i - 0.7, 0.1, 5}, 0.2, i);
  const std::vector<glm::dvec3> receivers = receivers_at(-0.3, -0.2, 0.04);
  EXPECT_EQ(propagate(rounded(mesh), receivers, std::vector<cl_short>(sample_count, 0), true, 20).accepted[0], 0);
}

}  // namespace
}  // namespace halfshade
