// One scene drawn in several ways that must come to the same picture, by every method. Exceptions are named where they are made,
// with their reasons.
#include <array>
#include <random>

#include "cli/cli_fixture.hpp"
#include "hard_cases/cases.hpp"
#include "hard_cases/shapes.hpp"
#include "image/image_io.hpp"
#include "light/light_model.hpp"
#include "support/comparator.hpp"
#include "support/draw.hpp"

namespace halfshade {
namespace {

constexpr unsigned samples = 64;

Shape box() {
  return box_of({-0.4, 1.1, 0.1}, glm::dvec3(1), {20, 30, 10});
}
Shape ball() {
  return Shape().sphere({0.8, 0.9, 0.6}, 0.45, 9);
}
Shape sheet() {
  return sheet_of({-1.4, 0.3}, {-0.2, 1.5}, 2.1).move({8, 0, 5});
}

Scene lit_by(const Light& light, std::vector<SceneMesh> meshes) {
  Scene scene;
  scene.name = "heap";
  scene.meshes = std::move(meshes);
  scene.camera = {.position = {0.5, 6, 8}, .target = {0, 0.5, 0}, .yfov_deg = 40, .zfar = 100, .resolution = {64, 64}};
  scene.lights = {light};
  return scene;
}

std::vector<SceneMesh> heap() {
  return {sheet_of({-5, -5}, {5, 5}, 0).mesh("floor"), box().mesh("box"), ball().mesh("globe"), sheet().mesh("sheet")};
}

Light spot() {
  return {.name = "spot", .position = {3, 8, 2}, .target = {0, 0.3, 0}, .up = glm::dvec3(0, 1, 0), .radius = 0.5, .cone_deg = 80};
}

/// One of each kind.
std::vector<Light> lights() {
  return {spot(),
          {.name = "sun",
           .type = LightType::directional,
           .direction = {-2, -5.5, -1},
           .up = glm::dvec3(0, 1, 0),
           .angular_radius_deg = 3},
          {.name = "ball", .type = LightType::point, .position = {1.3, 5, 1.2}, .up = {}, .radius = 0.3}};
}

Scene transformed(Scene scene, const glm::dmat4& m, double scale) {
  const auto point = [&](glm::dvec3& p) { p = glm::dvec3(m * glm::dvec4(p, 1.0)); };
  const auto direction = [&](glm::dvec3& p) { p = glm::dvec3(m * glm::dvec4(p, 0.0)) / scale; };
  for (SceneMesh& mesh : scene.meshes) mesh.world_from_mesh = m * mesh.world_from_mesh;
  point(scene.camera.position);
  point(scene.camera.target);
  direction(scene.camera.up);
  scene.camera.znear *= scale;
  scene.camera.zfar *= scale;
  for (Light& light : scene.lights) {
    point(light.position);
    point(light.target);
    direction(light.direction);
    if (light.up) direction(*light.up);
    light.radius *= scale;
    light.size *= scale;
  }
  return scene;
}

Scene scaled(const Scene& scene, double scale) {
  return transformed(scene, matrix_of({.scale = glm::dvec3(scale)}), scale);
}

/// The same surface with its triangles, their corners and its vertices in another order.
Shape shuffled(Shape shape, unsigned seed) {
  std::mt19937 random(seed);
  std::vector<unsigned> order(shape.corners.size());
  for (unsigned i = 0; i < order.size(); ++i) order[i] = i;
  std::shuffle(order.begin(), order.end(), random);
  std::vector<glm::dvec3> corners(order.size());
  for (unsigned i = 0; i < order.size(); ++i) corners[order[i]] = shape.corners[i];
  shape.corners = corners;
  std::shuffle(shape.triangles.begin(), shape.triangles.end(), random);
  for (glm::uvec3& t : shape.triangles) {
    t = {order[t.x], order[t.y], order[t.z]};
    for (unsigned turn = random() % 3; turn > 0; --turn) t = {t.y, t.z, t.x};
  }
  return shape;
}

bool has_fins(Method method) {
  return method == Method::smoothies || method == Method::penumbra_maps || method == Method::fins ||
         method == Method::layered_fins;
}

class HardCasesProperties : public testing::TestWithParam<Method> {
 protected:
  Settings settings() const { return {.method = GetParam(), .light_resolution_px = light_resolution_px_, .samples = samples}; }

