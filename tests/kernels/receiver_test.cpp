// Receivers against literal light maps: who is lit, and how the neighbours' outputs are filtered.
#include <numbers>
#include <random>

#include "support/kernel_fixture.hpp"

namespace halfshade {
namespace {

/// The kernels that turn receivers into visibility.
enum class Look { all, hard, pcf2, pcf4, pcss, smoothies };

constexpr unsigned map_px = 16;
constexpr float px_per_q = 16.0f;

/// A light at the origin that looks along +z with q in -1/2 .. 1/2, and a caller's G-buffer of positions in light space.
class Visibility : public ShapedKernelTest {
 protected:
  struct Pixel {
    glm::vec4 position;  // w > 0: something is there
    glm::vec4 normal = glm::vec4(0, 0, -1, 1);
  };

  std::vector<float> shadow_map_ = std::vector<float>(map_px * map_px, HS_EMPTY_Z);
  std::vector<float> fin_depth_ = std::vector<float>(map_px * map_px, HS_EMPTY_Z);
  std::vector<float> fin_alpha_ = std::vector<float>(map_px * map_px, 1.0f);
  std::vector<cl_uchar> near_fins_ = std::vector<cl_uchar>(4, 1);
  float radius_px_ = 0.8f, nearest_d_ = 2.0f;  // of receive_pcss: a penumbra of some texels
  std::vector<float> points_ = points_of(32);
  HsView light_ = straight_view(*runner_.device, {map_px, map_px}, px_per_q);

  /// Points of the unit disc: every x, then every y.
  static std::vector<float> points_of(unsigned count) {
    std::vector<float> points(2 * count);
    for (unsigned i = 0; i < count; ++i) {
      const double radius = std::sqrt((i + 0.5) / count), angle = 2.4 * i;
      points[i] = static_cast<float>(radius * std::cos(angle));
      points[count + i] = static_cast<float>(radius * std::sin(angle));
    }
    return points;
  }

  /// At a place of the map in texels (texel centres at halves) and a depth, facing the light.
  static Pixel at(float u, float v, float z) {
    return {glm::vec4((u - map_px / 2) / px_per_q * z, -(v - map_px / 2) / px_per_q * z, z, 1)};
  }

  std::vector<float> see(Look look, const std::vector<Pixel>& pixels, cl_uint falloff = HS_FALLOFF_LINEAR) const {
    std::vector<glm::vec4> positions, normals;
    for (const Pixel& pixel : pixels) {
      positions.push_back(pixel.position);
      normals.push_back(pixel.normal);
    }
    HsReceiverView view{};
    const HsTransform rows = identity_transform();
    view.from_world_x = rows.row_x;
    view.from_world_y = rows.row_y;
    view.from_world_z = rows.row_z;
    view.from_world_w = rows.row_w;
    view.axis_ws = {{0, 0, 1, 1}};
    view.unit = 1.0f;
    view.width_px = static_cast<cl_uint>(pixels.size());
    view.height_px = 1;
    view.has_depth = 0;
    view.tan_half_cone = 0.75f;
    const Buffer<cl_float> out = runner_.filled(2 * pixels.size(), -1.0f), map = runner_.buffer<cl_float>(shadow_map_);
    const Buffer<cl_float4> position = runner_.buffer<cl_float4>(positions), normal = runner_.buffer<cl_float4>(normals);
    const kernels::args::Gbuffer gbuffer{.depth_or_position = position.as<cl_float>(), .normal = normal};
    const kernels::args::Visibility output{.visibility = out, .plane = cl_uint{1}};
    const auto launch = [&](const auto& arguments) { runner_.launcher.launch_pixels({pixels.size(), 1}, arguments); };
    const auto look_up = [&]<class Kernel>(std::type_identity<Kernel>) {
      launch(Kernel{.light = light_, .view = view, .gbuffer = gbuffer, .shadow_map = map, .visibility = output});
    };
    switch (look) {
      case Look::all:
        launch(kernels::ReceiveAll{.light = light_, .view = view, .gbuffer = gbuffer, .visibility = output});
        break;
      case Look::hard:
        look_up(std::type_identity<kernels::ReceiveHard>{});
        break;
      case Look::pcf2:
        look_up(std::type_identity<kernels::ReceivePcf2>{});
        break;
      case Look::pcf4:
        look_up(std::type_identity<kernels::ReceivePcf4>{});
        break;
      case Look::pcss:
        launch(kernels::ReceivePcss{.light = light_,
                                    .view = view,
                                    .gbuffer = gbuffer,
                                    .shadow_map = map,
                                    .shape = fin_shape(radius_px_),
                                    .search_depths = runner_.filled(2, nearest_d_),
                                    .point_count = static_cast<cl_uint>(points_.size() / 2),
                                    .points = runner_.buffer<cl_float>(points_),
                                    .visibility = output});
        break;
      case Look::smoothies:
        launch(kernels::ReceiveSmoothies{.light = light_,
                                         .view = view,
                                         .gbuffer = gbuffer,
                                         .shadow_map = map,
                                         .fin_depth = runner_.buffer<cl_float>(fin_depth_),
                                         .fin_alpha = runner_.buffer<cl_float>(fin_alpha_),
                                         .tile_near_fins = runner_.buffer<cl_uchar>(near_fins_),
                                         .falloff = falloff,
                                         .visibility = output});
        break;
    }
    const std::vector<float> both = runner_.read<float>(out, 2 * pixels.size());
    for (std::size_t i = 0; i < pixels.size(); ++i) EXPECT_EQ(both[i], -1.0f) << "another light's plane was written";
    return {both.begin() + static_cast<std::ptrdiff_t>(pixels.size()), both.end()};
  }

