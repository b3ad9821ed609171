// Spot lights: their declaration, and the light space that it gives.
#include "support/light_round_trip.hpp"

namespace halfshade {
namespace {

TEST(Spot, GoesFromFileToMetadataAndBack) {
  const Light disc = light_of_file(R"({"name": "key", "type": "spot", "position": [0.1, 0.2, 0.3], "target": [1, 2, 3],
                                       "up": [1, 0, 0], "radius": 0.7, "cone_deg": 33.3})");
  EXPECT_EQ(disc.type, LightType::spot);
  EXPECT_EQ(disc.position, glm::dvec3(0.1, 0.2, 0.3));
  EXPECT_EQ(disc.up, glm::dvec3(1, 0, 0));
  EXPECT_EQ(disc.cone_deg, 33.3);
  EXPECT_EQ(disc_radius(disc), 0.7);
  expect_round_trip(disc);

  const Light rectangle = light_of_file(R"({"type": "spot", "position": [0.1, 0.2, 0.3], "target": [1, 2, 3],
                                            "shape": "rectangle", "size": [3, 4]})");
  EXPECT_EQ(rectangle.shape, LightShape::rectangle);
  EXPECT_EQ(disc_radius(rectangle), 2.5);
  expect_round_trip(rectangle);
}

TEST(Spot, OfAPictureWithoutATypeIsWhatThePictureTells) {
  ExrImage image;
  image.metadata["light.key"] = R"({"position":[0,5,0],"target":[0,0,0],"radius":0.25,"cone_deg":50})";
  const Light light = light_from_metadata(image, "key", "old.exr").value();
  EXPECT_EQ(light.type, LightType::spot);
  EXPECT_EQ(light.radius, 0.25);
  EXPECT_EQ(light.cone_deg, 50.0);
}

TEST(Spot, IsDrawnAsItselfIntoItsCone) {
  const Light light{.position = {1, 2, 3}, .target = {1, 2, -5}, .cone_deg = 90};
  ASSERT_EQ(faces_of(light).size(), 1u);
  EXPECT_EQ(faces_of(light)[0].position, light.position);
  EXPECT_NEAR(light_frustum(light).tan_half_x, 1.0, 1e-15);
  const LightModel& model = model_of(light.type);
  EXPECT_TRUE(model.has_cone);
  EXPECT_NEAR(model.tan_half_cone(light), 1.0, 1e-15);
  EXPECT_EQ(model.centre(light, {1, 1, 1}), glm::dvec4(0, 1, 2, 1));
  EXPECT_EQ(model.travel(light, {1, 2, 0}), glm::dvec3(0, 0, -3));
}

}  // namespace
}  // namespace halfshade
