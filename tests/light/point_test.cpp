// Point lights: their declaration, and the six faces that they are drawn in.
#include <algorithm>

#include "light/fit.hpp"
#include "light/samples.hpp"
#include "support/light_round_trip.hpp"

namespace halfshade {
namespace {

TEST(Point, GoesFromFileToMetadataAndBack) {
  const Light light = light_of_file(R"({"name": "lamp", "type": "point", "position": [0.1, 0.2, 0.3], "radius": 0.7})");
  EXPECT_EQ(light.type, LightType::point);
  EXPECT_EQ(light.position, glm::dvec3(0.1, 0.2, 0.3));
  EXPECT_EQ(disc_radius(light), 0.7);
  expect_round_trip(light);
}

TEST(Point, IsDrawnInSixFacesAlongTheWorldsAxes) {
  const Light light{.type = LightType::point, .position = {1, 2, 3}};
  const std::vector<Light> faces = faces_of(light);
  const glm::dvec3 axes[] = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
  ASSERT_EQ(faces.size(), 6u);
  for (std::size_t i = 0; i < 6; ++i) {
    EXPECT_EQ(row_of(light_axes(faces[i]), 2), axes[i]) << model_of(light.type).faces[i];
    EXPECT_NEAR(light_frustum(faces[i]).tan_half_x, 1.0, 1e-15);
    // A direction within the face finds the face's axes.
    const glm::dmat3 world_from_face = world_from_sphere_face(5.0 * axes[i] + glm::dvec3(0.3, -0.4, 0.2));
    EXPECT_EQ(world_from_face[2], axes[i]);
    EXPECT_EQ(world_from_face[0], row_of(light_axes(faces[i]), 0));
  }
}

TEST(Point, SamplesLieWithinTheSphereAndFillIt) {
  const Light light{.type = LightType::point, .position = {1, 2, 3}, .radius = 2};
  glm::dvec3 sum(0.0);
  double largest = 0.0;
  for (unsigned i = 0; i < 1024; ++i) {
    const Light sample = light_sample(light, {}, i, 1024);
    EXPECT_EQ(sample.type, LightType::point);
    EXPECT_EQ(sample.radius, 0.0);
    const glm::dvec3 offset = sample.position - light.position;
    EXPECT_LE(glm::length(offset), 2.0);
    largest = std::max(largest, glm::length(offset));
    sum += offset / 1024.0;
  }
  EXPECT_LT(glm::length(sum), 0.02);
  EXPECT_GT(largest, 1.95);
}

}  // namespace
}  // namespace halfshade
