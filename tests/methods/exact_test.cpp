// Method exact against closed forms, against brute force in double precision sample by sample, and against rays.
#include <random>

#include "device/embedded_kernels.hpp"
#include "report/rays.hpp"
#include "report/reference.hpp"
#include "support/closed_forms.hpp"
#include "support/draw.hpp"
#include "support/scenes.hpp"

namespace halfshade {
namespace {

using ExactTest = ShapedKernelTest;
HS_IN_BOTH_SHAPES(ExactTest);

Drawn draw(const KernelRunner& runner, const Scene& scene, const Settings& settings) {
  return draw(runner.device, scene, settings);
}

Settings exact(unsigned samples, SamplePattern pattern = SamplePattern::fixed) {
  Settings settings;
  settings.method = Method::exact;
  settings.light_resolution_px = 256;
  settings.samples = samples;
  settings.sample_pattern = pattern;
  return settings;
}

RayReceivers receivers_of(const Scene& scene, const Frame& frame) {
  return receivers_of(PreciseScene(scene), scene.camera, frame.depth, frame.normal_ws, scene.lights[0]);
}

/// Which of the samples each counted pixel sees, by brute force.
std::vector<std::vector<bool>> brute_force(const Scene& scene, const RayReceivers& receivers, unsigned samples) {
  const Reference all(scene);
  const Light& light = scene.lights[0];
  const glm::dmat4 light_from_world = light_frustum(light).view_from_world;
  const glm::dvec3 right(light_from_world[0][0], light_from_world[1][0], light_from_world[2][0]);
  const glm::dvec3 up(light_from_world[0][1], light_from_world[1][1], light_from_world[2][1]);
  std::vector<std::vector<bool>> sees;
  for (const glm::dvec3& point_ws : receivers.points_ws) {
    std::vector<bool>& seen = sees.emplace_back();
    for (const glm::dvec2& s : light_points(light, samples).points)
      seen.push_back(!all.is_occluded(point_ws - all.origin_ws(),
                                      light.position + disc_radius(light) * (s.x * right + s.y * up) - all.origin_ws()));
  }
  return sees;
}

/// How many they are.
std::vector<unsigned> brute_force_counts(const Scene& scene, const RayReceivers& receivers, unsigned samples) {
  std::vector<unsigned> counts;
  for (const std::vector<bool>& seen : brute_force(scene, receivers, samples))
    counts.push_back(static_cast<unsigned>(std::count(seen.begin(), seen.end(), true)));
  return counts;
}

/// Every counted pixel has the samples that brute force has, but for a few where one sample lies within rounding of an edge.
void expect_brute_force(const KernelRunner& runner, const Scene& scene, unsigned samples) {
  const Drawn drawn = draw(runner, scene, exact(samples));
  const RayReceivers receivers = receivers_of(scene, drawn.frame);
  ASSERT_GT(receivers.pixels.size(), 500u);
  const std::vector<unsigned> expected = brute_force_counts(scene, receivers, samples);
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

TEST_P(ExactTest, AgreesWithDiscsSmallerAndLargerThanTheLightInClosedForm) {
  for (const double radius : {0.2, 0.5, 0.9}) {
    const Scene scene = floor_scene({placed("disc", disc_mesh(), {0, 5, 0}, glm::dvec3(radius))});
    // At half height it is seen from p twice as large, about -p.
    const Frame frame = draw(runner_, scene, exact(1024)).frame;
    expect_on_floor(frame, 0.012, [&](const glm::dvec3& p) { return 1 - lens(2 * radius, std::hypot(p.x, p.z)) / M_PI; });
    // An umbra beneath the larger one alone; the light is never all hidden by the smaller.
    EXPECT_EQ(std::ranges::count(frame.visibility[0], 0.0f) > 20, radius > 0.5) << radius;
  }
}

TEST_P(ExactTest, AChainOfThreeHidesWhatTheyHideTogether) {
  // Each overlaps the next, at heights of their own; seen from (x, .), a place a at height y is at x + (a - x) 10 / y.
  struct Strip {
    double x0, x1, y;
  };
  constexpr Strip strips[] = {{-0.55, -0.15, 4}, {-0.25, 0.3, 6}, {0.15, 0.5, 5}};
  const Scene scene = floor_scene({sheet(strips[0].x0, strips[0].x1, -100, 100, strips[0].y),
                                   sheet(strips[1].x0, strips[1].x1, -100, 100, strips[1].y),
                                   sheet(strips[2].x0, strips[2].x1, -100, 100, strips[2].y)});
  const Frame frame = draw(runner_, scene, exact(1024)).frame;
  expect_on_floor(frame, 0.012, [&](const glm::dvec3& p) {
    std::vector<std::pair<double, double>> hidden;
    for (const Strip& strip : strips)
      hidden.emplace_back(p.x + (strip.x0 - p.x) * 10 / strip.y, p.x + (strip.x1 - p.x) * 10 / strip.y);
    std::ranges::sort(hidden);
    double seen = 1.0, from = -1e9;
    for (const auto& [begin, end] : hidden)
      if (end > from) {
        seen -= disc_beyond(std::max(begin, from)) - disc_beyond(end);
        from = end;
      }
    return seen;
  });
  EXPECT_GT(std::ranges::count_if(frame.visibility[0], [](float seen) { return seen < 0.5f; }), 200);
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

/// Boxes of random places, sizes and turns over a floor.
Scene random_boxes(std::mt19937& random, glm::uvec2 resolution) {
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  Scene scene = box_over_floor(resolution);
  for (int i = 0; i < 8; ++i) {
    const glm::dvec3 place{unit(random) * 3 - 1.5, 0.2 + unit(random) * 2, unit(random) * 3 - 1.5},
        size{0.1 + 0.6 * unit(random), 0.1 + 0.6 * unit(random), 0.1 + 0.6 * unit(random)},
        turn_deg{unit(random) * 360, unit(random) * 360, unit(random) * 360};
    scene.meshes.push_back(placed("box" + std::to_string(i), box_mesh(), place, size, turn_deg));
  }
  return scene;
}

TEST_P(ExactTest, HasTheSamplesOfBruteForceInRandomBoxes) {
  std::mt19937 random(8);
  for (int round = 0; round < 4; ++round) {
    Scene scene = random_boxes(random, {48, 40});
    scene.lights[0].radius = round % 2 ? 1.5 : 0.2;
    expect_brute_force(runner_, scene, 64);
  }
}

TEST_P(ExactTest, HasTheSamplesOfBruteForceInATriangleSoup) {
  // Open, intersecting, wound at random, with an edge of five faces in each fan: under a wide light, most planes cut the disc.
  std::mt19937 random(3);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  std::vector<glm::dvec3> corners;
  std::vector<glm::uvec3> triangles;
  for (unsigned fan = 0; fan < 6; ++fan) {
    const glm::dvec3 middle{1.5 * unit(random), 1.3 + unit(random), 1.5 * unit(random)};
    const unsigned first = fan * 7;
    for (int i = 0; i < 7; ++i) corners.push_back(middle + 0.6 * glm::dvec3{unit(random), unit(random), unit(random)});
    for (unsigned tip = first + 2; tip < first + 7; ++tip)
      triangles.push_back(tip % 3 ? glm::uvec3(first, first + 1, tip) : glm::uvec3(first + 1, first, tip));
  }
  Scene scene = box_over_floor({64, 56});
  scene.meshes[1] = placed("soup", std::make_shared<Mesh>(make_mesh("soup", corners, triangles)), {0, 0, 0}, glm::dvec3(1));
  for (const double radius : {scene.lights[0].radius, 2.0}) {
    scene.lights[0].radius = radius;
    expect_brute_force(runner_, scene, 64);
  }
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
  // A low light: part of the disc is below the floor, and the floor itself hides it from what stands on it.
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
  const RayReceivers receivers = receivers_of(scene, drawn.frame);
  const std::vector<unsigned> expected = brute_force_counts(scene, receivers, 1);
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
      const RayReceivers receivers = receivers_of(scene, drawn.frame);
      const std::vector<float> truth =
          trace_visibility(rays, scene.lights[0], receivers, {.samples = 256, .rotate = pattern == SamplePattern::rotated});
      const ErrorFigures figures = compare_visibility(drawn.frame.visibility[0], truth, receivers.kinds);
      EXPECT_GT(figures.penumbra_pixels, 300u) << name;
      EXPECT_LE(figures.rmse, 1e-4) << name;
      EXPECT_LE(figures.max_error, 0.02) << name;
      EXPECT_EQ(drawn.stats.lights[0].negative_pixels, 0u) << name;
    }
}

/// A bumpy sphere of `around` x `around` / 2 faces, closed.
SceneMesh bumpy_sphere(unsigned around, const glm::dvec3& at, double radius) {
  const unsigned rings = around / 2;
  std::vector<glm::dvec3> corners = {{0, 1, 0}};
  for (unsigned ring = 1; ring < rings; ++ring)
    for (unsigned i = 0; i < around; ++i) {
      const double polar = M_PI * ring / rings, turn = 2 * M_PI * i / around;
      const double r = 1 + 0.15 * std::sin(6 * turn) * std::sin(5 * polar);
      corners.emplace_back(r * std::sin(polar) * std::cos(turn), r * std::cos(polar), r * std::sin(polar) * std::sin(turn));
    }
  corners.emplace_back(0, -1, 0);
  const auto corner = [&](unsigned ring, unsigned i) {
    if (ring == 0) return 0u;
    if (ring == rings) return static_cast<unsigned>(corners.size()) - 1;
    return 1 + (ring - 1) * around + i % around;
  };
  std::vector<glm::uvec3> triangles;
  for (unsigned ring = 0; ring < rings; ++ring)
    for (unsigned i = 0; i < around; ++i) {
      if (ring > 0) triangles.emplace_back(corner(ring, i), corner(ring, i + 1), corner(ring + 1, i));
      if (ring + 1 < rings) triangles.emplace_back(corner(ring, i + 1), corner(ring + 1, i + 1), corner(ring + 1, i));
    }
  return placed("sphere", std::make_shared<Mesh>(make_mesh("sphere", corners, triangles)), at, glm::dvec3(radius));
}

/// Many short edges, over a floor and over themselves, before a light that the planes of many faces cut.
Scene spheres_and_boxes(std::mt19937& random, double light_radius) {
  Scene scene = random_boxes(random, {160, 128});
  scene.meshes.push_back(bumpy_sphere(128, {0.2, 0.9, 0.1}, 0.7));
  for (int i = 0; i < 6; ++i) scene.meshes.push_back(sheet(-1.2 + 0.4 * i, -0.9 + 0.4 * i, -1.0, 1.2, 0.01 + 0.02 * i));
  scene.lights[0].radius = light_radius;
  return scene;
}

TEST(Exact, PropagationAgreesWithCountingForEachReceiver) {
  // On CPU devices one receiver of a group counts crossings, which is propagated to the others; on GPU devices each counts.
  std::mt19937 random(17);
  for (const double light_radius : {0.002, 0.3, 1.5}) {
    for (const double height : {1.0, 0.35}) {
      Scene scene = spheres_and_boxes(random, light_radius);
      scene.lights[0].position.y *= height;
      const Drawn together = draw(KernelRunner("wide"), scene, exact(256)),
                  alone = draw(KernelRunner("narrow"), scene, exact(256));
      std::size_t partly = 0, differing = 0;
      for (std::size_t i = 0; i < alone.frame.depth.size(); ++i) {
        const float seen = together.frame.visibility[0][i];
        partly += seen > 0.0f && seen < 1.0f;
        differing += seen != alone.frame.visibility[0][i];
        EXPECT_NEAR(seen, alone.frame.visibility[0][i], 1.5 / 256);
      }
      EXPECT_GT(partly, light_radius > 0.1 ? 500u : 5u);
      EXPECT_LE(differing, 2u) << light_radius << ", " << height;
      EXPECT_EQ(together.stats.lights[0].negative_pixels, 0u);
    }
  }
}

/// The device with kernels that do not know of some instructions of its processor.
KernelRunner without(const std::vector<std::string>& instructions) {
  const TempFolder folder;
  for (const EmbeddedKernel& kernel : embedded_kernels()) {
    std::string text(kernel.text);
    if (kernel.file == "base/lanes.h")
      for (const std::string& macro : instructions) text = "#undef " + macro + "\n" + text;
    folder.write(kernel.file, text);
  }
  KernelRunner runner("wide");
  const char* variable = std::getenv("HALFSHADE_KERNELS");
  const std::string before = variable ? variable : "";  // an empty one is as good as none
  setenv("HALFSHADE_KERNELS", (folder / "").c_str(), 1);
  runner.device = std::dynamic_pointer_cast<DeviceImpl>(open_device("wide"));
  setenv("HALFSHADE_KERNELS", before.c_str(), 1);
  return runner;
}

TEST(Exact, OtherInstructionsCountTheSame) {
  std::mt19937 random(17);
  const Scene scene = spheres_and_boxes(random, 0.3);
  const std::vector<float> expected = draw(KernelRunner("wide"), scene, exact(256)).frame.visibility[0];
  EXPECT_EQ(draw(without({"__AVX512DQ__", "__AVX512F__"}), scene, exact(256)).frame.visibility[0], expected);
  EXPECT_EQ(draw(without({"__AVX512DQ__", "__AVX512F__", "__AVX2__"}), scene, exact(256)).frame.visibility[0], expected);
}

TEST(Exact, PropagationAgreesAboutColours) {
  // Of the spot's samples there are more in one place than a window's capacity.
  LightTexture halves{"halves", {2, 1}, {{2, 0, 0}, {0, 0, 6}}}, spot{"spot", {4, 4}, std::vector<glm::vec3>(16, {1, 0, 0})};
  spot.texels[5] = {0, 50, 200};
  for (const auto& [texture, size] : {std::pair{halves, glm::dvec2(1.5, 1.0)}, {spot, glm::dvec2(6.0, 4.0)}}) {
    std::mt19937 random(19);
    Scene scene = spheres_and_boxes(random, 0.0);
    scene.lights[0].shape = LightShape::rectangle;
    scene.lights[0].size = size;
    scene.lights[0].texture = std::make_shared<LightTexture>(texture);
    const Frame together = draw(KernelRunner("wide"), scene, exact(256)).frame,
                alone = draw(KernelRunner("narrow"), scene, exact(256)).frame;
    std::size_t partly = 0, differing = 0;
    for (std::size_t i = 0; i < alone.depth.size(); ++i) {
      partly += alone.visibility[0][i] > 0.0f && alone.visibility[0][i] < 1.0f;
      differing += glm::distance(together.rgb[i], alone.rgb[i]) > 1e-5f;
    }
    EXPECT_GT(partly, 500u);
    EXPECT_LE(differing, 2u) << texture.name;
  }
}

TEST_P(ExactTest, MoreSamplesBringItNearerToTheTruth) {
  std::mt19937 random(11);
  Scene scene = random_boxes(random, {96, 80});
  scene.lights[0].radius = 0.6;
  const RayScene rays(scene);
  double before = 1.0;
  for (const unsigned samples : {16u, 64u, 256u, 1024u}) {
    const Drawn drawn = draw(runner_, scene, exact(samples));
    const RayReceivers receivers = receivers_of(scene, drawn.frame);
    const std::vector<float> truth = trace_visibility(rays, scene.lights[0], receivers, {.samples = 4096, .seed = 5});
    const double error = compare_visibility(drawn.frame.visibility[0], truth, receivers.kinds).penumbra_rmse;
    EXPECT_LT(error, 0.7 * before) << samples;
    before = error;
  }
  EXPECT_LT(before, 0.004);
}

/// A G-buffer of positions in a renderer of the scene.
std::vector<float> draw_positions(const KernelRunner& runner, const Scene& scene, const Settings& settings,
                                  const std::vector<glm::vec4>& position_ws, const std::vector<glm::vec4>& normal_ws,
                                  double tolerance = 0.0) {
  Renderer renderer(runner.device);
  renderer.set_scene(scene);
  const Buffer<cl_float4> position = runner.buffer<cl_float4>(position_ws), normal = runner.buffer<cl_float4>(normal_ws);
  const Buffer<cl_float> visibility = runner.filled(position_ws.size(), -1.0f);
  renderer.enqueue_visibility({.gbuffer = {.resolution = scene.camera.resolution,
                                           .position = position.memory()(),
                                           .normal = normal.memory()(),
                                           .tolerance = tolerance},
                               .settings = settings,
                               .visibility = visibility.memory()()});
  return runner.read<float>(visibility, position_ws.size());
}

TEST_P(ExactTest, ReadsPositionsInsteadOfDepths) {
  std::mt19937 random(3);
  const Scene scene = random_boxes(random, {96, 80});
  const Drawn drawn = draw(runner_, scene, exact(64));
  // Pixels as large as these have their points off the surface by up to a 256th of one: what a rasterizer costs, and what depths
  // are allowed by default. For positions the tolerance says by how much.
  const double pixel = 2 * std::tan(glm::radians(scene.camera.yfov_deg / 2)) / scene.camera.resolution.y;
  const double tolerance = glm::distance(scene.camera.position, scene.camera.target) * pixel / 256;
  const std::vector<float> got =
      draw_positions(runner_, scene, exact(64), drawn.frame.position_ws, drawn.frame.normal_ws, tolerance);
  std::size_t partly = 0, off = 0;
  for (std::size_t i = 0; i < got.size(); ++i) {
    partly += got[i] > 0.0f && got[i] < 1.0f;
    off += got[i] != drawn.frame.visibility[0][i];
    // Where things touch it matters how far receivers are lifted, to a few samples.
    EXPECT_NEAR(got[i], drawn.frame.visibility[0][i], 6.5 / 64) << i;
  }
  EXPECT_GT(partly, 200u);
  EXPECT_LE(off, got.size() / 250);
}

TEST_P(ExactTest, AMirroredSceneHasTheMirroredVisibility) {
  // A line of light that lies in the mirror: its samples are their own mirror images. The receivers are given, mirrored bit for
  // bit, for the rasterizer's pixels are not their own.
  std::mt19937 random(5);
  Scene scene = random_boxes(random, {64, 56}), mirrored = scene;
  const auto mirror = [](glm::dvec3& v) { v.x = -v.x; };
  const Drawn drawn = draw(runner_, scene, exact(64));
  for (Scene* one : {&scene, &mirrored}) {
    one->lights[0].position.x = one->lights[0].target.x = 0.0;
    one->lights[0].shape = LightShape::rectangle;
    one->lights[0].size = {0.0, 1.5};
  }
  mirror(mirrored.camera.position);
  mirror(mirrored.camera.target);
  for (SceneMesh& mesh : mirrored.meshes) mirror_in_x(mesh);
  std::vector<glm::vec4> position = drawn.frame.position_ws, normal = drawn.frame.normal_ws;
  const std::vector<float> seen = draw_positions(runner_, scene, exact(64), position, normal);
  for (glm::vec4& p : position) p.x = -p.x;
  for (glm::vec4& n : normal) n.x = -n.x;
  EXPECT_EQ(draw_positions(runner_, mirrored, exact(64), position, normal), seen);
  EXPECT_GT(std::count_if(seen.begin(), seen.end(), [](float v) { return v > 0.0f && v < 1.0f; }), 100);
}

// ------------------------------------------------------------------------------------------------------------ light shapes

std::shared_ptr<const LightTexture> texture(glm::uvec2 resolution, std::vector<glm::vec3> texels) {
  return std::make_shared<LightTexture>(LightTexture{"test", resolution, std::move(texels)});
}

/// The floor's light as a rectangle. Its right is the world's -x: it faces down, and its up is +z.
Scene under_a_rectangle(Scene scene, glm::dvec2 size, std::shared_ptr<const LightTexture> picture = nullptr) {
  scene.lights[0].shape = LightShape::rectangle;
  scene.lights[0].size = size;
  scene.lights[0].texture = std::move(picture);
  return scene;
}

Settings light_samples_256() {
  return {.method = Method::light_samples, .light_resolution_px = 512, .samples = 256};
}

TEST_P(ExactTest, AgreesWithAHalfPlaneAcrossARectangleInClosedForm) {
  // Its edge x = 0 at half height is seen from (x, 0) to cross the light at -x.
  const Scene scene = under_a_rectangle(floor_scene({sheet(-100, 0, -100, 100, 5)}), {1.6, 0.5});
  const auto expected = [](const glm::dvec3& p) { return std::clamp(0.5 + p.x / 1.6, 0.0, 1.0); };
  expect_on_floor(draw(runner_, scene, exact(1024)).frame, 0.01, expected);
  expect_on_floor(draw(runner_, scene, light_samples_256()).frame, 0.08, expected);
}

TEST_P(ExactTest, AcrossItARectangleIsAsNarrowAsItIsHigh) {
  const Scene scene = under_a_rectangle(floor_scene({sheet(-100, 100, -100, 0, 5)}), {1.6, 0.5});
  const auto expected = [](const glm::dvec3& p) { return std::clamp(0.5 + p.z / 0.5, 0.0, 1.0); };
  expect_on_floor(draw(runner_, scene, exact(1024)).frame, 0.01, expected);
}

TEST_P(ExactTest, HasTheSamplesOfBruteForceUnderARectangle) {
  std::mt19937 random(2);
  for (const glm::dvec2 size : {glm::dvec2(1.2, 0.3), glm::dvec2(0.4, 2.0), glm::dvec2(0.0, 1.0)})
    expect_brute_force(runner_, under_a_rectangle(random_boxes(random, {48, 40}), size), 64);
}

TEST_P(ExactTest, AgreesWithRaysFromARectangle) {
  Scene scene = load_scene(std::filesystem::path(HALFSHADE_DATA_DIR) / "scenes" / "primitives.json");
  scene.camera.resolution = {160, 160};
  scene = under_a_rectangle(scene, {1.5, 0.4}, texture({2, 2}, {{1, 2, 3}, {0, 0, 0}, {0.2, 0.1, 0.2}, {5, 5, 1}}));
  Settings settings = exact(256);
  settings.light_resolution_px = 512;
  const Drawn drawn = draw(runner_, scene, settings);
  const RayScene rays(scene);
  const RayReceivers receivers = receivers_of(scene, drawn.frame);
  const std::vector<float> truth = trace_visibility(rays, scene.lights[0], receivers, {.samples = 256});
  const ErrorFigures figures = compare_visibility(drawn.frame.visibility[0], truth, receivers.kinds);
  EXPECT_GT(figures.penumbra_pixels, 300u);
  EXPECT_LE(figures.rmse, 1e-4);
  EXPECT_LE(figures.max_error, 0.02);
}

TEST_P(ExactTest, OfATextureOnlyTheLitPartCounts) {
  // White towards the world's +x, black towards -x, which is hidden from where x > 0.
  const Scene scene =
      under_a_rectangle(floor_scene({sheet(-100, 0, -100, 100, 5)}), {2, 0.5}, texture({2, 1}, {{1, 1, 1}, {0, 0, 0}}));
  const auto expected = [](const glm::dvec3& p) { return std::clamp(1.0 + p.x, 0.0, 1.0); };
  expect_on_floor(draw(runner_, scene, exact(1024)).frame, 0.01, expected);
  expect_on_floor(draw(runner_, scene, light_samples_256()).frame, 0.1, expected);
}

TEST_P(ExactTest, ATexturedLightHasTheColourOfWhatIsSeenOfIt) {
  // Red towards +x, blue of about the same luminance towards -x.
  const std::shared_ptr<const LightTexture> picture = texture({2, 1}, {{2, 0, 0}, {0, 0, 6}});
  const Scene hidden = under_a_rectangle(floor_scene({sheet(-100, 0, -100, 100, 5)}), {2, 0.5}, picture);
  const Scene open = under_a_rectangle(floor_scene({}), {2, 0.5}, picture);
  for (const Settings& settings : {exact(1024), light_samples_256()}) {
    const Frame whole = draw(runner_, open, settings).frame, part = draw(runner_, hidden, settings).frame;
    std::size_t tested = 0;
    for (std::size_t i = 0; i < whole.rgb.size(); ++i) {
      const glm::dvec3 p = part.position_ws[i];
      if (whole.depth[i] == 0.0f || whole.depth[i] != part.depth[i] || std::abs(p.x) > 1.1) continue;
      ++tested;
      EXPECT_NEAR(whole.rgb[i].b, 3 * whole.rgb[i].r, 1e-5);
      EXPECT_EQ(whole.rgb[i].g, 0.0f);
      EXPECT_NEAR(part.rgb[i].r / whole.rgb[i].r, std::clamp(1.0 + p.x, 0.0, 1.0), 0.1);
      EXPECT_NEAR(part.rgb[i].b / whole.rgb[i].b, std::clamp(p.x, 0.0, 1.0), 0.1);
      if (p.x < -0.1) {
        EXPECT_EQ(part.rgb[i].b, 0.0f);
      }
    }
    EXPECT_GT(tested, 200u);
  }
}

TEST_P(ExactTest, SeesTheVerySamplesThatBruteForceSees) {
  // 4 x 4 texels of one luminance, so that each holds one of 16 samples, with powers of two as their red, or blue: the colour
  // says which samples are seen.
  const unsigned samples = 16;
  std::vector<glm::vec3> texels;
  for (int i = 0; i < 16; ++i) {
    const float bit = static_cast<float>(1 << i % 8) / 256.0f, red = i < 8 ? bit : 0.0f, blue = i < 8 ? 0.0f : bit;
    texels.emplace_back(red, (1.0f - 0.2126f * red - 0.0722f * blue) / 0.7152f, blue);
  }
  std::mt19937 random(23);
  Scene scene = random_boxes(random, {64, 56});
  scene.ambient = glm::vec3(0.0f);
  scene = under_a_rectangle(scene, {1.2, 0.9}, texture({4, 4}, texels));
  Scene open = scene;
  for (SceneMesh& mesh : open.meshes) mesh.casts_shadow = false;
  const Frame seen = draw(runner_, scene, exact(samples)).frame, all = draw(runner_, open, exact(samples)).frame;

  const LightPoints points = light_points(scene.lights[0], samples);
  const RayReceivers receivers = receivers_of(scene, draw(runner_, scene, exact(samples)).frame);
  const std::vector<std::vector<bool>> expected = brute_force(scene, receivers, samples);
  std::size_t partly = 0, differing = 0;
  for (std::size_t i = 0; i < receivers.pixels.size(); ++i) {
    const std::size_t pixel = receivers.pixels[i];
    unsigned expected_red = 0, expected_blue = 0;
    for (unsigned s = 0; s < samples; ++s) {
      expected_red += expected[i][s] ? static_cast<unsigned>(std::lround(points.weights[s].r * 255 / samples)) : 0;
      expected_blue += expected[i][s] ? static_cast<unsigned>(std::lround(points.weights[s].b * 255 / samples)) : 0;
    }
    const bool same = std::lround(255 * seen.rgb[pixel].r / all.rgb[pixel].r) == expected_red &&
                      std::lround(255 * seen.rgb[pixel].b / all.rgb[pixel].b) == expected_blue;
    partly += expected_red > 0 && expected_red < 255;
    differing += !same;
  }
  EXPECT_GT(partly, 100u);
  EXPECT_LE(differing, 2 + receivers.pixels.size() / 1000);
}

TEST(Exact, OtherMethodsThatKnowDiscsAloneRefuseRectangles) {
  Renderer renderer(test_device());
  renderer.set_scene(under_a_rectangle(box_over_floor(), {1, 1}));
  for (const MethodInfo& info : methods()) {
    if (info.any_shape)
      renderer.render({.method = info.method, .samples = 16});
    else
      expect_error<InputError>([&] { renderer.render({.method = info.method}); },
                               {"light 'key'", "rectangle", info.name, "choose hard, pcf, light-samples, exact"});
  }
  expect_error<InputError>([&] { renderer.render(exact(64, SamplePattern::rotated)); }, {"light 'key'", "'fixed'"});
  EXPECT_FALSE(info_of(Method::fins).any_shape);
}

TEST_P(ExactTest, AliasFreeChangesNothingButHowItIsDecided) {
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
  expect_error<InputError>([&] { renderer.render(exact(100)); }, {"render: samples: expected 16, 64, 256 or 1024 (found '100')"});
  renderer.render(exact(16));  // and goes on after that
  EXPECT_EQ(renderer.read_frame().visibility.size(), 1u);
}

}  // namespace
}  // namespace halfshade
