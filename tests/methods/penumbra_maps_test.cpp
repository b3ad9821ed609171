// penumbra-maps, and smoothies beside it, along a straight edge across a disc: outer penumbrae.
#include <cmath>
#include <numbers>

#include "support/draw.hpp"
#include "support/straight_edge.hpp"

namespace halfshade {
namespace {

using namespace straight_edge;
using OuterPenumbrae = KernelTest;

TEST_F(OuterPenumbrae, OuterPenumbraRunsFromTheHardShadowToFullLight) {
  const double texel_u = 2.0 * std::tan(30.0 * std::numbers::pi / 180.0) / 1024 * 1.2 / (half_width());
  for (const Method method : {Method::smoothies, Method::penumbra_maps}) {
    SCOPED_TRACE(name_of(method));
    const Frame frame = draw_frame(runner_.device, straight_edge::scene(), {.method = method});
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
TEST_F(OuterPenumbrae, PenumbraMapsHoldWymanAndHansensIntensity) {
  const Frame frame =
      draw_frame(runner_.device, straight_edge::scene(), {.method = Method::penumbra_maps, .falloff = Falloff::linear});
  const double z_v = light_y - plate_y, z_p = light_y;
  for (std::size_t i = 0; i < frame.position_ws.size(); ++i) {
    const double delta = frame.position_ws[i].x / light_y, u = u_of(frame.position_ws[i]);
    if (u < 0.05 || u > 0.95) continue;
    const double z_f = 1.0 / (1.0 / z_v - delta / radius);
    ASSERT_NEAR(frame.visibility[0][i], (z_f - z_v) / (z_p - z_v), 0.01) << u;
  }
}

}  // namespace
}  // namespace halfshade
