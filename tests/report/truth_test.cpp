// The truth against closed forms and against the reference, at any size and place; what its check finds; its files.
#include "report/truth.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <stdexcept>

#include "cli/cli_fixture.hpp"
#include "report/report_json.hpp"
#include "report/truth_check.hpp"
#include "support/closed_forms.hpp"
#include "support/scenes.hpp"
#include "support/temp_folder.hpp"

namespace halfshade {
namespace {

/// A square of these corners.
SceneMesh square(const std::vector<glm::dvec3>& corners, const Placement& placement = {}) {
  const std::vector<glm::uvec3> triangles = {{0, 1, 2}, {0, 2, 3}};
  SceneMesh mesh;
  mesh.name = "square";
  mesh.mesh = std::make_shared<Mesh>(make_mesh("square", corners, triangles));
  mesh.world_from_mesh = matrix_of(placement);
  return mesh;
}

/// |x|, |z| <= size at height y, placed as a whole.
SceneMesh sheet(double size, double y, const Placement& placement = {}) {
  return square({{-size, y, -size}, {size, y, -size}, {size, y, size}, {-size, y, size}}, placement);
}

/// A spot light at height 8 over the origin, facing down.
Light lamp(double radius = 0.5) {
  return {
      .name = "key", .position = {0, 8, 0}, .target = {0, 0, 0}, .up = glm::dvec3(0, 0, 1), .radius = radius, .cone_deg = 100};
}

/// A scene with points of one of its surfaces.
struct Setting {
  Scene scene;
  Light light;
  std::vector<glm::dvec3> points;
  std::vector<glm::vec4> normals;

