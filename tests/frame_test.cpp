// Whole frames: the G-buffer, resolutions, what the renderer checks. What holds for every method is in all_methods_test.cpp.
#include <algorithm>

#include "support/kernel_fixture.hpp"
#include "support/scenes.hpp"
#include "support/temp_folder.hpp"

namespace halfshade {
namespace {

using FrameTest = ShapedKernelTest;
HS_IN_BOTH_SHAPES(FrameTest);

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

TEST_P(FrameTest, SmoothiesOnlyEverDarkenTheSharpShadow) {
  // Outer penumbrae only (Chan & Durand §3): what the filtered hard shadow darkens stays at least as dark.
  const Scene scene = box_over_floor();
  Settings linear = smoothies, filtered{.method = Method::pcf, .light_resolution_px = 256, .pcf_filter = 2};
  linear.falloff = Falloff::linear;
  const auto a = draw(runner_, scene, linear).visibility[0], b = draw(runner_, scene, filtered).visibility[0];
  for (std::size_t i = 0; i < a.size(); ++i) ASSERT_LE(a[i], b[i] + 1e-6f) << i;
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

TEST_P(FrameTest, ALightInsideTheBoxThatCastsLightsNothingOutsideIt) {
  Scene scene = box_over_floor();
  scene.lights[0].position = place_of(scene.meshes[1]);
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

// ------------------------------------------------------------------------------------------------------- the two shapes

class ShapesTest : public testing::Test {
 protected:
  Watchdog watchdog_;
};

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
  fails({.light_resolution_px = 0}, {"render: light-res: expected a whole number from 1 to 16384 (found '0')"});
  fails({.light_resolution_px = 16385}, {"render: light-res", "16385"});
  fails({.method = Method::pcf, .pcf_filter = 3}, {"render: pcf-filter: expected 2 or 4 (found '3')"});
  fails({.method = Method::pcss, .pcss_taps = 17}, {"render: pcss-taps: expected 16 or 32 (found '17')"});
  fails({.method = Method::smoothies, .smoothie_width = -0.1}, {"render: smoothie-width", "'-0.1'"});
  fails({.method = Method::smoothies, .smoothie_width = 2.1}, {"render: smoothie-width", "up to 2"});
  fails({.method = Method::smoothies, .smoothie_width = std::nan("")}, {"render: smoothie-width", "nan"});
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
  move_by(bad.meshes[0], {std::nan(""), 0, 0});
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
