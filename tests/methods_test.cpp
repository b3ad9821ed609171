// The penumbra methods against what is known exactly: a straight edge across a disc, a light without extent, one caster beneath
// another, a light wider than its caster.
#include <cmath>
#include <numbers>

#include "kernel_fixture.hpp"
#include "scenes.hpp"
#include "temp_folder.hpp"

namespace halfshade {
namespace {

namespace fs = std::filesystem;

class Methods : public testing::Test {
 protected:
  static Frame draw(const Scene& scene, const Settings& settings) {
    Renderer renderer(test_device());
    renderer.set_scene(scene);
    renderer.render(settings);
    return renderer.read_frame();
  }

  static Scene data_scene(const char* name, unsigned resolution_px) {
    Scene scene = load_scene(fs::path(HALFSHADE_DATA_DIR) / "scenes" / (std::string(name) + ".json"));
    scene.camera.resolution = glm::uvec2(resolution_px);
    return scene;
  }

  Watchdog watchdog_;
};

constexpr double light_y = 6.0, plate_y = 2.0, radius = 0.8;

/// A plate over x < 0 with its edge below the light, the floor beneath, both parallel to the light's plane; the camera between
/// them. The penumbra is over 100 texels wide.
Scene straight_edge() {
  Scene scene;
  scene.name = "straight-edge";
  scene.meshes = {placed("floor", ground_mesh(), {0, 0, 0}, glm::dvec3(40)),
                  placed("plate", ground_mesh(), {-10, plate_y, 0}, glm::dvec3(20)),
                  placed("basement", ground_mesh(), {0, -4, 0}, glm::dvec3(60))};
  scene.camera = {.position = {0, 1.5, 0}, .target = {0, 0, 0}, .up = {0, 0, 1}, .yfov_deg = 20, .resolution = {256, 64}};
  scene.lights = {{.name = "key", .position = {0, light_y, 0}, .target = {0, 0, 0}, .up = {}, .radius = radius, .cone_deg = 60}};
  return scene;
}

/// u = delta / w for a floor point, with delta = x / Lr and w = R (1/Lb - 1/Lr).
double u_of(const glm::vec4& position_ws) {
  return position_ws.x / light_y / (radius * (1 / (light_y - plate_y) - 1 / light_y));
}

/// The part of a disc above a line at u radii below its centre.
double disc_above(double u) {
  u = std::clamp(u, -1.0, 1.0);
  return 0.5 + (std::asin(u) + u * std::sqrt(1 - u * u)) / std::numbers::pi;
}

TEST_F(Methods, FinsFollowTheDiscAcrossAStraightEdge) {
  for (const Method method : {Method::fins, Method::layered_fins}) {
    SCOPED_TRACE(name_of(method));
    const Frame frame = draw(straight_edge(), {.method = method, .falloff = Falloff::disc});
    double worst = 0.0, low = 1.0, high = 0.0;
    for (std::size_t i = 0; i < frame.position_ws.size(); ++i) {
      const double exact = disc_above(u_of(frame.position_ws[i]));
      worst = std::max(worst, std::abs(frame.visibility[0][i] - exact));
      low = std::min(low, exact);
      high = std::max(high, exact);
    }
    EXPECT_LE(worst, 0.02);
    EXPECT_EQ(low, 0.0);
    EXPECT_EQ(high, 1.0);
  }
}

// One caster at one depth is what PCSS assumes: the filter's disc is then the light's, and the taps all that is between.
TEST_F(Methods, PcssFollowsTheDiscAcrossAStraightEdge) {
  double previous = 1.0;
  for (const unsigned taps : {16u, 32u}) {
    const Frame frame = draw(straight_edge(), {.method = Method::pcss, .pcss_taps = taps});
    double squares = 0.0, sum = 0.0, worst = 0.0;
    std::size_t count = 0;
    for (std::size_t i = 0; i < frame.position_ws.size(); ++i) {
      const double u = u_of(frame.position_ws[i]);
      if (std::abs(u) > 1.0) {
        // Beyond the penumbra by more than a texel all is decided.
        if (std::abs(u) > 1.02) {
          ASSERT_EQ(frame.visibility[0][i], u > 0.0 ? 1.0f : 0.0f) << u;
        }
        continue;
      }
      const double exact = 0.5 + (std::asin(u) + u * std::sqrt(1 - u * u)) / std::numbers::pi;
      const double error = frame.visibility[0][i] - exact;
      squares += error * error;
      sum += error;
      worst = std::max(worst, std::abs(error));
      ++count;
    }
    ASSERT_GT(count, 5000u);
    const double rmse = std::sqrt(squares / static_cast<double>(count));
    EXPECT_LE(worst, 2.5 / taps) << taps;
    EXPECT_LE(rmse, 1.0 / taps) << taps;
    EXPECT_LE(std::abs(sum) / static_cast<double>(count), 0.5 / taps) << taps;
    EXPECT_LT(rmse, previous);
    previous = rmse;
  }
}

TEST_F(Methods, PcssSearchesNoFartherThanItsCastersAsk) {
  // A floor that reaches behind the light moves the map's near plane to the light, not the search for blockers with it.
  Scene small = straight_edge(), large = straight_edge();
  for (Scene* scene : {&small, &large}) {
    scene->meshes.pop_back();
    scene->lights[0].target = {1, 0, 0};
    scene->lights[0].radius = 0.2;
  }
  large.meshes[0].scale = glm::dvec3(1000);
  const Frame a = draw(small, {.method = Method::pcss}), b = draw(large, {.method = Method::pcss});
  std::size_t penumbra = 0;
  for (std::size_t i = 0; i < a.position_ws.size(); ++i) {
    ASSERT_NEAR(a.visibility[0][i], b.visibility[0][i], 0.05) << i;
    penumbra += a.visibility[0][i] > 0.05f && a.visibility[0][i] < 0.95f;
  }
  EXPECT_GT(penumbra, 500u);
}

TEST_F(Methods, LayersChangeNothingWhereCastersDoNotOverlap) {
  const Frame one = draw(straight_edge(), {.method = Method::fins}),
              many = draw(straight_edge(), {.method = Method::layered_fins, .layers = 16});
  for (std::size_t i = 0; i < one.visibility[0].size(); ++i) ASSERT_NEAR(one.visibility[0][i], many.visibility[0][i], 1e-3) << i;
  // Left to the scene, one layer is enough for one plate, and is drawn as one. (Without a basement the floor casts nothing.)
  Scene plate = straight_edge();
  plate.meshes.pop_back();
  EXPECT_EQ(draw(plate, {.method = Method::layered_fins}).visibility[0], draw(plate, {.method = Method::fins}).visibility[0]);
}

// Cai et al. 2006 §7.2: what two casters hide of opposite sides of the light adds up.
TEST_F(Methods, AGapBetweenTwoCastersShowsWhatBothLeave) {
  const double half_gap = 0.1;
  Scene scene = straight_edge();
  scene.meshes[1] = placed("left", ground_mesh(), {-10 - half_gap, plate_y, 0}, glm::dvec3(20));
  scene.meshes.push_back(placed("right", ground_mesh(), {10 + half_gap, plate_y, 0}, glm::dvec3(20)));
  const double w = radius * (1 / (light_y - plate_y) - 1 / light_y), edge = half_gap / (light_y - plate_y);
  const auto worst = [&](const Settings& settings) {
    const Frame frame = draw(scene, settings);
    double most = 0.0;
    for (std::size_t i = 0; i < frame.position_ws.size(); ++i) {
      const double q = frame.position_ws[i].x / light_y;
      const double exact = std::max(0.0, disc_above((edge + q) / w) + disc_above((edge - q) / w) - 1.0);
      most = std::max(most, std::abs(frame.visibility[0][i] - exact));
    }
    return most;
  };
  // What is left: on texels of the one plate the other's fins, which are no deeper, are not kept.
  for (const Method method : {Method::fins, Method::layered_fins}) {
    EXPECT_LE(worst({.method = method}), 0.07) << name_of(method);
    EXPECT_GE(worst({.method = method, .falloff = Falloff::disc, .faithful = true}), 0.2) << name_of(method);
  }
  EXPECT_LE(worst({.method = Method::layered_fins, .layers = 16}), 0.07);
}

TEST_F(Methods, WhatLayersHideOfOppositeSidesAddsUp) {
  // Two plates, one higher, whose edges lie in one plane with the light's centre: next to nothing passes.
  const double high_y = 3.2, small_radius = 0.25;
  Scene scene = straight_edge();
  scene.lights[0].radius = small_radius;
  scene.meshes.push_back(placed("right", ground_mesh(), {10, high_y, 0}, glm::dvec3(20)));
  const double low_w = small_radius * (1 / (light_y - plate_y) - 1 / light_y),
               high_w = small_radius * (1 / (light_y - high_y) - 1 / light_y);
  for (const unsigned layers : {0u, 16u}) {
    Settings settings{.method = Method::layered_fins};
    if (layers > 0) settings.layers = layers;
    const Frame frame = draw(scene, settings);
    double worst = 0.0;
    for (std::size_t i = 0; i < frame.position_ws.size(); ++i) {
      const double q = frame.position_ws[i].x / light_y;
      const double exact = std::max(0.0, disc_above(q / low_w) + disc_above(-q / high_w) - 1.0);
      worst = std::max(worst, std::abs(frame.visibility[0][i] - exact));
    }
    EXPECT_LE(worst, 0.3) << layers;  // where the low plate is taken to stand in the way of all light
  }
}

TEST_F(Methods, AReceiverDoesNotSeeTheLightBelowItsOwnPlane) {
  // A plane that rises at 84 degrees to the light's, through the origin.
  const double rise = 84.0 * std::numbers::pi / 180.0;
  Scene scene;
  scene.name = "steep";
  scene.meshes = {placed("plane", ground_mesh(), {0, 0, 0}, glm::dvec3(4), {0, 0, -84}),
                  placed("box", box_mesh(), {2, 2, 0}, glm::dvec3(0.5))};
  scene.camera = {.position = {5, 0, 0}, .target = {0, 0, 0}, .yfov_deg = 20, .resolution = {48, 48}};
  scene.lights = {{.name = "key", .position = {0, light_y, 0}, .target = {0, 0, 0}, .up = {}, .radius = radius, .cone_deg = 80}};
  const double exact = disc_above(light_y * std::cos(rise) / (radius * std::sin(rise)));
  for (const Method method : {Method::fins, Method::layered_fins}) {
    const Frame frame = draw(scene, {.method = method});
    const Frame faithful = draw(scene, {.method = method, .faithful = true});
    for (std::size_t i = 0; i < frame.position_ws.size(); ++i) {
      ASSERT_EQ(frame.position_ws[i].w, 1.0f);
      ASSERT_NEAR(frame.visibility[0][i], exact, 0.005) << name_of(method) << " " << i;
      ASSERT_EQ(faithful.visibility[0][i], 1.0f) << name_of(method) << " " << i;
    }
  }
}

TEST_F(Methods, OuterPenumbraRunsFromTheHardShadowToFullLight) {
  const double texel_u =
      2.0 * std::tan(30.0 * std::numbers::pi / 180.0) / 1024 * 1.2 / (radius * (1 / (light_y - plate_y) - 1 / light_y));
  for (const Method method : {Method::smoothies, Method::penumbra_maps}) {
    SCOPED_TRACE(name_of(method));
    const Frame frame = draw(straight_edge(), {.method = method});
    for (std::size_t i = 0; i < frame.position_ws.size(); ++i) {
      const double u = u_of(frame.position_ws[i]);
      const float seen = frame.visibility[0][i];
      if (u < -texel_u) {
        ASSERT_EQ(seen, 0.0f) << u;
      }
      if (u > 1.0 + texel_u) {
        ASSERT_EQ(seen, 1.0f) << u;
      }
      if (u > 0.1 && u < 0.9) {
        ASSERT_TRUE(seen > 0.0f && seen < 1.0f) << u;
      }
    }
  }
}

// Wyman & Hansen 2003 Eq. 1 along the same edge, with 1/Z_F = 1/Zv - delta/R.
TEST_F(Methods, PenumbraMapsHoldWymanAndHansensIntensity) {
  const Frame frame = draw(straight_edge(), {.method = Method::penumbra_maps, .falloff = Falloff::linear});
  const double z_v = light_y - plate_y, z_p = light_y;
  for (std::size_t i = 0; i < frame.position_ws.size(); ++i) {
    const double delta = frame.position_ws[i].x / light_y, u = u_of(frame.position_ws[i]);
    if (u < 0.05 || u > 0.95) continue;
    const double z_f = 1.0 / (1.0 / z_v - delta / radius);
    ASSERT_NEAR(frame.visibility[0][i], (z_f - z_v) / (z_p - z_v), 0.01) << u;
  }
}

TEST_F(Methods, WithoutRadiusEveryMethodIsHard) {
  Scene scene = box_over_floor();
  scene.lights[0].radius = 0.0;
  const Frame hard = draw(scene, {.method = Method::hard});
  for (const MethodInfo& info : methods()) {
    if (info.method == Method::pcf) continue;  // filters whatever the light
    EXPECT_EQ(draw(scene, {.method = info.method}).visibility[0], hard.visibility[0]) << info.name;
  }
}

TEST_F(Methods, EveryMethodTendsToHardShadows) {
  Scene scene = box_over_floor();
  const Frame hard = draw(scene, {.method = Method::hard});
  for (const MethodInfo& info : methods()) {
    double previous = 1e9;
    for (const double light_radius : {0.4, 0.1, 0.01}) {
      scene.lights[0].radius = light_radius;
      const Frame frame = draw(scene, {.method = info.method});
      double difference = 0.0;
      for (std::size_t i = 0; i < hard.visibility[0].size(); ++i)
        difference += std::abs(frame.visibility[0][i] - hard.visibility[0][i]);
      EXPECT_LE(difference, previous + 1e-3) << info.name << " " << light_radius;
      previous = difference;
    }
    EXPECT_LE(previous / static_cast<double>(hard.visibility[0].size()), 0.01) << info.name;
  }
}

// Cai et al. 2006 Fig. 7: with one layer the torus's fins brighten the ground, which the raised plane shades wholly.
TEST_F(Methods, LayersKeepACastersFinsFromWhatAnotherShades) {
  const Scene scene = data_scene("torus", 256);
  const glm::dvec3 light = scene.lights[0].position;
  const auto leaks = [&](const Settings& settings) {
    const Frame frame = draw(scene, settings);
    std::size_t count = 0;
    for (std::size_t i = 0; i < frame.position_ws.size(); ++i) {
      const glm::dvec3 p(frame.position_ws[i]);
      if (frame.position_ws[i].w == 0.0f || p.y > 0.01) continue;
      // Through the raised plane's inner part: 2.3 by 1.7 half-extents at y = 1.8, more than the radius within.
      const glm::dvec3 q = p + (light - p) * (1.8 - p.y) / (light.y - p.y);
      if (std::abs(q.x) < 2.3 - 0.4 && std::abs(q.z) < 1.7 - 0.4 && frame.visibility[0][i] > 0.02f) ++count;
    }
    return count;
  };
  EXPECT_GT(leaks({.method = Method::fins, .faithful = true}), 200u);
  EXPECT_LE(leaks({.method = Method::fins}), 50u);  // these know that what passes by the torus falls on the plane
  EXPECT_EQ(leaks({.method = Method::layered_fins, .layers = 16}), 0u);
  EXPECT_EQ(leaks({.method = Method::layered_fins}), 0u);
}

// Where the outlines of two casters cross, one beneath the other: a fin knows its own caster's depth at each point of a long
// edge, is nothing to receivers before it, and does not reach over its silhouette beneath another caster.
TEST_F(Methods, LayersMeetWhereOutlinesCross) {
  const Scene scene = data_scene("overlap", 256);
  const Frame exact = draw(scene, {.method = Method::exact}), frame = draw(scene, {.method = Method::layered_fins});
  std::size_t wrong = 0;
  for (std::size_t i = 0; i < frame.position_ws.size(); ++i)
    wrong += std::abs(frame.visibility[0][i] - exact.visibility[0][i]) > 0.2f;
  EXPECT_LE(wrong, 12u);
}

std::size_t umbra_px(const Frame& frame) {
  std::size_t count = 0;
  for (std::size_t i = 0; i < frame.position_ws.size(); ++i)
    count += frame.position_ws[i].w > 0.0f && frame.position_ws[i].y < 0.001f && frame.visibility[0][i] < 0.01f;
  return count;
}

TEST_F(Methods, TheUmbraOfTwoSidedPenumbraeShrinksAsTheLightGrows) {
  for (const Method method : {Method::pcss, Method::fins, Method::layered_fins}) {
    std::vector<std::size_t> umbra;
    for (const char* name : {"cylinder", "cylinder-medium-light", "cylinder-large-light"})
      umbra.push_back(umbra_px(draw(data_scene(name, 256), {.method = method})));
    EXPECT_GT(umbra[0], umbra[1] * 1.1) << name_of(method);
    EXPECT_GT(umbra[1], umbra[2] * 1.3) << name_of(method);
    // Under a light wider than its caster there is none.
    EXPECT_EQ(umbra_px(draw(data_scene("large-light", 256), {.method = method})), 0u) << name_of(method);
  }
  // As published: outer penumbrae leave the hard shadow as it is.
  for (const Method method : {Method::smoothies, Method::penumbra_maps})
    EXPECT_GT(umbra_px(draw(data_scene("large-light", 256), {.method = method})), 100u) << name_of(method);
}

TEST_F(Methods, OneLightSampleIsHardAndManyApproachTheDisc) {
  EXPECT_EQ(draw(box_over_floor(), {.method = Method::light_samples, .samples = 1}).visibility[0],
            draw(box_over_floor(), {.method = Method::hard}).visibility[0]);
  const Frame frame = draw(straight_edge(), {.method = Method::light_samples, .samples = 1024});
  double squares = 0.0;
  for (std::size_t i = 0; i < frame.position_ws.size(); ++i) {
    const double u = u_of(frame.position_ws[i]), error = frame.visibility[0][i] - disc_above(u);
    ASSERT_NEAR(error, 0.0, 0.02) << u;
    squares += error * error;
  }
  EXPECT_LE(std::sqrt(squares / static_cast<double>(frame.position_ws.size())), 0.01);
}

TEST_F(Methods, LayersAndSamplesOutOfRangeAreRefused) {
  Renderer renderer(test_device());
  renderer.set_scene(box_over_floor());
  expect_error<InputError>([&] { renderer.render({.method = Method::layered_fins, .layers = 1025}); }, {"1025", "1024"});
  expect_error<InputError>([&] { renderer.render({.method = Method::layered_fins, .layers = 0}); }, {"0 layers", "1024"});
  expect_error<InputError>([&] { renderer.render({.method = Method::light_samples, .samples = 0}); }, {"samples", "at least 1"});
}

TEST_F(Methods, AnyNumberOfLayersDraws) {
  const Scene scene = box_over_floor();
  const Frame one = draw(scene, {.method = Method::fins});
  for (const unsigned layers : {1u, 2u, 33u, 1024u}) {
    const Frame frame = draw(scene, {.method = Method::layered_fins, .layers = layers});
    double difference = 0.0;
    for (std::size_t i = 0; i < frame.visibility[0].size(); ++i) {
      ASSERT_TRUE(frame.visibility[0][i] >= 0.0f && frame.visibility[0][i] <= 1.0f);
      difference += std::abs(frame.visibility[0][i] - one.visibility[0][i]);
    }
    EXPECT_LE(difference / static_cast<double>(frame.visibility[0].size()), 0.005) << layers;
  }
}

}  // namespace
}  // namespace halfshade
