// The reference in double precision against closed forms, and its tree against going through all triangles.
#include "report/reference.hpp"

#include <numbers>
#include <random>

#include "light/light_model.hpp"
#include "support/closed_forms.hpp"
#include "support/draw.hpp"
#include "support/scenes.hpp"

namespace halfshade {
namespace {

constexpr double pi = std::numbers::pi;

/// A horizontal rectangle at height y.
SceneMesh sheet(double x0, double x1, double z0, double z1, double y) {
  const std::vector<glm::dvec3> corners = {{x0, y, z0}, {x1, y, z0}, {x1, y, z1}, {x0, y, z1}};
  const std::vector<glm::uvec3> triangles = {{0, 1, 2}, {0, 2, 3}};
  return placed("sheet", std::make_shared<Mesh>(make_mesh("sheet", corners, triangles)), {0, 0, 0}, glm::dvec3(1));
}

Light light_above(double radius) {
  return {.name = "above", .position = {0, 10, 0}, .target = {0, 0, 0}, .up = {}, .radius = radius, .cone_deg = 120};
}

/// Visibility of a point of the ground, from 1024 points of the light unless said.
double seen_from(const Scene& scene, const Light& light, const glm::dvec3& ground_ws, unsigned points = 1024) {
  const Reference reference(scene);
  const SurfacePoint receiver{.position = ground_ws - reference.origin_ws(), .normal = {0, 1, 0}};
  return reference.visibility(light, receiver, light_points(light, points, 1).points);
}

TEST(Reference, AgreesWithAHalfPlaneInClosedForm) {
  // The edge x = 0 at height 5, light at height 10: seen from (x, 0), it crosses the disc at -x.
  Scene scene;
  scene.meshes = {sheet(-100, 0, -100, 100, 5)};
  for (double x = -1.2; x <= 1.2; x += 0.1)
    EXPECT_NEAR(seen_from(scene, light_above(1.0), {x, 0.0, 0.3}), disc_beyond(-x), 0.01) << x;
}

TEST(Reference, AgreesWithADiscInClosedForm) {
  // Of radius 0.5 at height 5: from the ground it covers a unit disc, whose centre is |x| from the light's.
  Scene scene;
  scene.meshes = {placed("disc", disc_mesh(), {0, 5, 0}, glm::dvec3(0.5))};
  for (double x = -2.2; x <= 2.2; x += 0.2)
    EXPECT_NEAR(seen_from(scene, light_above(1.0), {x, 0.0, 0.0}), 1 - lens(1, std::abs(x)) / pi, 0.01) << x;
}

TEST(Reference, AgreesWithASquareHoleInClosedForm) {
  // A square hole of side 0.5 at height 5 shows, from below its middle, a square of side 1 of the light.
  Scene scene;
  scene.meshes = {sheet(-9, -0.25, -9, 9, 5), sheet(0.25, 9, -9, 9, 5), sheet(-0.25, 0.25, -9, -0.25, 5),
                  sheet(-0.25, 0.25, 0.25, 9, 5)};
  EXPECT_NEAR(seen_from(scene, light_above(1.0), {0, 0, 0}), 1 / pi, 0.01);
  // Of a sphere light the same: it shows the ground below it the same disc. Of a rectangle of sides 2 a quarter.
  Light sphere = light_above(1.0), rectangle = light_above(1.0);
  sphere.type = LightType::point;
  rectangle.shape = LightShape::rectangle;
  rectangle.size = {2, 2};
  EXPECT_NEAR(seen_from(scene, sphere, {0, 0, 0}), 1 / pi, 0.01);
  EXPECT_NEAR(seen_from(scene, rectangle, {0, 0, 0}), 0.25, 1e-9);
  // Of the sun, whose disc has the radius tan(a) at distance 1: a square of side 0.1.
  Light sun{.name = "sun", .type = LightType::directional, .direction = {0, -1, 0}, .up = {}, .angular_radius_deg = 10};
  EXPECT_NEAR(seen_from(scene, sun, {0, 0, 0}), 0.01 / (pi * std::pow(std::tan(10 * pi / 180), 2)), 0.01);
}

TEST(Reference, OfASphereLightFacesEachReceiver) {
  const Light light{.name = "ball", .type = LightType::point, .position = {1, 2, 3}, .up = {}, .radius = 0.5};
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  for (int i = 0; i < 100; ++i) {
    const glm::dvec3 receiver = light.position + 3.0 * glm::dvec3{normal(random), normal(random), normal(random)};
    const LightDisc disc = disc_towards(light, receiver, glm::dvec3(0.0));
    const glm::dvec3 towards = glm::normalize(receiver - light.position);
    EXPECT_NEAR(glm::dot(disc.right, towards), 0, 1e-12);
    EXPECT_NEAR(glm::dot(disc.up, towards), 0, 1e-12);
    EXPECT_NEAR(glm::dot(disc.right, disc.up), 0, 1e-12);
    EXPECT_NEAR(glm::length(disc.right), 0.5, 1e-12);
    EXPECT_NEAR(glm::length(disc.up), 0.5, 1e-12);
  }
}

TEST(Reference, ASurfaceFlushWithTheLightDoesNotHideIt) {
  // A ceiling in the light's plane, and one a hair below it.
  for (const double scale : {1e-9, 1.0, 1e9}) {
    Scene scene;
    scene.meshes = {placed("ceiling", ground_mesh(), {0, 10 * scale, 0}, glm::dvec3(6 * scale))};
    Light light = light_above(scale);
    light.position *= scale;
    scene.camera.position = {0, 5 * scale, 0};
    EXPECT_EQ(seen_from(scene, light, {0.3 * scale, 0, 0.2 * scale}), 1.0) << scale;
    scene.meshes[0].world_from_mesh[3].y = 10 * scale * (1 - 1e-9);
    EXPECT_EQ(seen_from(scene, light, {0.3 * scale, 0, 0.2 * scale}), 0.0) << scale;
  }
}

TEST(Reference, ASurfaceHidesWhatLiesBelowItsHorizonIfItCasts) {
  // The plane of the floor cuts the disc in the middle.
  Scene scene;
  scene.meshes = {sheet(-5, 5, -5, 5, 0)};
  Light light = light_above(1.0);
  light.position = {3, 0, 0};
  EXPECT_NEAR(seen_from(scene, light, {-1, 1e-9, 0}), 0.5, 0.03);
  scene.meshes[0].casts_shadow = false;
  EXPECT_EQ(seen_from(scene, light, {-1, 1e-9, 0}), 1.0);
}

/// Triangles of all sizes and directions.
Scene soup(unsigned count, double scale, const glm::dvec3& offset) {
  std::mt19937 random(11);
  std::uniform_real_distribution<double> unit(-1, 1), power(-3, 0.5);
  std::vector<glm::dvec3> corners;
  std::vector<glm::uvec3> triangles;
  for (unsigned i = 0; i < count; ++i) {
    const glm::dvec3 middle{unit(random), unit(random), unit(random)};
    const double size = std::pow(10.0, power(random));
    for (int k = 0; k < 3; ++k) corners.push_back(middle + size * glm::dvec3{unit(random), unit(random), unit(random)});
    triangles.emplace_back(3 * i, 3 * i + 1, 3 * i + 2);
  }
  Scene scene;
  scene.meshes = {placed("soup", std::make_shared<Mesh>(make_mesh("soup", corners, triangles)), offset, glm::dvec3(scale))};
  scene.camera.position = offset + scale * glm::dvec3(0, 0, 3);
  return scene;
}

TEST(Reference, HasATreeThatLosesNoTriangle) {
  const Scene scene = soup(300, 1.0, {0, 0, 0});
  const Reference whole(scene);
  std::vector<Scene> alone;
  std::vector<Reference> each;
  for (const glm::uvec3& t : scene.meshes[0].mesh->triangles) {
    Mesh mesh = *scene.meshes[0].mesh;
    mesh.triangles = {t};
    alone.push_back(scene);
    alone.back().meshes[0].mesh = std::make_shared<Mesh>(mesh);
    each.emplace_back(alone.back());
  }
  std::mt19937 random(2);
  std::uniform_real_distribution<double> unit(-1.5, 1.5);
  std::size_t occluded = 0;
  for (int i = 0; i < 4000; ++i) {
    const auto point = [&] { return glm::dvec3{unit(random), unit(random), unit(random)} - glm::dvec3(0, 0, 3); };
    glm::dvec3 a = point(), b = a + 0.15 * point();
    if (i % 3 == 0) b[i % 9 / 3] = a[i % 9 / 3];  // along the tree's planes
    const bool expected = std::any_of(each.begin(), each.end(), [&](const Reference& one) { return one.is_occluded(a, b); });
    ASSERT_EQ(whole.is_occluded(a, b), expected) << i;
    const bool towards =
        std::any_of(each.begin(), each.end(), [&](const Reference& one) { return one.is_occluded_towards(a, b - a); });
    ASSERT_EQ(whole.is_occluded_towards(a, b - a), towards) << i;
    occluded += expected;
  }
  EXPECT_GT(occluded, 500u);
  EXPECT_LT(occluded, 3500u);
}

TEST(Reference, IsTheSameAtEveryScale) {
  std::mt19937 random(2);
  std::uniform_real_distribution<double> unit(-1, 1);
  std::vector<std::array<glm::dvec3, 2>> segments;
  for (int i = 0; i < 1000; ++i) {
    const glm::dvec3 a{unit(random), unit(random), unit(random)}, along{unit(random), unit(random), unit(random)};
    segments.push_back({a - glm::dvec3(0, 0, 3), a + 0.2 * along - glm::dvec3(0, 0, 3)});
  }
  const Reference one(soup(200, 1.0, {0, 0, 0}));
  for (const double scale : {0x1p-40, 1e-12, 1e12, 0x1p40}) {
    const Reference scaled(soup(200, scale, {0, 0, 0}));
    for (const auto& [a, b] : segments) ASSERT_EQ(scaled.is_occluded(scale * a, scale * b), one.is_occluded(a, b)) << scale;
  }
  const Reference far(soup(200, 1.0, {1e7, -2e7, 0.5e7}));
  for (const auto& [a, b] : segments) ASSERT_EQ(far.is_occluded(a, b), one.is_occluded(a, b));
}

TEST(Reference, HasNoGapsAlongEdgesAndAtCorners) {
  // Segments through the very vertices, and along the edges, of a closed mesh meet it.
  Scene scene;
  scene.meshes = {placed("box", box_mesh(), {0.1, 0.2, 0.3}, glm::dvec3(1.3), {20, 30, 10})};
  const Reference reference(scene);
  const Mesh& mesh = *scene.meshes[0].mesh;
  const auto world = [&](const glm::dvec3& p) {
    return glm::dvec3(scene.meshes[0].world_from_mesh * glm::dvec4(p + mesh.origin, 1.0)) - reference.origin_ws();
  };
  std::mt19937 random(4);
  std::uniform_real_distribution<double> unit(0, 1);
  std::size_t tested = 0;
  for (const glm::uvec3& t : mesh.triangles)
    for (int i = 0; i < 200; ++i) {
      const double part = i < 3 ? i / 2.0 : unit(random);
      const glm::dvec3 on_edge = world(glm::mix(glm::dvec3(mesh.positions[t.x]), glm::dvec3(mesh.positions[t.y]), part));
      const glm::dvec3 inside = world(0.4 * glm::dvec3{unit(random) - 0.5, unit(random) - 0.5, unit(random) - 0.5});
      EXPECT_TRUE(reference.is_occluded(inside, inside + 3.0 * (on_edge - inside)));
      ++tested;
    }
  EXPECT_GT(tested, 2000u);
}

/// Every pixel of a frame is placed, as near to the frame's own positions as their precision is.
TEST(Reference, PlacesThePixelsOfAFrame) {
  Scene scene = box_over_floor({96, 80});
  const Drawn drawn = draw(test_device(), scene, {.method = Method::hard});
  const Reference reference(scene);
  const SurfacePixels pixels = reference.surface_pixels(scene.camera, drawn.frame.depth, drawn.frame.normal_ws, scene.lights[0]);
  EXPECT_EQ(pixels.unplaced, 0u);
  EXPECT_GT(pixels.pixels.size(), 5000u);
  for (std::size_t i = 0; i < pixels.pixels.size(); ++i) {
    const glm::vec4 frame = drawn.frame.position_ws[pixels.pixels[i]];
    ASSERT_LT(glm::length(glm::dvec3(frame) - scene.camera.position - pixels.points[i].position), 0.005) << i;
    ASSERT_GT(glm::dot(pixels.points[i].normal, glm::dvec3(drawn.frame.normal_ws[pixels.pixels[i]])), 0.9999) << i;
  }
}

TEST(Reference, ItsComparisonNoticesAWrongPlane) {
  Scene scene = box_over_floor({96, 80});
  const Light& light = scene.lights[0];
  const Drawn drawn = draw(test_device(), scene, {.method = Method::hard});
  const Reference reference(scene);
  const SurfacePixels pixels = reference.surface_pixels(scene.camera, drawn.frame.depth, drawn.frame.normal_ws, light);
  const std::vector<glm::dvec2> points = light_points(light, 64).points;
  std::vector<float> plane = reference.visibility(light, pixels, points);
  const ReferenceFigures right = compare_with_reference(reference, light, pixels, plane, points);
  EXPECT_EQ(right.differing, 0u);
  EXPECT_EQ(right.error.max_error, 0.0);
  EXPECT_GT(right.error.penumbra_pixels, 100u);
  for (std::size_t i = 0; i < 7; ++i) {
    float& value = plane[pixels.pixels[i * 20]];
    value = value < 0.5f ? value + 0.3f : value - 0.3f;
  }
  const ReferenceFigures wrong = compare_with_reference(reference, light, pixels, plane, points);
  EXPECT_EQ(wrong.differing, 7u);
  EXPECT_EQ(wrong.unexplained, 7u);
  EXPECT_NEAR(wrong.error.max_error, 0.3, 1e-6);
}

}  // namespace
}  // namespace halfshade
