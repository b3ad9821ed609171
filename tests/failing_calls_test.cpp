// Whatever OpenCL call fails, a public call throws DeviceError, and all is as before: the next frame is bit for bit what it would
// have been.
#include <gtest/gtest.h>

#include <cstdlib>
#include <functional>

#include "support/draw.hpp"
#include "support/failing_opencl.hpp"
#include "support/scenes.hpp"

namespace halfshade {
namespace {

constexpr glm::uvec2 resolution{40, 32};

Scene scene_of_two_lights() {
  Scene scene = box_over_floor(resolution);
  Light fill = scene.lights[0];
  fill.name = "fill";
  fill.position.x = -2.5;
  scene.lights.push_back(fill);
  return scene;
}

/// A method with few points of the light where each of them is many calls, all alike.
Settings with_few_calls(Method method) {
  Settings settings = small_settings(method, 64);
  if (method == Method::light_samples) settings.samples = 2;
  return settings;
}

/// Something else: of other meshes, larger.
Scene other_scene() {
  Scene scene = box_over_floor({56, 48});
  scene.meshes.push_back(placed("disc", disc_mesh(), {1.5, 0.8, 0.5}, glm::dvec3(0.7)));
  scene.lights[0].radius = 0.5;
  return scene;
}

Frame drawn(Renderer& renderer, const Scene& scene, const Settings& settings) {
  renderer.set_scene(scene);
  renderer.render(settings);
  return renderer.read_frame();
}

Frame drawn(const std::shared_ptr<Device>& device, const Scene& scene, const Settings& settings) {
  Renderer renderer(device);
  return drawn(renderer, scene, settings);
}

void expect_same(const Frame& seen, const Frame& expected, const std::string& when) {
  EXPECT_EQ(seen.rgb, expected.rgb) << when;
  EXPECT_EQ(seen.visibility, expected.visibility) << when;
  EXPECT_EQ(seen.depth, expected.depth) << when;
  EXPECT_EQ(seen.normal_ws, expected.normal_ws) << when;
}

/// From one call that fails to the next: 1, or HALFSHADE_TEST_CALL_STEP, for builds that are slow.
unsigned call_step() {
  const char* variable = std::getenv("HALFSHADE_TEST_CALL_STEP");
  return variable ? static_cast<unsigned>(std::stoul(variable)) : 1;
}

/// Lets the first OpenCL call of `action` fail, then the second, until it comes to its end without that: it throws DeviceError,
/// or the call was not needed. After each calls `afterwards`. `begin` makes what the action works on. Returns which was the last.
unsigned fail_each_call(const std::function<void()>& begin, const std::function<void()>& action,
                        const std::function<void(const std::string& when)>& afterwards, const std::string& only = {}) {
  for (unsigned n = 1;; n += call_step()) {
    begin();
    std::string when;
    {
      const FailingCall failing(n, CL_OUT_OF_RESOURCES, only);
      try {
        action();
      } catch (const DeviceError& error) {
        EXPECT_NE(std::string(error.what()).find("CL_OUT_OF_RESOURCES"), std::string::npos) << error.what();
      }
      if (failing.failed().empty()) return n - 1;
      when = fmt::format("call {} failed, {}", n, failing.failed());
    }
    afterwards(when);
    if (testing::Test::HasFailure()) return n;  // one is enough to look at
  }
}

class FailingCalls : public testing::Test {
 protected:
  std::shared_ptr<Device> device_ = Device::open("");
  Scene scene_ = scene_of_two_lights(), other_ = other_scene();
};

TEST_F(FailingCalls, OfRenderLeaveARendererThatDrawsTheSame) {
  for (const MethodInfo& info : methods()) {
    const Settings settings = with_few_calls(info.method);
    SCOPED_TRACE(description_of(settings));
    const Frame expected = drawn(device_, scene_, settings);
    std::unique_ptr<Renderer> renderer;
    const unsigned failed = fail_each_call(
        [&] {
          renderer = std::make_unique<Renderer>(device_);
          renderer->set_scene(scene_);
        },
        [&] { renderer->render(settings); },
        [&](const std::string& when) {
          renderer->render(settings);
          expect_same(renderer->read_frame(), expected, when);
        });
    EXPECT_GT(failed, 100u);
  }
}

TEST_F(FailingCalls, OfARendererInUseLeaveItSo) {
  // Buffers that have to grow, of methods that have drawn smaller ones.
  for (const MethodInfo& info : methods()) {
    const Settings settings = with_few_calls(info.method);
    SCOPED_TRACE(description_of(settings));
    Settings larger = settings;
    larger.light_resolution_px = 96;
    const Frame expected = drawn(device_, other_, larger), before = drawn(device_, scene_, settings);
    std::unique_ptr<Renderer> renderer;
    fail_each_call(
        [&] {
          renderer = std::make_unique<Renderer>(device_);
          drawn(*renderer, scene_, settings);
          renderer->set_scene(other_);
        },
        [&] { renderer->render(larger); },
        [&](const std::string& when) {
          renderer->render(larger);
          expect_same(renderer->read_frame(), expected, when);
          expect_same(drawn(*renderer, scene_, settings), before, when);
        },
        "clCreateBuffer");
  }
}

TEST_F(FailingCalls, OfSetSceneLeaveTheSceneOfBeforeAndItsFrame) {
  const Settings settings = small_settings(Method::exact, 64);
  Renderer renderer(device_);
  const Frame expected = drawn(renderer, scene_, settings), expected_other = drawn(device_, other_, settings);
  const unsigned failed = fail_each_call(
      [&] {
        renderer.set_scene(scene_);
        renderer.render(settings);
      },
      [&] { renderer.set_scene(other_); },
      [&](const std::string& when) {
        expect_same(renderer.read_frame(), expected, when);
        renderer.render(settings);
        expect_same(renderer.read_frame(), expected, when);
      });
  EXPECT_GT(failed, 10u);
  renderer.render(settings);
  expect_same(renderer.read_frame(), expected_other, "at last");
}

TEST_F(FailingCalls, OfEnqueueVisibilityLeaveARendererThatDrawsTheSame) {
  for (const Method method : {Method::exact, Method::fins, Method::smoothies, Method::light_samples}) {
    const Settings settings = with_few_calls(method);
    SCOPED_TRACE(description_of(settings));
    const std::size_t pixels = std::size_t{resolution.x} * resolution.y;
    cl_int status = CL_SUCCESS;
    const cl_mem plane = clCreateBuffer(device_->context(), CL_MEM_READ_WRITE, pixels * sizeof(float), nullptr, &status);
    ASSERT_EQ(status, CL_SUCCESS);
    const auto read_plane = [&] {
      std::vector<float> values(pixels);
      EXPECT_EQ(
          clEnqueueReadBuffer(device_->queue(), plane, CL_TRUE, 0, pixels * sizeof(float), values.data(), 0, nullptr, nullptr),
          CL_SUCCESS);
      return values;
    };
    const std::vector<float> expected = drawn(device_, scene_, settings).visibility[1];
    std::unique_ptr<Renderer> renderer;
    GBuffer gbuffer;
    const auto draw_plane = [&] {
      renderer->enqueue_visibility({.gbuffer = gbuffer, .light = 1, .settings = settings, .visibility = plane});
    };
    const unsigned failed = fail_each_call(
        [&] {
          renderer = std::make_unique<Renderer>(device_);
          renderer->set_scene(scene_);
          gbuffer = renderer->enqueue_gbuffer();
        },
        draw_plane,
        [&](const std::string& when) {
          draw_plane();
          EXPECT_EQ(read_plane(), expected) << when;
        });
    EXPECT_GT(failed, 50u);
    clReleaseMemObject(plane);
  }
}

TEST_F(FailingCalls, OfEveryOtherPublicCallAreDeviceErrors) {
  const Settings settings = small_settings(Method::smoothies, 64);
  Renderer renderer(device_);
  const Frame expected = drawn(renderer, scene_, settings);
  const LightBuffers buffers = renderer.read_light_buffers(0);
  const auto nothing = [] {};
  const auto same = [&](const std::string& when) {
    expect_same(renderer.read_frame(), expected, when);
    EXPECT_EQ(renderer.stats().triangles, 14u) << when;
  };
  fail_each_call(
      nothing, [&] { renderer.read_frame(); }, same);
  fail_each_call(
      nothing, [&] { renderer.stats(); }, same);
  fail_each_call(
      nothing, [&] { renderer.stage_times(); }, same);
  fail_each_call(
      nothing, [&] { renderer.read_light_buffers(0); },
      [&](const std::string& when) {
        EXPECT_EQ(renderer.read_light_buffers(0).planes.at(0).values, buffers.planes.at(0).values) << when;
        same(when);
      });
  const auto list = [&](const std::string& when) { EXPECT_FALSE(list_devices().empty()) << when; };
  EXPECT_GT(fail_each_call(
                nothing, [] { Device::open(""); }, list),
            10u);
  EXPECT_GT(fail_each_call(
                nothing, [] { list_devices(); }, list),
            10u);
  EXPECT_GT(fail_each_call(
                nothing, [&] { Device::adopt(device_->context(), device_->queue()); }, list),
            10u);
}

TEST_F(FailingCalls, OfBuildingKernelsLeaveADeviceThatBuildsThem) {
  const Settings settings = small_settings(Method::hard, 64);
  const Frame expected = drawn(device_, scene_, settings);
  for (const char* function : {"clCreateProgramWithSource", "clBuildProgram", "clCreateKernel"}) {
    std::unique_ptr<Renderer> renderer;
    const unsigned failed = fail_each_call(
        [&] {
          renderer = std::make_unique<Renderer>(Device::open(""));
          renderer->set_scene(scene_);
        },
        [&] { renderer->render(settings); },
        [&](const std::string& when) {
          renderer->render(settings);
          EXPECT_EQ(renderer->read_frame().rgb, expected.rgb) << when;
        },
        function);
    EXPECT_GT(failed, 3u) << function;
  }
}

}  // namespace
}  // namespace halfshade
