// What overlapping fins make of the light that a receiver sees, kernels/methods/shadow_fins/illuminance.h: within a layer (Cai et
// al. 2006 §3.4) and from layer to layer (§4.2), for footprints whose fins are given.
#include <numbers>
#include <random>

#include "support/kernel_fixture.hpp"
#include "support/twins.hpp"

namespace halfshade {
namespace {

using Illuminance = ShapedKernelTest;
HS_IN_BOTH_SHAPES(Illuminance);

constexpr double zfar = 32.0, d_far = 1.0 / zfar, radius = 0.05;
constexpr float px_per_q = 64.0f;

/// A texel's fins: weight for the far plane, 1/Lb (0: none), direction out of the shadow; second ones by the cosine to the first.
struct Fin {
  float s = 0, d = 0, nx = 0, ny = 0;
};
struct SecondFin {
  float s = 0, d = 0, cosine = 0;
};
struct Texel {
  Fin inner, outer;
  SecondFin inner2, outer2;
  float reach_d = 0;
};
using FinFootprint = std::array<Texel, 4>;  // x, then y

/// The fins of a layer, the same at all four texels.
FinFootprint everywhere(const Texel& texel) {
  return {texel, texel, texel, texel};
}

struct Receiver {
  double d = 1.0 / 16;
  std::array<bool, 4> lit{true, true, true, true};
  glm::dvec2 place{0.25, 0.6};  // between the texels

  double weight(int k) const { return (k & 1 ? place.x : 1 - place.x) * (k & 2 ? place.y : 1 - place.y); }
};

/// out: one_layer of the first layer; then for each, part of lit, done and at_hand, and at_d.
constexpr const char* source = R"(
__kernel void combine(const HsView view, const HsFinShape shape, const HsLayers layers, const uint layer_count, const uint varied,
                      __global const float* given, const float receiver_d, const float4 weights, const uint lit,
                      __global float* out) {
  HS_SHARED TileFins fins;
  TileReceiver r;
  r.mine = (vint)(-1);
  r.d = (vfloat)(receiver_d);
  r.behind_d = layers.faithful ? (vfloat)(0.0f) : (vfloat)(receiver_d);
  r.texel = (vint)(0);
  r.w[0] = (vfloat)(weights.x);
  r.w[1] = (vfloat)(weights.y);
  r.w[2] = (vfloat)(weights.z);
  r.w[3] = (vfloat)(weights.w);
  for (int k = 0; k < 4; ++k) r.lit[k] = (vint)((lit >> k & 1) ? -1 : 0);
  Illuminance seen;
  seen.lit.part = (vfloat)(1.0f);
  seen.lit.nx = seen.lit.ny = (vfloat)(0.0f);
  seen.done = seen.at_hand = seen.lit;
  seen.at_d = (vfloat)(0.0f);
  for (uint layer = 0; layer < layer_count; ++layer) {
    for (int k = 0; k < 4; ++k) {
      const int slot = (k >> 1) * HS_TILE + (k & 1);
      __global const float* from = given + 15 * (4 * layer + k);
      fins.inner.s[slot] = from[0]; fins.inner.d[slot] = from[1]; fins.inner.nx[slot] = from[2]; fins.inner.ny[slot] = from[3];
      fins.outer.s[slot] = from[4]; fins.outer.d[slot] = from[5]; fins.outer.nx[slot] = from[6]; fins.outer.ny[slot] = from[7];
      fins.inner2.s[slot] = from[8]; fins.inner2.d[slot] = from[9]; fins.inner2.c[slot] = from[10];
      fins.outer2.s[slot] = from[11]; fins.outer2.d[slot] = from[12]; fins.outer2.c[slot] = from[13];
      fins.reach_d[slot] = from[14];
    }
    FinTaps taps;
    if (layer == 0) {
      load_fins(&fins, &r, varied, true, layers.faithful, &taps);
      out[0] = v_first(one_layer(view, layers, &r, &taps));
    }
    load_fins(&fins, &r, varied, false, layers.faithful, &taps);
    add_layer(view, shape, layers, &fins, &r, &taps, &seen);
    out[4 * layer + 1] = v_first(seen.lit.part);
    out[4 * layer + 2] = v_first(seen.done.part);
    out[4 * layer + 3] = v_first(seen.at_hand.part);
    out[4 * layer + 4] = v_first(seen.at_d);
  }
})";

struct Seen {
  double lit, done, at_hand, at_d;
};
struct Combined {
  double one_layer;
  std::vector<Seen> after;  // each layer
};

struct Mode {
  bool faithful = false;
  cl_uint falloff = HS_FALLOFF_LINEAR;
  bool varied = false;
};

class Combiner {
 public:
  explicit Combiner(const KernelRunner& runner)
      : runner_(runner), kernel_(runner.kernel_with("methods/shadow_fins/illuminance.h", source, "combine")) {}

