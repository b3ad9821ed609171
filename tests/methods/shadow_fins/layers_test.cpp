// Which layer silhouettes of each depth go to, kernels/methods/shadow_fins/layers.cl: Cai et al. 2006 §4.1.
#include <numeric>
#include <random>

#include "support/kernel_fixture.hpp"
#include "support/twins.hpp"

namespace halfshade {
namespace {

using Layers = ShapedKernelTest;
HS_IN_BOTH_SHAPES(Layers);

constexpr float znear = 2.0f, zfar = 34.0f, px_per_q = 64.0f;
constexpr double radius = 0.05, sublayer_depth = (zfar - znear) / HS_SUBLAYERS;

HsView light_view(const KernelRunner& runner) {
  return straight_view(*runner.device, {64, 64}, px_per_q, znear, zfar);
}

TEST_P(Layers, EdgesCountWhereTheirMiddleLies) {
  std::mt19937 random(51);
  std::uniform_real_distribution<double> depth(1, 40);  // some beyond either end
  const std::size_t count = 3000;
  std::vector<cl_float4> vertices;
  std::vector<cl_uint2> edges;
  std::vector<cl_uint> silhouettes, expected(HS_SUBLAYERS, 0);
  for (cl_uint i = 0; i < count; ++i) {
    // Well within a sub-layer, so that rounding does not matter.
    const double middle = znear + (std::floor((depth(random) - znear) / sublayer_depth) + 0.5) * sublayer_depth;
    const double half = std::min(0.9, middle - 0.1);
    for (const double z : {middle - half, middle + half})
      vertices.push_back({{0, 0, static_cast<float>(z), static_cast<float>(1 / z)}});
    edges.push_back({{2 * i, 2 * i + 1}});
    if (i % 3 == 0) continue;  // not a silhouette
    silhouettes.push_back(i);
    ++expected[static_cast<std::size_t>(std::clamp((middle - znear) / sublayer_depth, 0.0, HS_SUBLAYERS - 1.0))];
  }
  const Buffer<cl_uint> counts = runner_.filled(HS_SUBLAYERS, cl_uint{0});
  runner_.launcher.launch_strided(
      kernels::CountSublayers{.view = light_view(runner_),
                              .silhouettes = runner_.buffer<cl_uint>(silhouettes),
                              .edges = runner_.buffer<cl_uint2>(edges),
                              .vertices_ls = runner_.buffer<cl_float4>(vertices),
                              .status = runner_.filled(1, HsStatus{static_cast<cl_uint>(silhouettes.size()), 0, 0, 0}),
                              .counts = counts});
  EXPECT_EQ(runner_.read<cl_uint>(counts, HS_SUBLAYERS), expected);
  EXPECT_GT(expected.front(), 50u);
  EXPECT_GT(expected.back(), 200u);
}

struct Merged {
  std::vector<unsigned> layers;  // of each sub-layer
  unsigned used;
  std::vector<float> caster_range;
};

Merged merge(const KernelRunner& runner, const std::vector<unsigned>& counts, const HsLayers& layers) {
  const Buffer<cl_uint> merged = runner.filled(HS_SUBLAYERS + 1, ~cl_uint{0});
  const Buffer<cl_float> range = runner.filled(3, -1.0f);
  HsFinShape shape = fin_shape(static_cast<float>(radius * px_per_q));
  runner.launcher.launch_once(
      kernels::MergeSublayers{.view = light_view(runner),
                              .shape = shape,
                              .layers = layers,
                              .status = runner.filled(1, HsStatus{std::accumulate(counts.begin(), counts.end(), 0u), 0, 0, 0}),
                              .counts = runner.buffer<cl_uint>(counts),
                              .sublayer_layers = merged,
                              .caster_range = range});
  std::vector<unsigned> out = runner.read<cl_uint>(merged, HS_SUBLAYERS + 1);
  const unsigned used = out.back();
  out.pop_back();
  return {out, used, runner.read<cl_float>(range, 3)};
}

std::vector<unsigned> random_counts(unsigned seed, double density, unsigned max_count) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> one(0, 1);
  std::vector<unsigned> counts(HS_SUBLAYERS, 0);
  for (std::size_t i = 100; i < 900; ++i)
    if (one(random) < density) counts[i] = 1 + random() % max_count;
  return counts;
}

TEST_P(Layers, HoldAsManyEdgesEach) {
  for (const unsigned layers : {1u, 2u, 7u, 16u, 1024u}) {
    SCOPED_TRACE(layers);
    for (unsigned seed = 0; seed < 4; ++seed) {
      const std::vector<unsigned> counts = random_counts(seed, seed % 2 ? 0.9 : 0.02, seed < 2 ? 3 : 50);
      const Merged merged = merge(runner_, counts, {layers, HS_FALLOFF_DISC, 0, 0});
      EXPECT_EQ(merged.layers, twins::equal_layers(counts, layers));
      EXPECT_EQ(merged.used, layers);
      EXPECT_EQ(merged.caster_range[2], static_cast<float>(layers));
      // What "as many each" means: none differs from the mean by more than a sub-layer's.
      std::vector<double> held(layers, 0.0);
      double total = 0.0, largest = 0.0;
      for (std::size_t i = 0; i < counts.size(); ++i) {
        held[merged.layers[i]] += counts[i];
        total += counts[i];
        largest = std::max(largest, double(counts[i]));
      }
      for (const double edges : held) EXPECT_NEAR(edges, total / layers, largest + 1e-9);
      EXPECT_TRUE(std::is_sorted(merged.layers.begin(), merged.layers.end()));
    }
  }
}

TEST_P(Layers, DepthsOfCastersBeginAtTheFirstSilhouetteAndEndAtTheLast) {
  std::vector<unsigned> counts(HS_SUBLAYERS, 0);
  counts[200] = 3;
  counts[711] = 1;
  const Merged merged = merge(runner_, counts, {4, HS_FALLOFF_DISC, 0, 0});
  const double first = znear + 200 * sublayer_depth, end = znear + 712 * sublayer_depth;
  EXPECT_NEAR(merged.caster_range[0], first, 1e-4);
  EXPECT_NEAR(merged.caster_range[1] * (end - first), HS_CASTER_BITS - 1, 1e-3);  // the last bit is for what lies beyond
}

TEST_P(Layers, ChosenFromTheSceneNoneIsThickerThanACastersOutlineMayBeDeep) {
  const HsLayers automatic{HS_AUTO_LAYERS, HS_FALLOFF_DISC, 0, 1};
  // Two clusters far apart, each within one caster's depth; one cluster; none.
  std::vector<unsigned> two(HS_SUBLAYERS, 0), one = two;
  const auto at = [](double z) { return static_cast<std::size_t>((z - znear) / sublayer_depth); };
  const double depth = twins::caster_depth(radius, 4.0, zfar);
  ASSERT_GT(depth, 3 * sublayer_depth);
  for (const double z : {4.0, 4.0 + 0.5 * depth}) two[at(z)] = one[at(z)] = 5;
  two[at(20.0)] = 2;
  EXPECT_EQ(merge(runner_, two, automatic).used, 2u);
  EXPECT_EQ(merge(runner_, one, automatic).used, 1u);
  EXPECT_EQ(merge(runner_, std::vector<unsigned>(HS_SUBLAYERS, 0), automatic).used, 1u);
  EXPECT_EQ(merge(runner_, two, automatic).layers, twins::layers_by_depth(two, znear, zfar, radius, 1.0));
}

TEST_P(Layers, AreThickerWhereThereWouldBeTooMany) {
  const HsLayers automatic{HS_AUTO_LAYERS, HS_FALLOFF_DISC, 0, 1};
  const std::vector<unsigned> counts = random_counts(9, 0.95, 4);
  ASSERT_GT(twins::layers_by_depth(counts, znear, zfar, radius, 1.0).back() + 1, unsigned{HS_AUTO_LAYERS});
  double thickness = 1.0;
  std::vector<unsigned> expected;
  do {
    expected = twins::layers_by_depth(counts, znear, zfar, radius, thickness);
    thickness *= 1.5;
  } while (expected.back() + 1 > HS_AUTO_LAYERS);
  const Merged merged = merge(runner_, counts, automatic);
  EXPECT_EQ(merged.used, expected.back() + 1);
  std::size_t off = 0;  // by rounding, a sub-layer may fall to the next
  for (std::size_t i = 0; i < expected.size(); ++i) off += merged.layers[i] != expected[i];
  EXPECT_LE(off, HS_AUTO_LAYERS);
}

}  // namespace
}  // namespace halfshade
