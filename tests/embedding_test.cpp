// The pipeline inside somebody else's compute renderer: their context, their queue, their G-buffer.
#include <fmt/format.h>

#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <limits>
#include <mutex>
#include <thread>

#include "support/draw.hpp"
#include "support/scenes.hpp"

namespace halfshade {
namespace {

using namespace std::chrono_literals;

/// A small deferred renderer with a context and an in-order queue of its own.
class Host {
 public:
  explicit Host(cl_command_queue_properties properties = 0) {
    const cl::Device device = std::dynamic_pointer_cast<DeviceImpl>(test_device())->cl_device;
    context = cl::Context(device);
    queue = cl::CommandQueue(context, device, properties);
  }

  template <class T>
  cl::Buffer buffer(const std::vector<T>& values) const {
    return cl::Buffer(context, CL_MEM_READ_WRITE | CL_MEM_COPY_HOST_PTR, values.size() * sizeof(T),
                      const_cast<T*>(values.data()));
  }
  cl::Buffer plane(std::size_t floats) const { return buffer(std::vector<float>(floats, -1.0f)); }
  std::vector<float> read(const cl::Buffer& from, std::size_t count) const {
    std::vector<float> values(count);
    queue.enqueueReadBuffer(from, CL_TRUE, 0, count * sizeof(float), values.data());
    return values;
  }

  cl::Context context;
  cl::CommandQueue queue;
};

/// The reference picture, drawn by halfshade alone, and its G-buffer as a renderer of one's own would have made it.
class Embedding : public testing::Test {
 protected:
  void SetUp() override {
    scene_ = box_over_floor();
    scene_.lights.push_back(scene_.lights[0]);
    scene_.lights[1].name = "fill";
    scene_.lights[1].position = {-3, 5, 2};
    Renderer ours(test_device());
    ours.set_scene(scene_);
    ours.render(settings_);
    frame_ = ours.read_frame();
    pixels_ = frame_.depth.size();
    normals_ = frame_.normal_ws;
    for (std::size_t i = 0; i < pixels_; ++i) normals_[i].w = frame_.depth[i] > 0 ? 1.0f : 0.0f;
  }

  GBuffer gbuffer_of(const cl::Buffer& depth, const cl::Buffer& normal) const {
    GBuffer gbuffer;
    gbuffer.resolution = frame_.resolution;
    gbuffer.depth = depth();
    gbuffer.normal = normal();
    return gbuffer;
  }