  Combined operator()(const std::vector<FinFootprint>& layers, const Receiver& receiver, const Mode& mode = {}) const {
    std::vector<float> given;
    for (const FinFootprint& layer : layers)
      for (const Texel& t : layer)
        given.insert(given.end(), {t.inner.s, t.inner.d, t.inner.nx, t.inner.ny, t.outer.s, t.outer.d, t.outer.nx, t.outer.ny,
                                   t.inner2.s, t.inner2.d, t.inner2.cosine, t.outer2.s, t.outer2.d, t.outer2.cosine, t.reach_d});
    cl_float4 weights{};
    cl_uint lit = 0;
    for (int k = 0; k < 4; ++k) {
      weights.s[k] = static_cast<float>(receiver.weight(k));
      lit |= cl_uint{receiver.lit[static_cast<std::size_t>(k)]} << k;
    }
    const Buffer<cl_float> out = runner_.filled(4 * layers.size() + 1, -9.0f);
    runner_.run(kernel_, cl::NDRange(1), cl::NDRange(1),
                straight_view(*runner_.device, {64, 64}, px_per_q, 0.125f, static_cast<float>(zfar)),
                fin_shape(static_cast<float>(radius * px_per_q)),
                HsLayers{static_cast<cl_uint>(layers.size()), mode.falloff, mode.faithful, 0},
                static_cast<cl_uint>(layers.size()), cl_uint{mode.varied}, runner_.buffer<cl_float>(given),
                static_cast<cl_float>(receiver.d), weights, lit, out);
    const auto numbers = runner_.read<float>(out, 4 * layers.size() + 1);
    Combined combined{numbers[0], {}};
    for (std::size_t i = 1; i < numbers.size(); i += 4)
      combined.after.push_back({numbers[i], numbers[i + 1], numbers[i + 2], numbers[i + 3]});
    return combined;
  }