  /// Those that look into a map.
  static constexpr Look looks_[] = {Look::hard, Look::pcf2, Look::pcf4, Look::pcss, Look::smoothies};
};
HS_IN_BOTH_SHAPES(Visibility);

TEST_P(Visibility, BehindTheShadowMapIsDarkBeforeItLit) {
  shadow_map_.assign(shadow_map_.size(), 2.0f);
  for (const Look look : looks_)
    EXPECT_EQ(see(look, {at(8.2f, 7.3f, 4), at(8.2f, 7.3f, 2.1f), at(8.2f, 7.3f, 1.9f), at(3, 4, 0.5f)}),
              (std::vector<float>{0, 0, 1, 1}))
        << static_cast<int>(look);
}

TEST_P(Visibility, WhatTheMapHoldsItselfIsLit) {
  // A tilted plane n.p = c, in the map at texel centres. The automatic bias must neither shadow it nor light what lies behind.
  for (const glm::vec3 tilt :
       {glm::vec3(0, 0, -1), glm::vec3(0.6f, 0, -0.8f), glm::vec3(-0.7f, 0.5f, -0.51f), glm::vec3(0.1f, 0.98f, -0.17f)}) {
    const glm::vec3 n = glm::normalize(tilt);
    const float c = n.z * 4;
    const auto depth_at = [&](float u, float v) {
      return c / glm::dot(n, glm::vec3((u - map_px / 2) / px_per_q, -(v - map_px / 2) / px_per_q, 1));
    };
    std::vector<Pixel> on, behind;
    for (unsigned i = 0; i < map_px * map_px; ++i) {
      const float z = depth_at(i % map_px + 0.5f, i / map_px + 0.5f);
      shadow_map_[i] = z > 0 ? z : HS_EMPTY_Z;
    }
    std::mt19937 random(14);
    std::uniform_real_distribution<float> place(2.5f, 13.5f);
    for (int i = 0; i < 500; ++i) {
      const float u = place(random), v = place(random), z = depth_at(u, v);
      bool seen_around = true;  // the plane, as far as a filter reaches
      for (const glm::vec2& corner : {glm::vec2(-2.5f), glm::vec2(2.5f, -2.5f), glm::vec2(-2.5f, 2.5f), glm::vec2(2.5f)})
        seen_around &= depth_at(u + corner.x, v + corner.y) > 0;
      if (!seen_around) continue;
      on.push_back(at(u, v, z));
      on.back().normal = glm::vec4(n, 1);
      behind.push_back(at(u, v, z * 1.25f));
      behind.back().normal = glm::vec4(n, 1);
    }
    ASSERT_GT(on.size(), 100u);
    for (const Look look : looks_) {
      for (const float v : see(look, on)) EXPECT_NEAR(v, 1.0f, 1e-6f) << static_cast<int>(look) << " " << tilt.x;
      // On the steepest of these planes depth changes by more than the bias follows within the outermost taps of the 4x4 filter.
      for (const float v : see(look, behind)) EXPECT_LT(v, 0.01f) << static_cast<int>(look) << " " << tilt.x;
    }
  }
}

TEST_P(Visibility, WhatNeedsNoLookUpIsDecided) {
  shadow_map_.assign(shadow_map_.size(), 0.5f);  // all else is dark
  const Pixel dark = at(8, 8, 4);
  Pixel nothing = dark, receives_none = dark, away = dark, edge_on = dark, outside_cone = dark, behind_light = dark,
        outside_map = dark;
  nothing.position.w = 0;
  receives_none.normal.w = 0;
  away.normal = {0, 0, 1, 1};
  edge_on.normal = {1, 0, 0, 1};
  outside_cone.position = {4 * 0.76f, 0, 4, 1};
  behind_light.position = {0, 0, -4, 1};
  outside_map.position = {0, 4 * 0.6f, 4, 1};  // in the cone, but no caster reaches there
  Pixel away_outside_cone = outside_cone;
  away_outside_cone.normal = {0, 0, 1, 1};
  for (const Look look : looks_)
    EXPECT_EQ(
        see(look, {dark, nothing, receives_none, away, edge_on, outside_cone, behind_light, outside_map, away_outside_cone}),
        (std::vector<float>{0, 1, 1, 0, 0, 1, 1, 1, 1}))
        << static_cast<int>(look);
  EXPECT_EQ(see(Look::all, {dark, nothing, receives_none, away, edge_on, outside_cone, behind_light}),
            (std::vector<float>{1, 1, 1, 0, 0, 1, 1}));
}

TEST_P(Visibility, NumbersThatAreNoneMakeNoneOfTheirOwn) {
  shadow_map_.assign(shadow_map_.size(), 2.0f);
  const float nan = std::nanf(""), inf = HUGE_VALF;
  std::vector<Pixel> pixels(6, at(8, 8, 4));
  pixels[0].position.x = nan;
  pixels[1].position.z = inf;
  pixels[2].position.w = nan;
  pixels[3].normal = glm::vec4(nan, nan, nan, 1);
  pixels[4].position = {1e30f, 1e30f, 1e30f, 1};
  pixels[5].position = {0, 0, 1e-30f, 1};
  for (const Look look : looks_)
    for (const float v : see(look, pixels)) EXPECT_TRUE(v >= 0.0f && v <= 1.0f) << static_cast<int>(look) << " " << v;
}

TEST_P(Visibility, HardAsksTheTexelThatHoldsTheReceiver) {
  for (unsigned i = 0; i < shadow_map_.size(); ++i) shadow_map_[i] = (i % map_px + i / map_px) % 2 ? 2.0f : HS_EMPTY_Z;
  EXPECT_EQ(see(Look::hard, {at(4.1f, 4.9f, 4), at(5.1f, 4.1f, 4), at(4.9f, 5.1f, 4), at(5.9f, 5.9f, 4), at(0.1f, 0.1f, 4),
                             at(15.9f, 0.1f, 4), at(15.9f, 15.9f, 4)}),
            (std::vector<float>{1, 0, 0, 1, 1, 0, 1}));
}

TEST_P(Visibility, Pcf2WeightsTheFourNearestTexels) {
  for (unsigned i = 0; i < shadow_map_.size(); ++i) shadow_map_[i] = i % map_px < 8 ? 2.0f : HS_EMPTY_Z;  // left half dark
  shadow_map_[3 * map_px + 12] = 2.0f;
  const std::vector<float> v = see(Look::pcf2, {at(7.5f, 6, 4), at(7.75f, 6, 4), at(8.0f, 6, 4), at(8.5f, 6, 4), at(2, 6, 4),
                                                at(12.5f, 3.5f, 4), at(12.75f, 3.75f, 4), at(12.25f, 3.0f, 4)});
  const std::vector<float> expected = {0, 0.25f, 0.5f, 1, 0, 0, 1 - 0.75f * 0.75f, 1 - 0.75f * 0.5f};
  for (std::size_t i = 0; i < v.size(); ++i) EXPECT_NEAR(v[i], expected[i], 1e-5f) << i;
}

TEST_P(Visibility, Pcf4WeightsSixteenTexelsWithTheCubicBSpline) {
  shadow_map_[5 * map_px + 9] = 2.0f;  // one dark texel, centre (9.5, 5.5)
  const auto spline = [](double x) {
    x = std::abs(x);
    return x < 1 ? 2.0 / 3 - x * x + x * x * x / 2 : x < 2 ? (2 - x) * (2 - x) * (2 - x) / 6 : 0.0;
  };
  std::mt19937 random(15);
  std::uniform_real_distribution<float> offset(-2.4f, 2.4f);
  std::vector<Pixel> pixels;
  std::vector<double> expected;
  for (int i = 0; i < 200; ++i) {
    const float du = offset(random), dv = offset(random);
    pixels.push_back(at(9.5f + du, 5.5f + dv, 4));
    expected.push_back(1.0 - spline(du) * spline(dv));
  }
  const std::vector<float> v = see(Look::pcf4, pixels);
  for (std::size_t i = 0; i < v.size(); ++i) EXPECT_NEAR(v[i], expected[i], 1e-5) << i;
}

// Fernando 2005 as it reads: search, mean, filter. A caster is at any of several depths, the receivers' planes lean any way.
TEST_P(Visibility, PcssIsSearchThenMeanThenFilter) {
  std::mt19937 random(17);
  std::uniform_real_distribution<float> place(0.01f, 15.99f), depth(3, 6), one(0, 1), lean(-0.6f, 0.6f);
  for (std::size_t i = 0; i < shadow_map_.size(); ++i) {
    const bool casts = std::hypot(i % map_px - 6.0, i / map_px - 8.0) < 4.0 || one(random) < 0.02f;
    shadow_map_[i] = casts ? 1.0f + one(random) : HS_EMPTY_Z;
  }
  radius_px_ = 6.0f;
  nearest_d_ = 1.0f;
  for (const unsigned count : {16u, 32u}) {
    points_ = points_of(count);
    std::vector<Pixel> pixels;
    std::vector<double> expected;
    for (int i = 0; i < 300; ++i) {
      const float px = place(random), py = place(random), z = depth(random);
      pixels.push_back(at(px, py, z));
      const glm::dvec3 n = glm::normalize(glm::dvec3{lean(random), lean(random), -1}), p(pixels.back().position);
      pixels.back().normal = glm::vec4(n, 1);
      const double u = px - 0.5, v = py - 0.5;  // texel centres at integers
      const double per_px_x = n.x / glm::dot(n, p) / px_per_q, per_px_y = -n.y / glm::dot(n, p) / px_per_q;
      const auto map_at = [&](int x, int y) { return double{shadow_map_[std::clamp(y, 0, 15) * map_px + std::clamp(x, 0, 15)]}; };
      const auto lit_at = [&](int x, int y) {
        const double d = 1 / p.z + per_px_x * (x - u) + per_px_y * (y - v) + 0.25 * (std::abs(per_px_x) + std::abs(per_px_y));
        return map_at(x, y) * std::clamp(d, 0.5 / p.z, 2 / p.z) >= 1;
      };
      const auto each_tap = [&](double width, auto&& look) {
        for (unsigned k = 0; k < count; ++k) {
          const double x = u + width * points_[k], y = v + width * points_[count + k];
          look(x, y, x < -0.5 || x > 15.5 || y < -0.5 || y > 15.5);
        }
      };
      double blockers = 0, sum_d = 0, sum_lit = 0, known = 0;
      bool close = false;  // rounding may decide whether a look-up meets a blocker
      // Returns the greatest 1/z of what stands before the receiver's plane, but not where it hides anything.
      const auto search = [&](double reach) {
        double beside_d = 0;
        for (unsigned k = 0; k < count; ++k) {
          const double tap_u = u + reach * points_[k], tap_v = v + reach * points_[count + k];
          const int x = static_cast<int>(std::lround(tap_u)), y = static_cast<int>(std::lround(tap_v));
          if (tap_u < -0.5 || tap_u > 15.5 || tap_v < -0.5 || tap_v > 15.5 || lit_at(x, y)) continue;
          const double d = 1 / map_at(x, y);
          beside_d = std::max(beside_d, d);
          const double distance =
              std::max(reach * std::hypot(points_[k], points_[count + k]), 0.5 * std::max(std::abs(x - u), std::abs(y - v)));
          close |= std::abs(distance - radius_px_ * (d - 1 / p.z)) < 1e-4;
          if (distance >= radius_px_ * (d - 1 / p.z)) continue;
          ++blockers;
          sum_d += d;
        }
        return beside_d;
      };
      const double reach = radius_px_ * (nearest_d_ - 1 / p.z), beside_d = search(reach);
      if (blockers == 0) {
        const int x = static_cast<int>(std::lround(u)), y = static_cast<int>(std::lround(v));
        const bool dark = !lit_at(x, y);
        if (dark || beside_d > 0) search(radius_px_ * ((dark ? 1 / map_at(x, y) : beside_d) - 1 / p.z));
        if (dark && blockers == 0) {
          blockers = 1;
          sum_d = 1 / map_at(x, y);
        }
      }
      if (blockers == 0) {
        expected.push_back(close ? -1 : 1);
        continue;
      }
      each_tap(radius_px_ * (sum_d / blockers - 1 / p.z), [&](double tap_u, double tap_v, bool outside) {
        const int x = std::clamp(static_cast<int>(std::floor(tap_u)), 0, 14);
        const int y = std::clamp(static_cast<int>(std::floor(tap_v)), 0, 14);
        const double s = std::clamp(tap_u - x, 0.0, 1.0), t = std::clamp(tap_v - y, 0.0, 1.0);
        // What casts beyond the cone is not in the map.
        const double beyond = std::max(std::abs(tap_u - 7.5), std::abs(tap_v - 7.5));
        if (outside && beyond > 0.75 * px_per_q) return;
        ++known;
        sum_lit += outside ? 1
                           : (1 - t) * ((1 - s) * lit_at(x, y) + s * lit_at(x + 1, y)) +
                                 t * ((1 - s) * lit_at(x, y + 1) + s * lit_at(x + 1, y + 1));
      });
      expected.push_back(close ? -1.0 : sum_lit / known);
    }
    const std::vector<float> seen = see(Look::pcss, pixels);
    std::size_t penumbra = 0, lit = 0;
    for (std::size_t i = 0; i < seen.size(); ++i) {
      if (expected[i] < 0) continue;
      EXPECT_NEAR(seen[i], expected[i], 1e-4) << count << " taps, pixel " << i;
      penumbra += expected[i] > 0.05 && expected[i] < 0.95;
      lit += expected[i] == 1;
    }
    EXPECT_GT(penumbra, 50u);
    EXPECT_GT(lit, 20u);
  }
}

TEST_P(Visibility, PcssWidensWithTheDistanceFromTheBlocker) {
  // A half-plane of casters at z = 2 and a receiver 2 texels into the light: w = 8 (1/2 - 1/z) texels.
  for (unsigned i = 0; i < shadow_map_.size(); ++i) shadow_map_[i] = i % map_px < 8 ? 2.0f : HS_EMPTY_Z;
  radius_px_ = 8.0f;
  nearest_d_ = 0.5f;
  const std::vector<float> seen = see(Look::pcss, {at(10, 8, 2.5f), at(10, 8, 4), at(10, 8, 8), at(10, 8, 100)});
  EXPECT_EQ(seen[0], 1.0f);  // w = 0.8
  EXPECT_EQ(seen[1], 1.0f);  // w = 2
  EXPECT_LT(seen[2], 0.99f);
  EXPECT_LT(seen[3], seen[2] - 0.05f);
  radius_px_ = 0.0f;
  EXPECT_EQ(see(Look::pcss, {at(10, 8, 100), at(6, 8, 100)}), (std::vector<float>{1, 0}));
}

TEST_P(Visibility, SmoothieAlphaGoesThroughTheFalloff) {
  fin_depth_.assign(fin_depth_.size(), 2.0f);
  for (const float alpha : {0.0f, 0.125f, 0.3f, 0.5f, 0.8f, 0.999f}) {
    fin_alpha_.assign(fin_alpha_.size(), alpha);
    const std::vector<Pixel> pixel = {at(8.2f, 7.4f, 4)};
    const double x = alpha, u = 2 * x - 1, pi = std::numbers::pi;
    EXPECT_NEAR(see(Look::smoothies, pixel, HS_FALLOFF_LINEAR)[0], x, 1e-6);
    EXPECT_NEAR(see(Look::smoothies, pixel, HS_FALLOFF_BERNSTEIN)[0], 3 * x * x - 2 * x * x * x, 1e-6);
    EXPECT_NEAR(see(Look::smoothies, pixel, HS_FALLOFF_SINE)[0], 0.5 - 0.5 * std::cos(pi * x), 1e-6);
    EXPECT_NEAR(see(Look::smoothies, pixel, HS_FALLOFF_DISC)[0], 0.5 + (std::asin(u) + u * std::sqrt(1 - u * u)) / pi, 1e-6);
  }
}

TEST_P(Visibility, SmoothiesShadowOnlyWhatLiesBehindThem) {
  fin_depth_.assign(fin_depth_.size(), 2.0f);
  fin_alpha_.assign(fin_alpha_.size(), 0.25f);
  EXPECT_EQ(see(Look::smoothies, {at(8, 8, 4), at(8, 8, 1.5f)}), (std::vector<float>{0.25f, 1.0f}));
  near_fins_.assign(near_fins_.size(), 0);  // a tile that no fin can touch is not looked up
  EXPECT_EQ(see(Look::smoothies, {at(8, 8, 4)}), (std::vector<float>{1.0f}));
}

TEST_P(Visibility, WhereNoFinsAreTheFinBuffersAreNotBelieved) {
  // Tiles that hold no fins keep what an earlier light left there. Neighbouring pixels, some of whose tiles do hold fins.
  const unsigned size = 64, tile = runner_.device->tile_px;
  light_ = straight_view(*runner_.device, {size, size}, px_per_q);
  shadow_map_.assign(size * size, HS_EMPTY_Z);
  fin_depth_.assign(size * size, 2.0f);
  fin_alpha_.assign(size * size, 0.25f);
  near_fins_.assign(std::size_t{light_.tiles_x} * light_.tiles_y, 0);
  for (std::size_t t = 0; t < near_fins_.size(); ++t) near_fins_[t] = t % light_.tiles_x * tile < size / 2;  // the left half
  std::vector<Pixel> pixels;
  std::vector<float> expected;
  for (int i = 0; i < 37; ++i) {
    const float u = 26.25f + static_cast<float>(i * 7 % 12), from_middle = u - size / 2;
    pixels.push_back(at(map_px / 2 + from_middle, 8, 4));
    expected.push_back(std::floor(u - 0.5f) < size / 2 ? 0.25f : 1.0f);
  }
  EXPECT_EQ(see(Look::smoothies, pixels), expected);
}

TEST_P(Visibility, SmoothiesFilterTheComparisonsOfFourTexels) {
  const unsigned i = 5 * map_px + 9;                             // centres (9.5, 5.5), (10.5, 5.5), (9.5, 6.5), (10.5, 6.5)
  shadow_map_[i] = 2.0f;                                         // in the shadow: 0
  fin_depth_[i + 1] = 2.0f, fin_alpha_[i + 1] = 0.5f;            // behind the smoothie: alpha'
  fin_depth_[i + map_px] = 6.0f, fin_alpha_[i + map_px] = 0.5f;  // before it: 1
  const float expected = 0.6f * (0.3f * 0.0f + 0.7f * 0.5f) + 0.4f * (0.3f * 1 + 0.7f * 1);
  EXPECT_NEAR(see(Look::smoothies, {at(9.5f + 0.7f, 5.5f + 0.4f, 4)})[0], expected, 1e-5f);
}

TEST_P(Visibility, EachPixelStandsAlone) {
  // Whatever its neighbours in the vector are, and however many.
  std::mt19937 random(16);
  std::uniform_real_distribution<float> place(-1, 17), depth(1, 6), one(0, 1);
  for (std::size_t i = 0; i < shadow_map_.size(); ++i) {
    shadow_map_[i] = one(random) < 0.3f ? depth(random) : HS_EMPTY_Z;
    if (one(random) < 0.4f) fin_depth_[i] = depth(random), fin_alpha_[i] = one(random);
  }
  std::vector<Pixel> pixels;
  for (int i = 0; i < 37; ++i) {
    const float px = place(random), py = place(random);
    pixels.push_back(at(px, py, depth(random)));
    if (i % 7 == 3) pixels.back().normal.z = 1;
    if (i % 9 == 4) pixels.back().position.w = 0;
  }
  for (const Look look : looks_) {
    const std::vector<float> together = see(look, pixels);
    for (std::size_t i = 0; i < pixels.size(); ++i)
      EXPECT_EQ(see(look, {pixels[i]})[0], together[i]) << static_cast<int>(look) << " " << i;
  }
}

}  // namespace
}  // namespace halfshade
