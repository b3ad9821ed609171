// fins and layered-fins against closed forms: a straight edge across a disc, gaps between casters, layers of them.
#include <cmath>
#include <numbers>

#include "support/draw.hpp"
#include "support/straight_edge.hpp"

namespace halfshade {
namespace {

using namespace straight_edge;
using ShadowFins = KernelTest;

Scene data_scene(const char* name, unsigned resolution_px) {
  Scene scene = load_scene(std::filesystem::path(HALFSHADE_DATA_DIR) / "scenes" / (std::string(name) + ".json"));
  scene.camera.resolution = glm::uvec2(resolution_px);
  return scene;
}

TEST_F(ShadowFins, FollowTheDiscAcrossAStraightEdge) {
  for (const Method method : {Method::fins, Method::layered_fins}) {
    SCOPED_TRACE(name_of(method));
    const Frame frame = draw_frame(runner_.device, straight_edge::scene(), {.method = method, .falloff = Falloff::disc});
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

TEST_F(ShadowFins, LayersChangeNothingWhereCastersDoNotOverlap) {
  const Frame one = draw_frame(runner_.device, straight_edge::scene(), {.method = Method::fins}),
              many = draw_frame(runner_.device, straight_edge::scene(), {.method = Method::layered_fins, .layers = 16});
  for (std::size_t i = 0; i < one.visibility[0].size(); ++i) ASSERT_NEAR(one.visibility[0][i], many.visibility[0][i], 1e-3) << i;
  // Left to the scene, one layer is enough for one plate, and is drawn as one. (Without a basement the floor casts nothing.)
  Scene plate = straight_edge::scene();
  plate.meshes.pop_back();
  EXPECT_EQ(draw_frame(runner_.device, plate, {.method = Method::layered_fins}).visibility[0],
            draw_frame(runner_.device, plate, {.method = Method::fins}).visibility[0]);
}

// Cai et al. 2006 §7.2: what two casters hide of opposite sides of the light adds up.
TEST_F(ShadowFins, AGapBetweenTwoCastersShowsWhatBothLeave) {
  const double half_gap = 0.1;
  Scene scene = straight_edge::scene();
  scene.meshes[1] = placed("left", ground_mesh(), {-10 - half_gap, plate_y, 0}, glm::dvec3(20));
  scene.meshes.push_back(placed("right", ground_mesh(), {10 + half_gap, plate_y, 0}, glm::dvec3(20)));
  const double w = half_width(), edge = half_gap / (light_y - plate_y);
  const auto worst = [&](const Settings& settings) {
    const Frame frame = draw_frame(runner_.device, scene, settings);
    double max_error = 0.0;
    for (std::size_t i = 0; i < frame.position_ws.size(); ++i) {
      const double q = frame.position_ws[i].x / light_y;
      const double exact = std::max(0.0, disc_above((edge + q) / w) + disc_above((edge - q) / w) - 1.0);
      max_error = std::max(max_error, std::abs(frame.visibility[0][i] - exact));
    }
    return max_error;
  };
  // What is left: on texels of the one plate the other's fins, which are no deeper, are not kept.
  for (const Method method : {Method::fins, Method::layered_fins}) {
    EXPECT_LE(worst({.method = method}), 0.07) << name_of(method);
    EXPECT_GE(worst({.method = method, .falloff = Falloff::disc, .faithful = true}), 0.2) << name_of(method);
  }
  EXPECT_LE(worst({.method = Method::layered_fins, .layers = 16}), 0.07);
}

TEST_F(ShadowFins, WhatLayersHideOfOppositeSidesAddsUp) {
  // Two plates, one higher, whose edges lie in one plane with the light's centre: next to nothing passes.
  const double high_y = 3.2, small_radius = 0.25;
  Scene scene = straight_edge::scene();
  scene.lights[0].radius = small_radius;
  scene.meshes.push_back(placed("right", ground_mesh(), {10, high_y, 0}, glm::dvec3(20)));
  const double low_w = half_width(plate_y, small_radius), high_w = half_width(high_y, small_radius);
  for (const unsigned layers : {0u, 16u}) {
    Settings settings{.method = Method::layered_fins};
    if (layers > 0) settings.layers = layers;
    const Frame frame = draw_frame(runner_.device, scene, settings);
    double worst = 0.0;
    for (std::size_t i = 0; i < frame.position_ws.size(); ++i) {
      const double q = frame.position_ws[i].x / light_y;
      const double exact = std::max(0.0, disc_above(q / low_w) + disc_above(-q / high_w) - 1.0);
      worst = std::max(worst, std::abs(frame.visibility[0][i] - exact));
    }
    EXPECT_LE(worst, 0.3) << layers;  // where the low plate is taken to hide all light
  }
}

TEST_F(ShadowFins, AReceiverDoesNotSeeTheLightBelowItsOwnPlane) {
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
    const Frame frame = draw_frame(runner_.device, scene, {.method = method});
    const Frame faithful = draw_frame(runner_.device, scene, {.method = method, .faithful = true});
    for (std::size_t i = 0; i < frame.position_ws.size(); ++i) {
      ASSERT_EQ(frame.position_ws[i].w, 1.0f);
      ASSERT_NEAR(frame.visibility[0][i], exact, 0.005) << name_of(method) << " " << i;
      ASSERT_EQ(faithful.visibility[0][i], 1.0f) << name_of(method) << " " << i;
    }
  }
}

// Cai et al. 2006 Fig. 7: with one layer the torus's fins brighten the ground, which the raised plane shades wholly.
TEST_F(ShadowFins, LayersKeepACastersFinsFromWhatAnotherShades) {
  const Scene scene = data_scene("torus", 256);
  const glm::dvec3 light = scene.lights[0].position;
  const auto leaks = [&](const Settings& settings) {
    const Frame frame = draw_frame(runner_.device, scene, settings);
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
TEST_F(ShadowFins, LayersMeetWhereOutlinesCross) {
  const Scene scene = data_scene("overlap", 256);
  const Frame exact = draw_frame(runner_.device, scene, {.method = Method::exact}),
              frame = draw_frame(runner_.device, scene, {.method = Method::layered_fins});
  std::size_t wrong = 0;
  for (std::size_t i = 0; i < frame.position_ws.size(); ++i)
    wrong += std::abs(frame.visibility[0][i] - exact.visibility[0][i]) > 0.2f;
  EXPECT_LE(wrong, 12u);
}

TEST_F(ShadowFins, AnyNumberOfLayersDraws) {
  const Scene scene = box_over_floor();
  const Frame one = draw_frame(runner_.device, scene, {.method = Method::fins});
  for (const unsigned layers : {1u, 2u, 33u, 1024u}) {
    const Frame frame = draw_frame(runner_.device, scene, {.method = Method::layered_fins, .layers = layers});
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
