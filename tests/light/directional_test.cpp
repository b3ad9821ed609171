// Directional lights: their declaration, and the projective space that they are drawn in.
#include <cmath>

#include "light/fit.hpp"
#include "support/light_round_trip.hpp"

namespace halfshade {
namespace {

TEST(Directional, GoesFromFileToMetadataAndBack) {
  const Light light = light_of_file(R"({"name": "sun", "type": "directional", "direction": [0.1, -2, 0.3], "up": [1, 0, 0],
                                        "angular_radius_deg": 3.3})");
  EXPECT_EQ(light.type, LightType::directional);
  EXPECT_EQ(light.direction, glm::dvec3(0.1, -2, 0.3));
  EXPECT_EQ(light.angular_radius_deg, 3.3);
  EXPECT_EQ(disc_radius(light), std::tan(glm::radians(3.3)));
  expect_round_trip(light);
}

TEST(Directional, HasNoPlaceAndTravelsAlikeEverywhere) {
  const Light light{.type = LightType::directional, .direction = {0, -3, 0}};
  const LightModel& model = model_of(light.type);
  EXPECT_FALSE(model.has_cone);
  EXPECT_EQ(model.centre(light, {7, 8, 9}), glm::dvec4(0, 1, 0, 0));
  EXPECT_EQ(model.travel(light, {7, 8, 9}), light.direction);
}

TEST(Directional, KeepsDistancesAlongItsDirection) {
  // A cube of side 2 about the origin, one of side 4 about (0, -6, 0), seen from above.
  const Light light{.type = LightType::directional, .direction = {0, -1, 0}};
  PlacedMesh above, below;
  above.bounds = {glm::dvec3(-1), glm::dvec3(1)};
  below.bounds = {glm::dvec3(-2, -8, -2), glm::dvec3(2, -4, 2)};
  const LightView fitted = fit_light_view(light, {above, below}, 256, 32);
  ASSERT_TRUE(fitted.is_projective);
  EXPECT_EQ(fitted.casters, (std::vector<std::uint32_t>{0, 1}));
  for (const double y : {1.0, -1.0, -4.0, -8.0}) {
    const glm::dvec3 p = in_view(fitted.frustum.view_from_world, {0.25, y, -0.5});
    EXPECT_NEAR(fitted.distance_of(p.z), -y, 1e-12);
  }
}

}  // namespace
}  // namespace halfshade