  Watchdog watchdog_;
  const Settings settings_{.method = Method::smoothies, .light_resolution_px = 256};
  Scene scene_;
  Frame frame_;
  std::size_t pixels_ = 0;
  std::vector<glm::vec4> normals_;
};

TEST_F(Embedding, AForeignGBufferOfDepthsHasTheSameVisibilityBitForBit) {
  const Host host;
  Renderer renderer(Device::adopt(host.context(), host.queue()));
  renderer.set_scene(scene_);
  const cl::Buffer depth = host.buffer(frame_.depth), normal = host.buffer(normals_), visibility = host.plane(2 * pixels_);
  for (const MethodInfo& info : methods()) {
    const Method method = info.method;
    const Settings settings = small_settings(method);
    Renderer ours(test_device());
    ours.set_scene(scene_);
    ours.render(settings);
    const Frame expected = ours.read_frame();
    for (std::size_t light = 0; light < 2; ++light)
      renderer.enqueue_visibility({.gbuffer = gbuffer_of(depth, normal),
                                   .light = light,
                                   .settings = settings,
                                   .visibility = visibility(),
                                   .plane = light});
    const std::vector<float> both = host.read(visibility, 2 * pixels_);
    EXPECT_TRUE(std::equal(both.begin(), both.begin() + pixels_, expected.visibility[0].begin())) << name_of(method);
    EXPECT_TRUE(std::equal(both.begin() + pixels_, both.end(), expected.visibility[1].begin())) << name_of(method);
  }
}

TEST_F(Embedding, AForeignGBufferOfPositionsHasTheSameVisibilityButForRounding) {
  const Host host;
  Renderer renderer(Device::adopt(host.context(), host.queue()));
  renderer.set_scene(scene_);
  const cl::Buffer position = host.buffer(frame_.position_ws), normal = host.buffer(normals_), visibility = host.plane(pixels_);
  GBuffer gbuffer;
  gbuffer.resolution = frame_.resolution;
  gbuffer.position = position();
  gbuffer.normal = normal();
  renderer.enqueue_visibility({.gbuffer = gbuffer, .settings = settings_, .visibility = visibility()});
  const std::vector<float> got = host.read(visibility, pixels_);
  std::size_t off = 0;
  for (std::size_t i = 0; i < pixels_; ++i) off += std::abs(got[i] - frame_.visibility[0][i]) > 1e-3f;
  EXPECT_LE(off, pixels_ / 1000);
}

TEST_F(Embedding, AGBufferHasASizeOfItsOwn) {
  // Other rows and columns than the scene's camera has, of the same field of view.
  const Host host;
  for (const glm::uvec2 size : {glm::uvec2(192, 160), glm::uvec2(50, 41), glm::uvec2(301, 70)}) {
    Scene at_size = scene_;
    at_size.camera.resolution = size;
    Renderer ours(test_device()), renderer(Device::adopt(host.context(), host.queue()));
    ours.set_scene(at_size);
    renderer.set_scene(scene_);
    for (const MethodInfo& info : methods()) {
      const Settings settings = small_settings(info.method);
      ours.render(settings);
      const Frame expected = ours.read_frame();
      const std::size_t pixels = expected.depth.size();
      std::vector<glm::vec4> normals = expected.normal_ws;
      for (std::size_t i = 0; i < pixels; ++i) normals[i].w = expected.depth[i] > 0 ? 1.0f : 0.0f;
      const cl::Buffer depth = host.buffer(expected.depth), normal = host.buffer(normals), visibility = host.plane(pixels);
      renderer.enqueue_visibility({.gbuffer = {.resolution = size, .depth = depth(), .normal = normal()},
                                   .settings = settings,
                                   .visibility = visibility()});
      EXPECT_EQ(host.read(visibility, pixels), expected.visibility[0]) << info.name << " " << size.x << "x" << size.y;
    }
  }
}

TEST_F(Embedding, PositionsMeanTheSameWhereverTheScenesCameraIs) {
  const Host host;
  Renderer renderer(Device::adopt(host.context(), host.queue()));
  Scene elsewhere = scene_;
  elsewhere.camera.position = {-40, 70, 300};
  elsewhere.camera.yfov_deg = 3;
  elsewhere.camera.resolution = {17, 9};
  const cl::Buffer position = host.buffer(frame_.position_ws), normal = host.buffer(normals_), visibility = host.plane(pixels_);
  for (const MethodInfo& info : methods()) {
    const auto seen_in = [&](const Scene& scene) {
      renderer.set_scene(scene);
      renderer.enqueue_visibility({.gbuffer = {.resolution = frame_.resolution, .position = position(), .normal = normal()},
                                   .settings = small_settings(info.method),
                                   .visibility = visibility()});
      return host.read(visibility, pixels_);
    };
    EXPECT_EQ(seen_in(elsewhere), seen_in(scene_)) << info.name;
  }
}

TEST_F(Embedding, ReceiversOffTheirSurfaceNeedATolerance) {
  // A floor alone, and positions that lie beneath it by less than 2e-2, as some renderers store them.
  Scene scene = scene_;
  scene.meshes = {scene.meshes[0], placed("below", ground_mesh(), {0, -1, 0}, glm::dvec3(10))};  // so that the floor casts
  scene.meshes[1].casts_shadow = false;
  const Host host;
  Renderer renderer(Device::adopt(host.context(), host.queue()));
  renderer.set_scene(scene);
  std::vector<glm::vec4> positions, normals;
  for (int i = 0; i < 64 * 64; ++i) {
    positions.emplace_back(0.05f * static_cast<float>(i % 64) - 1.6f, -2e-2f * static_cast<float>(i % 7) / 7,
                           0.05f * static_cast<float>(i / 64) - 1.6f, 1);
    normals.emplace_back(0, 1, 0, 1);
  }
  const cl::Buffer position = host.buffer(positions), normal = host.buffer(normals), visibility = host.plane(positions.size());
  for (const Method method : {Method::hard, Method::exact})
    for (const double tolerance : {0.0, 3e-2}) {
      renderer.enqueue_visibility(
          {.gbuffer = {.resolution = {64, 64}, .position = position(), .normal = normal(), .tolerance = tolerance},
           .settings = {.method = method},
           .visibility = visibility()});
      const std::vector<float> seen = host.read(visibility, positions.size());
      const auto dark = std::ranges::count_if(seen, [](float v) { return v < 1.0f; });
      if (tolerance > 0.0)
        EXPECT_EQ(dark, 0) << name_of(method);
      else
        EXPECT_GT(dark, 1000) << name_of(method) << ": they shadow themselves";
    }
}

TEST_F(Embedding, WhereNothingIsSeenThereMayStandAnyNumber) {
  constexpr float nan = std::numeric_limits<float>::quiet_NaN(), infinity = std::numeric_limits<float>::infinity();
  constexpr std::array<float, 6> none{nan, infinity, -infinity, 0.0f, -1.0f, -1e30f};
  const Host host;
  Renderer renderer(Device::adopt(host.context(), host.queue()));
  renderer.set_scene(scene_);
  const auto is_hole = [](std::size_t i) { return i % 7 == 3 || i / 64 % 5 == 1; };  // single pixels, and whole vectors
  std::vector<float> zeros = frame_.depth, any = frame_.depth;
  std::vector<glm::vec4> nowhere = frame_.position_ws, anywhere = frame_.position_ws, normals = normals_;
  for (std::size_t i = 0; i < pixels_; ++i) {
    if (!is_hole(i)) continue;
    zeros[i] = 0.0f;
    any[i] = none[i % none.size()];
    nowhere[i] = glm::vec4(0.0f);
    anywhere[i] = glm::vec4(glm::vec3(none[i % none.size()]), i % 2 == 0 ? 0.0f : -1.0f);
    normals[i] = glm::vec4(glm::vec3(none[(i + 1) % none.size()]), 1.0f);
  }
  const cl::Buffer planes[] = {host.buffer(zeros), host.buffer(any), host.buffer(nowhere), host.buffer(anywhere)};
  const cl::Buffer normal = host.buffer(normals_), any_normal = host.buffer(normals), visibility = host.plane(pixels_);
  for (const MethodInfo& info : methods()) {
    const Settings settings = small_settings(info.method);
    for (const bool has_depth : {true, false}) {
      const auto seen_with = [&](const cl::Buffer& plane, const cl::Buffer& with_normal) {
        GBuffer gbuffer = gbuffer_of(plane, with_normal);
        if (!has_depth) std::swap(gbuffer.depth, gbuffer.position);
        renderer.enqueue_visibility({.gbuffer = gbuffer, .settings = settings, .visibility = visibility()});
        return host.read(visibility, pixels_);
      };
      const std::vector<float> expected = seen_with(planes[has_depth ? 0 : 2], normal),
                               got = seen_with(planes[has_depth ? 1 : 3], any_normal);
      std::size_t shadowed = 0;
      for (std::size_t i = 0; i < pixels_; ++i) {
        ASSERT_EQ(expected[i], got[i]) << info.name << " " << has_depth << " " << i;
        ASSERT_TRUE(!is_hole(i) || got[i] == 1.0f) << info.name << " " << has_depth << " " << i;
        shadowed += got[i] < 1.0f;
      }
      EXPECT_GT(shadowed, 100u) << info.name;
    }
  }
}

// Shadow fins reach as far as the farthest receiver of their tile needs: to others in it that must make no difference.
TEST_F(Embedding, FinsReachAllThatTheyCanShadowWhateverElseIsSeen) {
  constexpr unsigned width = 192, rows = 16;
  Scene scene;
  scene.name = "plate";
  scene.meshes = {placed("plate", ground_mesh(), {-10, 2, 0}, glm::dvec3(20)),
                  placed("floor", ground_mesh(), {0, 0, 0}, glm::dvec3(40)),
                  placed("basement", ground_mesh(), {0, -4, 0}, glm::dvec3(60))};
  scene.meshes[1].casts_shadow = false;
  scene.camera = {.position = {0, 1.5, 0}, .target = {0, 0, 0}, .up = {0, 0, 1}, .resolution = {width, 2 * rows}};
  const glm::vec3 light(0, 6, 0);
  scene.lights = {{.name = "key", .position = light, .target = {0, 0, 0}, .up = {}, .radius = 0.8, .cone_deg = 60}};
  const Host host;
  Renderer renderer(Device::adopt(host.context(), host.queue()));
  renderer.set_scene(scene);
  const auto seen_from = [&](float y, Method method) {
    // On the floor, and beneath each of these where the light's ray through it meets y.
    std::vector<glm::vec4> positions, normals(std::size_t(width) * 2 * rows, glm::vec4(0, 1, 0, 1));
    for (unsigned row = 0; row < 2 * rows; ++row)
      for (unsigned x = 0; x < width; ++x) {
        const glm::vec3 p(0.01f * (static_cast<float>(x) - 0.5f * width), 0, 0.1f * static_cast<float>(row % rows));
        positions.emplace_back(row < rows ? p : light + (p - light) * (light.y - y) / light.y, 1.0f);
      }
    const cl::Buffer position = host.buffer(positions), normal = host.buffer(normals), visibility = host.plane(positions.size());
    GBuffer gbuffer;
    gbuffer.resolution = {width, 2 * rows};
    gbuffer.position = position();
    gbuffer.normal = normal();
    renderer.enqueue_visibility({.gbuffer = gbuffer, .settings = {.method = method}, .visibility = visibility()});
    return host.read(visibility, width * rows);
  };
  for (const Method method : {Method::fins, Method::layered_fins}) {
    const std::vector<float> alone = seen_from(0.0f, method), with_basement = seen_from(-3.9f, method);
    std::size_t penumbra = 0;
    for (std::size_t i = 0; i < alone.size(); ++i) {
      ASSERT_NEAR(alone[i], with_basement[i], 1e-5) << name_of(method) << " " << i % width;
      penumbra += alone[i] > 0.0f && alone[i] < 1.0f;
    }
    EXPECT_GT(penumbra, 1000u);
  }
}

TEST_F(Embedding, OurOwnGBufferOnTheirQueueIsTheSameToo) {
  const Host host;
  Renderer renderer(Device::adopt(host.context(), host.queue()));
  renderer.set_scene(scene_);
  const cl::Buffer visibility = host.plane(2 * pixels_);
  const cl::Buffer rgb = host.plane(4 * pixels_);
  const GBuffer gbuffer = renderer.enqueue_gbuffer();
  for (std::size_t light = 0; light < 2; ++light)
    renderer.enqueue_visibility(
        {.gbuffer = gbuffer, .light = light, .settings = settings_, .visibility = visibility(), .plane = light});
  renderer.enqueue_shade({.gbuffer = gbuffer, .visibility = visibility(), .rgb = rgb()});
  const std::vector<float> shaded = host.read(rgb, 4 * pixels_);
  EXPECT_TRUE(std::equal(shaded.begin(), shaded.end(), &frame_.rgb[0].x));
}

TEST_F(Embedding, TexturedLightsHaveTheirColoursToo) {
  const auto picture = [](std::vector<glm::vec3> texels) {
    return std::make_shared<LightTexture>(LightTexture{"test", {2, 1}, std::move(texels)});
  };
  Scene scene = scene_;  // the first light stays a disc
  scene.lights[1].shape = LightShape::rectangle;
  scene.lights[1].size = {1.5, 1.5};
  scene.lights[1].texture = picture({{2, 0, 0}, {0, 0, 6}});
  scene.lights.push_back(scene.lights[1]);
  scene.lights[2].name = "third";
  scene.lights[2].position = {3, 5, 2};
  scene.lights[2].texture = picture({{0, 3, 0}, {1, 1, 1}});
  scene.ambient = glm::vec3(0.0f);
  for (const Method method : {Method::exact, Method::light_samples}) {
    const Settings settings{.method = method, .light_resolution_px = 256, .samples = 64};
    Renderer ours(test_device());
    ours.set_scene(scene);
    ours.render(settings);
    const Frame expected = ours.read_frame();
    std::vector<glm::vec4> sum(pixels_);
    for (const Light& light : scene.lights) {
      Scene one = scene;
      one.lights = {light};
      ours.set_scene(one);
      ours.render(settings);
      const Frame part = ours.read_frame();
      for (std::size_t i = 0; i < pixels_; ++i) sum[i] += part.rgb[i];
    }
    for (std::size_t i = 0; i < pixels_; ++i)
      ASSERT_LT(glm::distance(glm::vec3(sum[i]), glm::vec3(expected.rgb[i])), 1e-4f) << name_of(method) << i;

    const Host host;
    Renderer renderer(Device::adopt(host.context(), host.queue()));
    renderer.set_scene(scene);
    const cl::Buffer visibility = host.plane(3 * pixels_), tints = host.plane(2 * 4 * pixels_), rgb = host.plane(4 * pixels_);
    const GBuffer gbuffer = renderer.enqueue_gbuffer();
    for (const std::size_t light : {2, 0, 1})
      renderer.enqueue_visibility({.gbuffer = gbuffer,
                                   .light = light,
                                   .settings = settings,
                                   .visibility = visibility(),
                                   .plane = light,
                                   .tints = tints()});
    renderer.enqueue_shade({.gbuffer = gbuffer, .visibility = visibility(), .rgb = rgb(), .tints = tints()});
    const std::vector<float> colours = host.read(rgb, 4 * pixels_);
    EXPECT_TRUE(std::equal(colours.begin(), colours.end(), &expected.rgb[0].x)) << name_of(method);
    const std::vector<float> written = host.read(tints, 2 * 4 * pixels_);
    EXPECT_EQ(std::ranges::count(written, -1.0f), 0) << "planes are written whole";

    renderer.enqueue_shade({.gbuffer = gbuffer, .visibility = visibility(), .rgb = rgb()});
    const std::vector<float> mean = host.read(rgb, 4 * pixels_);
    std::size_t differing = 0;
    for (std::size_t i = 0; i < pixels_; ++i) differing += std::abs(mean[4 * i] - colours[4 * i]) > 0.01f;
    EXPECT_GT(differing, 50u) << name_of(method);
  }
}

TEST_F(Embedding, OnlyItsPlaneIsWritten) {
  const Host host;
  Renderer renderer(Device::adopt(host.context(), host.queue()));
  renderer.set_scene(scene_);
  const cl::Buffer depth = host.buffer(frame_.depth), normal = host.buffer(normals_), visibility = host.plane(3 * pixels_);
  renderer.enqueue_visibility(
      {.gbuffer = gbuffer_of(depth, normal), .settings = settings_, .visibility = visibility(), .plane = 1});
  const std::vector<float> planes = host.read(visibility, 3 * pixels_);
  for (std::size_t i = 0; i < pixels_; ++i) {
    ASSERT_EQ(planes[i], -1.0f);
    ASSERT_EQ(planes[pixels_ + i], frame_.visibility[0][i]);
    ASSERT_EQ(planes[2 * pixels_ + i], -1.0f);
  }
}

TEST_F(Embedding, EnqueueingNeitherWaitsNorRunsAhead) {
  const Host host;
  Renderer renderer(Device::adopt(host.context(), host.queue()));
  renderer.set_scene(scene_);
  const cl::Buffer depth = host.buffer(frame_.depth), normal = host.buffer(normals_), visibility = host.plane(pixels_);
  cl::UserEvent gate(host.context);
  const std::vector<cl_event> wait = {gate()};

  // Should a call block on the gate, the gate is opened after a while, so that the test fails instead of hanging.
  std::mutex mutex;
  std::condition_variable returned;
  bool has_returned = false, was_forced = false;
  std::thread rescue([&] {
    std::unique_lock lock(mutex);
    if (!returned.wait_for(lock, 20s, [&] { return has_returned; })) {
      was_forced = true;
      gate.setStatus(CL_COMPLETE);
    }
  });
  cl_event done = nullptr;
  renderer.enqueue_visibility(
      {.gbuffer = gbuffer_of(depth, normal), .settings = settings_, .visibility = visibility(), .wait = wait, .done = &done});
  {
    const std::lock_guard lock(mutex);
    has_returned = true;
  }
  returned.notify_one();
  rescue.join();
  ASSERT_FALSE(was_forced) << "enqueue_visibility waited for an event in its wait list";
  ASSERT_NE(done, nullptr);
  const cl::Event finished(done);  // takes the reference that the caller must release

  host.queue.flush();
  std::this_thread::sleep_for(100ms);
  EXPECT_GT(finished.getInfo<CL_EVENT_COMMAND_EXECUTION_STATUS>(), CL_COMPLETE) << "done before what it waits for";
  gate.setStatus(CL_COMPLETE);
  finished.wait();
  EXPECT_EQ(finished.getInfo<CL_EVENT_COMMAND_EXECUTION_STATUS>(), CL_COMPLETE);
  EXPECT_EQ(host.read(visibility, pixels_), frame_.visibility[0]);
}

TEST_F(Embedding, ScenesMayChangeWhileWorkIsPending) {
  Scene moved = scene_, larger = scene_;
  moved.lights[0].position.x += 1;
  move_by(moved.meshes[1], {0.3, 0.2, -0.4});
  larger.meshes.push_back(placed("more", box_mesh(), {1, 2, 1}, glm::dvec3(0.5)));
  for (const Method method : {Method::smoothies, Method::layered_fins, Method::exact}) {
    const Settings settings = small_settings(method);
    const Host host;
    Renderer renderer(Device::adopt(host.context(), host.queue()));
    const cl::Buffer depth = host.buffer(frame_.depth), normal = host.buffer(normals_), visibility = host.plane(pixels_);
    std::vector<std::vector<float>> expected;
    const std::vector<const Scene*> scenes = {&scene_, &moved, &larger};
    for (const Scene* scene : scenes) {
      renderer.set_scene(*scene);
      renderer.enqueue_visibility({.gbuffer = gbuffer_of(depth, normal), .settings = settings, .visibility = visibility()});
      expected.push_back(host.read(visibility, pixels_));
    }
    EXPECT_NE(expected[0], expected[1]);
    EXPECT_NE(expected[0], expected[2]);

    cl::UserEvent gate(host.context);
    const std::vector<cl_event> wait = {gate()};
    const cl::Buffer planes = host.plane(3 * pixels_);
    for (std::size_t i = 0; i < scenes.size(); ++i) {
      renderer.set_scene(*scenes[i]);
      renderer.enqueue_visibility(
          {.gbuffer = gbuffer_of(depth, normal), .settings = settings, .visibility = planes(), .plane = i, .wait = wait});
    }
    gate.setStatus(CL_COMPLETE);
    const std::vector<float> got = host.read(planes, 3 * pixels_);
    for (std::size_t i = 0; i < scenes.size(); ++i)
      EXPECT_TRUE(std::equal(expected[i].begin(), expected[i].end(), got.begin() + static_cast<std::ptrdiff_t>(i * pixels_)))
          << name_of(method) << ", scene " << i;
  }
}

TEST_F(Embedding, AQueueWithProfilingIsRightToo) {
  const Host host(CL_QUEUE_PROFILING_ENABLE);
  Renderer renderer(Device::adopt(host.context(), host.queue()));
  renderer.set_scene(scene_);
  renderer.render(settings_);
  EXPECT_EQ(renderer.read_frame().visibility, frame_.visibility);
  EXPECT_FALSE(renderer.stage_times().empty());
}

TEST_F(Embedding, ContextAndQueueOutliveTheRenderer) {
  const Host host;
  // Commands that have run may let go of the queue a little later.
  const auto settles_at = [&](cl_uint count) {
    for (int i = 0; i < 500 && host.queue.getInfo<CL_QUEUE_REFERENCE_COUNT>() != count; ++i) std::this_thread::sleep_for(10ms);
    return host.queue.getInfo<CL_QUEUE_REFERENCE_COUNT>() == count;
  };
  {
    Renderer renderer(Device::adopt(host.context(), host.queue()));
    renderer.set_scene(scene_);
    renderer.render(settings_);
    EXPECT_GT(host.queue.getInfo<CL_QUEUE_REFERENCE_COUNT>(), 1u) << "ours beside theirs";
  }
  EXPECT_TRUE(settles_at(1));
  host.read(host.plane(16), 16);  // still works
}

TEST_F(Embedding, WrongBuffersAreInputErrors) {
  const Host host;
  Renderer renderer(Device::adopt(host.context(), host.queue()));
  const cl::Buffer depth = host.buffer(frame_.depth), normal = host.buffer(normals_), visibility = host.plane(2 * pixels_);
  const cl::Buffer small = host.plane(pixels_ - 1);
  const auto fails = [&](const GBuffer& gbuffer, cl_mem out, std::size_t plane, std::initializer_list<std::string_view> parts) {
    expect_error<InputError>(
        [&] { renderer.enqueue_visibility({.gbuffer = gbuffer, .settings = settings_, .visibility = out, .plane = plane}); },
        parts);
  };
  const GBuffer good = gbuffer_of(depth, normal);
  fails(good, visibility(), 0, {"set_scene"});
  renderer.set_scene(scene_);

  GBuffer bad = good;
  bad.depth = nullptr;
  fails(bad, visibility(), 0, {"depth or position"});
  bad = good;
  bad.depth = small();
  fails(bad, visibility(), 0, {"depth", fmt::format("{}", pixels_ * 4)});
  bad = good;
  bad.depth = nullptr;
  bad.position = depth();  // holds a float a pixel, not four
  fails(bad, visibility(), 0, {"position"});
  bad = good;
  bad.normal = nullptr;
  fails(bad, visibility(), 0, {"no normal buffer"});
  bad = good;
  bad.normal = depth();
  fails(bad, visibility(), 0, {"normal"});
  bad = good;
  bad.resolution.y += 1;  // more than its planes hold
  fails(bad, visibility(), 0, {"depth", fmt::format("{}", (pixels_ + 96) * 4)});
  for (const glm::uvec2 size : {glm::uvec2(0, 80), glm::uvec2(96, 0), glm::uvec2(16385, 1)}) {
    bad = good;
    bad.resolution = size;
    fails(bad, visibility(), 0, {fmt::format("{}x{}", size.x, size.y), "1 to 16384"});
  }
  for (const double tolerance : {-0.1, std::nan(""), HUGE_VAL}) {
    bad = good;
    bad.tolerance = tolerance;
    fails(bad, visibility(), 0, {"tolerance", "at least 0"});
  }
  const Host other;
  const cl::Buffer foreign = other.plane(pixels_);
  bad = good;
  bad.depth = foreign();
  fails(bad, visibility(), 0, {"depth buffer is of another OpenCL context"});
  fails(good, foreign(), 0, {"visibility buffer is of another OpenCL context"});
  const cl::Image2D image(host.context, CL_MEM_READ_WRITE, cl::ImageFormat(CL_RGBA, CL_FLOAT), 96, 80);
  bad = good;
  bad.normal = image();
  fails(bad, visibility(), 0, {"normal is an OpenCL image", "expected a buffer"});
  fails(good, image(), 0, {"visibility is an OpenCL image"});
  fails(good, nullptr, 0, {"no visibility buffer"});
  fails(good, small(), 0, {"visibility"});
  fails(good, visibility(), 2, {"visibility"});
  const auto refuses = [&](const VisibilityRequest& request, std::initializer_list<std::string_view> parts) {
    expect_error<InputError>([&] { renderer.enqueue_visibility(request); }, parts);
  };
  refuses({.gbuffer = good, .light = 2, .settings = settings_, .visibility = visibility()},
          {"enqueue_visibility", "light 2", "the scene has 2"});
  refuses({.gbuffer = good, .settings = {.method = Method::pcf, .pcf_filter = 5}, .visibility = visibility()},
          {"enqueue_visibility", "pcf-filter", "2 or 4", "'5'"});

  const cl::Buffer rgb = host.plane(4 * pixels_);
  const auto cannot_shade = [&](const ShadeRequest& request, std::initializer_list<std::string_view> parts) {
    expect_error<InputError>([&] { renderer.enqueue_shade(request); }, parts);
  };
  cannot_shade({.gbuffer = good, .visibility = visibility(), .rgb = rgb()}, {"enqueue_shade", "base colour"});
  bad = good;
  bad.base_color = normal();
  cannot_shade({.gbuffer = bad, .visibility = small(), .rgb = rgb()}, {"visibility"});
  cannot_shade({.gbuffer = bad, .visibility = visibility(), .rgb = small()}, {"rgb"});
  Scene textured = scene_;
  textured.lights[0].shape = LightShape::rectangle;
  textured.lights[0].size = {1, 1};
  textured.lights[0].texture = std::make_shared<LightTexture>(LightTexture{"test", {1, 1}, {glm::vec3(1)}});
  renderer.set_scene(textured);
  cannot_shade({.gbuffer = bad, .visibility = visibility(), .rgb = rgb(), .tints = small()}, {"tints"});
  refuses({.gbuffer = good, .visibility = visibility(), .tints = small()}, {"tints"});
  renderer.set_scene(scene_);

  renderer.enqueue_visibility({.gbuffer = good, .settings = settings_, .visibility = visibility()});  // and it works on
  EXPECT_EQ(host.read(visibility, pixels_), frame_.visibility[0]);
}

TEST_F(Embedding, WhatCannotBeAdoptedIsAnInputError) {
  const Host host, other;
  expect_error<InputError>([&] { Device::adopt(nullptr, host.queue()); }, {"adopt", "null"});
  expect_error<InputError>([&] { Device::adopt(host.context(), nullptr); }, {"adopt", "null"});
  expect_error<InputError>([&] { Device::adopt(other.context(), host.queue()); }, {"adopt", "another context"});
  const Host unordered(CL_QUEUE_OUT_OF_ORDER_EXEC_MODE_ENABLE);
  expect_error<InputError>([&] { Device::adopt(unordered.context(), unordered.queue()); }, {"adopt", "in-order"});
}

}  // namespace
}  // namespace halfshade