  /// Draws both and expects the same picture, but for what `rule` allows, wherever both show the same surface: at a border a
  /// pixel may fall to either side of it.
  void expect_same(const Scene& scene, const Scene& other, const ImageRule& rule, const std::string& what) {
    const Frame one = draw(renderer_, scene, settings()).frame, two = draw(renderer_, other, settings()).frame;
    const std::vector<float>& a = one.visibility[0];
    std::vector<float> b = two.visibility[0];
    std::size_t other_surface = 0;
    for (std::size_t i = 0; i < a.size(); ++i) {
      const double depth = one.depth[i] / scene.camera.znear, other_depth = two.depth[i] / other.camera.znear;
      if (std::abs(depth - other_depth) <= 0.01 * depth) continue;
      b[i] = a[i];
      ++other_surface;
    }
    if (other_surface > a.size() / 200) wrong_ += fmt::format("{}: {} pixels show another surface\n", what, other_surface);
    const std::string difference = image_difference(a, b, 1, rule);
    if (!difference.empty()) wrong_ += what + ": " + difference + "\n";
  }
  /// Bit for bit.
  void expect_equal(const Scene& scene, const Scene& other, const std::string& what) {
    expect_same(scene, other, {.percent = 0, .threshold = 0, .hard = 0}, what);
  }
  /// The same but for rounding: exact may see a sample more or less at some pixels; maps may lose or win a texel, which is in
  /// many maps of light-samples, and under many look-ups of pcss.
  static ImageRule rounding() {
    if (GetParam() == Method::exact) return {.percent = 1.5, .threshold = 1.0 / 255, .hard = 2.5 / samples};
    if (GetParam() == Method::pcss || GetParam() == Method::light_samples)
      return {.percent = 4.0, .threshold = 1.0 / 255, .hard = 0.25};
    return {.percent = 1.5, .threshold = 1.0 / 255, .hard = 1.0};
  }
  /// The same but for where texels lie: exact has none. The samples lie elsewhere too where the light turns.
  static ImageRule other_texels() {
    if (GetParam() == Method::exact) return rounding();
    return {.percent = 4.0, .threshold = 0.1, .hard = 1.0};
  }
  void TearDown() override {
    const std::string test = testing::UnitTest::GetInstance()->current_test_info()->name();
    const std::string name = test.substr(0, test.find('/')) + "/" + std::string(name_of(GetParam()));
    if (holds_not_yet(name)) {
      GTEST_SKIP() << name << (wrong_.empty() ? " holds now: take it off the list of what does not" : " not yet: " + wrong_);
    } else {
      EXPECT_EQ(wrong_, "");
    }
  }