 private:
  const KernelRunner& runner_;
  cl::Kernel kernel_;
};

Texel outer(double s, double z, double angle = 0.0) {
  Texel t;
  t.outer = {float(s), float(1 / z), float(std::cos(angle)), float(std::sin(angle))};
  return t;
}
Texel inner(double s, double z, double angle = 0.0) {
  Texel t;
  t.inner = {float(s), float(1 / z), float(std::cos(angle)), float(std::sin(angle))};
  return t;
}
const Receiver in_light{}, in_shadow{.lit = {false, false, false, false}};

double refined(double s, double z, const Receiver& receiver = in_light) {
  return twins::refined_weight(s, 1 / z, receiver.d, d_far);
}

double disc_falloff(double x) {
  const double u = 2 * x - 1;
  return 0.5 + (std::asin(u) + u * std::sqrt(1 - u * u)) / std::numbers::pi;
}

constexpr double tolerance = 2e-6;

// ------------------------------------------------------------------------------------------------------------- one layer

TEST_P(Illuminance, TwoFinsHideByTheAngleBetweenThem) {
  const cl::Kernel kernel = runner_.kernel_with("methods/shadow_fins/illuminance.h", R"(
    __kernel void both(__global const float* a, __global const float* b, __global const float* c, __global float* out) {
      const int i = get_global_id(0);
      out[i] = v_first(hidden_by_both((vfloat)(a[i]), (vfloat)(b[i]), (vfloat)(c[i])));
    })",
                                                "both");
  std::vector<float> a, b, c;
  for (const float x : {0.0f, 0.1f, 0.35f, 0.5f, 0.8f, 1.0f})
    for (const float y : {0.0f, 0.25f, 0.5f, 0.9f})
      for (const float cosine : {-1.0f, -0.5f, -0.01f, 0.0f, 0.1f, 0.29f, 0.3f, 0.7f, 1.0f}) {
        a.push_back(x);
        b.push_back(y);
        c.push_back(cosine);
      }
  const Buffer<cl_float> out = runner_.filled(a.size(), -1.0f);
  runner_.run(kernel, cl::NDRange(a.size()), cl::NDRange(1), runner_.buffer<cl_float>(a), runner_.buffer<cl_float>(b),
              runner_.buffer<cl_float>(c), out);
  const auto got = runner_.read<float>(out, a.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    EXPECT_NEAR(got[i], twins::hidden_by_both(a[i], b[i], c[i]), tolerance) << a[i] << " " << b[i] << " " << c[i];
    EXPECT_GE(got[i], std::max(a[i], b[i]) - 1e-6f);
  }
}

TEST_P(Illuminance, OuterFinsHideAndInnerFinsLetInByTheirRefinedWeight) {
  const Combiner combine(runner_);
  for (const double z : {4.0, 8.0, 15.0})
    for (const double s : {0.02, 0.2, 0.45, 0.5}) {
      SCOPED_TRACE(z);
      SCOPED_TRACE(s);
      const double weight = refined(s, z);
      EXPECT_NEAR(combine({everywhere(outer(s, z))}, in_light).one_layer, 1 - weight, tolerance);
      EXPECT_NEAR(combine({everywhere(inner(s, z))}, in_shadow).one_layer, weight, tolerance);
      EXPECT_NEAR(combine({everywhere(outer(s, z))}, in_light, {.falloff = HS_FALLOFF_DISC}).one_layer, 1 - disc_falloff(weight),
                  1e-5);
    }
  EXPECT_EQ(refined(0.2, 15.9), 0.0) << "at contact the penumbra has no width";
}

TEST_P(Illuminance, AReceiverBeforeAFinSeesNothingOfIt) {
  const Combiner combine(runner_);
  const Receiver near{.d = 1.0 / 5};
  EXPECT_EQ(combine({everywhere(outer(0.4, 6))}, near).one_layer, 1.0);
  EXPECT_EQ(combine({everywhere(outer(0.4, 6))}, near, {.faithful = true}).one_layer, 1.0);
}

TEST_P(Illuminance, TexelsCountByTheirBilinearWeightsLitOnesAndDarkOnesApart) {
  const Combiner combine(runner_);
  Receiver receiver;
  receiver.lit = {true, false, true, false};
  const double dark = receiver.weight(1) + receiver.weight(3);
  for (const auto& [in, out] : {std::pair{0.4, 0.46}, {0.47, 0.4}}) {
    Texel both = outer(out, 6);
    both.inner = inner(in, 6).inner;
    const double more = refined(in, 6) - refined(out, 6);
    EXPECT_NEAR(combine({everywhere(both)}, receiver).one_layer,
                (1 - dark) * std::clamp(1 + more, 0.0, 1.0) + dark * std::clamp(more, 0.0, 1.0), tolerance);
  }
  // Weight 1/2 marks the fin of the other side, which reaches over the silhouette: it counts on its own side alone.
  Texel both = outer(0.5, 6);
  both.inner = inner(0.5, 6).inner;
  EXPECT_NEAR(combine({everywhere(both)}, receiver).one_layer, (1 - dark) * 0.5 + dark * 0.5, tolerance);
  // A texel without a fin counts as 0.
  FinFootprint some = everywhere(outer(0.3, 6));
  some[0] = some[3] = Texel();
  const double has = in_light.weight(1) + in_light.weight(2);
  EXPECT_NEAR(combine({some}, in_light).one_layer, 1 - has * refined(0.3, 6), tolerance);
  // Others by the mean of their weights and depths.
  some[1].outer.s = 0.1f;
  const double mean = (in_light.weight(1) * 0.1 + in_light.weight(2) * 0.3) / has;
  EXPECT_NEAR(combine({some}, in_light).one_layer, 1 - has * refined(mean, 6), tolerance);
}

