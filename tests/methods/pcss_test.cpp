// pcss against a straight edge across a disc, which is what it assumes.
#include <cmath>

#include "support/draw.hpp"
#include "support/straight_edge.hpp"

namespace halfshade {
namespace {

using namespace straight_edge;
using Pcss = KernelTest;

// One caster at one depth is what PCSS assumes: the filter's disc is then the light's, and the taps all that is between.
TEST_F(Pcss, FollowsTheDiscAcrossAStraightEdge) {
  double previous = 1.0;
  for (const unsigned taps : {16u, 32u}) {
    const Frame frame = draw_frame(runner_.device, straight_edge::scene(), {.method = Method::pcss, .pcss_taps = taps});
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
      const double exact = disc_above(u);
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

TEST_F(Pcss, SearchesNoFartherThanItsCastersAsk) {
  // A floor that reaches behind the light moves the map's near plane to the light, not the search for blockers with it.
  Scene small = straight_edge::scene(), large = straight_edge::scene();
  for (Scene* scene : {&small, &large}) {
    scene->meshes.pop_back();
    scene->lights[0].target = {1, 0, 0};
    scene->lights[0].radius = 0.2;
  }
  large.meshes[0] = placed("floor", ground_mesh(), {0, 0, 0}, glm::dvec3(1000));
  const Frame a = draw_frame(runner_.device, small, {.method = Method::pcss}),
              b = draw_frame(runner_.device, large, {.method = Method::pcss});
  std::size_t penumbra = 0;
  for (std::size_t i = 0; i < a.position_ws.size(); ++i) {
    ASSERT_NEAR(a.visibility[0][i], b.visibility[0][i], 0.05) << i;
    penumbra += a.visibility[0][i] > 0.05f && a.visibility[0][i] < 0.95f;
  }
  EXPECT_GT(penumbra, 500u);
}

TEST_F(Pcss, ACapBelowTheLightHidesItFromAllOfTheFloor) {
  // The search, and the filter, are wider than the light's cone.
  Scene scene = straight_edge::scene();
  scene.meshes.pop_back();
  scene.meshes[1] = placed("cap", disc_mesh(), {0, straight_edge::light_y - 0.3, 0}, glm::dvec3(1.2, 1, 1.2));
  const Frame frame = draw_frame(runner_.device, scene, {.method = Method::pcss});
  for (std::size_t i = 0; i < frame.visibility[0].size(); ++i) ASSERT_EQ(frame.visibility[0][i], 0.0f) << i;
}

TEST_F(Pcss, ACasterNearTheLightLeavesFarUmbraeDark) {
  // A small box beside the light, far from the shadow of the large one.
  Scene scene = box_over_floor();
  const Frame alone = draw_frame(runner_.device, scene, {.method = Method::pcss});
  scene.meshes.push_back(placed("near", box_mesh(), {2.6, 5.7, 1}, glm::dvec3(0.1)));
  const Frame exact = draw_frame(runner_.device, scene, {.method = Method::exact}),
              frame = draw_frame(runner_.device, scene, {.method = Method::pcss});
  std::size_t dark = 0;
  double seen = 0.0, seen_alone = 0.0;
  for (std::size_t i = 0; i < frame.position_ws.size(); ++i) {
    if (exact.visibility[0][i] > 0.0f || frame.position_ws[i].w == 0.0f) continue;
    ++dark;
    seen += frame.visibility[0][i];
    seen_alone += alone.visibility[0][i];
  }
  ASSERT_GT(dark, 200u);
  EXPECT_LE(seen, seen_alone + 0.01 * static_cast<double>(dark));
}

TEST_F(Pcss, AnEmptyRoomIsLitUpToItsCorners) {
  Scene scene;
  scene.name = "room";
  scene.meshes = {placed("room", box_mesh(), {0, 0, 0}, {6, 6, 6})};
  scene.camera = {
      .position = {-2.7, -2.5, -2.8}, .target = {1.5, 1.5, 1.5}, .yfov_deg = 90, .znear = 0.01, .resolution = {96, 96}};
  Light ball{.name = "ball", .type = LightType::point, .position = {0.3, 0.2, -0.4}};
  ball.radius = 0.25;
  scene.lights = {ball};
  const Frame frame = draw_frame(runner_.device, scene, {.method = Method::pcss}),
              hard = draw_frame(runner_.device, scene, {.method = Method::hard});
  // But for what any look-up of the map gets wrong within a texel of a corner.
  std::size_t dark = 0;
  for (std::size_t i = 0; i < frame.visibility[0].size(); ++i) dark += frame.visibility[0][i] < hard.visibility[0][i] - 0.01f;
  EXPECT_LE(dark, 4u);
}

}  // namespace
}  // namespace halfshade