  unsigned light_resolution_px_ = 256;
  std::string wrong_;
  Watchdog watchdog_;
  Renderer renderer_{test_device()};
};

std::vector<Method> every() {
  std::vector<Method> all;
  for (const MethodInfo& info : methods()) all.push_back(info.method);
  return all;
}
INSTANTIATE_TEST_SUITE_P(Registry, HardCasesProperties, testing::ValuesIn(every()),
                         [](const auto& info) { return test_name_of(info.param); });

TEST_P(HardCasesProperties, UnitsOfPowersOfTwoAreTheSameBitForBit) {
  for (const Light& light : lights())
    for (const double scale : {0x1p-40, 0x1p-20, 0x1p-1, 0x1p20, 0x1p40}) {
      const Scene scene = lit_by(light, heap());
      expect_equal(scene, scaled(scene, scale), fmt::format("{} times {}", light.name, scale));
    }
}

TEST_P(HardCasesProperties, AnyUnitIsTheSame) {
  for (const Light& light : lights())
    for (const double scale : {1e-12, 1e-6, 3e-3, 1e6, 1e12}) {
      const Scene scene = lit_by(light, heap());
      expect_same(scene, scaled(scene, scale), rounding(), fmt::format("{} times {}", light.name, scale));
    }
}

TEST_P(HardCasesProperties, FarAwayIsTheSame) {
  for (const Light& light : lights()) {
    const Scene scene = lit_by(light, heap());
    for (const glm::dvec3& offset : {glm::dvec3(1e7, -2e7, 0.5e7), glm::dvec3(0, 0, -1e7)})
      // The texel grid of a directional light stays with the world.
      expect_same(scene, transformed(scene, matrix_of({.translation = offset}), 1.0),
                  light.type == LightType::directional ? other_texels() : rounding(), light.name);
  }
}

TEST_P(HardCasesProperties, RotatedIsTheSame) {
  for (const Light& light : lights()) {
    // The cube of a ball of light stays with the world, and with it the turn of its samples: its noise is another.
    const bool is_sphere = model_of(light.type).is_sphere;
    const Scene scene = lit_by(light, heap());
    for (const glm::dvec3& rotation_deg : {glm::dvec3(0, 90, 0), glm::dvec3(33, -20, 40), glm::dvec3(180, 0, 0)})
      expect_same(scene, transformed(scene, matrix_of({.rotation_deg = rotation_deg}), 1.0),
                  is_sphere ? ImageRule{.percent = 4, .threshold = 0.1, .hard = 1.0} : other_texels(),
                  fmt::format("{} turned by {}, {}, {}", light.name, rotation_deg.x, rotation_deg.y, rotation_deg.z));
  }
}

TEST_P(HardCasesProperties, TheOrderOfTrianglesCornersAndVerticesDoesNotMatter) {
  for (const Light& light : lights()) {
    std::vector<SceneMesh> meshes = heap();
    meshes[1] = shuffled(box(), 1).mesh("box");
    meshes[2] = shuffled(ball(), 2).mesh("globe");
    meshes[3] = shuffled(sheet(), 3).mesh("sheet");
    expect_equal(lit_by(light, heap()), lit_by(light, meshes), light.name);
  }
}

TEST_P(HardCasesProperties, WoundTheOtherWayIsTheSame) {
  for (const Light& light : lights()) {
    std::vector<SceneMesh> meshes = heap();
    meshes[1] = box().reverse().mesh("box");
    meshes[2] = ball().reverse().mesh("globe");
    meshes[3] = sheet().reverse().mesh("sheet");
    expect_same(lit_by(light, heap()), lit_by(light, meshes), {.percent = 0.1, .threshold = 1.0 / 255, .hard = 0.1}, light.name);
  }
}

TEST_P(HardCasesProperties, DoubledMeshesAreAsOne) {
  if (GetParam() == Method::fins || GetParam() == Method::layered_fins)
    GTEST_SKIP() << "what two fins hide is added up, however alike they are";
  for (const Light& light : lights()) {
    std::vector<SceneMesh> meshes = heap();
    for (std::size_t i = 1; i < 4; ++i) {
      meshes.push_back(meshes[i]);
      meshes.back().name += "-again";
    }
    expect_same(lit_by(light, heap()), lit_by(light, meshes), {.percent = 0.1, .threshold = 1.0 / 255, .hard = 0.1}, light.name);
  }
}

TEST_P(HardCasesProperties, MergedMeshesAreTheSame) {
  for (const Light& light : lights()) {
    const std::vector<SceneMesh> meshes = {heap()[0], Shape(box()).also(ball()).also(sheet()).mesh("all")};
    expect_same(lit_by(light, heap()), lit_by(light, meshes), rounding(), light.name);
  }
}

TEST_P(HardCasesProperties, SplitMeshesAreTheSame) {
  if (has_fins(GetParam())) GTEST_SKIP() << "a mesh's border is a silhouette and has fins";
  for (const Light& light : lights()) {
    std::vector<SceneMesh> meshes = {heap()[0]};
    const Shape whole = Shape(box()).also(ball()).also(sheet());
    for (unsigned part = 0; part < 7; ++part) {
      Shape some;
      for (std::size_t i = part; i < whole.triangles.size(); i += 7)
        some.triangle(whole.corners[whole.triangles[i].x], whole.corners[whole.triangles[i].y],
                      whole.corners[whole.triangles[i].z]);
      meshes.push_back(some.mesh("part" + std::to_string(part)));
    }
    expect_same(lit_by(light, heap()), lit_by(light, meshes), rounding(), light.name);
  }
}

TEST_P(HardCasesProperties, ASheetOfTwoTrianglesIsAsOneOfTwoHundred) {
  for (const Light& light : lights()) {
    const std::vector<SceneMesh> floor = {sheet_of({-5, -5}, {5, 5}, 0).mesh("floor")};
    std::vector<SceneMesh> two = floor, many = {Shape().sheet_of_cells({-5, -5}, {5, 5}, 0, 10, 10).mesh("floor")};
    two.push_back(sheet_of({-1, -1}, {1, 1}, 1.5).mesh("sheet"));
    many.push_back(Shape().sheet_of_cells({-1, -1}, {1, 1}, 1.5, 10, 10).mesh("sheet"));
    expect_same(lit_by(light, two), lit_by(light, many), rounding(), light.name);
  }
}

TEST_P(HardCasesProperties, AWallOfTwoBoxesIsAsOne) {
  // Seen from behind, with a map that is fine enough for outlines between the boxes.
  const auto wall = [&](const Light& light, std::vector<SceneMesh> boxes) {
    boxes.push_back(sheet_of({-3, -3}, {3, 3}, 0).mesh("floor"));
    Scene scene = lit_by(light, boxes);
    scene.camera = {.position = {-1.5, 3, -4.5}, .target = {0, 0.2, -1}, .yfov_deg = 45, .zfar = 200, .resolution = {128, 128}};
    return scene;
  };
  Light light = spot();
  light.position = {0.8, 2.2, 4};
  light.target = {0, 0.3, -0.5};
  light.radius = 0.35;
  light.cone_deg = 70;
  light_resolution_px_ = 1024;
  const ImageRule rule = GetParam() == Method::exact ? rounding() : ImageRule{.percent = 1.0, .threshold = 0.02, .hard = 0.15};
  expect_same(wall(light, {Shape().box({-1, 0, 0}, {1, 1, 0.2}).mesh("wall")}),
              wall(light, {Shape().box({-1, 0, 0}, {0, 1, 0.2}).mesh("left"), Shape().box({0, 0, 0}, {1, 1, 0.2}).mesh("right")}),
              rule, "abutting");
}

/// Threads and the cache of kernels are fixed before the first call to OpenCL: each of these draws in a process of its own.
class HardCasesRuns : public Cli {
 protected:
  void SetUp() override {
    Cli::SetUp();
    scene([](nlohmann::json& json) {
      json["meshes"].push_back(
          {{"name", "lid"}, {"path", "box.obj"}, {"translation", {0.3, 1.2, 0.2}}, {"scale", {0.5, 0.3, 0.5}}});
      json["meshes"].push_back({{"name", "floor"}, {"path", "box.obj"}, {"translation", {0, -0.7, 0}}, {"scale", {8, 0.2, 8}}});
      json["camera"]["resolution"] = {64, 48};
    });
  }