TEST_P(Illuminance, SecondFinsHideAndLetInByTheAngleToTheFirst) {
  const Combiner combine(runner_);
  for (const double cosine : {-1.0, -0.4, 0.0, 0.2}) {
    SCOPED_TRACE(cosine);
    Texel hides = outer(0.42, 5), lets_in = inner(0.35, 5);
    hides.outer2 = {0.4f, 1.0f / 7, static_cast<float>(cosine)};
    lets_in.inner2 = {0.45f, 1.0f / 7, static_cast<float>(cosine)};
    const Mode varied{.varied = true};
    EXPECT_NEAR(combine({everywhere(hides)}, in_light, varied).one_layer,
                1 - twins::hidden_by_both(refined(0.42, 5), refined(0.4, 7), cosine), tolerance);
    EXPECT_NEAR(combine({everywhere(lets_in)}, in_shadow, varied).one_layer,
                twins::hidden_by_both(refined(0.35, 5), refined(0.45, 7), cosine), tolerance);
    // As published the stronger one counts, and there is no other.
    EXPECT_NEAR(combine({everywhere(hides)}, in_light).one_layer, 1 - refined(0.42, 5), tolerance);
  }
}

TEST_P(Illuminance, WhatPassesASilhouetteReachesNoFartherThanWhatItFallsOn) {
  const Combiner combine(runner_);
  Texel lets_in = inner(0.4, 6);
  lets_in.reach_d = 1.0f / 10;  // falls on something at depth 10; the receiver is at 16
  EXPECT_EQ(combine({everywhere(lets_in)}, in_shadow).one_layer, 0.0);
  EXPECT_NEAR(combine({everywhere(lets_in)}, in_shadow, {.faithful = true}).one_layer, refined(0.4, 6), tolerance);
  lets_in.reach_d = 1.0f / 20;
  EXPECT_NEAR(combine({everywhere(lets_in)}, in_shadow).one_layer, refined(0.4, 6), tolerance);
}

// ---------------------------------------------------------------------------------------------------------------- layers

TEST_P(Illuminance, AsPublishedTheLessOfTwoLayersStands) {
  const Combiner combine(runner_);
  const std::vector<FinFootprint> layers = {everywhere(outer(0.2, 4)), everywhere(outer(0.45, 6, 2.0)), everywhere(Texel()),
                                            everywhere(outer(0.4, 9, 4.0))};
  const Combined combined = combine(layers, in_light, {.faithful = true});
  const double first = refined(0.2, 4), second = refined(0.45, 6), last = refined(0.4, 9);
  ASSERT_GT(second, first);
  EXPECT_NEAR(combined.after[0].lit, 1 - first, tolerance);
  EXPECT_NEAR(combined.after[1].lit, 1 - std::max(first, second), tolerance);
  EXPECT_NEAR(combined.after[2].lit, combined.after[1].lit, tolerance) << "lit here: what was before is kept";
  EXPECT_NEAR(combined.after[3].lit, 1 - std::max({first, second, last}), tolerance);
}

