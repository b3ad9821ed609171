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

}  // namespace
}  // namespace halfshade
