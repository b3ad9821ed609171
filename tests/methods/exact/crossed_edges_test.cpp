// What the edges that pass before a receiver's disc add to the depth complexity of each sample,
// kernels/methods/exact/crossed_edges.h, against one segment after the other from the centre to the sample.
#include <random>

#include "light/samples.hpp"
#include "passes/light_points.hpp"
#include "support/exact_stages.hpp"

namespace halfshade {
namespace {

using CrossedEdges = ShapedKernelTest;
HS_IN_BOTH_SHAPES(CrossedEdges);

constexpr double radius = 0.7;

/// Projects edges from p and counts their crossings, as many edges at a time as a list may have. counts: a number a sample;
/// found: touched, near.
constexpr const char* source = R"(
__kernel void count(const HsDisc disc, const float4 receiver, const float2 rotation, __global const EdgeBlock* edges,
                    const int edge_count, HS_ARGS_SAMPLES, __global short* counts_out, __global int* found) {
  const SampleSet set = {samples, below, weights, cell_xy, cells, window_xy, windows};
  EdgePool pool;
  Passing passing;
  v_short counts[HS_MAX_SAMPLES / HS_LANES];
  Walk walk = {false, false};
  for (int from = 0; from < edge_count; from += HS_LISTED) {
    const int n = min(edge_count - from, HS_LISTED);
    for (int i = 0; i < n; ++i) {
      __global const EdgeBlock* block = edges + (from + i) / HS_LANES;
      const int lane = (from + i) % HS_LANES;
      pool.ax[i] = block->ax[lane]; pool.ay[i] = block->ay[lane]; pool.az[i] = block->az[lane];
      pool.bx[i] = block->bx[lane]; pool.by[i] = block->by[lane]; pool.bz[i] = block->bz[lane];
      pool.n0x[i] = block->n0x[lane]; pool.n0y[i] = block->n0y[lane]; pool.n0z[i] = block->n0z[lane]; pool.n0w[i] = block->n0w[lane];
      pool.n1x[i] = block->n1x[lane]; pool.n1y[i] = block->n1y[lane]; pool.n1z[i] = block->n1z[lane]; pool.n1w[i] = block->n1w[lane];
      pool.m[i] = block->m[lane];
      pool.o0[i] = (block->orientations[lane] & 3) - 1;
      pool.o1[i] = (block->orientations[lane] >> 2) - 1;
    }
    pad_list(&pool, 0, n);
    const int passing_count = project_edges(&pool, 0, n, disc, receiver.x, receiver.y, receiver.z, &passing, &walk);
    if (passing_count > 0) count_crossings(&passing, passing_count, disc, rotation, &set, counts, &walk);
  }
  for (int k = 0; k < (int)disc.sample_count; ++k) counts_out[k] = walk.touched ? ((const short*)counts)[k] : 0;
  found[0] = walk.touched;
  found[1] = walk.near;
})";

class CrossingCounter {
 public:
  CrossingCounter(const KernelRunner& runner, unsigned sample_count)
      : runner_(runner), kernel_(runner.kernel_with("methods/exact/crossed_edges.h", source, "count")) {
    const Light light;  // a disc
    points_ = LightPointBuffers().of(*runner.device, light, sample_count);
    const SampleTable table = sample_table(light_points(light, sample_count));
    for (unsigned i = 0; i < sample_count; ++i) samples.emplace_back(table.samples[i], table.samples[sample_count + i]);
    disc.radius = static_cast<float>(radius);
    disc.radius_px = static_cast<float>(radius) * 100;
    disc.reach2 = disc.radius * disc.radius * 1.001f;
    disc.near_q = 0.0f;
    disc.table_per_turn = points_.per_turn;
    disc.sample_count = sample_count;
    disc.cells_across = points_.cells_across;
  }

  struct Result {
    std::vector<cl_short> counts;
    bool touched, near;
  };
  Result count(const std::vector<twins::Edge>& edges, const glm::dvec3& p, double turn = 0.0) const {
    const Buffer<cl_short> counts = runner_.filled(disc.sample_count, cl_short{99});
    const Buffer<cl_int> found = runner_.filled(2, cl_int{-1});
    runner_.run(kernel_, cl::NDRange(1), cl::NDRange(1), disc, cl_float4{{float(p.x), float(p.y), float(p.z), 0}},
                cl_float2{{float(std::cos(turn)), float(-std::sin(turn))}}, store_edges(runner_, edges),
                static_cast<cl_int>(edges.size()), points_.samples, points_.below, points_.weights, points_.cell_xy,
                points_.cells, points_.window_xy, points_.windows, counts, found);
    const auto is = runner_.read<cl_int>(found, 2);
    return {runner_.read<cl_short>(counts, disc.sample_count), is[0] != 0, is[1] != 0};
  }