TEST_P(Illuminance, LayersHideByTheAngleBetweenThem) {
  const Combiner combine(runner_);
  const double a = refined(0.42, 4), b = refined(0.4, 6);
  for (const double angle : {0.0, 0.5, 1.2, std::numbers::pi / 2, 2.2, std::numbers::pi}) {
    SCOPED_TRACE(angle);
    const Combined combined = combine({everywhere(outer(0.42, 4)), everywhere(outer(0.4, 6, angle))}, in_light);
    EXPECT_NEAR(combined.after[1].lit, 1 - twins::hidden_by_both(a, b, std::cos(angle)), 1e-5);
  }
  // The direction of what is hidden so far is the mean of both, by how much each hides.
  const double hidden = twins::hidden_by_both(a, b, 0.0), third = refined(0.45, 9);
  const glm::dvec2 mean = (glm::dvec2(1, 0) * a + glm::dvec2(0, 1) * b) / (a + b);
  const Combined three = combine(
      {everywhere(outer(0.42, 4)), everywhere(outer(0.4, 6, std::numbers::pi / 2)), everywhere(outer(0.45, 9, std::numbers::pi))},
      in_light);
  EXPECT_NEAR(three.after[2].lit, 1 - twins::hidden_by_both(hidden, third, glm::dot(mean, glm::dvec2(-1, 0))), 1e-5);
}

TEST_P(Illuminance, ACastersOwnOutlineInAnotherLayerLetsInTheMore) {
  const Combiner combine(runner_);
  const double depth = twins::caster_depth(radius, 6, zfar);
  const double z = 6 + 0.5 * depth;  // within what one caster's outline may be deep
  for (const bool faithful : {true, false}) {
    const Combined combined = combine({everywhere(inner(0.3, 6)), everywhere(inner(0.45, z)), everywhere(inner(0.2, z))},
                                      in_shadow, {.faithful = faithful});
    const double more = std::max(refined(0.3, 6), refined(0.45, z));
    EXPECT_NEAR(combined.after[0].at_hand, refined(0.3, 6), tolerance);
    EXPECT_NEAR(combined.after[0].at_d, 1.0 / 6, tolerance);
    EXPECT_NEAR(combined.after[1].at_hand, more, tolerance);
    EXPECT_NEAR(combined.after[2].at_hand, more, tolerance) << "the less is not taken";
    EXPECT_EQ(combined.after[2].done, 1.0);
  }
}

TEST_P(Illuminance, AnotherCasterBeneathLeavesWhatBothLeave) {
  const Combiner combine(runner_);
  const double z = 6 + 2 * twins::caster_depth(radius, 6, zfar);
  ASSERT_LT(z, 14.0);
  const double first = refined(0.3, 6), second = refined(0.45, z);
  // The first caster is done with as the second comes.
  const Combined published = combine({everywhere(inner(0.3, 6)), everywhere(inner(0.45, z))}, in_shadow, {.faithful = true});
  EXPECT_NEAR(published.after[1].done, first, tolerance);
  EXPECT_NEAR(published.after[1].at_hand, second, tolerance);
  EXPECT_NEAR(published.after[1].at_d, 1 / z, tolerance);
  // Then one without an inner fin here only hides.
  Texel hides = outer(0.35, z + 1, 1.0);
  const Combined third = combine({everywhere(inner(0.3, 6)), everywhere(hides)}, in_shadow, {.faithful = true});
  EXPECT_NEAR(third.after[1].done, 1 - refined(0.35, z + 1), tolerance);
  EXPECT_NEAR(third.after[1].at_hand, first, tolerance);
}

TEST_P(Illuminance, ACastersLightThatFallsOnSomethingBeforeLeavesUmbra) {
  const Combiner combine(runner_);
  Texel lets_in = inner(0.4, 6);
  lets_in.reach_d = 1.0f / 10;
  EXPECT_NEAR(combine({everywhere(lets_in)}, in_shadow).after[0].at_d, -1.0 / 6, tolerance);
  lets_in.reach_d = 1.0f / 20;
  EXPECT_NEAR(combine({everywhere(lets_in)}, in_shadow).after[0].at_d, 1.0 / 6, tolerance);
}

}  // namespace
}  // namespace halfshade
