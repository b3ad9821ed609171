// Directional and point lights: the same methods through other views. A directional light is a spot that is far away; a point
// light has no seams, wherever its faces meet; both agree with rays.
#include <cmath>

#include "report/rays.hpp"
#include "support/draw.hpp"
#include "support/scenes.hpp"

namespace halfshade {
namespace {

using LightsTest = ShapedKernelTest;
HS_IN_BOTH_SHAPES(LightsTest);

/// Every method, with what the tests' bounds are for.
std::vector<Settings> all_settings() {
  std::vector<Settings> all;
  for (const MethodInfo& info : methods()) {
    Settings settings{.method = info.method};
    if (info.method == Method::light_samples) settings.samples = 8;
    all.push_back(settings);
  }
  return all;
}

Frame draw(const KernelRunner& runner, const Scene& scene, const Settings& settings) {
  return draw_frame(runner.device, scene, settings);
}

ErrorFigures difference(const Frame& frame, const Frame& reference, const Light& light) {
  std::vector<glm::dvec3> positions(reference.position_ws.begin(), reference.position_ws.end());
  return compare_visibility(frame.visibility[0], reference.visibility[0], pixel_kinds(positions, reference.normal_ws, light));
}

const glm::dvec3 light_direction(-2, -5.5, -1);

Scene under_directional_light() {
  Scene scene = box_over_floor();
  scene.lights = {{.name = "distant", .type = LightType::directional, .direction = light_direction, .angular_radius_deg = 3.0}};
  return scene;
}

/// A spot in that direction, so far away and so large that it looks the same, and as bright on the floor.
Scene spot_at(double distance) {
  Scene scene = under_directional_light();
  Light& light = scene.lights[0];
  light.type = LightType::spot;
  light.target = {0, 0.5, 0};
  light.position = light.target - distance * glm::normalize(light_direction);
  light.radius = distance * std::tan(glm::radians(3.0));
  light.cone_deg = 2 * glm::degrees(std::atan(8.0 / distance));
  return scene;
}

TEST_P(LightsTest, ADirectionalLightIsASpotFarAway) {
  for (const Settings& settings : all_settings()) {
    SCOPED_TRACE(name_of(settings.method));
    const Scene scene = under_directional_light();
    const Frame directional = draw(runner_, scene, settings);
    const ErrorFigures near = difference(draw(runner_, spot_at(6), settings), directional, scene.lights[0]);
    const ErrorFigures far = difference(draw(runner_, spot_at(400), settings), directional, scene.lights[0]);
    EXPECT_EQ(far.nonfinite, 0u);
    // What is left are texels of another grid; from near, the shadow is elsewhere.
    EXPECT_LT(far.rmse, settings.method == Method::hard ? 0.08 : 0.03);
    EXPECT_LT(far.rmse, 0.4 * near.rmse);
  }
}

TEST_P(LightsTest, ADirectionalLightShadesByItsDirectionEverywhere) {
  Scene scene = under_directional_light();
  scene.meshes.resize(1);
  scene.lights[0].intensity = 2.0;
  const Frame frame = draw(runner_, scene, {.method = Method::hard});
  const double cosine = glm::dot(glm::normalize(-light_direction), glm::dvec3(0, 1, 0));
  for (std::size_t i = 0; i < frame.depth.size(); ++i) {
    if (frame.depth[i] > 0.0f) {
      ASSERT_NEAR(frame.rgb[i].x, 0.8 * (0.1 + 2.0 * cosine), 1e-5);
    }
  }
}

/// The same samples seen as by rays, but where rounding decides about one of them.
void expect_rays(const KernelRunner& runner, const Scene& scene, unsigned samples) {
  const Frame frame = draw(runner, scene, {.method = Method::exact, .samples = samples});
  const RayScene rays(scene);
  const RayReceivers receivers = receivers_of(PreciseScene(scene), scene.camera, frame.depth, frame.normal_ws, scene.lights[0]);
  ASSERT_GT(receivers.pixels.size(), 2000u);
  const std::vector<float> expected =
      trace_visibility(rays, scene.lights[0], receivers, {.rotate = false, .pattern = disc_samples(samples)});
  std::size_t partly = 0, differing = 0;
  for (const std::uint32_t i : receivers.pixels) {
    partly += expected[i] > 0.0f && expected[i] < 1.0f;
    const double samples_off = std::abs(frame.visibility[0][i] - expected[i]) * samples;
    differing += samples_off > 0.5;
    EXPECT_LT(samples_off, 2.5) << "pixel " << i % scene.camera.resolution.x << ',' << i / scene.camera.resolution.x;
  }
  EXPECT_GT(partly, 50u);
  EXPECT_LE(differing, 3 + partly / 50);
}

TEST_P(LightsTest, ExactSeesADirectionalLightAsRaysDo) {
  expect_rays(runner_, under_directional_light(), 64);
}

/// A lamp above a floor, with boxes in the directions in which its faces meet and in one that lies within a face, and a camera
/// above, all turned about the lamp by `turn_deg`.
Scene lamp_lit(double turn_deg) {
  const double angle = glm::radians(turn_deg), c = std::cos(angle), s = std::sin(angle);
  const auto turned = [&](const glm::dvec3& p) { return glm::dvec3(c * p.x + s * p.z, p.y, c * p.z - s * p.x); };
  Scene scene;
  scene.name = "lamp";
  scene.meshes = {placed("floor", ground_mesh(), {0, 0, 0}, glm::dvec3(24), {0, turn_deg, 0}),
                  placed("edge", box_mesh(), turned({1.6, 1.0, 0.2}), glm::dvec3(0.8), {0, turn_deg, 0}),
                  placed("corner", box_mesh(), turned({-1.2, 1.1, 1.2}), {0.6, 1, 0.6}, {0, turn_deg, 0}),
                  placed("below", box_mesh(), turned({0.1, 0.7, -0.9}), {1.5, 0.3, 0.5}, {0, turn_deg, 0})};
  scene.camera = {.position = turned({0, 11, 3}), .target = turned({0, 0, 0.3}), .yfov_deg = 55, .resolution = {120, 120}};
  scene.lights = {{.name = "lamp", .type = LightType::point, .position = {0, 2.4, 0}, .radius = 0.25}};
  scene.ambient = {0.1f, 0.1f, 0.1f};
  return scene;
}

TEST_P(LightsTest, ExactSeesASphereAsRaysDo) {
  expect_rays(runner_, lamp_lit(0), 64);
  expect_rays(runner_, lamp_lit(30), 64);
}

TEST_P(LightsTest, APointLightHasNoSeams) {
  // Turned, other places lie where its faces meet, and the picture is the same.
  for (const Settings& settings : all_settings()) {
    SCOPED_TRACE(name_of(settings.method));
    const Scene scene = lamp_lit(0);
    const ErrorFigures figures =
        difference(draw(runner_, lamp_lit(29), settings), draw(runner_, scene, settings), scene.lights[0]);
    EXPECT_EQ(figures.nonfinite, 0u);
    const bool jagged = settings.method == Method::hard || settings.method == Method::pcf;
    // Each sample's edge, or tap, is elsewhere, turned.
    const bool stepped = settings.method == Method::light_samples || settings.method == Method::pcss;
    EXPECT_LT(figures.rmse, jagged || stepped ? 0.06 : 0.02);
    EXPECT_LT(figures.bad_fraction, stepped ? 0.1 : 0.01);
  }
}

TEST_P(LightsTest, ASearchFromAPointLightLooksBeyondItsFaces) {
  // In the umbra of a plate that lies before all of the lamp, wherever faces meet.
  Scene scene = lamp_lit(0);
  scene.meshes = {scene.meshes[0], placed("plate", box_mesh(), {0, 1.7, 0}, {6, 0.1, 6})};
  scene.camera = {.position = {0, 1.6, 0}, .target = {0.4, 0, 0.3}, .up = {0, 0, 1}, .yfov_deg = 120, .resolution = {80, 80}};
  const Frame frame = draw(runner_, scene, {.method = Method::pcss});
  for (std::size_t i = 0; i < frame.depth.size(); ++i) {
    const glm::vec4& p = frame.position_ws[i];
    if (frame.depth[i] > 0.0f && p.y < 0.01f && std::max(std::abs(p.x), std::abs(p.z)) < 5.5f) {
      ASSERT_LT(frame.visibility[0][i], 0.001f) << p.x << " " << p.z;
    }
  }
}

TEST_P(LightsTest, FinsOfAPointLightAreWhereRaysSeePenumbrae) {
  const Scene scene = lamp_lit(0);
  const Frame hard = draw(runner_, scene, {.method = Method::hard});
  const RayScene rays(scene);
  const RayReceivers receivers = receivers_of(PreciseScene(scene), scene.camera, hard.depth, hard.normal_ws, scene.lights[0]);
  const std::vector<float> truth = trace_visibility(rays, scene.lights[0], receivers, {.samples = 256});
  const auto rmse = [&](const Settings& settings) {
    return compare_visibility(draw(runner_, scene, settings).visibility[0], truth, receivers.kinds).rmse;
  };
  const double of_hard = compare_visibility(hard.visibility[0], truth, receivers.kinds).rmse;
  EXPECT_LT(rmse({.method = Method::fins}), 0.35 * of_hard);
  EXPECT_LT(rmse({.method = Method::layered_fins}), 0.35 * of_hard);
  EXPECT_LT(rmse({.method = Method::light_samples, .samples = 64}), 0.2 * of_hard);
}

TEST_P(LightsTest, APointLightShinesAllAround) {
  // Inside a box that receives: every pixel of every wall is lit.
  Scene scene;
  scene.name = "room";
  scene.meshes = {placed("room", box_mesh(), {3, 1, -2}, glm::dvec3(8))};
  scene.meshes[0].casts_shadow = false;
  scene.lights = {{.name = "lamp", .type = LightType::point, .position = {3, 1, -2}, .radius = 0.3}};
  for (const glm::dvec3& target :
       {glm::dvec3(1, 0.2, 0.1), glm::dvec3(-1, 0.1, 1), glm::dvec3(0.1, 1, 0.2), glm::dvec3(0, -1, 0.4)}) {
    scene.camera = {
        .position = {3.2, 1.1, -2.1}, .target = glm::dvec3(3.2, 1.1, -2.1) + target, .yfov_deg = 110, .resolution = {50, 40}};
    for (const Settings& settings : all_settings()) {
      const Frame frame = draw(runner_, scene, settings);
      for (std::size_t i = 0; i < frame.depth.size(); ++i) {
        ASSERT_EQ(frame.visibility[0][i], 1.0f) << name_of(settings.method) << " " << i;
        ASSERT_GT(frame.rgb[i].x, 0.1f) << i;
      }
    }
  }
}

TEST_P(LightsTest, AMillionUnitsAwayLooksTheSame) {
  for (Scene scene : {under_directional_light(), lamp_lit(0)}) {
    Scene away = scene;
    const glm::dvec3 offset(1e6, -2e6, 3e6);
    for (SceneMesh& mesh : away.meshes) move_by(mesh, offset);
    away.camera.position += offset;
    away.camera.target += offset;
    away.lights[0].position += offset;
    for (const Settings& settings : all_settings()) {
      if (settings.method == Method::light_samples) continue;
      SCOPED_TRACE(name_of(settings.method));
      const Frame here = draw(runner_, scene, settings);
      Frame there = draw(runner_, away, settings);
      const ErrorFigures figures = difference(there, here, scene.lights[0]);
      // A directional light's texels keep to the world's grid, which is another one there.
      EXPECT_LT(figures.rmse, scene.lights[0].type == LightType::point ? 0.005 : settings.method == Method::hard ? 0.08 : 0.03);
    }
  }
}

TEST_P(LightsTest, SurfacesParallelToTheLightsPlaneAreNotSpeckled) {
  // Without slope there is no tolerance for what snapped vertices are off.
  for (const unsigned resolution : {97u, 256u, 333u}) {
    Scene scene = lamp_lit(17);
    scene.camera.resolution = glm::uvec2(resolution);
    for (const Light& light : {scene.lights[0], Light{.name = "distant", .type = LightType::directional, .direction = {0, -1, 0}},
                               Light{.name = "spot", .position = {0, 5, 0}, .target = {0, 0, 0}, .cone_deg = 120}}) {
      scene.lights = {light};
      const Frame frame = draw(runner_, scene, {.method = Method::hard});
      for (std::size_t i = 0; i < frame.depth.size(); ++i) {
        if (frame.normal_ws[i].y > 0.999f && frame.position_ws[i].y > 0.5f) {
          ASSERT_EQ(frame.visibility[0][i], 1.0f) << light.name << " " << resolution << " " << i;
        }
      }
    }
  }
}

using LightBuffersTest = KernelTest;

TEST_F(LightBuffersTest, OfADirectionalLightHoldTheDistanceAlongItsDirection) {
  Scene scene = under_directional_light();
  scene.meshes[1] = placed("box", box_mesh(), {0, 1.2, 0}, glm::dvec3(1));
  scene.lights[0].direction = {0, -3, 0};
  Renderer renderer(runner_.device);
  renderer.set_scene(scene);
  renderer.render({.method = Method::smoothies, .light_resolution_px = 64});
  const LightBuffers buffers = renderer.read_light_buffers(0);
  ASSERT_EQ(buffers.planes.size(), 3u);
  // The box's top is at y = 1.7, the floor at 0: z = -y. Its map holds x to the right and z up, or their opposites.
  std::size_t top = 0, floor = 0;
  for (std::size_t i = 0; i < buffers.planes[0].values.size(); ++i) {
    const double z = buffers.planes[0].values[i];
    const double x = buffers.lm_from_px_origin.x + (i % buffers.resolution.x + 0.5) * buffers.lm_from_px_scale;
    const double y = buffers.lm_from_px_origin.y - (i / buffers.resolution.x + 0.5) * buffers.lm_from_px_scale;
    const bool on_box = std::max(std::abs(x), std::abs(y)) < 0.5 - 1.0 / 64;
    const bool off_box = std::max(std::abs(x), std::abs(y)) > 0.5 + 1.0 / 64;
    if (on_box) {
      EXPECT_NEAR(z, -1.7, 1e-4);
      ++top;
    } else if (off_box) {
      EXPECT_NEAR(z, 0.0, 1e-4);
      ++floor;
    }
  }
  EXPECT_GT(top, 100u);
  EXPECT_GT(floor, 20u);
  EXPECT_LT(buffers.znear, -1.6);
  EXPECT_GT(buffers.zfar, -0.1);
  EXPECT_THROW(renderer.read_light_buffers(0, 1), InputError);
}

TEST_F(LightBuffersTest, OfAPointLightAreSix) {
  Renderer renderer(runner_.device);
  renderer.set_scene(lamp_lit(0));
  renderer.render({.method = Method::smoothies, .light_resolution_px = 64});
  EXPECT_FALSE(renderer.read_light_buffers(0, 3).planes.empty()) << "below are the boxes";
  EXPECT_TRUE(renderer.read_light_buffers(0, 2).planes.empty()) << "above is nothing";
  EXPECT_THROW(renderer.read_light_buffers(0, 6), InputError);
  EXPECT_GT(renderer.stats().lights.at(0).silhouette_edges, 0u);
}

TEST_F(LightBuffersTest, OnlySpotsAreRectangles) {
  Renderer renderer(runner_.device);
  for (Scene scene : {under_directional_light(), lamp_lit(0)}) {
    scene.lights[0].shape = LightShape::rectangle;
    scene.lights[0].size = {1, 1};
    EXPECT_THROW(renderer.set_scene(scene), InputError);
  }
}

TEST_F(LightBuffersTest, ASmoothieWidthIsOfACone) {
  Renderer renderer(runner_.device);
  renderer.set_scene(under_directional_light());
  EXPECT_THROW(renderer.render({.method = Method::smoothies, .smoothie_width = 0.1}), InputError);
  EXPECT_NO_THROW(renderer.render({.method = Method::smoothies}));
}

}  // namespace
}  // namespace halfshade
