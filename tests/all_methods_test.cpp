// What holds for every method of the registry, in both shapes of the kernels, whatever the picture. A method that is added is
// tested here without a line of its own; an exception is named where it is made, with its reason.
#include <cmath>
#include <random>

#include "support/comparator.hpp"
#include "support/draw.hpp"
#include "support/scenes.hpp"

namespace halfshade {
namespace {

class AllMethods : public testing::TestWithParam<Method> {
 protected:
  /// Calls body(device) for the kernels of CPU devices and those of GPU devices.
  template <class Body>
  static void in_both_shapes(Body&& body) {
    for (const std::string& shape : kernel_shapes()) {
      SCOPED_TRACE(shape);
      body(test_device(shape));
      if (HasFatalFailure()) return;
    }
  }
  /// Calls body(device, settings) for each value of each of the method's options, too.
  template <class Body>
  static void with_options_in_both_shapes(Body&& body) {
    in_both_shapes([&](const std::shared_ptr<Device>& device) {
      for (const Settings& settings : with_each_option(GetParam())) {
        SCOPED_TRACE(description_of(settings));
        body(device, settings);
        if (HasFatalFailure()) return;
      }
    });
  }

  Watchdog watchdog_;
};

std::vector<Method> all_methods() {
  std::vector<Method> all;
  for (const MethodInfo& info : methods()) all.push_back(info.method);
  return all;
}

INSTANTIATE_TEST_SUITE_P(Registry, AllMethods, testing::ValuesIn(all_methods()),
                         [](const auto& info) { return test_name_of(info.param); });

std::size_t count_between(const std::vector<float>& plane, float low, float high) {
  return static_cast<std::size_t>(std::count_if(plane.begin(), plane.end(), [&](float v) { return v > low && v < high; }));
}

/// Visibility is a fraction, colours are finite, and what sees nothing says so.
void expect_sound(const Frame& frame) {
  for (const std::vector<float>& plane : frame.visibility) {
    ASSERT_EQ(plane.size(), frame.depth.size());
    for (std::size_t i = 0; i < plane.size(); ++i) {
      ASSERT_TRUE(plane[i] >= 0.0f && plane[i] <= 1.0f) << "pixel " << i << ": " << plane[i];
      if (frame.depth[i] == 0.0f) {
        ASSERT_EQ(plane[i], 1.0f) << i;
      }
    }
  }
  for (const glm::vec4& rgb : frame.rgb)
    for (int c = 0; c < 3; ++c) ASSERT_TRUE(std::isfinite(rgb[c]) && rgb[c] >= 0.0f);
}

double mean_difference(const Frame& a, const Frame& b) {
  double sum = 0.0;
  for (std::size_t i = 0; i < a.depth.size(); ++i) sum += std::abs(a.visibility[0][i] - b.visibility[0][i]);
  return sum / static_cast<double>(a.depth.size());
}

bool has_penumbra(Method method) {
  return method != Method::hard && method != Method::pcf;  // the latter antialiases, as much whatever the light
}

// ------------------------------------------------------------------------------------------------------- light and shadow

TEST_P(AllMethods, DrawsLightUmbraAndWhatItShouldBetween) {
  with_options_in_both_shapes([](const std::shared_ptr<Device>& device, const Settings& settings) {
    const Frame frame = draw_frame(device, box_over_floor(), settings);
    expect_sound(frame);
    const std::vector<float>& plane = frame.visibility[0];
    EXPECT_GT(count_between(plane, -1, 0.001f), 100u);
    EXPECT_GT(count_between(plane, 0.999f, 2), 1000u);
    if (settings.method == Method::hard)
      EXPECT_EQ(count_between(plane, 0, 1), 0u);
    else
      EXPECT_GT(count_between(plane, 0.01f, 0.99f), 5u);
  });
}

TEST_P(AllMethods, IsHardWithoutRadius) {
  if (GetParam() == Method::pcf) GTEST_SKIP() << "filters whatever the light";
  in_both_shapes([](const std::shared_ptr<Device>& device) {
    Scene scene = box_over_floor();
    scene.lights[0].radius = 0.0;
    EXPECT_EQ(draw_frame(device, scene, {.method = GetParam()}).visibility[0],
              draw_frame(device, scene, {.method = Method::hard}).visibility[0]);
  });
}

TEST_P(AllMethods, TendsToHardShadows) {
  Scene scene = box_over_floor();
  const Frame hard = draw_frame(test_device(), scene, {.method = Method::hard});
  double previous = 1e9;
  for (const double light_radius : {0.4, 0.1, 0.01}) {
    scene.lights[0].radius = light_radius;
    const double difference = mean_difference(draw_frame(test_device(), scene, {.method = GetParam()}), hard);
    EXPECT_LE(difference, previous + 2e-7) << light_radius;
    previous = difference;
  }
  EXPECT_LE(previous, 0.01);
}

TEST_P(AllMethods, WhereNothingCastsAllThatFacesTheLightIsLit) {
  Scene none = box_over_floor(), away = box_over_floor();
  for (SceneMesh& mesh : none.meshes) mesh.casts_shadow = false;
  away.lights[0].target = {3, 12, 2};  // the light looks elsewhere: nothing is in its cone
  with_options_in_both_shapes([&](const std::shared_ptr<Device>& device, const Settings& settings) {
    const Frame lit = draw_frame(device, none, settings);
    std::size_t facing = 0;
    for (std::size_t i = 0; i < lit.depth.size(); ++i) {
      const glm::vec3 to_light = glm::vec3(none.lights[0].position) - glm::vec3(lit.position_ws[i]);
      const bool faces_light = glm::dot(glm::vec3(lit.normal_ws[i]), to_light) > 0.0f;
      if (lit.depth[i] > 0.0f && !faces_light) continue;
      ASSERT_EQ(lit.visibility[0][i], 1.0f) << i;
      facing += lit.depth[i] > 0.0f;
    }
    EXPECT_GT(facing, 1000u);
    EXPECT_EQ(count_between(draw_frame(device, away, settings).visibility[0], -1, 0.999f), 0u);
  });
}

TEST_P(AllMethods, WhatReceivesNoShadowIsLit) {
  Scene scene = box_over_floor();
  scene.meshes[0].receives_shadow = false;
  in_both_shapes([&](const std::shared_ptr<Device>& device) {
    const Frame frame = draw_frame(device, scene, small_settings(GetParam()));
    for (std::size_t i = 0; i < frame.depth.size(); ++i)
      if (frame.depth[i] > 0 && frame.position_ws[i].y < 0.01f) {
        ASSERT_EQ(frame.visibility[0][i], 1.0f) << i;
      }
  });
}

TEST_P(AllMethods, SurfacesTurnedAwayAreDark) {
  Scene scene = box_over_floor();
  scene.lights[0].position = {0.3, -5, 0.2};  // under the floor
  scene.lights[0].target = {0, 0, 0};
  with_options_in_both_shapes([&](const std::shared_ptr<Device>& device, const Settings& settings) {
    const Frame frame = draw_frame(device, scene, settings);
    for (std::size_t i = 0; i < frame.depth.size(); ++i)
      if (frame.depth[i] > 0 && frame.position_ws[i].y < 0.01f && glm::length(glm::vec3(frame.position_ws[i])) < 3) {
        ASSERT_EQ(frame.visibility[0][i], 0.0f) << i;
      }
  });
}

TEST_P(AllMethods, AddingACasterNeverBrightens) {
  if (GetParam() == Method::fins || GetParam() == Method::layered_fins)
    GTEST_SKIP() << "inner fins give light to the umbra with one weight a texel, whoever's umbra it is";
  if (GetParam() == Method::pcss) GTEST_SKIP() << "the width of its filter is a mean over blockers: one more may narrow it";
  if (GetParam() == Method::light_samples) GTEST_SKIP() << "the maps of its points move with what casts";
  // The floor is a slab that casts in all of the cone, so that the light map stays where it is; then boxes come one by one. A new
  // box is seen by the camera too: compare where the picture shows the same surface.
  Scene scene = box_over_floor();
  scene.meshes[0] = placed("slab", box_mesh(), {0, -0.1, 0}, {14, 0.2, 14});
  with_options_in_both_shapes([&](const std::shared_ptr<Device>& device, const Settings& settings) {
    Renderer renderer(device);
    Scene growing = scene;
    Frame before = draw(renderer, growing, settings).frame;
    const LightBuffers map = renderer.read_light_buffers(0);
    std::size_t darkened = 0;
    for (int i = 0; i < 3; ++i) {
      growing.meshes.push_back(
          placed("box-" + std::to_string(i), box_mesh(), {-1.5 + i, 0.9 + 0.4 * i, 1.2 - i}, glm::dvec3(0.6), {10.0 * i, 25, 5}));
      const Frame after = draw(renderer, growing, settings).frame;
      const LightBuffers same = renderer.read_light_buffers(0);
      ASSERT_EQ(same.lm_from_px_scale, map.lm_from_px_scale);
      ASSERT_EQ(same.lm_from_px_origin, map.lm_from_px_origin);
      for (std::size_t p = 0; p < after.depth.size(); ++p) {
        if (after.depth[p] != before.depth[p] || after.normal_ws[p] != before.normal_ws[p]) continue;
        // Outer penumbrae are sized for the depth that the map holds, not for the pixel's: where a new box comes before the floor
        // in a texel that a pixel on another box's side also looks up, Lr is nearer and the old penumbra narrower there.
        const bool sized_by_map = settings.method == Method::smoothies || settings.method == Method::penumbra_maps;
        if (sized_by_map && after.position_ws[p].y > 1e-3f) continue;
        ASSERT_LE(after.visibility[0][p], before.visibility[0][p] + 1e-6f) << "pixel " << p;
        darkened += after.visibility[0][p] < before.visibility[0][p] - 0.1f;
      }
      before = after;
    }
    EXPECT_GT(darkened, 100u);
  });
}

std::size_t umbra_px(const Frame& frame) {
  std::size_t count = 0;
  for (std::size_t i = 0; i < frame.position_ws.size(); ++i)
    count += frame.position_ws[i].w > 0.0f && frame.position_ws[i].y < 0.001f && frame.visibility[0][i] < 0.01f;
  return count;
}

TEST_P(AllMethods, AnUmbraShrinksAsTheLightGrowsUnlessPenumbraeAreOuterAlone) {
  const auto umbra_of = [](const char* name) {
    Scene scene = load_scene(std::filesystem::path(HALFSHADE_DATA_DIR) / "scenes" / (std::string(name) + ".json"));
    scene.camera.resolution = glm::uvec2(256);
    return umbra_px(draw_frame(test_device(), scene, {.method = GetParam(), .samples = 64}));
  };
  const std::size_t large = umbra_of("large-light");
  const bool outer_alone = GetParam() == Method::smoothies || GetParam() == Method::penumbra_maps;
  if (outer_alone || !has_penumbra(GetParam())) {
    EXPECT_GT(large, 100u);  // as published: outer penumbrae leave the hard shadow as it is
    return;
  }
  EXPECT_EQ(large, 0u) << "under a light wider than its caster there is none";
  const std::size_t small = umbra_of("cylinder"), medium = umbra_of("cylinder-medium-light");
  EXPECT_GT(static_cast<double>(small), static_cast<double>(medium) * 1.1);
  EXPECT_GT(static_cast<double>(medium), static_cast<double>(umbra_of("cylinder-large-light")) * 1.3);
}

// -------------------------------------------------------------------------------------------------------- whatever the scene

TEST_P(AllMethods, AnEmptySceneIsBlack) {
  Scene scene = box_over_floor({20, 20});
  scene.meshes.clear();
  with_options_in_both_shapes([&](const std::shared_ptr<Device>& device, const Settings& settings) {
    const Frame frame = draw_frame(device, scene, settings);
    expect_sound(frame);
    EXPECT_EQ(frame.visibility[0], std::vector<float>(400, 1.0f));
    EXPECT_EQ(frame.rgb, std::vector<glm::vec4>(400, glm::vec4(0)));
  });
}

TEST_P(AllMethods, CameraAndLightMayStandInsideAMesh) {
  Scene room = box_over_floor();
  room.meshes.push_back(placed("room", box_mesh(), {0, 3, 0}, glm::dvec3(30)));
  Scene inside = box_over_floor();
  inside.lights[0].position = place_of(inside.meshes[1]);
  inside.lights[0].target = {0, 0, 0.01};
  with_options_in_both_shapes([&](const std::shared_ptr<Device>& device, const Settings& settings) {
    expect_sound(draw_frame(device, room, settings));
    expect_sound(draw_frame(device, inside, settings));
  });
}

TEST_P(AllMethods, ManyBoxesInARandomHeapAreSound) {
  std::mt19937 random(17);
  std::uniform_real_distribution<double> place(-2, 2), angle(0, 360), size(0.01, 1);
  for (int trial = 0; trial < 2; ++trial) {
    Scene scene = box_over_floor();
    for (int i = 0; i < 12; ++i)
      scene.meshes.push_back(placed("box-" + std::to_string(i), box_mesh(), {place(random), place(random), place(random)},
                                    {size(random), size(random), i % 5 == 0 ? 1e-4 : size(random)},
                                    {angle(random), angle(random), angle(random)}));
    scene.lights[0].radius = size(random) * 3;
    with_options_in_both_shapes([&](const std::shared_ptr<Device>& device, const Settings& settings) {
      expect_sound(draw_frame(device, scene, settings));
    });
  }
}

TEST_P(AllMethods, AMillionUnitsAwayLooksTheSame) {
  const glm::dvec3 away(1e6, 1e6, -1e6);
  Scene moved = box_over_floor();
  for (SceneMesh& mesh : moved.meshes) move_by(mesh, away);
  moved.camera.position += away;
  moved.camera.target += away;
  moved.lights[0].position += away;
  moved.lights[0].target += away;
  with_options_in_both_shapes([&](const std::shared_ptr<Device>& device, const Settings& settings) {
    const Frame here = draw_frame(device, box_over_floor(), settings), there = draw_frame(device, moved, settings);
    // A hard edge may fall to the other side of a pixel's centre.
    EXPECT_EQ(image_difference(here.visibility[0], there.visibility[0], 1, {.percent = 0.2, .threshold = 1e-3, .hard = 1.0}), "");
    EXPECT_EQ(image_difference(here.depth, there.depth, 1, {.percent = 0.2, .threshold = 1e-4, .hard = 10.0}), "");
  });
}

// ---------------------------------------------------------------------------------------------------------- the same again

TEST_P(AllMethods, DrawnTwiceIsTheSameBitForBit) {
  with_options_in_both_shapes([](const std::shared_ptr<Device>& device, const Settings& settings) {
    Renderer renderer(device);  // its first frame is cold: buffers are made, tile lists may be too small
    const Frame cold = draw(renderer, box_over_floor(), settings).frame;
    for (int i = 0; i < 2; ++i) {
      renderer.render(settings);
      const Frame warm = renderer.read_frame();
      EXPECT_EQ(warm.visibility, cold.visibility);
      EXPECT_EQ(warm.rgb, cold.rgb);
      EXPECT_EQ(warm.depth, cold.depth);
    }
  });
}

TEST_P(AllMethods, WhatWasDrawnBeforeLeavesNoTrace) {
  Scene other = box_over_floor({200, 150});
  other.meshes.push_back(placed("more", box_mesh(), {1, 2, 1}, glm::dvec3(0.5), {45, 0, 45}));
  in_both_shapes([&](const std::shared_ptr<Device>& device) {
    const Settings settings = small_settings(GetParam());
    const Frame fresh = draw_frame(device, box_over_floor(), settings);
    Renderer renderer(device);
    for (const Settings& before : every_method(333)) {
      draw(renderer, other, before);
      const Frame after = draw(renderer, box_over_floor(), settings).frame;
      EXPECT_EQ(after.visibility, fresh.visibility) << name_of(before.method);
      EXPECT_EQ(after.rgb, fresh.rgb) << name_of(before.method);
    }
  });
}

TEST_P(AllMethods, TheOrderOfMeshesDoesNotMatter) {
  Scene scene = box_over_floor(), reversed = scene;
  for (Scene* one : {&scene, &reversed}) {
    one->meshes.push_back(placed("second", box_mesh(), {-1, 0.6, 1}, glm::dvec3(0.7), {0, 50, 0}));
    one->meshes.push_back(placed("third", box_mesh(), {0.2, 2.4, 0.3}, glm::dvec3(0.4), {30, 5, 70}));
  }
  std::reverse(reversed.meshes.begin(), reversed.meshes.end());
  with_options_in_both_shapes([&](const std::shared_ptr<Device>& device, const Settings& settings) {
    EXPECT_EQ(draw_frame(device, reversed, settings).visibility, draw_frame(device, scene, settings).visibility);
  });
}

TEST_P(AllMethods, TwoLightsAreEachOnItsOwn) {
  Scene both = box_over_floor(), second = box_over_floor();
  both.lights.push_back(both.lights[0]);
  both.lights[1].name = "fill";
  both.lights[1].position = {-3, 4, 2};
  both.lights[1].radius = 0;
  second.lights = {both.lights[1]};
  with_options_in_both_shapes([&](const std::shared_ptr<Device>& device, const Settings& settings) {
    const Frame frame = draw_frame(device, both, settings);
    expect_sound(frame);
    ASSERT_EQ(frame.visibility.size(), 2u);
    EXPECT_EQ(frame.visibility[0], draw_frame(device, box_over_floor(), settings).visibility[0]);
    EXPECT_EQ(frame.visibility[1], draw_frame(device, second, settings).visibility[0]);
  });
}

TEST_P(AllMethods, BothShapesOfTheKernelsDrawTheSame) {
  Scene scene = box_over_floor({150, 133});
  scene.meshes.push_back(placed("second", box_mesh(), {-1, 0.6, 1}, glm::dvec3(0.7), {0, 50, 0}));
  for (const Settings& settings : with_each_option(GetParam())) {
    SCOPED_TRACE(description_of(settings));
    Renderer wide(test_device("wide")), narrow(test_device("narrow"));
    const Frame a = draw(wide, scene, settings).frame, b = draw(narrow, scene, settings).frame;
    EXPECT_EQ(image_difference(a.visibility[0], b.visibility[0], 1, {.percent = 0.05, .threshold = 1e-3, .hard = 1.0}), "");
    EXPECT_EQ(a.normal_ws, b.normal_ws);
    const LightBuffers map_a = wide.read_light_buffers(0), map_b = narrow.read_light_buffers(0);
    ASSERT_EQ(map_a.planes.size(), map_b.planes.size());
    ASSERT_EQ(map_a.resolution, map_b.resolution);
    for (std::size_t plane = 0; plane < map_a.planes.size(); ++plane) {
      EXPECT_EQ(map_a.planes[plane].name, map_b.planes[plane].name);
      std::vector<float> ratio(map_a.planes[plane].values.size(), 1.0f), one = ratio;
      for (std::size_t i = 0; i < ratio.size(); ++i) {
        const float from = map_b.planes[plane].values[i], to = map_a.planes[plane].values[i];
        ratio[i] = map_a.planes[plane].name.ends_with(".Z") ? to / from : 1.0f + (to - from);
      }
      EXPECT_EQ(image_difference(ratio, one, 1, {.percent = 0.05, .threshold = plane == 0 ? 1e-5 : 1e-3, .hard = 1.0}), "")
          << map_a.planes[plane].name;
    }
  }
}

// ------------------------------------------------------------------------------------------------------------- settings

struct LightKind {
  const char* what;
  Light light;
};

/// A light of every type and shape that scenes may have.
std::vector<LightKind> all_lights() {
  Light rectangle{.name = "rectangle", .position = {2, 6, 1}, .cone_deg = 80, .shape = LightShape::rectangle, .size = {1, 0.5}};
  Light textured = rectangle;
  textured.name = "textured";
  textured.texture = std::make_shared<LightTexture>(LightTexture{"test", {2, 1}, {{2, 0, 0}, {0, 0, 6}}});
  return {
      {"disc", box_over_floor().lights[0]},
      {"directional", {.name = "distant", .type = LightType::directional, .direction = {-2, -5.5, -1}, .angular_radius_deg = 3}},
      {"sphere", {.name = "lamp", .type = LightType::point, .position = {0.3, 4, 0.2}, .radius = 0.3}},
      {"rectangle", rectangle},
      {"textured rectangle", textured}};
}

TEST_P(AllMethods, DrawsEveryLightThatItDoesNotRefuseAndSaysWhichMethodsDrawTheOthers) {
  for (const auto& [what, light] : all_lights()) {
    SCOPED_TRACE(what);
    Scene scene = box_over_floor();
    scene.lights = {light};
    for (const Settings& settings : with_each_option(GetParam())) {
      SCOPED_TRACE(description_of(settings));
      Renderer renderer(test_device());
      renderer.set_scene(scene);
      if (can_draw(settings, light)) {
        const Frame frame = draw(renderer, scene, settings).frame;
        expect_sound(frame);
        EXPECT_GT(count_between(frame.visibility[0], -1, 0.001f), 20u);
        EXPECT_GT(count_between(frame.visibility[0], 0.999f, 2), 100u);
        continue;
      }
      try {
        renderer.render(settings);
        ADD_FAILURE() << "drawn, though can_draw says that it is not";
      } catch (const InputError& error) {
        const std::string said = error.what();
        EXPECT_TRUE(said.starts_with("render: ")) << said;
        EXPECT_NE(said.find("light"), said.npos) << said;
        EXPECT_NE(said.find(light.name), said.npos) << said;
        if (can_draw(small_settings(GetParam()), light)) continue;  // it is an option's value that is refused
        // The methods that it names can, and no other can.
        EXPECT_NE(said.find(info_of(GetParam()).name), said.npos) << said;
        const std::size_t choose = said.find("choose ");
        ASSERT_NE(choose, said.npos) << said;
        const std::string named = ", " + said.substr(choose + 7) + ",";
        for (const MethodInfo& other : methods())
          EXPECT_EQ(named.find(" " + std::string(other.name) + ",") != named.npos, can_draw(small_settings(other.method), light))
              << other.name << " in: " << said;
      }
    }
  }
}

TEST_P(AllMethods, ItsOptionsAcceptWhatTheySayOfThemselves) {
  const Settings defaults{.method = GetParam()};
  for (const Option& option : options_of(GetParam())) {
    SCOPED_TRACE(option.name);
    EXPECT_NO_THROW(option.check(defaults));
    EXPECT_FALSE(option.summary.empty());
    std::string key(option.name);
    std::replace(key.begin(), key.end(), '-', '_');
    EXPECT_TRUE(option.key.starts_with(key)) << option.key;
    for (const std::string_view listed : {option.measured, option.measured_quickly}) {
      std::istringstream values{std::string(listed)};
      for (std::string value; values >> value;) {
        Settings settings = defaults;
        ASSERT_NO_THROW(option.set(settings, value)) << value;
        EXPECT_EQ(option.text(settings), value) << "what was typed is what is drawn with";
        EXPECT_NO_THROW(check_settings(settings, "test"));
      }
    }
    // Named in the method's own list, and in pictures.
    EXPECT_NE((" " + std::string(info_of(GetParam()).options) + " ").find(" " + std::string(option.name) + " "),
              std::string::npos);
    const auto described = describe(defaults);
    EXPECT_EQ(std::count_if(described.begin(), described.end(), [&](const auto& entry) { return entry.first == option.key; }), 1);
  }
}

TEST_P(AllMethods, ItsOptionsRefuseWhatTheyCannotBe) {
  Renderer renderer(test_device());
  renderer.set_scene(box_over_floor({8, 8}));
  for (const Option& option : options_of(GetParam())) {
    SCOPED_TRACE(option.name);
    for (const char* typed : {"", "-1", "1e9", "99999999", "nonsense"}) {
      Settings settings{.method = GetParam()};
      expect_error<InputError>([&] { option.set(settings, typed); }, {"'" + std::string(typed) + "'"});
    }
  }
  for (const unsigned pixels : {0u, 16385u})
    expect_error<InputError>(
        [&] { renderer.render({.method = GetParam(), .light_resolution_px = pixels}); },
        {"render: light-res: expected a whole number from 1 to 16384 (found '" + std::to_string(pixels) + "')"});
  renderer.render(small_settings(GetParam(), 8));  // and it works on
}

TEST(Registry, NamesEveryMethodOnceAndFindsItAgain) {
  std::vector<std::string_view> names;
  for (const MethodInfo& info : methods()) {
    EXPECT_EQ(std::count(names.begin(), names.end(), info.name), 0) << info.name;
    names.push_back(info.name);
    EXPECT_EQ(method_from_name(info.name), info.method);
    EXPECT_EQ(name_of(info.method), info.name);
    EXPECT_EQ(&info_of(info.method), &info);
    for (const std::string_view text : {info.summary, info.source, info.exact_when, info.receivers, info.time})
      EXPECT_FALSE(text.empty()) << info.name;
  }
  EXPECT_EQ(Settings{}.method, Method::exact);
  expect_error<InputError>([] { method_from_name("fast"); }, {"'fast'", "hard, pcf", "exact"});
  expect_error<InputError>([] { info_of(static_cast<Method>(99)); }, {"99"});
}

TEST(Registry, CountsOutOfRangeAreRefused) {
  Renderer renderer(test_device());
  renderer.set_scene(box_over_floor({8, 8}));
  const auto fails = [&](const Settings& settings, std::initializer_list<std::string_view> parts) {
    expect_error<InputError>([&] { renderer.render(settings); }, parts);
  };
  fails({.method = Method::layered_fins, .layers = 1025}, {"render: layers: expected a whole number from 1 to 1024", "'1025'"});
  fails({.method = Method::layered_fins, .layers = 0}, {"render: layers", "1 to 1024", "'0'"});
  fails({.method = Method::light_samples, .samples = 0}, {"render: samples: expected a whole number from 1", "'0'"});
  fails({.method = Method::exact, .samples = 0}, {"render: samples: expected 16, 64, 256 or 1024 (found '0')"});
}

}  // namespace
}  // namespace halfshade
