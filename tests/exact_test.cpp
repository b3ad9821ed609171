// Method exact against closed forms, against brute force in double precision sample by sample, and against rays.
#include <random>

#include "brute_force.hpp"
#include "kernel_fixture.hpp"
#include "rays.hpp"
#include "scenes.hpp"

namespace halfshade {
namespace {

using ExactTest = ShapedKernelTest;
HS_IN_BOTH_SHAPES(ExactTest);

struct Drawn {
  Frame frame;
  FrameStats stats;
};

Drawn draw(const KernelRunner& runner, const Scene& scene, const Settings& settings) {
  Renderer renderer(runner.device);
  renderer.set_scene(scene);
  renderer.render(settings);
  Drawn drawn{renderer.read_frame(), renderer.stats()};
  for (std::size_t i = 0; i < drawn.frame.depth.size(); ++i)
    drawn.frame.normal_ws[i].w = drawn.frame.depth[i] > 0.0f ? 1.0f : 0.0f;
  return drawn;
}

Settings exact(unsigned samples, SamplePattern pattern = SamplePattern::fixed) {
  Settings settings;
  settings.method = Method::exact;
  settings.light_resolution_px = 256;
  settings.samples = samples;
  settings.sample_pattern = pattern;
  return settings;
}

RayReceivers receivers_of(const RayScene& rays, const Scene& scene, const Frame& frame) {
  return rays.receivers(scene.camera, frame.depth, frame.normal_ws, scene.lights[0]);
}

/// How many of the samples each counted pixel sees, by brute force.
std::vector<unsigned> brute_force_counts(const Scene& scene, const RayScene& rays, const RayReceivers& receivers,
                                         unsigned samples) {
  const BruteForce all(scene);
  const Light& light = scene.lights[0];
  const glm::dmat4 light_from_world = light_frustum(light).view_from_world;
  const glm::dvec3 right(light_from_world[0][0], light_from_world[1][0], light_from_world[2][0]);
  const glm::dvec3 up(light_from_world[0][1], light_from_world[1][1], light_from_world[2][1]);
  std::vector<unsigned> counts;
  for (const glm::vec3& origin : receivers.origins) {
    unsigned seen = 0;
    for (const glm::dvec2& s : disc_samples(samples))
      seen += !all.occluded(glm::dvec3(origin) + rays.origin_ws(), light.position + light.radius * (s.x * right + s.y * up));
    counts.push_back(seen);
  }
  return counts;
}

/// Every counted pixel has the samples that brute force has, but for a few where one sample lies within rounding of an edge.
void expect_brute_force(const KernelRunner& runner, const Scene& scene, unsigned samples) {
  const Drawn drawn = draw(runner, scene, exact(samples));
  const RayScene rays(scene);
  const RayReceivers receivers = receivers_of(rays, scene, drawn.frame);
  ASSERT_GT(receivers.pixels.size(), 500u);
  const std::vector<unsigned> expected = brute_force_counts(scene, rays, receivers, samples);
  std::size_t partly = 0, differing = 0;
  for (std::size_t i = 0; i < receivers.pixels.size(); ++i) {
    const float seen = drawn.frame.visibility[0][receivers.pixels[i]] * static_cast<float>(samples);
    partly += expected[i] > 0 && expected[i] < samples;
    differing += seen != static_cast<float>(expected[i]);
    EXPECT_NEAR(seen, static_cast<float>(expected[i]), 1.5f)
        << "pixel " << receivers.pixels[i] % scene.camera.resolution.x << ',' << receivers.pixels[i] / scene.camera.resolution.x;
  }
  EXPECT_GT(partly, 50u) << "the scene has no penumbra to test";
  EXPECT_LE(differing, 2 + receivers.pixels.size() / 500);
  EXPECT_EQ(drawn.stats.lights[0].negative_pixels, 0u);
}

/// A rectangle at height y.
SceneMesh sheet(double x0, double x1, double z0, double z1, double y) {
  const std::vector<glm::dvec3> corners = {{x0, y, z0}, {x1, y, z0}, {x1, y, z1}, {x0, y, z1}};
  const std::vector<glm::uvec3> triangles = {{0, 1, 2}, {0, 2, 3}};
  static unsigned number = 0;  // names are a scene's own
  return placed("sheet" + std::to_string(number++), std::make_shared<Mesh>(make_mesh("sheet", corners, triangles)), {0, 0, 0},
                glm::dvec3(1));
}

/// Sheets above a floor, a light of radius 1 at height 10 above it, facing down, and a camera below the sheets.
Scene floor_scene(std::vector<SceneMesh> casters) {
  Scene scene;
  scene.name = "floor";
  scene.meshes = std::move(casters);
  scene.meshes.push_back(placed("floor", ground_mesh(), {0, 0, 0}, glm::dvec3(40)));
  scene.camera = {.position = {0, 1.5, 2.5}, .target = {0, 0, 0}, .yfov_deg = 60, .resolution = {64, 64}};
  scene.lights = {{.name = "key", .position = {0, 10, 0}, .target = {0, 0, 0}, .up = {}, .radius = 1.0, .cone_deg = 120}};
  return scene;
}

/// The part of a unit disc on the far side of a chord at signed distance u from the centre.
double disc_beyond(double u) {
  u = std::clamp(u, -1.0, 1.0);
  return 0.5 - (std::asin(u) + u * std::sqrt(1 - u * u)) / M_PI;
}

/// Where `expected` is a number.
void expect_on_floor(const Frame& frame, double tolerance, const std::function<double(const glm::dvec3&)>& expected) {
  for (std::size_t i = 0; i < frame.depth.size(); ++i)
    if (frame.depth[i] > 0.0f && frame.normal_ws[i].y > 0.9f && std::abs(frame.position_ws[i].y) < 0.01f) {
      const double value = expected(frame.position_ws[i]);
      if (std::isnan(value)) continue;
      ASSERT_NEAR(frame.visibility[0][i], value, tolerance) << frame.position_ws[i].x << ", " << frame.position_ws[i].z;
    }
}

TEST_P(ExactTest, AgreesWithAHalfPlaneInClosedForm) {
  // The edge x = 0 at half height is seen from (x, 0) to cross the disc at -x.
  const Scene scene = floor_scene({sheet(-100, 0, -100, 100, 5)});
  expect_on_floor(draw(runner_, scene, exact(1024)).frame, 0.008, [](const glm::dvec3& p) { return disc_beyond(-p.x); });
}

TEST_P(ExactTest, TwoHalvesOfALightHideAllOfIt) {
  // Either half hides half of the light, at different heights and from different sides.
  const Scene complementary = floor_scene({sheet(-100, 0.5, -100, 100, 5), sheet(0.4, 100, -100, 100, 6)});
  expect_on_floor(draw(runner_, complementary, exact(256)).frame, 0.0,
                  [](const glm::dvec3& p) { return std::abs(p.x) < 0.9 ? 0.0 : NAN; });
}

TEST_P(ExactTest, ASecondEqualSheetHidesNothingMore) {
  const Scene one = floor_scene({sheet(-100, 0, -100, 100, 5)});
  const Scene two = floor_scene({sheet(-100, 0, -100, 100, 5), sheet(-100, -0.4, -100, 100, 7)});
  const Drawn drawn = draw(runner_, one, exact(256)), again = draw(runner_, two, exact(256));
  EXPECT_EQ(again.frame.visibility[0], drawn.frame.visibility[0]);
}

TEST_P(ExactTest, ASquareHoleIsSeenThrough) {
  // A frame of four sheets round a hole of half side 0.25: from below its middle, the hole is the square of half side 0.5.
  const Scene scene = floor_scene({sheet(-50, -0.25, -50, 50, 5), sheet(0.25, 50, -50, 50, 5), sheet(-0.25, 0.25, -50, -0.25, 5),
                                   sheet(-0.25, 0.25, 0.25, 50, 5)});
  const Frame frame = draw(runner_, scene, exact(1024)).frame;
  std::size_t tested = 0;
  for (std::size_t i = 0; i < frame.depth.size(); ++i)
    if (frame.depth[i] > 0.0f && glm::length(glm::dvec2(frame.position_ws[i].x, frame.position_ws[i].z)) < 0.1) {
      ++tested;
      EXPECT_NEAR(frame.visibility[0][i], 1.0 / M_PI, 0.01);
    }
  EXPECT_GT(tested, 3u);
}

TEST_P(ExactTest, HasTheSamplesOfBruteForceUnderABox) {
  expect_brute_force(runner_, box_over_floor({64, 56}), 64);
}

TEST_P(ExactTest, HasTheSamplesOfBruteForceInRandomBoxes) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  for (int round = 0; round < 4; ++round) {
    Scene scene = box_over_floor({48, 40});
    for (int i = 0; i < 8; ++i)
      scene.meshes.push_back(placed("box" + std::to_string(i), box_mesh(),
                                    {unit(random) * 3 - 1.5, 0.2 + unit(random) * 2, unit(random) * 3 - 1.5},
                                    glm::dvec3(0.1 + 0.6 * unit(random), 0.1 + 0.6 * unit(random), 0.1 + 0.6 * unit(random)),
                                    {unit(random) * 360, unit(random) * 360, unit(random) * 360}));
    scene.lights[0].radius = round % 2 ? 1.5 : 0.2;
    expect_brute_force(runner_, scene, 64);
  }
}

TEST_P(ExactTest, HasTheSamplesOfBruteForceInATriangleSoup) {
  // Open, intersecting, wound at random, with an edge of three faces in each fan.
  std::mt19937 random(3);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  std::vector<glm::dvec3> corners;
  std::vector<glm::uvec3> triangles;
  for (unsigned fan = 0; fan < 6; ++fan) {
    const glm::dvec3 middle(1.5 * unit(random), 1.3 + unit(random), 1.5 * unit(random));
    const unsigned first = fan * 5;
    for (int i = 0; i < 5; ++i) corners.push_back(middle + 0.6 * glm::dvec3(unit(random), unit(random), unit(random)));
    triangles.emplace_back(first, first + 1, first + 2);
    triangles.emplace_back(first, first + 1, first + 3);
    triangles.emplace_back(first + 1, first, first + 4);
  }
  Scene scene = box_over_floor({64, 56});
  scene.meshes[1] = placed("soup", std::make_shared<Mesh>(make_mesh("soup", corners, triangles)), {0, 0, 0}, glm::dvec3(1));
  expect_brute_force(runner_, scene, 64);
}

TEST_P(ExactTest, ACasterThroughTheLightsPlaneHidesOnlyWhatIsBefore) {
  // A wall that cuts through the disc, and one that stands on both sides of the light's plane beside it.
  Scene scene = box_over_floor({64, 56});
  scene.lights[0].radius = 0.8;
  scene.lights[0].position = {0, 4, 0};
  scene.lights[0].target = {0.2, 0, 0.1};
  scene.meshes[1] = placed("wall", box_mesh(), {0.1, 4.0, 0.1}, {0.05, 1.5, 3}, {5, 30, 10});
  scene.meshes.push_back(placed("beside", box_mesh(), {1.2, 3.9, 0}, {0.3, 1.0, 0.3}, {0, 10, 20}));
  expect_brute_force(runner_, scene, 64);
}

TEST_P(ExactTest, AFloorThatCutsTheLightHidesItsLowerPart) {
  // Low sun: part of the disc is below the floor, and the floor itself hides it from what stands on it.
  Scene scene = box_over_floor({64, 56});
  scene.lights[0].position = {4, 0.8, 1.0};
  scene.lights[0].target = {0, 0.5, 0};
  scene.lights[0].radius = 1.5;
  expect_brute_force(runner_, scene, 64);
}

TEST_P(ExactTest, RadiusZeroIsAHardShadowWithoutAliasing) {
  Scene scene = box_over_floor({64, 56});
  scene.lights[0].radius = 0.0;
  Settings settings = exact(16);
  settings.light_resolution_px = 32;  // a texel is many pixels wide
  const Drawn drawn = draw(runner_, scene, settings);
  const RayScene rays(scene);
  const RayReceivers receivers = receivers_of(rays, scene, drawn.frame);
  const std::vector<unsigned> expected = brute_force_counts(scene, rays, receivers, 1);
  std::size_t dark = 0;
  for (std::size_t i = 0; i < receivers.pixels.size(); ++i) {
    dark += expected[i] == 0;
    EXPECT_EQ(drawn.frame.visibility[0][receivers.pixels[i]], static_cast<float>(expected[i])) << receivers.pixels[i];
  }
  EXPECT_GT(dark, 100u);
}

TEST_P(ExactTest, AgreesWithRaysOnTheSameSamples) {
  for (const char* name : {"primitives", "overlap", "near-boxes"})
    for (const SamplePattern pattern : {SamplePattern::fixed, SamplePattern::rotated}) {
      Scene scene = load_scene(std::filesystem::path(HALFSHADE_DATA_DIR) / "scenes" / (std::string(name) + ".json"));
      scene.camera.resolution = {160, 160};
      Settings settings = exact(256, pattern);
      settings.light_resolution_px = 512;
      const Drawn drawn = draw(runner_, scene, settings);
      const RayScene rays(scene);
      const RayReceivers receivers = receivers_of(rays, scene, drawn.frame);
      const std::vector<float> truth =
          trace_visibility(rays, scene.lights[0], receivers, {.samples = 256, .rotate = pattern == SamplePattern::rotated});
      const ErrorFigures figures = compare_visibility(drawn.frame.visibility[0], truth, receivers.kinds);
      EXPECT_GT(figures.penumbra_pixels, 300u) << name;
      EXPECT_LE(figures.rmse, 2e-4) << name;
      EXPECT_LE(figures.max_error, 0.02) << name;
      EXPECT_EQ(drawn.stats.lights[0].negative_pixels, 0u) << name;
    }
}

TEST_P(ExactTest, AliasFreeChangesNothingButTheWayThere) {
  const Scene scene = box_over_floor({96, 80});
  Settings settings = exact(64);
  const Drawn by_map = draw(runner_, scene, settings);
  settings.alias_free = true;
  EXPECT_EQ(draw(runner_, scene, settings).frame.visibility[0], by_map.frame.visibility[0]);
}

TEST_P(ExactTest, DoesNotDependOnOrderOrOnTheFrameBefore) {
  Scene scene = load_scene(std::filesystem::path(HALFSHADE_DATA_DIR) / "scenes" / "primitives.json");
  scene.camera.resolution = {128, 128};
  Renderer renderer(runner_.device);
  renderer.set_scene(scene);
  renderer.render(exact(64));
  const Frame first = renderer.read_frame();
  for (int i = 0; i < 3; ++i) {
    renderer.render(exact(64));
    ASSERT_EQ(renderer.read_frame().visibility, first.visibility);
  }
  std::reverse(scene.meshes.begin(), scene.meshes.end());
  EXPECT_EQ(draw(runner_, scene, exact(64)).frame.visibility, first.visibility);
}

TEST(Exact, RefusesOtherNumbersOfSamples) {
  Renderer renderer(test_device());
  renderer.set_scene(box_over_floor());
  EXPECT_THROW(renderer.render(exact(100)), InputError);
  renderer.render(exact(16));  // and goes on after that
  EXPECT_EQ(renderer.read_frame().visibility.size(), 1u);
}

}  // namespace
}  // namespace halfshade