  /// Every picture that a run draws, by its file's name.
  std::map<std::string, std::vector<float>> drawn(std::vector<std::string> options) {
    fs::remove_all(folder_ / "out");
    options.insert(options.begin(), {"render", "scene.json", "-o", "out", "--light-res", "128"});
    const Result result = run(options);
    EXPECT_EQ(result.code, 0) << result.err;
    std::map<std::string, std::vector<float>> planes;
    for (const std::string& file : files_in("out")) planes[file] = read_exr(folder_ / "out" / file).channels.at("shadow_key.Y");
    return planes;
  }
};

TEST_F(HardCasesRuns, AnyNumberOfThreadsDrawsTheSameBitForBit) {
  const auto one = drawn({"-m", "all", "--threads", "1"});
  EXPECT_EQ(one.size(), methods().size());
  for (const auto& [file, plane] : one) EXPECT_NE(*std::min_element(plane.begin(), plane.end()), 1.0f) << file;
  for (const char* threads : {"2", "7"}) EXPECT_EQ(drawn({"-m", "all", "--threads", threads}), one) << threads;
}

TEST_F(HardCasesRuns, AColdCacheOfKernelsDrawsWhatAWarmOneDraws) {
  const auto warm = drawn({"-m", "exact"});
  const char* before = std::getenv("POCL_CACHE_DIR");
  const std::optional<std::string> kept = before != nullptr ? std::optional<std::string>(before) : std::nullopt;
  fs::create_directory(folder_ / "cache");
  setenv("POCL_CACHE_DIR", (folder_ / "cache").c_str(), 1);
  const auto cold = drawn({"-m", "exact"});
  kept ? setenv("POCL_CACHE_DIR", kept->c_str(), 1) : unsetenv("POCL_CACHE_DIR");
  EXPECT_EQ(warm.size(), 1u);
  EXPECT_EQ(cold, warm);
}

/// A sheet with a hole, and the sheet that fills the hole: what one hides of the light the other leaves.
TEST(HardCasesComplements, WhatOneSheetHidesTheOtherLeaves) {
  const Watchdog watchdog;
  for (const Light& light : lights()) {
    const glm::dvec2 low(-0.7, -0.6), high(0.5, 0.8);
    const Shape hole = sheet_of(low, high, 1.5);
    const Shape rest = Shape()
                           .sheet({-60, -60}, {low.x, 60}, 1.5)
                           .sheet({high.x, -60}, {60, 60}, 1.5)
                           .sheet({low.x, -60}, {high.x, low.y}, 1.5)
                           .sheet({low.x, high.y}, {high.x, 60}, 1.5);
    Scene filled = lit_by(light, {sheet_of({-5, -5}, {5, 5}, 0).mesh("floor"), hole.mesh("hole")});
    filled.camera.position = {-3, 1.3, 3};  // below the sheets
    Scene holed = filled;
    holed.meshes[1] = rest.mesh("rest");
    const Settings settings{.light_resolution_px = 256, .samples = samples};
    const Frame a = draw_frame(test_device(), filled, settings), b = draw_frame(test_device(), holed, settings);
    std::size_t partly = 0, wrong = 0, counted = 0;
    for (std::size_t i = 0; i < a.depth.size(); ++i) {
      if (a.depth[i] <= 0.0f || a.position_ws[i].y > 0.1f || b.position_ws[i].y > 0.1f) continue;
      ++counted;
      partly += a.visibility[0][i] > 0.0f && a.visibility[0][i] < 1.0f;
      wrong += std::abs(a.visibility[0][i] + b.visibility[0][i] - 1.0f) > 0.5f / samples;
    }
    EXPECT_GT(counted, 500u) << light.name;
    EXPECT_GT(partly, 10u) << light.name;
    EXPECT_LE(wrong, counted / 300) << light.name << ": a sample on the very edge may be hidden by both";
  }
}

/// The mean of a rectangle's halves is the rectangle, in the light of any method that draws it.
TEST(HardCasesComplements, TwoHalvesOfALightAreTheWhole) {
  const Watchdog watchdog;
  Light whole = spot(), left = whole, right = whole;
  whole.shape = left.shape = right.shape = LightShape::rectangle;
  whole.size = {1.2, 0.6};
  left.size = right.size = {0.6, 0.6};
  left.name = "left";
  right.name = "right";
  const glm::dmat4 axes = light_axes(whole);
  const glm::dvec3 aside = 0.3 * row_of(axes, 0);
  for (auto& [light, offset] : {std::pair<Light&, glm::dvec3>(left, -aside), {right, aside}}) {
    light.position += offset;
    light.target += offset;
  }
  Scene scene = lit_by(whole, heap());
  scene.lights = {whole, left, right};
  for (const Method method : {Method::exact, Method::light_samples}) {
    const Frame frame = draw_frame(test_device(), scene, {.method = method, .light_resolution_px = 512, .samples = 256});
    double squares = 0.0;
    for (std::size_t i = 0; i < frame.depth.size(); ++i) {
      const double halves = 0.5 * (double{frame.visibility[1][i]} + double{frame.visibility[2][i]});
      squares += std::pow(halves - frame.visibility[0][i], 2);
    }
    EXPECT_LE(std::sqrt(squares / static_cast<double>(frame.depth.size())), 0.008) << name_of(method);
  }
}

}  // namespace
}  // namespace halfshade
