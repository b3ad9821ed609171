// Rays against closed forms, against the reference in double precision, and their noise.
#include "report/rays.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "light/light_model.hpp"
#include "report/reference.hpp"
#include "support/closed_forms.hpp"
#include "support/scenes.hpp"

namespace halfshade {
namespace {

constexpr double pi = std::numbers::pi;

SceneMesh placed(std::string name, std::vector<glm::dvec3> positions, std::vector<glm::uvec3> triangles,
                 glm::dvec3 translation = glm::dvec3(0.0)) {
  SceneMesh mesh;
  mesh.name = name;
  mesh.mesh = std::make_shared<Mesh>(make_mesh(std::move(name), positions, triangles));
  mesh.world_from_mesh = matrix_of({.translation = translation});
  return mesh;
}

/// A horizontal rectangle at height y.
SceneMesh sheet(double x0, double x1, double z0, double z1, double y, glm::dvec3 translation = glm::dvec3(0.0)) {
  return placed("sheet", {{x0, y, z0}, {x1, y, z0}, {x1, y, z1}, {x0, y, z1}}, {{0, 1, 2}, {0, 2, 3}}, translation);
}

SceneMesh from_data(std::string_view name) {
  SceneMesh mesh;
  mesh.name = name;
  mesh.mesh = std::make_shared<Mesh>(load_obj(std::filesystem::path(HALFSHADE_DATA_DIR) / "meshes" / name));
  return mesh;
}

/// A light at height 10, straight above `at`, facing down.
Light light_above(double radius, glm::dvec3 at = glm::dvec3(0.0)) {
  Light light;
  light.name = "key";
  light.position = at + glm::dvec3(0, 10, 0);
  light.target = at;
  light.radius = radius;
  light.cone_deg = 120;
  return light;
}

/// Visibility of ground points that look up.
std::vector<float> visibility_at(const Scene& scene, const Light& light, const std::vector<glm::dvec3>& points,
                                 const RaySettings& settings) {
  const RayScene rays(scene);
  const std::vector<glm::vec4> up(points.size(), glm::vec4(0, 1, 0, 1));
  const RayReceivers receivers = receivers_of(PreciseScene(scene), {static_cast<unsigned>(points.size()), 1}, points, up, light);
  return trace_visibility(rays, light, receivers, settings);
}

TEST(DiscSamples, AreNPointsOfTheDiscWithItsCentreAndItsArea) {
  for (const unsigned n : {1u, 2u, 3u, 4u, 7u, 16u, 37u, 64u, 256u, 1000u, 1024u}) {
    const std::vector<glm::dvec2> samples = disc_samples(n);
    ASSERT_EQ(samples.size(), n);
    glm::dvec2 mean(0.0);
    double inside_half = 0;
    for (const glm::dvec2& s : samples) {
      ASSERT_LE(glm::length(s), 1.0) << n;
      mean += s / static_cast<double>(n);
      inside_half += glm::length(s) < std::sqrt(0.5);  // half of the area
    }
    if (n >= 16) {
      EXPECT_NEAR(glm::length(mean), 0.0, 1.0 / n + 0.02) << n;
      EXPECT_NEAR(inside_half / n, 0.5, 1.0 / std::sqrt(n)) << n;
    }
  }
}

TEST(DiscSamples, HaveOneInEachStratum) {
  // Sectors of equal area hold as many samples as their share, but for those on the strata that their borders cut.
  const std::vector<glm::dvec2> samples = disc_samples(1024);
  int count[8] = {};
  for (const glm::dvec2& s : samples) ++count[static_cast<int>((std::atan2(s.y, s.x) + pi) / (2 * pi) * 8) % 8];
  for (const int in_sector : count) EXPECT_NEAR(in_sector, 128, 12);
}

TEST(Rays, AgreeWithAHalfPlaneInClosedForm) {
  // The edge x = 0 at height 5, light at height 10: seen from (x, 0), it crosses the disc at x_light = -x.
  Scene scene;
  scene.meshes.push_back(sheet(-100, 0, -100, 100, 5));
  const Light light = light_above(1.0);
  std::vector<glm::dvec3> points;
  for (double x = -1.2; x <= 1.2; x += 0.05) points.emplace_back(x, 0.0, 0.3);
  const std::vector<float> seen = visibility_at(scene, light, points, {.samples = 1024});
  for (std::size_t i = 0; i < points.size(); ++i) EXPECT_NEAR(seen[i], disc_beyond(-points[i].x), 0.012) << points[i].x;
}

TEST(Rays, AgreeWithADiscOverAPlaneInClosedForm) {
  // A disc of radius 0.5 at height 5 has, from the ground, twice the radius at the light: two unit discs |2x| apart overlap.
  Scene scene;
  scene.meshes.push_back(halfshade::placed("disc", disc_mesh(), {0, 5, 0}, glm::dvec3(0.5)));
  std::vector<glm::dvec3> points;
  for (double x = -1.1; x <= 1.1; x += 0.1) points.emplace_back(x, 0.0, 0.0);
  const std::vector<float> seen = visibility_at(scene, light_above(1.0), points, {.samples = 1024});
  for (std::size_t i = 0; i < points.size(); ++i) {
    // From x, the disc's centre is seen at -x above the ground's middle, that is at 2·0 - x from the light's centre.
    EXPECT_NEAR(seen[i], 1 - lens(1, std::abs(points[i].x)) / pi, 0.012) << points[i].x;
  }
}

TEST(Rays, AddUpTwoHalvesThatHideDifferentPartsOfTheLight) {
  // Each sheet alone hides half of the light from the origin, the two together all of it.
  const Light light = light_above(1.0);
  Scene left, right, both;
  left.meshes.push_back(sheet(-100, 0, -100, 100, 5));
  right.meshes.push_back(sheet(0, 100, -100, 100, 3));
  both.meshes = {left.meshes[0], right.meshes[0]};
  const std::vector<glm::dvec3> origin{{0, 0, 0}};
  EXPECT_NEAR(visibility_at(left, light, origin, {.samples = 1024})[0], 0.5, 0.005);
  EXPECT_NEAR(visibility_at(right, light, origin, {.samples = 1024})[0], 0.5, 0.005);
  EXPECT_EQ(visibility_at(both, light, origin, {.samples = 1024})[0], 0.0f);
}

TEST(Rays, HaveLessNoiseWithMoreSamples) {
  Scene scene;
  scene.meshes.push_back(sheet(-100, 0, -100, 100, 5));
  std::vector<glm::dvec3> points;
  for (double x = -0.95; x <= 0.95; x += 0.001) points.emplace_back(x, 0.0, 0.0);
  double last = 1.0;
  for (const unsigned n : {4u, 16u, 64u, 256u, 1024u}) {
    const std::vector<float> seen = visibility_at(scene, light_above(1.0), points, {.samples = n});
    double squares = 0;
    for (std::size_t i = 0; i < points.size(); ++i) squares += std::pow(seen[i] - disc_beyond(-points[i].x), 2);
    const double rmse = std::sqrt(squares / points.size());
    EXPECT_LT(rmse, last * 0.6) << n;
    last = rmse;
  }
  EXPECT_LT(last, 0.004);
}

TEST(Rays, TraceMoreOnlyWhereTheFirstDisagree) {
  Scene scene;
  scene.meshes.push_back(sheet(-100, 0, -100, 100, 5));
  const std::vector<glm::dvec3> points{{-2, 0, 0}, {0.1, 0, 0}, {2, 0, 0}};
  const std::vector<float> seen = visibility_at(scene, light_above(1.0), points, {.samples = 16, .more_samples = 64});
  EXPECT_EQ(seen[0], 0.0f);
  EXPECT_EQ(seen[2], 1.0f);
  EXPECT_NEAR(seen[1], disc_beyond(-0.1), 0.03);
  // 80 samples, not 16 nor 64
  EXPECT_NEAR(seen[1] * 80, std::round(seen[1] * 80), 1e-4);
  EXPECT_GT(std::abs(seen[1] * 16 - std::round(seen[1] * 16)), 1e-3);

  // Where the first agree they have the last word, right or wrong.
  std::vector<glm::dvec3> row;
  for (double x = -1.1; x <= 1.1; x += 0.005) row.emplace_back(x, 0.0, 0.0);
  const std::vector<float> few = visibility_at(scene, light_above(1.0), row, {.samples = 16}),
                           both = visibility_at(scene, light_above(1.0), row, {.samples = 16, .more_samples = 64}),
                           many = visibility_at(scene, light_above(1.0), row, {.samples = 64});
  std::size_t wrong = 0;
  for (std::size_t i = 0; i < row.size(); ++i) {
    if (few[i] != 0.0f && few[i] != 1.0f) continue;
    EXPECT_EQ(both[i], few[i]) << row[i].x;
    wrong += many[i] != few[i];
  }
  EXPECT_GT(wrong, 5u);
}

TEST(Rays, ThatShareAPacketAreEachFromTheirOwnPoint) {
  Scene scene;
  scene.meshes.push_back(sheet(-0.5, 0.5, -100, 100, 5));
  std::vector<glm::dvec3> points;
  for (double x = -3; x <= 3; x += 0.31) points.emplace_back(x, 0.0, 0.0);
  for (const unsigned samples : {1u, 3u, 4u, 7u}) {
    const RaySettings settings{.samples = samples, .rotate = false};
    const std::vector<float> together = visibility_at(scene, light_above(1.0), points, settings);
    for (std::size_t i = 0; i < points.size(); ++i)
      EXPECT_EQ(together[i], visibility_at(scene, light_above(1.0), {points[i]}, settings)[0]) << samples << " " << points[i].x;
  }
}

TEST(Rays, OfAnotherSeedHaveOtherNoise) {
  // A plane of noise is compared with the truth: were they alike, it would look better than it is.
  EXPECT_NE(disc_samples(64, 1), disc_samples(64, 2));
  Scene scene;
  scene.meshes.push_back(sheet(-100, 0, -100, 100, 5));
  std::vector<glm::dvec3> points;
  for (double x = -0.95; x <= 0.95; x += 0.01) points.emplace_back(x, 0.0, 0.0);
  const std::vector<float> a = visibility_at(scene, light_above(1.0), points, {.samples = 16, .seed = 1});
  const std::vector<float> b = visibility_at(scene, light_above(1.0), points, {.samples = 16, .seed = 2});
  double together = 0, alone_a = 0, alone_b = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double truth = disc_beyond(-points[i].x);
    together += (a[i] - truth) * (b[i] - truth);
    alone_a += (a[i] - truth) * (a[i] - truth);
    alone_b += (b[i] - truth) * (b[i] - truth);
  }
  EXPECT_LT(std::abs(together) / std::sqrt(alone_a * alone_b), 0.3);
}

/// Points of a grid on the ground and on the mesh's upper faces, all of them receivers.
struct GroundAndTorus {
  Scene scene;
  Light light;
  std::vector<glm::dvec3> points;
  explicit GroundAndTorus(glm::dvec3 at = glm::dvec3(0.0)) {
    SceneMesh torus = from_data("torus.obj");
    torus.world_from_mesh = matrix_of({.translation = at + glm::dvec3(0, 1.5, 0), .rotation_deg = {35, 20, 10}});
    scene.meshes = {torus, sheet(-8, 8, -8, 8, 0, at)};
    scene.camera.target = at;
    light = light_above(0.7, at);
    light.position += glm::dvec3(2, -3, 1);
    for (int i = 0; i < 16 * 16; ++i) points.push_back(at + glm::dvec3((i % 16 - 7.5) * 0.3, 0.0, (i / 16 - 7.5) * 0.3));
  }
};

TEST(Rays, AgreeWithTheReferenceInDoublePrecision) {
  const GroundAndTorus test;
  const std::vector<glm::dvec2> pattern = disc_samples(16);
  const std::vector<float> seen =
      visibility_at(test.scene, test.light, test.points, {.samples = 16, .rotate = false, .pattern = pattern});
  const glm::dmat4 light_from_world = light_frustum(test.light).view_from_world;
  const glm::dmat3 world_from_light = glm::transpose(glm::dmat3(light_from_world));
  const Reference reference(test.scene);
  int differing = 0, shadowed = 0;
  for (std::size_t i = 0; i < test.points.size(); ++i) {
    int lit = 0;
    for (const glm::dvec2& s : pattern) {
      const glm::dvec3 to = test.light.position + world_from_light * glm::dvec3(s * test.light.radius, 0.0);
      lit += !reference.is_occluded(test.points[i] + glm::dvec3(0, 1e-6, 0) - reference.origin_ws(), to - reference.origin_ws());
    }
    differing += std::abs(seen[i] * 16 - lit) > 0.01;
    shadowed += lit < 16;
  }
  EXPECT_GT(shadowed, 20);
  EXPECT_EQ(differing, 0);
}

TEST(Rays, SeeTheSameFarFromTheWorldsOrigin) {
  const GroundAndTorus near, far({1e6, -2e6, 5e5});
  const std::vector<float> a = visibility_at(near.scene, near.light, near.points, {.samples = 64});
  const std::vector<float> b = visibility_at(far.scene, far.light, far.points, {.samples = 64});
  double largest = 0;
  for (std::size_t i = 0; i < a.size(); ++i) largest = std::max<double>(largest, std::abs(a[i] - b[i]));
  EXPECT_LE(largest, 2.0 / 64);
  EXPECT_NE(*std::min_element(a.begin(), a.end()), 1.0f);
}

TEST(Rays, LeaveOutWhatCastsNoShadowAndWhatIsNotCounted) {
  Scene scene;
  scene.meshes = {sheet(-100, 100, -100, 100, 5)};
  scene.meshes[0].casts_shadow = false;
  const std::vector<glm::dvec3> points{{0, 0, 0}, {0, 0, 0}, {0, 0, 0}};
  const RayScene rays(scene);
  const Light light = light_above(1.0);
  const std::vector<glm::vec4> normals{{0, 1, 0, 1}, {0, -1, 0, 1}, {0, 1, 0, 0}};
  const RayReceivers receivers = receivers_of(PreciseScene(scene), {3, 1}, points, normals, light);
  EXPECT_EQ(receivers.pixels, std::vector<std::uint32_t>{0});
  EXPECT_EQ(trace_visibility(rays, light, receivers, {.samples = 4}), (std::vector<float>{1.0f, 0.0f, 1.0f}));
}

TEST(Rays, AreNotShadowedByTheFloorTheyStandOnHoweverLargeNorByTheLampsCeiling) {
  const std::vector<glm::dvec3> points{{0.3, 0, 0.2}, {-1.7, 0, 2.1}, {3.1, 0, -2.3}};
  for (const double size : {6.0, 1e4, 1e5, 1e7}) {
    Scene scene;
    scene.meshes = {sheet(-size, size, -size, size, 0)};
    scene.meshes[0].world_from_mesh = matrix_of({.rotation_deg = {0, 33, 0}});
    EXPECT_EQ(visibility_at(scene, light_above(0.5), points, {.samples = 64}), std::vector<float>(3, 1.0f)) << size;
  }
  Scene scene;
  scene.meshes = {sheet(-6, 6, -6, 6, 10)};  // the light is at height 10
  EXPECT_EQ(visibility_at(scene, light_above(0.5), points, {.samples = 64}), std::vector<float>(3, 1.0f));
}

/// Camera and light over one mesh: nothing shadows a convex body where the whole light is above its horizon.
TEST(Rays, DoNotShadowASurfaceByItself) {
  Scene scene;
  scene.meshes = {from_data("sphere.obj")};
  scene.camera.position = {0, 3, 4};
  scene.camera.resolution = {256, 256};
  scene.lights = {light_above(0.5)};
  validate(scene, "test");
  const auto device = Device::open("");
  Renderer renderer(device);
  for (const double scale : {0.01, 1.0, 100.0}) {
    scene.meshes[0].world_from_mesh = matrix_of({.scale = glm::dvec3(scale)});
    scene.camera.position = glm::dvec3(0, 3, 4) * scale;
    scene.camera.znear = 0.01 * scale;
    scene.lights[0].position = glm::dvec3(0, 10, 0) * scale;
    scene.lights[0].radius = 0.5 * scale;
    renderer.set_scene(scene);
    renderer.render({.method = Method::hard});
    Frame frame = renderer.read_frame();
    for (glm::vec4& n : frame.normal_ws) n.w = n == glm::vec4(0) ? 0.0f : 1.0f;
    const RayScene rays(scene);
    const RayReceivers receivers = receivers_of(PreciseScene(scene), scene.camera, frame.depth, frame.normal_ws, scene.lights[0]);
    const std::vector<float> seen = trace_visibility(rays, scene.lights[0], receivers, {.samples = 64});
    std::size_t wrong = 0, checked = 0;
    for (const std::uint32_t i : receivers.pixels) {
      const glm::dvec3 to_light = scene.lights[0].position - glm::dvec3(frame.position_ws[i]);
      const double height = glm::dot(glm::dvec3(frame.normal_ws[i]), to_light);
      if (height < scene.lights[0].radius * 1.01) continue;  // part of the disc is below this face's horizon
      ++checked;
      wrong += seen[i] != 1.0f;
    }
    EXPECT_GT(checked, 1000u);
    EXPECT_EQ(wrong, 0u) << "scale " << scale;
  }
}

}  // namespace
}  // namespace halfshade
