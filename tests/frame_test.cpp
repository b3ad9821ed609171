// Whole frames: properties that hold whatever the picture.
#include <algorithm>
#include <random>

#include "comparator.hpp"
#include "kernel_fixture.hpp"
#include "scenes.hpp"
#include "temp_folder.hpp"

namespace halfshade {
namespace {

using FrameTest = ShapedKernelTest;
HS_IN_BOTH_SHAPES(FrameTest);

const std::vector<Settings>& all_settings() {
  static const std::vector<Settings> settings = {
      {.method = Method::hard, .light_resolution_px = 256},
      {.method = Method::pcf, .light_resolution_px = 256, .pcf_filter = 2},
      {.method = Method::pcf, .light_resolution_px = 256, .pcf_filter = 4},
      {.method = Method::pcss, .light_resolution_px = 256, .pcss_taps = 16},
      {.method = Method::pcss, .light_resolution_px = 256},
      {.method = Method::smoothies, .light_resolution_px = 256},
      {.method = Method::smoothies, .light_resolution_px = 256, .smoothie_width = 0.05},
      {.method = Method::penumbra_maps, .light_resolution_px = 256},
      {.method = Method::fins, .light_resolution_px = 256},
      {.method = Method::layered_fins, .light_resolution_px = 256}};
  return settings;
}
const Settings smoothies{.method = Method::smoothies, .light_resolution_px = 256};
const Settings hard{.method = Method::hard, .light_resolution_px = 256};

Frame draw(Renderer& renderer, const Scene& scene, const Settings& settings) {
  renderer.set_scene(scene);
  renderer.render(settings);
  return renderer.read_frame();
}

Frame draw(const KernelRunner& runner, const Scene& scene, const Settings& settings) {
  Renderer renderer(runner.device);
  return draw(renderer, scene, settings);
}

/// Every number is one, visibility is a fraction, and what sees nothing says so.
void expect_sound(const Frame& frame) {
  const std::size_t pixels = std::size_t{frame.resolution.x} * frame.resolution.y;
  ASSERT_EQ(frame.rgb.size(), pixels);
  ASSERT_EQ(frame.depth.size(), pixels);
  ASSERT_EQ(frame.normal_ws.size(), pixels);
  ASSERT_EQ(frame.position_ws.size(), pixels);
  for (const std::vector<float>& plane : frame.visibility) {
    ASSERT_EQ(plane.size(), pixels);
    for (std::size_t i = 0; i < pixels; ++i) {
      ASSERT_TRUE(plane[i] >= 0.0f && plane[i] <= 1.0f) << "pixel " << i << ": " << plane[i];
      if (frame.depth[i] == 0.0f) {
        ASSERT_EQ(plane[i], 1.0f) << i;
      }
    }
  }
  for (std::size_t i = 0; i < pixels; ++i) {
    ASSERT_TRUE(std::isfinite(frame.depth[i]) && frame.depth[i] >= 0.0f) << i;
    for (int c = 0; c < 3; ++c)
      ASSERT_TRUE(std::isfinite(frame.rgb[i][c]) && frame.rgb[i][c] >= 0 && std::isfinite(frame.normal_ws[i][c]) &&
                  std::isfinite(frame.position_ws[i][c]))
          << i;
    const float length = glm::length(glm::vec3(frame.normal_ws[i]));
    ASSERT_NEAR(length, frame.depth[i] > 0.0f ? 1.0f : 0.0f, 1e-5f) << i;
  }
}

std::size_t count_between(const std::vector<float>& plane, float low, float high) {
  return static_cast<std::size_t>(std::count_if(plane.begin(), plane.end(), [&](float v) { return v > low && v < high; }));
}

TEST_P(FrameTest, EveryMethodDrawsLightUmbraAndWhatItShouldBetween) {
  Renderer renderer(runner_.device);
  for (const Settings& settings : all_settings()) {
    const Frame frame = draw(renderer, box_over_floor(), settings);
    expect_sound(frame);
    const std::vector<float>& plane = frame.visibility[0];
    EXPECT_GT(count_between(plane, -1, 0.001f), 100u);
    EXPECT_GT(count_between(plane, 0.999f, 2), 1000u);
    if (settings.method == Method::hard)
      EXPECT_EQ(count_between(plane, 0, 1), 0u);
    else
      EXPECT_GT(count_between(plane, 0.01f, 0.99f), 5u);
  }
}

TEST_P(FrameTest, TheGBufferIsWhatTheCameraSees) {
  // Straight down on the floor: depth is the height, position follows from the pixel.
  Scene scene = box_over_floor({40, 30});
  scene.meshes.resize(1);
  scene.camera = {.position = {1, 8, 2}, .target = {1, 0, 2}, .up = {0, 0, -1}, .yfov_deg = 60, .resolution = {40, 30}};
  const Frame frame = draw(runner_, scene, hard);
  const double per_px = 2 * std::tan(glm::radians(30.0)) * 8 / 30;
  for (int y = 0; y < 30; ++y)
    for (int x = 0; x < 40; ++x) {
      const std::size_t i = y * 40 + x;
      const glm::dvec3 expected(1 + (x + 0.5 - 20) * per_px, 0, 2 + (y + 0.5 - 15) * per_px);
      if (std::max(std::abs(expected.x), std::abs(expected.z)) > 4.99) continue;
      ASSERT_NEAR(frame.depth[i], 8, 1e-4);
      ASSERT_LE(glm::distance(glm::dvec3(frame.position_ws[i]), expected), 1e-4);
      ASSERT_EQ(frame.normal_ws[i], glm::vec4(0, 1, 0, 0));
    }
}

TEST_P(FrameTest, EachMeshHasItsOwnColour) {
  Scene scene = box_over_floor();
  scene.lights.clear();
  scene.meshes[0].base_color = {1, 0, 0.5f};
  scene.meshes[1].base_color = {0, 1, 0.25f};
  const Frame frame = draw(runner_, scene, hard);
  std::size_t seen[2] = {0, 0};
  for (std::size_t i = 0; i < frame.depth.size(); ++i) {
    if (frame.depth[i] == 0) continue;
    const bool box = frame.position_ws[i].y > 0.01f;
    ++seen[box];
    const glm::vec3 expected = 0.1f * scene.meshes[box].base_color;
    for (int c = 0; c < 3; ++c) ASSERT_NEAR(frame.rgb[i][c], expected[c], 1e-7f) << i;
  }
  EXPECT_GT(seen[0], 1000u);
  EXPECT_GT(seen[1], 300u);
}

TEST_P(FrameTest, APointLightsSmoothiesAreHardShadows) {
  Scene scene = box_over_floor();
  scene.lights[0].radius = 0;
  EXPECT_EQ(draw(runner_, scene, smoothies).visibility, draw(runner_, scene, hard).visibility);
}

TEST_P(FrameTest, SmoothiesOnlyEverDarkenTheSharpShadow) {
  // Outer penumbrae only (Chan & Durand §3): what the filtered hard shadow darkens stays at least as dark.
  const Scene scene = box_over_floor();
  Settings linear = smoothies, filtered{.method = Method::pcf, .light_resolution_px = 256, .pcf_filter = 2};
  linear.falloff = Falloff::linear;
  const auto a = draw(runner_, scene, linear).visibility[0], b = draw(runner_, scene, filtered).visibility[0];
  for (std::size_t i = 0; i < a.size(); ++i) ASSERT_LE(a[i], b[i] + 1e-6f) << i;
}

TEST_P(FrameTest, AddingACasterNeverBrightens) {
  // The floor is a slab that casts in all of the cone, so that the light map stays where it is; then boxes come one by one. A new
  // box is seen by the camera too: compare where the picture shows the same surface.
  Scene scene = box_over_floor();
  scene.meshes[0] = placed("slab", box_mesh(), {0, -0.1, 0}, {14, 0.2, 14});
  for (const Settings& settings : all_settings()) {
    // Inner fins give light to the umbra with one weight a texel, whoever's umbra it is: overlapping shadows may brighten.
    if (settings.method == Method::fins || settings.method == Method::layered_fins) continue;
    // The width of its filter is a mean over blockers: one more may narrow it.
    if (settings.method == Method::pcss) continue;
    Renderer renderer(runner_.device);
    Scene growing = scene;
    Frame before = draw(renderer, growing, settings);
    const LightBuffers map = renderer.read_light_buffers(0);
    std::size_t darkened = 0;
    for (int i = 0; i < 3; ++i) {
      growing.meshes.push_back(
          placed("box-" + std::to_string(i), box_mesh(), {-1.5 + i, 0.9 + 0.4 * i, 1.2 - i}, glm::dvec3(0.6), {10.0 * i, 25, 5}));
      const Frame after = draw(renderer, growing, settings);
      const LightBuffers same = renderer.read_light_buffers(0);
      ASSERT_EQ(same.lm_from_px_scale, map.lm_from_px_scale);
      ASSERT_EQ(same.lm_from_px_origin, map.lm_from_px_origin);
      for (std::size_t p = 0; p < after.depth.size(); ++p) {
        if (after.depth[p] != before.depth[p] || after.normal_ws[p] != before.normal_ws[p]) continue;
        // Outer penumbrae are sized for the depth that the map holds, not for the pixel's: where a new box comes before the floor
        // in a texel that a pixel on another box's side also looks up, Lr is nearer and the old penumbra narrower there.
        const bool sized_by_map = settings.method == Method::smoothies || settings.method == Method::penumbra_maps;
        if (sized_by_map && after.position_ws[p].y > 1e-3f) continue;
        ASSERT_LE(after.visibility[0][p], before.visibility[0][p] + 1e-6f) << name_of(settings.method) << ", pixel " << p;
        darkened += after.visibility[0][p] < before.visibility[0][p] - 0.1f;
      }
      before = after;
    }
    EXPECT_GT(darkened, 100u);
  }
}

TEST_P(FrameTest, DrawnTwiceIsTheSameBitForBit) {
  for (const Settings& settings : all_settings()) {
    Renderer renderer(runner_.device);  // its first frame is cold: buffers are made, tile lists may be too small
    const Frame cold = draw(renderer, box_over_floor(), settings);
    for (int i = 0; i < 3; ++i) {
      renderer.render(settings);
      const Frame warm = renderer.read_frame();
      EXPECT_EQ(warm.visibility, cold.visibility);
      EXPECT_EQ(warm.rgb, cold.rgb);
      EXPECT_EQ(warm.depth, cold.depth);
    }
  }
}

TEST_P(FrameTest, WhatWasDrawnBeforeLeavesNoTrace) {
  Scene other = box_over_floor({200, 150});
  other.meshes.push_back(placed("more", box_mesh(), {1, 2, 1}, glm::dvec3(0.5), {45, 0, 45}));
  Settings large = smoothies;
  large.light_resolution_px = 777;
  Renderer renderer(runner_.device);
  draw(renderer, other, large);
  const Frame after = draw(renderer, box_over_floor(), smoothies), fresh = draw(runner_, box_over_floor(), smoothies);
  EXPECT_EQ(after.visibility, fresh.visibility);
  EXPECT_EQ(after.rgb, fresh.rgb);
}

TEST_P(FrameTest, AMillionUnitsAwayLooksTheSame) {
  const glm::dvec3 away(1e6, 1e6, -1e6);
  Scene moved = box_over_floor();
  for (SceneMesh& mesh : moved.meshes) mesh.translation += away;
  moved.camera.position += away;
  moved.camera.target += away;
  moved.lights[0].position += away;
  moved.lights[0].target += away;
  for (const Settings& settings : all_settings()) {
    const Frame here = draw(runner_, box_over_floor(), settings), there = draw(runner_, moved, settings);
    // A hard edge may fall to the other side of a pixel's centre.
    EXPECT_EQ(image_difference(here.visibility[0], there.visibility[0], 1, {.percent = 0.2, .threshold = 1e-3, .hard = 1.0}), "")
        << name_of(settings.method);
    EXPECT_EQ(image_difference(here.depth, there.depth, 1, {.percent = 0.2, .threshold = 1e-4, .hard = 10.0}), "");
  }
}

TEST_P(FrameTest, AnyResolutionIsRight) {
  for (const glm::uvec2 resolution :
       {glm::uvec2(1, 1), glm::uvec2(2, 3), glm::uvec2(17, 33), glm::uvec2(95, 31), glm::uvec2(1, 70)}) {
    const Frame frame = draw(runner_, box_over_floor(resolution), smoothies);
    expect_sound(frame);
    EXPECT_EQ(frame.resolution, resolution);
    const glm::uvec2 larger = resolution * 3u;  // the middle pixel of each 3 x 3 looks along the same ray
    const Frame fine = draw(runner_, box_over_floor(larger), smoothies);
    for (unsigned y = 0; y < resolution.y; ++y)
      for (unsigned x = 0; x < resolution.x; ++x) {
        const std::size_t a = y * resolution.x + x, b = (3 * y + 1) * larger.x + 3 * x + 1;
        if (frame.normal_ws[a] != fine.normal_ws[b]) continue;  // on an edge of the picture
        // Vertices are snapped to 1/256 of a pixel, which is much where a pixel is half the picture.
        const float snap = 0.2f / static_cast<float>(std::min(resolution.x, resolution.y));
        ASSERT_NEAR(frame.depth[a], fine.depth[b], snap) << x << " " << y;
        ASSERT_NEAR(frame.visibility[0][a], fine.visibility[0][b], 2 * snap) << x << " " << y;
      }
  }
}

TEST_P(FrameTest, AnyLightMapResolutionIsSound) {
  for (const unsigned resolution : {1u, 2u, 3u, 31u, 33u, 100u}) {
    Settings settings = smoothies;
    settings.light_resolution_px = resolution;
    Renderer renderer(runner_.device);
    expect_sound(draw(renderer, box_over_floor(), settings));
    const LightBuffers buffers = renderer.read_light_buffers(0);
    EXPECT_LE(std::max(buffers.resolution.x, buffers.resolution.y), std::max(2u, resolution));
    EXPECT_GE(std::min(buffers.resolution.x, buffers.resolution.y), 2u) << "look-ups read pairs of texels";
  }
}

TEST_P(FrameTest, AnEmptySceneIsBlack) {
  Scene scene = box_over_floor({20, 20});
  scene.meshes.clear();
  for (const Settings& settings : all_settings()) {
    const Frame frame = draw(runner_, scene, settings);
    expect_sound(frame);
    EXPECT_EQ(frame.visibility[0], std::vector<float>(400, 1.0f));
    EXPECT_EQ(frame.rgb, std::vector<glm::vec4>(400, glm::vec4(0)));
  }
}

TEST_P(FrameTest, WithoutLightsThereIsAmbient) {
  Scene scene = box_over_floor({20, 20});
  scene.lights.clear();
  const Frame frame = draw(runner_, scene, smoothies);
  expect_sound(frame);
  EXPECT_TRUE(frame.visibility.empty());
  for (std::size_t i = 0; i < frame.rgb.size(); ++i)
    if (frame.depth[i] > 0) {
      EXPECT_NEAR(frame.rgb[i].x, 0.08f, 1e-6f);
    }
}

TEST_P(FrameTest, CameraAndLightMayStandInsideAMesh) {
  Scene scene = box_over_floor();
  scene.meshes.push_back(placed("room", box_mesh(), {0, 3, 0}, glm::dvec3(30)));
  for (const Settings& settings : all_settings()) expect_sound(draw(runner_, scene, settings));
  // The light inside the box that casts: all outside it is dark, where the light looks.
  scene = box_over_floor();
  scene.lights[0].position = scene.meshes[1].translation;
  scene.lights[0].target = {0, 0, 0.01};
  scene.lights[0].cone_deg = 120;
  const Frame frame = draw(runner_, scene, hard);
  expect_sound(frame);
  std::size_t dark = 0;
  for (std::size_t i = 0; i < frame.depth.size(); ++i) {
    const glm::vec3 p = frame.position_ws[i];
    if (p.y < 1e-3f && frame.depth[i] > 0 && std::max(std::abs(p.x), std::abs(p.z)) < 1.5f) {
      EXPECT_EQ(frame.visibility[0][i], 0.0f) << p.x << " " << p.z;
      ++dark;
    }
  }
  EXPECT_GT(dark, 100u);
}

TEST_P(FrameTest, ALightThatLooksAwayCastsNothing) {
  Scene scene = box_over_floor();
  scene.lights[0].target = {3, 12, 2};
  for (const Settings& settings : all_settings()) {
    const Frame frame = draw(runner_, scene, settings);
    EXPECT_EQ(count_between(frame.visibility[0], -1, 0.999f), 0u);
  }
}

TEST_P(FrameTest, OutsideTheConeVisibilityIsOneAndLightNone) {
  Scene scene = box_over_floor();
  scene.lights[0].cone_deg = 12;
  const Frame frame = draw(runner_, scene, smoothies);
  const Frustum frustum = light_frustum(scene.lights[0]);
  std::size_t outside = 0;
  for (std::size_t i = 0; i < frame.depth.size(); ++i) {
    if (frame.depth[i] == 0) continue;
    const glm::dvec3 p_ls = frustum.view_from_world * glm::dvec4(glm::dvec3(frame.position_ws[i]), 1);
    if (std::max(std::abs(p_ls.x), std::abs(p_ls.y)) < 1.001 * frustum.tan_half_x * p_ls.z) continue;
    ++outside;
    EXPECT_EQ(frame.visibility[0][i], 1.0f);
    EXPECT_NEAR(frame.rgb[i].x, 0.08f, 1e-6f);
  }
  EXPECT_GT(outside, 1000u);
}

TEST_P(FrameTest, WhatReceivesNoShadowIsLitWhatCastsNoneLeavesNone) {
  Scene scene = box_over_floor();
  scene.meshes[0].receives_shadow = false;
  Frame frame = draw(runner_, scene, smoothies);
  for (std::size_t i = 0; i < frame.depth.size(); ++i)
    if (frame.depth[i] > 0 && frame.position_ws[i].y < 0.01f) {
      EXPECT_EQ(frame.visibility[0][i], 1.0f);
    }
  scene = box_over_floor();
  scene.meshes[1].casts_shadow = false;
  frame = draw(runner_, scene, smoothies);
  for (std::size_t i = 0; i < frame.depth.size(); ++i)
    if (frame.depth[i] > 0 && frame.position_ws[i].y < 0.01f) {
      EXPECT_EQ(frame.visibility[0][i], 1.0f);
    }
}

TEST_P(FrameTest, SurfacesTurnedAwayAreDark) {
  Scene scene = box_over_floor();
  scene.lights[0].position = {0.3, -5, 0.2};  // under the floor
  scene.lights[0].target = {0, 0, 0};
  for (const Settings& settings : all_settings()) {
    const Frame frame = draw(runner_, scene, settings);
    for (std::size_t i = 0; i < frame.depth.size(); ++i)
      if (frame.depth[i] > 0 && frame.position_ws[i].y < 0.01f && glm::length(glm::vec3(frame.position_ws[i])) < 3) {
        EXPECT_EQ(frame.visibility[0][i], 0.0f);
      }
  }
}

TEST_P(FrameTest, TwoLightsAreEachOnItsOwn) {
  Scene both = box_over_floor(), second = box_over_floor();
  both.lights.push_back(both.lights[0]);
  both.lights[1].name = "fill";
  both.lights[1].position = {-3, 4, 2};
  both.lights[1].radius = 0;
  second.lights = {both.lights[1]};
  for (const Settings& settings : all_settings()) {
    const Frame frame = draw(runner_, both, settings);
    expect_sound(frame);
    ASSERT_EQ(frame.visibility.size(), 2u);
    EXPECT_EQ(frame.visibility[0], draw(runner_, box_over_floor(), settings).visibility[0]);
    EXPECT_EQ(frame.visibility[1], draw(runner_, second, settings).visibility[0]);
  }
}

TEST_P(FrameTest, ManyBoxesInARandomHeapAreSound) {
  std::mt19937 random(17);
  std::uniform_real_distribution<double> place(-2, 2), angle(0, 360), size(0.01, 1);
  for (int trial = 0; trial < 3; ++trial) {
    Scene scene = box_over_floor();
    for (int i = 0; i < 12; ++i)
      scene.meshes.push_back(placed("box-" + std::to_string(i), box_mesh(), {place(random), place(random), place(random)},
                                    {size(random), size(random), i % 5 == 0 ? 1e-4 : size(random)},
                                    {angle(random), angle(random), angle(random)}));
    scene.lights[0].radius = size(random) * 3;
    for (const Settings& settings : all_settings()) expect_sound(draw(runner_, scene, settings));
  }
}

// ------------------------------------------------------------------------------------------------------- the two shapes

class ShapesTest : public testing::Test {
 protected:
  Watchdog watchdog_;
};

TEST_F(ShapesTest, BothShapesOfTheKernelsDrawTheSame) {
  const KernelRunner wide("wide"), narrow("narrow");
  ASSERT_EQ(wide.device->lanes, 16u);
  ASSERT_EQ(narrow.device->lanes, 1u);
  Scene scene = box_over_floor({150, 133});
  scene.meshes.push_back(placed("second", box_mesh(), {-1, 0.6, 1}, glm::dvec3(0.7), {0, 50, 0}));
  for (const Settings& settings : all_settings()) {
    Renderer a(wide.device), b(narrow.device);
    const Frame in_a = draw(a, scene, settings), in_b = draw(b, scene, settings);
    EXPECT_EQ(image_difference(in_a.visibility[0], in_b.visibility[0], 1, {.percent = 0.05, .threshold = 1e-3, .hard = 1.0}), "");
    EXPECT_EQ(in_a.normal_ws, in_b.normal_ws);
    const LightBuffers map_a = a.read_light_buffers(0), map_b = b.read_light_buffers(0);
    ASSERT_EQ(map_a.planes.size(), map_b.planes.size());
    ASSERT_EQ(map_a.resolution, map_b.resolution);
    for (std::size_t i = 0; i < map_a.planes[0].values.size(); ++i)
      ASSERT_NEAR(map_a.planes[0].values[i] / map_b.planes[0].values[i], 1.0f, 1e-5f);
    if (map_a.planes.size() == 3) {
      EXPECT_EQ(
          image_difference(map_a.planes[2].values, map_b.planes[2].values, 1, {.percent = 0.05, .threshold = 1e-3, .hard = 1.0}),
          "");
    }
  }
}

TEST_F(ShapesTest, AnUnknownShapeIsAnError) {
  setenv("HALFSHADE_KERNEL_SHAPE", "round", 1);
  expect_error<InputError>([] { Device::open(""); }, {"HALFSHADE_KERNEL_SHAPE", "'wide' or 'narrow'", "round"});
  unsetenv("HALFSHADE_KERNEL_SHAPE");
}

// ------------------------------------------------------------------------------------------------------------- settings

class SettingsTest : public testing::Test {
 protected:
  Watchdog watchdog_;
  Renderer renderer_{test_device()};
};

TEST_F(SettingsTest, OutOfRangeIsAnInputError) {
  renderer_.set_scene(box_over_floor({8, 8}));
  const auto fails = [&](const Settings& settings, std::initializer_list<std::string_view> parts) {
    expect_error<InputError>([&] { renderer_.render(settings); }, parts);
  };
  fails({.light_resolution_px = 0}, {"light map resolution 0", "1 to 16384"});
  fails({.light_resolution_px = 16385}, {"16385"});
  fails({.method = Method::pcf, .pcf_filter = 3}, {"filter 3", "2 or 4"});
  fails({.method = Method::pcss, .pcss_taps = 17}, {"17 PCSS taps", "16 or 32"});
  fails({.smoothie_width = -0.1}, {"smoothie width", "-0.1"});
  fails({.smoothie_width = 2.1}, {"smoothie width"});
  fails({.smoothie_width = std::nan("")}, {"smoothie width", "nan"});
  renderer_.render({.light_resolution_px = 8});  // and it works on
}

TEST_F(SettingsTest, CallsOutOfOrderAreInputErrors) {
  expect_error<InputError>([&] { renderer_.render({}); }, {"no scene", "set_scene"});
  expect_error<InputError>([&] { renderer_.enqueue_gbuffer(); }, {"no scene", "set_scene"});
  expect_error<InputError>([&] { renderer_.read_frame(); }, {"render"});
  renderer_.set_scene(box_over_floor({8, 8}));
  expect_error<InputError>([&] { renderer_.read_frame(); }, {"render"});
  expect_error<InputError>([&] { renderer_.read_light_buffers(0); }, {"render"});
  renderer_.render({.light_resolution_px = 8});
  expect_error<InputError>([&] { renderer_.read_light_buffers(1); }, {"light 1", "the scene has 1"});
  renderer_.set_scene(box_over_floor({8, 8}));
  expect_error<InputError>([&] { renderer_.read_frame(); }, {"render"});
}

TEST_F(SettingsTest, AnImpossibleSceneIsAnInputErrorAndTheOldOneStays) {
  renderer_.set_scene(box_over_floor({8, 8}));
  Scene bad = box_over_floor({8, 8});
  bad.lights[0].radius = -1;
  EXPECT_THROW(renderer_.set_scene(bad), InputError);
  bad = box_over_floor({8, 8});
  bad.meshes[0].translation.x = std::nan("");
  EXPECT_THROW(renderer_.set_scene(bad), InputError);
  bad = box_over_floor({0, 8});
  EXPECT_THROW(renderer_.set_scene(bad), InputError);
  renderer_.render({.light_resolution_px = 8});
  EXPECT_EQ(renderer_.read_frame().resolution, glm::uvec2(8, 8));
}

TEST_F(SettingsTest, StatisticsCountWhatWasDrawn) {
  renderer_.set_scene(box_over_floor({32, 32}));
  renderer_.render(smoothies);
  const FrameStats stats = renderer_.stats();
  EXPECT_EQ(stats.triangles, 14u);
  EXPECT_EQ(stats.vertices, 12u);
  EXPECT_EQ(stats.edges, 18u + 5u);
  ASSERT_EQ(stats.lights.size(), 1u);
  EXPECT_EQ(stats.lights[0].name, "key");
  EXPECT_EQ(stats.lights[0].silhouette_edges, 6u) << "a box seen corner on";
  EXPECT_EQ(stats.lights[0].features, 12u);
  EXPECT_FALSE(stats.lights[0].skipped);
  const std::vector<StageTime> times = renderer_.stage_times();
  EXPECT_FALSE(times.empty());
  for (const StageTime& time : times) EXPECT_GE(time.time_ms, 0.0) << time.stage;
}

}  // namespace
}  // namespace halfshade