  HsDisc disc{};
  std::vector<glm::dvec2> samples;  ///< of the unit disc

 private:
  const KernelRunner& runner_;
  cl::Kernel kernel_;
  LightPointBuffer points_;
};

std::vector<twins::Edge> random_edges(std::mt19937& random, std::size_t count) {
  std::uniform_real_distribution<double> unit(-1, 1);
  std::vector<twins::Edge> edges;
  for (std::size_t i = 0; i < count; ++i) {
    const double z = 4 + 3.5 * unit(random);
    twins::Edge edge;
    edge.a = {0.5 * unit(random), 0.5 * unit(random), z};
    edge.b = edge.a + glm::dvec3{unit(random), unit(random), unit(random)};
    edge.b.z = std::max(edge.b.z, 0.3);
    edge.m = static_cast<int>(random() % 5) - 2;
    for (unsigned f = 0; f < random() % 3; ++f)
      edge.faces.push_back({random() % 2 ? 1 : -1,
                            twins::plane_of(edge.a, edge.b, edge.a + glm::dvec3{unit(random), unit(random), unit(random)})});
    edges.push_back(rounded(edge));
  }
  return edges;
}

/// Every sample that is not within rounding of an edge has the twin's count. Returns how many are not 0.
std::size_t expect_twin(const CrossingCounter& counter, const std::vector<twins::Edge>& edges, const glm::dvec3& p,
                        double turn = 0.0) {
  const CrossingCounter::Result result = counter.count(edges, p, turn);
  std::size_t tested = 0, not_0 = 0;
  for (std::size_t i = 0; i < counter.samples.size(); ++i) {
    const glm::dvec2 unit = counter.samples[i];
    const glm::dvec2 s =
        radius * glm::dvec2(std::cos(turn) * unit.x - std::sin(turn) * unit.y, std::sin(turn) * unit.x + std::cos(turn) * unit.y);
    const twins::Count expected = twins::crossings(edges, p, s);
    if (expected.margin < 1e-5) continue;
    EXPECT_EQ(result.counts[i], expected.value) << "sample " << i << " at " << s.x << ", " << s.y;
    ++tested;
    not_0 += expected.value != 0;
  }
  EXPECT_GT(tested, counter.samples.size() * 9 / 10);
  return not_0;
}

TEST_P(CrossedEdges, OneEdgeAddsItsMultiplicityWhereItIsCrossed) {
  const CrossingCounter counter(runner_, 256);
  const glm::dvec3 p(0, 0, 10);
  // At half depth, so that it is seen at twice its place; from both sides, in either direction.
  for (const int m : {1, 2, -1})
    for (const double x : {0.1, -0.1, 0.2}) {
      twins::Edge up, down;
      up.a = {x, -0.3, 5};
      up.b = {x, 0.25, 5};
      up.m = m;
      down = up;
      std::swap(down.a, down.b);
      EXPECT_GT(expect_twin(counter, {rounded(up)}, p), 20u);
      EXPECT_GT(expect_twin(counter, {rounded(down)}, p), 20u);
    }
}

TEST_P(CrossedEdges, WhatIsCrossedAddsUp) {
  std::mt19937 random(21);
  std::uniform_real_distribution<double> unit(-1, 1);
  for (const unsigned count : {16u, 64u, 256u, 1024u}) {
    SCOPED_TRACE(count);
    const CrossingCounter counter(runner_, count);
    std::size_t not_0 = 0;
    for (int i = 0; i < 6; ++i) {
      const glm::dvec3 p(glm::vec3{0.4 * unit(random), 0.4 * unit(random), 9 + unit(random)});
      not_0 += expect_twin(counter, random_edges(random, 1 + 7 * static_cast<std::size_t>(i)), p);
    }
    EXPECT_GT(not_0, count);
  }
}

TEST_P(CrossedEdges, EdgesThatPassThroughTheReceiversDepthAreCutThere) {
  const CrossingCounter counter(runner_, 256);
  const glm::dvec3 p(0.1, 0.05, 6);
  std::vector<twins::Edge> edges(3);
  edges[0].a = {-0.1, -0.2, 3}, edges[0].b = {0.3, 0.4, 9};
  edges[1].a = {0.4, 0.3, 8}, edges[1].b = {-0.2, 0.1, 2};
  edges[2].a = {0.1, 0.2, 7}, edges[2].b = {0.2, 0.2, 8};  // behind
  for (twins::Edge& edge : edges) edge.m = 1, edge = rounded(edge);
  for (const twins::Edge& edge : edges) expect_twin(counter, {edge}, p);
  EXPECT_GT(expect_twin(counter, edges, p), 20u);
  EXPECT_FALSE(counter.count({edges[2]}, p).touched);
}

TEST_P(CrossedEdges, TurnedSamplesAreCountedWhereTheyAreTurnedTo) {
  CrossingCounter counter(runner_, 256);
  counter.disc.rotated = 1;
  std::mt19937 random(22);
  std::size_t not_0 = 0;
  for (const double turn : {0.3, 2.0, 4.4, 6.1}) not_0 += expect_twin(counter, random_edges(random, 12), {0.1, 0.2, 9}, turn);
  EXPECT_GT(not_0, 200u);
}

TEST_P(CrossedEdges, OfASphereTheDiscFacesTheReceiver) {
  CrossingCounter counter(runner_, 256);
  counter.disc.sphere = 1;
  std::mt19937 random(23);
  const glm::dvec3 p(glm::vec3(2, -1.5, 7));
  // The smallest turn that takes the z axis to where p is (Rodrigues' formula) takes the disc's axes, too.
  const glm::dvec3 z = glm::normalize(p), axis = glm::normalize(glm::cross(glm::dvec3(0, 0, 1), z));
  const double angle = std::acos(z.z);
  const auto turned = [&](const glm::dvec3& v) {
    return v * std::cos(angle) + glm::cross(axis, v) * std::sin(angle) + axis * glm::dot(axis, v) * (1 - std::cos(angle));
  };
  const glm::dvec3 x = turned({1, 0, 0}), y = turned({0, 1, 0});
  const auto seen_from_disc = [&](const glm::dvec3& v) { return glm::dvec3(glm::dot(x, v), glm::dot(y, v), glm::dot(z, v)); };
  std::size_t not_0 = 0;
  for (int i = 0; i < 4; ++i) {
    std::vector<twins::Edge> edges = random_edges(random, 12), facing;
    for (twins::Edge& edge : edges) {
      edge.a += 0.5 * p * (edge.a.z / p.z), edge.b += 0.5 * p * (edge.a.z / p.z);  // about the segment to p
      edge = rounded(edge);
      twins::Edge turned_edge = edge;
      turned_edge.a = seen_from_disc(edge.a), turned_edge.b = seen_from_disc(edge.b);
      for (twins::Edge::Face& face : turned_edge.faces) face.plane.n = seen_from_disc(face.plane.n);
      facing.push_back(turned_edge);
    }
    const CrossingCounter::Result result = counter.count(edges, p);
    for (std::size_t k = 0; k < counter.samples.size(); ++k) {
      const twins::Count expected = twins::crossings(facing, seen_from_disc(p), radius * counter.samples[k]);
      if (expected.margin < 1e-5) continue;
      EXPECT_EQ(result.counts[k], expected.value) << k;
      not_0 += expected.value != 0;
    }
  }
  EXPECT_GT(not_0, 50u);
}

TEST_P(CrossedEdges, ASilhouetteThatPassesNearInTheMapIsReported) {
  CrossingCounter counter(runner_, 16);
  counter.disc.near_q = 0.02f;
  const glm::dvec3 p(0.4, 0.2, 8);  // at (0.05, 0.025) in the map
  for (const double away : {0.0, 0.015, 0.019, 0.021, 0.05, 0.3}) {
    twins::Edge edge;
    edge.a = {4 * (0.05 + away), -1, 4};
    edge.b = {4 * (0.05 + away), 1, 4};
    edge.m = 1;
    EXPECT_EQ(counter.count({rounded(edge)}, p).near, away < 0.02) << away;
    edge.m = 0;
    EXPECT_FALSE(counter.count({rounded(edge)}, p).near) << "no silhouette";
  }
}

}  // namespace
}  // namespace halfshade
