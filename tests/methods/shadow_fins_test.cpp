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

// ---- all methods with fins --------------------------------------------------------------------------------------------------

constexpr Method fin_methods[] = {Method::smoothies, Method::penumbra_maps, Method::fins, Method::layered_fins};

/// The light that a wire of this width takes from the floor, in pixels; and the least visibility.
std::pair<double, float> taken_by_wire(const KernelRunner& runner, Method method, double width) {
  Scene scene = box_over_floor({128, 128});
  scene.meshes[1] = placed("wire", box_mesh(), {0, 1.2, 0}, {width, width, 3}, {0, 31, 0});
  const Frame frame = draw_frame(runner.device, scene, {.method = method});
  double taken = 0.0;
  float least = 1.0f;
  for (std::size_t i = 0; i < frame.visibility[0].size(); ++i) {
    if (frame.position_ws[i].w == 0.0f || frame.position_ws[i].y > 0.01f) continue;
    taken += 1.0 - frame.visibility[0][i];
    least = std::min(least, frame.visibility[0][i]);
  }
  return {taken, least};
}

TEST_F(ShadowFins, ACasterWithoutWidthCastsNothing) {
  for (const Method method : fin_methods)
    for (const double width : {1e-4, 1e-6, 1e-9}) {
      const auto [taken, least] = taken_by_wire(runner_, method, width);
      EXPECT_LE(taken, 3.0) << name_of(method) << " " << width;
      EXPECT_GE(least, width < 1e-5 ? 0.98f : 0.0f) << name_of(method) << " " << width;
    }
}

TEST_F(ShadowFins, DarknessFallsWithACastersWidth) {
  for (const Method method : fin_methods) {
    double wider = 1e300;
    for (const double width : {0.4, 0.2, 0.1, 0.05, 0.025, 0.0125, 0.006}) {
      const double taken = taken_by_wire(runner_, method, width).first;
      EXPECT_LT(taken, 0.85 * wider) << name_of(method) << " " << width;
      wider = taken;
    }
    EXPECT_LT(wider, 100.0) << name_of(method);
  }
}

TEST_F(ShadowFins, PiecesOfOneWallCastItsShadow) {
  // A wall that the light looks at aslant, of one piece and of two that abut, or run into one another.
  Scene whole = box_over_floor({160, 160});
  whole.lights[0].position = {0.3, 3, 3};
  whole.camera.position = {-1.5, 3, -4.5};
  whole.camera.target = {0, 0.2, -1};
  whole.meshes[1] = placed("wall", box_mesh(), {0, 0.5, 0}, {2, 1, 0.2});
  Scene halves = whole;
  halves.meshes[1] = placed("a", box_mesh(), {-0.5, 0.5, 0}, {1, 1, 0.2});
  halves.meshes.push_back(placed("b", box_mesh(), {0.5, 0.5, 0}, {1, 1, 0.2}));
  Scene overlapping = halves;
  overlapping.meshes[1] = placed("a", box_mesh(), {-0.475, 0.5, 0}, {1.05, 1, 0.2});
  for (const Method method : fin_methods) {
    const Frame one = draw_frame(runner_.device, whole, {.method = method});
    for (const Scene& scene : {halves, overlapping}) {
      const Frame two = draw_frame(runner_.device, scene, {.method = method});
      for (std::size_t i = 0; i < one.visibility[0].size(); ++i)
        ASSERT_NEAR(one.visibility[0][i], two.visibility[0][i], 0.02) << name_of(method) << " " << i;
    }
  }
}

TEST_F(ShadowFins, LayersDoNotDependOnWinding) {
  // Two boxes that share an edge, and one beneath: no solid, by their topology.
  std::vector<glm::dvec3> corners;
  std::vector<glm::uvec3> triangles;
  const auto add = [&](const glm::dvec3& low, const glm::dvec3& high) {
    const std::shared_ptr<const Mesh> box = box_mesh();
    const auto first = static_cast<std::uint32_t>(corners.size());
    for (const glm::vec3& p : box->positions) corners.push_back(low + (glm::dvec3(p) + 0.5) * (high - low));
    for (const glm::uvec3& t : box->triangles) triangles.push_back(t + first);
  };
  add({-0.5, 0, -0.2}, {0.5, 0.3, 0.2});
  add({0.2, 0.3, -0.2}, {0.5, 1.2, 0.2});
  add({-0.9, 0.05, 0.3}, {-0.6, 0.35, 0.9});
  Scene scene = box_over_floor({160, 160});
  scene.meshes[1] =
      placed("l", std::make_shared<Mesh>(make_mesh("l", corners, triangles)), {0, 0.7, 0}, glm::dvec3(1), {10, 30, 5});
  Scene reversed = scene;
  for (glm::uvec3& t : triangles) std::swap(t.y, t.z);
  reversed.meshes[1].mesh = std::make_shared<Mesh>(make_mesh("l", corners, triangles));
  for (const unsigned layers : {0u, 16u}) {
    Settings settings{.method = Method::layered_fins};
    if (layers > 0) settings.layers = layers;
    const Frame a = draw_frame(runner_.device, scene, settings), b = draw_frame(runner_.device, reversed, settings);
    for (std::size_t i = 0; i < a.visibility[0].size(); ++i)
      ASSERT_NEAR(a.visibility[0][i], b.visibility[0][i], 1e-3) << layers << " " << i;
  }
}

}  // namespace
}  // namespace halfshade
