// light-samples: one is hard, many approach the disc.
#include <cmath>

#include "support/draw.hpp"
#include "support/straight_edge.hpp"

namespace halfshade {
namespace {

using namespace straight_edge;
using LightSamples = KernelTest;

TEST_F(LightSamples, OneLightSampleIsHardAndManyApproachTheDisc) {
  EXPECT_EQ(draw_frame(runner_.device, box_over_floor(), {.method = Method::light_samples, .samples = 1}).visibility[0],
            draw_frame(runner_.device, box_over_floor(), {.method = Method::hard}).visibility[0]);
  const Frame frame = draw_frame(runner_.device, straight_edge::scene(), {.method = Method::light_samples, .samples = 1024});
  double squares = 0.0;
  for (std::size_t i = 0; i < frame.position_ws.size(); ++i) {
    const double u = u_of(frame.position_ws[i]), error = frame.visibility[0][i] - disc_above(u);
    ASSERT_NEAR(error, 0.0, 0.02) << u;
    squares += error * error;
  }
  EXPECT_LE(std::sqrt(squares / static_cast<double>(frame.position_ws.size())), 0.01);
}

}  // namespace
}  // namespace halfshade