  glm::uvec2 resolution() const { return {static_cast<unsigned>(points.size()), 1}; }
  RayReceivers receivers() const { return receivers_of(PreciseScene(scene), resolution(), points, normals, light); }
  std::vector<float> truth(unsigned samples = 256) const {
    const RayReceivers all = receivers();
    return trace_truth(PreciseScene(scene), light, all, 0, all.pixels.size(), samples);
  }
  std::string key(unsigned samples = 256) const { return truth_key(scene, light, receivers(), samples); }
};

/// A tilted box over a floor; everything scaled, then moved. Points lie on the floor, in and out of the box's shadow.
Setting box_above_floor(double scale = 1.0, const glm::dvec3& at = glm::dvec3(0.0), double floor_size = 6.0) {
  Setting all;
  const SceneMesh box = placed("box", box_mesh(), at + scale * glm::dvec3(0.1, 1.5, 0), glm::dvec3(scale), {20, 30, 10});
  all.scene.meshes = {box, sheet(floor_size, 0, {.translation = at, .scale = glm::dvec3(scale)})};
  all.scene.camera.position = at + scale * glm::dvec3(0, 4, 6);
  all.scene.camera.target = at;
  all.light = lamp(0.5 * scale);
  all.light.position = at + scale * glm::dvec3(1, 8, 0.5);
  all.light.target = at;
  for (int i = 0; i < 20 * 20; ++i) {
    all.points.push_back(at + scale * glm::dvec3((i % 20 - 9.5) * 0.15, 0.0, (i / 20 - 9.5) * 0.15));
    all.normals.emplace_back(0, 1, 0, 1);
  }
  return all;
}

TEST(Truth, AgreesWithAHalfPlaneAndHasLessErrorWithMoreSamples) {
  // The edge x = 0 at height 4, light at height 8: seen from (x, 0), it crosses the disc at -x.
  Setting all;
  all.scene.meshes = {sheet(50, 4, {.translation = {-50, 0, 0}})};
  all.light = lamp(1.0);
  for (double x = -0.99; x < 1.0; x += 0.02) all.points.emplace_back(x, 0.0, 0.3);
  all.normals.assign(all.points.size(), glm::vec4(0, 1, 0, 1));
  const auto rmse = [&](unsigned samples) {
    const std::vector<float> seen = all.truth(samples);
    double squares = 0.0;
    for (std::size_t i = 0; i < seen.size(); ++i) squares += std::pow(seen[i] - disc_beyond(-all.points[i].x), 2);
    return std::sqrt(squares / static_cast<double>(seen.size()));
  };
  // n samples, one in each of n strata, leave an error of n^-3/4 in penumbrae.
  EXPECT_NEAR(rmse(256), 0.4 * std::pow(256, -0.75), 0.1 * std::pow(256, -0.75));
  EXPECT_NEAR(rmse(1024), 0.4 * std::pow(1024, -0.75), 0.1 * std::pow(1024, -0.75));
  EXPECT_NEAR(rmse(16384), 0.4 * std::pow(16384, -0.75), 0.1 * std::pow(16384, -0.75));
}

TEST(Truth, OnAFloorIsTheSameHoweverLargeTheFloorIs) {
  const std::vector<float> expected = box_above_floor().truth();
  EXPECT_EQ(std::ranges::count(expected, 0.0f) > 5 && std::ranges::count(expected, 1.0f) > 50, true);
  for (const double size : {1e3, 1e4, 1e5, 1e7}) EXPECT_EQ(box_above_floor(1.0, {}, size).truth(), expected) << size;
}

TEST(Truth, IsTheSameAtAnySizeAndPlace) {
  const std::vector<float> expected = box_above_floor().truth();
  const auto expect_same = [&](double scale, const glm::dvec3& at) {
    const std::vector<float> seen = box_above_floor(scale, at).truth();
    ASSERT_EQ(seen.size(), expected.size()) << scale << " " << at.x;
    std::size_t differing = 0;  // where a sample lies within the rounding of an edge
    for (std::size_t i = 0; i < seen.size(); ++i) {
      EXPECT_NEAR(seen[i], expected[i], 2.5 / 256) << scale << " " << at.x << " " << i;
      differing += seen[i] != expected[i];
    }
    EXPECT_LE(differing, 4u) << scale << " " << at.x;
  };
  for (const double scale : {1e-12, 1e-6, 0.3, 1e6, 1e12}) expect_same(scale, glm::dvec3(0.0));
  expect_same(1.0, {1e7, -3e6, 2e7});
  expect_same(1e-3, {1e7, 0, 0});
}

TEST(Truth, FromFarAwayIsThatOfTheReference) {
  // Receivers a million times as far as casters are large, and a light as wide as they are far.
  Setting all;
  all.scene.meshes = {placed("box", box_mesh(), {0, 5e5, 0}, glm::dvec3(1.0))};
  all.light = lamp(3.0);
  all.light.position = {0, 1e6, 0};
  for (int i = 0; i < 100; ++i) all.points.emplace_back((i % 10 - 4.5) * 0.7, 0.0, (i / 10 - 4.5) * 0.7);
  all.normals.assign(all.points.size(), glm::vec4(0, 1, 0, 1));
  const std::vector<float> seen = all.truth();
  EXPECT_GT(std::ranges::count_if(seen, [](float s) { return s > 0.0f && s < 1.0f; }), 30);
  const TruthCheck check = check_truth(Reference(all.scene), all.light, all.receivers(), seen, 256);
  EXPECT_EQ(check.pixels, 100u);
  EXPECT_EQ(check.differing, 0u) << check.largest;
}

TEST(Truth, LampsShineThatLieInTheirCeiling) {
  for (const glm::dvec3 tilt : {glm::dvec3(0.0), glm::dvec3(13, 37, 29), glm::dvec3(71, 3, -8)}) {
    // The corners of the turned ceiling are rounded to single precision, like those of any mesh file.
    const glm::dmat3 turn(matrix_of({.rotation_deg = tilt}));
    std::vector<glm::dvec3> corners;
    for (const glm::dvec2 c : {glm::dvec2(-6, -6), glm::dvec2(-6, 6), glm::dvec2(6, 6), glm::dvec2(6, -6)})
      corners.push_back(turn * glm::dvec3(c.x, 8, c.y));
    Setting all;
    all.scene.meshes = {square(corners)};
    all.light = lamp();
    all.light.position = turn * glm::dvec3(0, 8, 0);
    all.light.up = turn * glm::dvec3(0, 0, 1);
    all.points = {turn * glm::dvec3(0, 0, 0), turn * glm::dvec3(2, 0, -1)};
    all.normals.assign(2, glm::vec4(turn * glm::dvec3(0, 1, 0), 1));
    EXPECT_EQ(all.truth(), (std::vector<float>{1.0f, 1.0f})) << tilt.x;
    // What hangs below the lamp by a little hides it.
    all.scene.meshes[0].world_from_mesh = matrix_of({.translation = turn * glm::dvec3(0, -1e-4, 0)});
    EXPECT_EQ(all.truth(), (std::vector<float>{0.0f, 0.0f})) << tilt.x;
  }
}

TEST(Receivers, OfALargeFloorStandOnItWhateverTheRoundingOfItsCorners) {
  Setting all = box_above_floor(1.0, {}, 1e5);
  all.scene.camera.resolution = {32, 32};
  all.scene.camera.yfov_deg = 40;
  all.scene.lights = {all.light};
  validate(all.scene, "test");
  Renderer renderer(Device::open(""));
  renderer.set_scene(all.scene);
  renderer.render({.method = Method::hard});
  Frame frame = renderer.read_frame();
  for (float& depth : frame.depth) depth *= 1.0f - 3e-4f;  // as if the floor were drawn a millimetre above or below
  for (glm::vec4& n : frame.normal_ws) n.w = n == glm::vec4(0) ? 0.0f : 1.0f;
  for (const float off : {1.0f, 1.0f + 6e-4f}) {
    for (float& depth : frame.depth) depth *= off;
    const RayReceivers receivers =
        receivers_of(PreciseScene(all.scene), all.scene.camera, frame.depth, frame.normal_ws, all.light);
    std::size_t on_floor = 0;
    for (std::size_t i = 0; i < receivers.pixels.size(); ++i) {
      if (receivers.normals_ws[i].y < 0.99f || receivers.points_ws[i].y > 0.1) continue;
      ++on_floor;
      EXPECT_GT(receivers.points_ws[i].y, 1e-5);
      EXPECT_LT(receivers.points_ws[i].y, 1e-2);
    }
    EXPECT_GT(on_floor, 200u);
  }
}

TEST(TruthCheck, HoldsForATruthAndNotForAWrongOne) {
  const Setting all = box_above_floor();
  const RayReceivers receivers = all.receivers();
  const Reference reference(all.scene);
  const std::vector<float> truth = all.truth();
  const auto check = [&](const std::vector<float>& plane) { return check_truth(reference, all.light, receivers, plane, 256, 1); };
  const TruthCheck right = check(truth);
  EXPECT_TRUE(right.holds());
  EXPECT_EQ(right.pixels, 100u);
  EXPECT_EQ(right.differing, 0u);

  // Everywhere a little off: more than one in a hundred differs.
  std::vector<float> wrong = truth;
  for (float& seen : wrong) seen = seen > 0.5f ? seen - 1.0f / 256 : seen + 1.0f / 256;
  EXPECT_FALSE(check(wrong).holds());
  EXPECT_NEAR(check(wrong).mean, 1.0 / 256, 1e-6);
  // A tenth of the pixels, as a shift of the light would do, or not a number.
  for (const float value : {0.25f, std::numeric_limits<float>::quiet_NaN()}) {
    wrong = truth;
    for (std::size_t i = 0; i < wrong.size(); i += 10) wrong[i] = value;
    const TruthCheck found = check(wrong);
    EXPECT_FALSE(found.holds());
    expect_error<DeviceError>(
        [&] {
          require(found, "room", "key", {400, 1}, "truth-0.f32");
        },
        {"room, light key", "truth", fmt::format("pixel {},0", found.worst_pixel), "truth-0.f32"});
  }
  // Another light.
  Light other = all.light;
  other.radius *= 1.1;
  EXPECT_FALSE(check_truth(reference, other, receivers, truth, 256).holds());
}

TEST(TruthCache, GivesBackWhatItStoredAndTracesAnewWhereAnythingChanged) {
  const TempFolder folder;
  const TruthCache cache(folder / "cache");
  Setting all = box_above_floor();
  const auto truth = [&](unsigned samples, int& traced) {
    traced = 0;
    return cache.truth(all.key(samples), PreciseScene(all.scene), all.light, all.receivers(), samples,
                       [&](double) { traced = 1; });
  };
  int traced = 0;
  const std::vector<float> first = truth(64, traced);
  EXPECT_EQ(traced, 1);
  EXPECT_EQ(first, all.truth(64));
  EXPECT_EQ(truth(64, traced), first);
  EXPECT_EQ(traced, 0);
  const auto expect_traced = [&](const char* what, unsigned samples = 64) {
    truth(samples, traced);
    EXPECT_EQ(traced, 1) << what;
  };
  expect_traced("samples", 16);
  all.light.radius *= 1.01;
  expect_traced("radius");
  all.scene.meshes[0].world_from_mesh[3].y += 0.1;
  expect_traced("transform");
  all.points[3].x += 0.01;
  expect_traced("receivers");
  // A file that is too long is no truth, nor is one cut short, nor one with a bit turned.
  const std::filesystem::path file = cache.path(all.key(64));
  const auto size = std::filesystem::file_size(file);
  std::ofstream(file, std::ios::app | std::ios::binary) << "more";
  expect_traced("too long");
  std::filesystem::resize_file(file, size / 2);
  expect_traced("truncated");
  std::filesystem::resize_file(file, 0);
  expect_traced("emptied");
  std::fstream turned(file, std::ios::in | std::ios::out | std::ios::binary);
  turned.seekp(static_cast<std::streamoff>(size) - 100);
  turned.put('\x3f');
  turned.close();
  expect_traced("damaged");
  EXPECT_EQ(truth(64, traced), all.truth(64));
  EXPECT_EQ(traced, 0);
}

TEST(TruthCache, GoesOnWithTheTileWhereItWasInterrupted) {
  const TempFolder folder;
  const Setting all = box_above_floor();
  const std::string key = all.key(64);
  const TruthCache cache(folder / "cache", 64 * 30);  // 30 of the 400 receivers a tile
  const auto truth = [&](const std::function<void(double)>& progress) {
    return cache.truth(key, PreciseScene(all.scene, 1), all.light, all.receivers(), 64, progress);
  };
  struct Killed {};
  EXPECT_THROW(truth([](double done) {
                 if (done > 0.5) throw Killed();
               }),
               Killed);
  double first = 1.0;
  const std::vector<float> seen = truth([&](double done) { first = std::min(first, done); });
  EXPECT_GT(first, 0.45);
  EXPECT_EQ(seen, all.truth(64));
  // Only the whole is left.
  std::size_t files = 0;
  for ([[maybe_unused]] const auto& entry : std::filesystem::directory_iterator(folder / "cache")) ++files;
  EXPECT_EQ(files, 1u);
}

TEST(TruthKey, IsAnotherWhereAMeshOrItsPlaceIsAnother) {
  // Of the same receivers, so that the scene alone tells them apart.
  const Setting all = box_above_floor();
  const RayReceivers receivers = all.receivers();
  const auto key = [&](const Scene& scene) { return truth_key(scene, all.light, receivers, 64); };
  const std::string before = key(all.scene);
  EXPECT_EQ(key(all.scene), before);

  Scene moved = all.scene, bent = all.scene, torn = all.scene, without = all.scene;
  moved.meshes[0].world_from_mesh[3].x += 1e-3;
  Mesh mesh = *all.scene.meshes[0].mesh;
  mesh.positions[7].x += 1e-3f;
  bent.meshes[0].mesh = std::make_shared<Mesh>(mesh);
  mesh = *all.scene.meshes[0].mesh;
  mesh.triangles[7] = mesh.triangles[8];
  torn.meshes[0].mesh = std::make_shared<Mesh>(mesh);
  without.meshes[0].casts_shadow = false;
  for (const Scene& scene : {moved, bent, torn, without}) EXPECT_NE(key(scene), before);
  moved = all.scene;
  moved.meshes[0].base_color = {1, 0, 0};
  EXPECT_EQ(key(moved), before) << "colours cast nothing";
}

/// Values of the report.json of a folder.
Json report_of(const fs::path& folder) {
  return Json::parse(read_text(folder / "report.json"));
}

class ReportOfTruth : public Cli {
 protected:
  Result report() {
    return run({"report", scene(), "-m", "hard", "--light-res", "64", "--repeat", "1", "--truth-samples", "64", "-o", "out",
                "--cache", "cache"});
  }
};

TEST_F(ReportOfTruth, SaysHowItWasChecked) {
  const Result result = report();
  ASSERT_EQ(result.code, 0) << result.err;
  const Json check = report_of(folder_ / "out").at("scenes").at(0).at("lights").at(0).at("truth_check");
  EXPECT_GT(check.at("pixels"), 10);
  EXPECT_EQ(check.at("differing"), 0);
  EXPECT_EQ(check.at("largest_difference"), 0.0);
  EXPECT_EQ(check.at("mean_difference"), 0.0);
}

TEST_F(ReportOfTruth, IsNotPublishedWhereTheTruthIsWrong) {
  ASSERT_EQ(report().code, 0);
  const std::string key = report_of(folder_ / "out").at("scenes").at(0).at("lights").at(0).at("truth_key");
  const TruthCache cache(folder_ / "cache");
  std::vector<float> truth = *cache.find(key, 37 * 21);
  for (float& seen : truth) seen = 1.0f - seen;
  cache.keep(key, truth);

  const Result result = report();
  EXPECT_EQ(result.code, 1);
  for (const char* part : {"scene, light key", "truth", "pixel ", "Nothing is published", key.c_str()})
    EXPECT_TRUE(has(result.err, part)) << part << ": " << result.err;
  EXPECT_FALSE(fs::exists(folder_ / "out" / "index.html"));
  EXPECT_FALSE(fs::exists(folder_ / "out" / "report.csv"));

  fs::remove(cache.path(key));
  EXPECT_EQ(report().code, 0);
  EXPECT_TRUE(fs::exists(folder_ / "out" / "index.html"));
}

}  // namespace
}  // namespace halfshade
