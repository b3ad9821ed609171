// Ambient and Lambert on a caller's G-buffer: pictures that can be worked out by hand.
#include "support/kernel_fixture.hpp"
#include "support/scenes.hpp"

namespace halfshade {
namespace {

using Shade = ShapedKernelTest;
HS_IN_BOTH_SHAPES(Shade);

struct Pixel {
  glm::vec4 position = {0, 0, 0, 1};
  glm::vec4 normal = {0, 1, 0, 1};
  glm::vec4 base_color = {1, 0.5f, 0.25f, 1};
  float visibility0 = 1, visibility1 = 1;
};

std::vector<glm::vec4> shade(const KernelRunner& runner, Scene scene, const std::vector<Pixel>& pixels) {
  std::vector<glm::vec4> positions, normals, colors;
  std::vector<float> visibility(std::max<std::size_t>(1, scene.lights.size()) * pixels.size());
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    positions.push_back(pixels[i].position);
    normals.push_back(pixels[i].normal);
    colors.push_back(pixels[i].base_color);
    visibility[i] = pixels[i].visibility0;
    if (scene.lights.size() > 1) visibility[pixels.size() + i] = pixels[i].visibility1;
  }
  scene.camera.resolution = {pixels.size(), 1};
  Renderer renderer(runner.device);
  renderer.set_scene(scene);
  const Buffer<cl_float4> position = runner.buffer<cl_float4>(positions), normal = runner.buffer<cl_float4>(normals),
                          color = runner.buffer<cl_float4>(colors),
                          rgb = runner.filled(pixels.size(), cl_float4{{-1, -1, -1, -1}});
  const Buffer<cl_float> planes = runner.buffer<cl_float>(visibility);
  renderer.enqueue_shade({.gbuffer = {.resolution = scene.camera.resolution,
                                      .position = position.memory()(),
                                      .normal = normal.memory()(),
                                      .base_color = color.memory()()},
                          .visibility = planes.memory()(),
                          .rgb = rgb.memory()()});
  return runner.read<glm::vec4>(rgb, pixels.size());
}

/// A light three above the origin looking down, 90 degrees wide.
Scene lamp() {
  Scene scene;
  scene.lights = {{.name = "lamp",
                   .position = {0, 3, 0},
                   .target = {0, 0, 0},
                   .up = {},
                   .radius = 0.1,
                   .cone_deg = 90,
                   .color = {1, 0.5f, 1},
                   .intensity = 2}};
  scene.ambient = {0.125f, 0.25f, 0.5f};
  scene.camera.position = {4, 5, 6};
  return scene;
}

void expect_near(const glm::vec4& got, const glm::vec4& expected) {
  for (int c = 0; c < 4; ++c) EXPECT_NEAR(got[c], expected[c], 2e-6f) << "channel " << c;
}

TEST_P(Shade, FacingTheLightReceivesItsIntensity) {
  // base (1, 1/2, 1/4) times (ambient + (2, 1, 2) cos visibility)
  const auto rgb = shade(runner_, lamp(), {{}, {.visibility0 = 0}, {.visibility0 = 0.5f}});
  expect_near(rgb[0], {2.125f, 0.625f, 0.625f, 1});
  expect_near(rgb[1], {0.125f, 0.125f, 0.125f, 1});
  expect_near(rgb[2], {1.125f, 0.375f, 0.375f, 1});
}

TEST_P(Shade, CosineOfTheAngle) {
  const float s = std::sqrt(0.75f);
  const auto rgb = shade(runner_, lamp(), {{.normal = {s, 0.5f, 0, 1}}, {.normal = {0, -1, 0, 1}}, {.normal = {1, 0, 0, 1}}});
  expect_near(rgb[0], {1.125f, 0.375f, 0.375f, 1});
  expect_near(rgb[1], {0.125f, 0.125f, 0.125f, 1});
  expect_near(rgb[2], {0.125f, 0.125f, 0.125f, 1});
}

TEST_P(Shade, OutsideTheConeThereIsNoLight) {
  const auto rgb = shade(runner_, lamp(),
                         {{.position = {3.1f, 0, 0, 1}},
                          {.position = {0, 0, -3.1f, 1}},
                          {.position = {0, 4, 0, 1}},
                          {.position = {2.9f, 0, 2.9f, 1}}});
  for (int i = 0; i < 3; ++i) expect_near(rgb[i], {0.125f, 0.125f, 0.125f, 1});
  EXPECT_GT(rgb[3].x, 0.5f);
}

TEST_P(Shade, NothingSeenIsBlackWithoutCoverage) {
  expect_near(shade(runner_, lamp(), {{.position = {0, 0, 0, 0}}})[0], {0, 0, 0, 0});
}

TEST_P(Shade, LightsAddUpEachWithItsOwnVisibility) {
  Scene scene = lamp();
  scene.lights.push_back(scene.lights[0]);
  scene.lights[1].name = "second";
  scene.lights[1].color = {0, 1, 0};
  scene.lights[1].intensity = 1;
  const auto rgb = shade(runner_, scene, {{.visibility0 = 0.5f, .visibility1 = 1}, {.visibility0 = 0, .visibility1 = 0.25f}});
  expect_near(rgb[0], {1.125f, 0.5f * 1.75f, 0.375f, 1});
  expect_near(rgb[1], {0.125f, 0.5f * 0.5f, 0.125f, 1});
}

TEST_P(Shade, WithoutLightsAmbientRemains) {
  Scene scene = lamp();
  scene.lights.clear();
  expect_near(shade(runner_, scene, {{}})[0], {0.125f, 0.125f, 0.125f, 1});
}

TEST_P(Shade, EveryPixelOfAnOddWidthIsWritten) {
  for (const std::size_t width : {15, 16, 17, 33}) {
    std::vector<Pixel> pixels(width);
    for (std::size_t i = 0; i < width; ++i) pixels[i].visibility0 = static_cast<float>(i) / static_cast<float>(width);
    const auto rgb = shade(runner_, lamp(), pixels);
    for (std::size_t i = 0; i < width; ++i) EXPECT_NEAR(rgb[i].x, 0.125f + 2 * pixels[i].visibility0, 2e-6f) << i;
  }
}

}  // namespace
}  // namespace halfshade
