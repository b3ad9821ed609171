#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "halfshade/halfshade.hpp"
#include "scene/animation.hpp"
#include "support/temp_folder.hpp"

namespace {

using halfshade::InputError;
using halfshade::LightType;
using halfshade::load_scene;
using halfshade::Scene;
using halfshade::scene_at_frame;
using halfshade::validate;
using Json = nlohmann::json;

constexpr double infinity = std::numeric_limits<double>::infinity();

class SceneFile : public testing::Test {
 protected:
  SceneFile() {
    folder_.write("box.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n");
    json_ = Json::parse(R"({
      "meshes": [{"path": "box.obj"}],
      "camera": {"position": [0, 6, 9], "target": [0, 1, -0.5]},
      "lights": [{"type": "spot", "position": [4, 9, 2], "target": [0, 1, -0.5]}]
    })");
  }

  Scene load() { return load_scene(folder_.write("my.scene.json", json_.dump())); }

  /// Expects the scene to be refused with a message that begins with the file and holds `parts`.
  void refuse_text(std::string_view text, std::initializer_list<std::string_view> parts) {
    SCOPED_TRACE(text);
    const auto path = folder_.write("my.scene.json", text);
    expect_error<InputError>([&] { load_scene(path); }, parts);
    expect_error<InputError>([&] { load_scene(path); }, {path.string() + ": "});
  }

  /// The same for the good scene with one value put in at `pointer`.
  void refuse(const char* pointer, const Json& value, std::initializer_list<std::string_view> parts) {
    Json json = json_;
    json[Json::json_pointer(pointer)] = value;
    refuse_text(json.dump(), parts);
  }

  TempFolder folder_;
  Json json_;
};

// ---- reading ----------------------------------------------------------------------------------------------------------------

TEST_F(SceneFile, WhatIsLeftOutHasItsDefault) {
  const Scene scene = load();
  EXPECT_EQ(scene.name, "my.scene");
  ASSERT_EQ(scene.meshes.size(), 1u);
  EXPECT_EQ(scene.meshes[0].name, "box");
  EXPECT_EQ(scene.meshes[0].mesh->triangles.size(), 4u);
  EXPECT_EQ(scene.meshes[0].world_from_mesh, glm::dmat4(1.0));
  EXPECT_TRUE(scene.meshes[0].casts_shadow);
  EXPECT_TRUE(scene.meshes[0].receives_shadow);
  EXPECT_EQ(scene.camera.up, glm::dvec3(0, 1, 0));
  EXPECT_EQ(scene.camera.resolution, glm::uvec2(1024, 1024));
  ASSERT_EQ(scene.lights.size(), 1u);
  EXPECT_EQ(scene.lights[0].name, "light0");
  EXPECT_FALSE(scene.lights[0].up.has_value());
  EXPECT_EQ(scene.lights[0].radius, 0.1);
  EXPECT_EQ(scene.ambient, glm::vec3(0.0f));
  EXPECT_EQ(scene.animation.first_frame, 1);
  EXPECT_EQ(scene.animation.last_frame, 1);
}

TEST_F(SceneFile, ALightCanBeARectangleWithATexture) {
  json_["lights"][0].update({{"shape", "rectangle"}, {"size", {1.5, 0}}, {"texture", "panel.exr"}});
  const auto picture = std::make_shared<halfshade::LightTexture>(halfshade::LightTexture{"panel.exr", {1, 1}, {glm::vec3(2.0f)}});
  std::filesystem::path asked;
  const Scene scene = load_scene(folder_.write("my.scene.json", json_.dump()), [&](const std::filesystem::path& path) {
    asked = path;
    return picture;
  });
  EXPECT_EQ(asked, folder_ / "panel.exr");
  EXPECT_EQ(scene.lights[0].shape, halfshade::LightShape::rectangle);
  EXPECT_EQ(scene.lights[0].size, glm::dvec2(1.5, 0));
  EXPECT_EQ(scene.lights[0].texture, picture);
}

TEST_F(SceneFile, ARectanglesSizeIsAnimatedAndADiscsRadius) {
  const auto animated = [&](const std::string& member, const Json& keys) {
    json_["animation"] = {{"tracks", {{{"target", "light0." + member}, {"keys", keys}}}}};
    return json_.dump();
  };
  refuse_text(animated("size", {{1, {1, 2}}}), {"animation.tracks[0].target", "light0.size"});
  json_["lights"][0].erase("radius");
  json_["lights"][0].update({{"shape", "rectangle"}, {"size", {1, 2}}});
  refuse_text(animated("radius", {{1, 2}}), {"animation.tracks[0].target", "light0.radius"});
  refuse_text(animated("size", {{1, 2}}), {"animation.tracks[0].keys[0]", "two numbers"});
  refuse_text(animated("size", {{1, {1, 2}}, {2, {1, -2}}}), {"animation.tracks[0].keys[1]", "at least 0", "[1, -2]"});
  animated("size", {{1, {1, 2}}, {3, {3, 0}}});
  EXPECT_EQ(scene_at_frame(load(), 2).lights[0].size, glm::dvec2(2, 1));
}

TEST_F(SceneFile, RefusesShapesThatAreNone) {
  refuse("/lights/0/shape", "rectangel", {"lights[0].shape", "disc, rectangle", "did you mean \"rectangle\""});
  refuse("/lights/0/size", {1, 2}, {"lights[0].size", "none for a disc"});
  refuse("/lights/0/texture", "a.exr", {"lights[0].texture", "none for a disc"});
  json_["lights"][0]["shape"] = "rectangle";
  refuse_text(json_.dump(), {"lights[0]", "\"size\"", "missing"});
  refuse("/lights/0/size", {1, 2, 3}, {"lights[0].size", "two numbers"});
  refuse("/lights/0/size", {1, -2}, {"lights[0]", "size", "at least 0", "[1, -2]"});
  json_["lights"][0]["size"] = {1, 2};
  refuse("/lights/0/radius", 1, {"lights[0].radius", "no radius of a rectangle"});
  refuse("/lights/0/texture", "a.exr", {"lights[0].texture", "reads no pictures"});
  refuse("/lights/0/texture", "a\n.exr", {"lights[0].texture", "control characters"});
}

TEST_F(SceneFile, RefusesTexturesThatAreNoLight) {
  const auto refuse_texture = [&](glm::uvec2 resolution, std::vector<glm::vec3> texels, std::string_view expected) {
    Scene scene = load();
    scene.lights[0].shape = halfshade::LightShape::rectangle;
    scene.lights[0].size = {1, 1};
    scene.lights[0].texture = std::make_shared<halfshade::LightTexture>(halfshade::LightTexture{"t.exr", resolution, texels});
    expect_error<InputError>([&] { validate(scene, "here"); }, {"here", "lights[0]", "texture", "t.exr", expected});
  };
  refuse_texture({1, 1}, {glm::vec3(0.0f)}, "not black all over");
  refuse_texture({1, 1}, {glm::vec3(1, -1, 0)}, "at least 0");
  refuse_texture({1, 1}, {glm::vec3(1, NAN, 0)}, "finite");
  refuse_texture({2, 1}, {glm::vec3(1.0f)}, "as many texels");
  refuse_texture({0, 0}, {}, "as many texels");
  Scene scene = load();
  scene.lights[0].texture = std::make_shared<halfshade::LightTexture>(halfshade::LightTexture{"t.exr", {1, 1}, {glm::vec3(1)}});
  expect_error<InputError>([&] { validate(scene, "here"); }, {"none for a disc"});
}

TEST_F(SceneFile, EveryKeyIsRead) {
  json_ = Json::parse(R"({
    "meshes": [{"name": "b", "path": "box.obj", "translation": [1, 2, 3], "rotation_deg": [4, 5, 6], "scale": [7, 8, -9],
                "casts_shadow": false, "receives_shadow": false, "base_color": [0.25, 0.5, 0.75]}],
    "camera": {"position": [0, 6, 9], "target": [0, 1, 2], "up": [0, 0, 1], "yfov_deg": 30, "znear": 0.5, "zfar": 50,
               "resolution": [640, 1]},
    "lights": [{"name": "key-1_a", "type": "spot", "position": [4, 9, 2], "target": [0, 1, 0], "up": [1, 0, 0], "radius": 0,
                "cone_deg": 174.5, "color": [1, 2, 3], "intensity": 4}],
    "ambient": [0.5, 0.25, 0.125],
    "animation": {"frames": [-3, 48], "tracks": [{"target": "key-1_a.radius", "keys": [[1.5, 0.25]]}]}
  })");
  const Scene scene = load();
  const auto& mesh = scene.meshes[0];
  EXPECT_EQ(mesh.name, "b");
  EXPECT_EQ(mesh.world_from_mesh,
            halfshade::matrix_of({.translation = {1, 2, 3}, .rotation_deg = {4, 5, 6}, .scale = {7, 8, -9}}));
  EXPECT_FALSE(mesh.casts_shadow);
  EXPECT_FALSE(mesh.receives_shadow);
  EXPECT_EQ(mesh.base_color, glm::vec3(0.25f, 0.5f, 0.75f));
  EXPECT_EQ(scene.camera.target, glm::dvec3(0, 1, 2));
  EXPECT_EQ(scene.camera.up, glm::dvec3(0, 0, 1));
  EXPECT_EQ(scene.camera.yfov_deg, 30.0);
  EXPECT_EQ(scene.camera.znear, 0.5);
  EXPECT_EQ(scene.camera.zfar, 50.0);
  EXPECT_EQ(scene.camera.resolution, glm::uvec2(640, 1));
  const auto& light = scene.lights[0];
  EXPECT_EQ(light.name, "key-1_a");
  EXPECT_EQ(light.up, glm::dvec3(1, 0, 0));
  EXPECT_EQ(light.radius, 0.0);
  EXPECT_EQ(light.cone_deg, 174.5);
  EXPECT_EQ(light.color, glm::vec3(1, 2, 3));
  EXPECT_EQ(light.intensity, 4.0);
  EXPECT_EQ(scene.ambient, glm::vec3(0.5f, 0.25f, 0.125f));
  EXPECT_EQ(scene.animation.first_frame, -3);
  EXPECT_EQ(scene.animation.last_frame, 48);
  ASSERT_EQ(scene.animation.tracks.size(), 1u);
  EXPECT_EQ(scene.animation.tracks[0].keys[0].frame, 1.5);
  EXPECT_EQ(scene.animation.tracks[0].keys[0].value.x, 0.25);
}

TEST_F(SceneFile, EachLightTypeHasItsOwnKeys) {
  json_["lights"] = Json::parse(R"([
    {"name": "sun", "type": "directional", "direction": [0, -2, 1], "up": [1, 0, 0], "angular_radius_deg": 0.5, "intensity": 2},
    {"name": "lamp", "type": "point", "position": [1, 2, 3], "radius": 0.25},
    {"name": "noon", "type": "directional", "direction": [0, -1, 0]}])");
  json_["animation"] = Json::parse(R"({"tracks": [{"target": "sun.direction", "keys": [[1, [0, -1, 0]], [3, [2, -1, 0]]]},
                                                  {"target": "sun.angular_radius_deg", "keys": [[1, 1]]},
                                                  {"target": "lamp.position", "keys": [[1, [4, 5, 6]]]}]})");
  const Scene scene = load();
  EXPECT_EQ(scene.lights[0].type, LightType::directional);
  EXPECT_EQ(scene.lights[0].direction, glm::dvec3(0, -2, 1));
  EXPECT_EQ(scene.lights[0].up, glm::dvec3(1, 0, 0));
  EXPECT_EQ(scene.lights[0].angular_radius_deg, 0.5);
  EXPECT_EQ(scene.lights[0].intensity, 2.0);
  EXPECT_EQ(scene.lights[1].type, LightType::point);
  EXPECT_EQ(scene.lights[1].position, glm::dvec3(1, 2, 3));
  EXPECT_EQ(scene.lights[1].radius, 0.25);
  EXPECT_EQ(scene.lights[2].angular_radius_deg, 0.2665) << "the sun's";
  const Scene middle = scene_at_frame(scene, 2);
  EXPECT_EQ(middle.lights[0].direction, glm::dvec3(1, -1, 0));
  EXPECT_EQ(middle.lights[0].angular_radius_deg, 1.0);
  EXPECT_EQ(middle.lights[1].position, glm::dvec3(4, 5, 6));
}

TEST_F(SceneFile, KeysAndValuesThatALightTypeDoesNotHaveAreRefused) {
  json_["lights"] = Json::parse(R"([{"type": "directional", "direction": [0, -1, 0]}])");
  refuse("/lights/0/position", {0, 1, 0}, {": lights[0]: expected one of the keys ", "angular_radius_deg", "\"position\""});
  refuse("/lights/0/radius", 1, {": lights[0]: expected one of the keys "});
  refuse("/lights/0/cone_deg", 60, {": lights[0]: expected one of the keys "});
  refuse("/lights/0/shape", "rectangle", {": lights[0]: expected one of the keys "});
  refuse("/lights/0/direction", {0, 0, 0}, {": lights[0].direction: ", "not 0"});
  refuse("/lights/0/direction", {1e308, 1e308, 0}, {": lights[0].direction: ", "out of reach"});
  refuse("/lights/0/up", {0, 2, 0}, {": lights[0].up: ", "not along the light's direction"});
  for (const double angle : {-0.1, 45.0, 90.0})
    refuse("/lights/0/angular_radius_deg", angle, {": lights[0].angular_radius_deg: ", "below 45"});
  refuse("/animation", {{"tracks", {{{"target", "light0.position"}, {"keys", {{1, {0, 0, 0}}}}}}}},
         {": animation.tracks[0].target: ", "what it has of"});
  refuse("/animation", {{"tracks", {{{"target", "light0.angular_radius_deg"}, {"keys", {{1, 50}}}}}}},
         {": animation.tracks[0].keys[0]: ", "below 45"});
  json_["lights"] = Json::parse(R"([{"type": "directional"}])");
  refuse("/ambient", {0, 0, 0}, {"expected the key \"direction\""});
  json_["lights"] = Json::parse(R"([{"type": "point", "position": [0, 1, 0]}])");
  refuse("/lights/0/target", {0, 0, 0}, {": lights[0]: expected one of the keys ", "\"target\""});
  refuse("/lights/0/radius", -1, {": lights[0].radius: ", "at least 0"});
  json_["lights"] = Json::parse("[5]");
  refuse("/ambient", {0, 0, 0}, {": lights[0]: expected an object"});
}

TEST_F(SceneFile, NothingToDrawAndNoLightIsAScene) {
  json_["meshes"] = Json::array();
  json_.erase("lights");
  const Scene scene = load();
  EXPECT_TRUE(scene.meshes.empty());
  EXPECT_TRUE(scene.lights.empty());
}

TEST_F(SceneFile, AMeshFileIsLoadedOnceUnderWhateverName) {
  std::filesystem::create_directories(folder_ / "sub");
  json_["meshes"] = Json::parse(R"([{"path": "box.obj"}, {"name": "b", "path": "./sub/../box.obj"}])");
  json_["meshes"].push_back({{"name", "c"}, {"path", (folder_ / "box.obj").string()}});
  const Scene scene = load();
  EXPECT_EQ(scene.meshes[0].mesh, scene.meshes[1].mesh);
  EXPECT_EQ(scene.meshes[0].mesh, scene.meshes[2].mesh);
}

TEST(SceneFiles, OfThisProjectAreReadWhereTheirMeshesArePresent) {
  std::size_t count = 0;
  for (const auto& entry : std::filesystem::directory_iterator(HALFSHADE_DATA_DIR "/scenes")) {
    SCOPED_TRACE(entry.path());
    ++count;
    try {
      EXPECT_FALSE(load_scene(entry.path()).lights.empty());
    } catch (const InputError& error) {
      EXPECT_NE(std::string_view(error.what()).find("install the Debian package glmark2-data"), std::string_view::npos)
          << error.what();
    }
  }
  EXPECT_GE(count, 10u);
}

// ---- form -------------------------------------------------------------------------------------------------------------------

TEST_F(SceneFile, BrokenJsonIsRefusedWithLineAndColumn) {
  refuse_text("{\n  \"meshes\": [,]\n}", {"line 2, column 14", "not valid JSON"});
  refuse_text("", {"line 1, column 1", "not valid JSON"});
  refuse_text("{\"meshes\": \"\xff\"}", {"line 1, column ", "not valid JSON"});
  refuse_text("{\"meshes\": [] // comment\n}", {"line 1, column ", "not valid JSON"});
  refuse_text("{\"ambient\": [1e999, 0, 0]}", {"\"ambient\"", "1e999"});
  refuse_text("{\"ambient\": [NaN, 0, 0]}", {"line 1, column 14"});
  refuse_text("[]", {"expected an object (found [])"});
  refuse_text(std::string(60, '['), {"line 1, column 61"});
}

TEST_F(SceneFile, AKeyGivenTwiceIsRefused) {
  refuse_text(R"({"meshes": [], "camera": {"znear": 1, "zfar": 2, "znear": 3}})", {"\"znear\" twice"});
  EXPECT_NO_THROW(load()) << "equal keys of different objects (position, target) are no duplicates";
}

TEST_F(SceneFile, UnknownKeysAreRefusedWithTheNearestKnownOne) {
  refuse("/light", 1, {"json: expected one of the keys meshes, camera, lights", "found \"light\"", "did you mean \"lights\"?"});
  refuse("/camera/resolutoin", 1, {": camera: ", "\"resolutoin\"", "did you mean \"resolution\"?"});
  refuse("/meshes/0/colour", 1, {": meshes[0]: ", "\"colour\""});
  refuse("/lights/0/raduis", 1, {": lights[0]: ", "\"raduis\"", "did you mean \"radius\"?"});
  refuse("/lights/0/zz\nzz", 1, {": lights[0]: ", "\"zz\\nzz\""});
  refuse("/animation/track", 1, {": animation: ", "did you mean \"tracks\"?"});
  refuse("/animation/tracks/0/key", 1, {": animation.tracks[0]: ", "did you mean \"keys\"?"});
}

TEST_F(SceneFile, MissingKeysAreNamed) {
  for (const char* pointer : {"/meshes", "/camera", "/camera/position", "/camera/target", "/meshes/0/path", "/lights/0/type",
                              "/lights/0/position", "/lights/0/target"}) {
    Json json = json_;
    const Json::json_pointer where(pointer);
    json[where.parent_pointer()].erase(where.back());
    const auto key = "expected the key \"" + where.back() + "\"";
    refuse_text(json.dump(), {key, "(it is missing); add it"});
  }
}

TEST_F(SceneFile, WrongTypesAreNamedWithTheirPlace) {
  refuse("/meshes", 3, {": meshes: expected an array (found 3)"});
  refuse("/meshes/0", "box.obj", {": meshes[0]: expected an object (found \"box.obj\")"});
  refuse("/meshes/0/path", 3, {": meshes[0].path: expected a string (found 3)"});
  refuse("/meshes/0/scale", 2, {": meshes[0].scale: expected an array of three numbers (found 2)"});
  refuse("/meshes/0/scale", {1, 2}, {": meshes[0].scale: expected an array of three numbers (found [1,2])"});
  refuse("/meshes/0/scale", {1, 2, "3"}, {": meshes[0].scale[2]: expected a number (found \"3\")"});
  refuse("/meshes/0/casts_shadow", 1, {": meshes[0].casts_shadow: expected true or false (found 1)"});
  refuse("/camera", Json::array(), {": camera: expected an object (found [])"});
  refuse("/camera/znear", nullptr, {": camera.znear: expected a number (found null)"});
  refuse("/camera/resolution", 512, {": camera.resolution: expected an array of two whole numbers"});
  refuse("/camera/resolution", {512, 1.5}, {": camera.resolution[1]: expected a whole number"});
  refuse("/camera/resolution", {-1, 512}, {": camera.resolution[0]: expected a whole number"});
  refuse("/camera/resolution", {512, 1e12}, {": camera.resolution[1]: expected a whole number"});
  refuse("/lights/0/radius", "big", {": lights[0].radius: expected a number (found \"big\")"});
  refuse("/lights/0/type", 1, {": lights[0].type: expected a string"});
  refuse("/lights/0/name", "", {": lights[0]: expected a light with a name"});
  refuse("/ambient", 0.5, {": ambient: expected an array of three numbers"});
  refuse("/animation", 1, {": animation: expected an object"});
  refuse("/animation/frames", {1}, {": animation.frames: expected an array of the first and the last frame"});
  refuse("/animation/frames", {1, 2.5}, {": animation.frames[1]: expected a whole number"});
}

TEST_F(SceneFile, UnknownLightTypesAreRefusedWithTheKnownOnes) {
  refuse("/lights/0/type", "area", {": lights[0].type: ", "light types spot, directional, point", "\"area\""});
  refuse("/lights/0/type", "Spot", {"did you mean \"spot\"?"});
}

TEST_F(SceneFile, MeshFilesThatCannotBeReadAreNamedWithTheirMesh) {
  refuse("/meshes/0/path", "nowhere.obj", {"mesh \"nowhere\"", "nowhere.obj: ", "no such file"});
  refuse("/meshes/0/path", ".", {"mesh ", "found a folder"});
  refuse("/meshes/0/path", "/usr/share/glmark2/models/no_such.obj", {"no such file", "install the Debian package glmark2-data"});
  refuse("/meshes/0/path", "a\nb.obj", {": meshes[0].path: ", "without control characters", "\"a\\nb.obj\""});
  folder_.write("bad.obj", "v 0 0 nan\n");
  refuse("/meshes/0/path", "bad.obj", {"mesh \"bad\"", "bad.obj: line 1: "});
}

TEST_F(SceneFile, WhatIsNoReadableFileIsRefused) {
  expect_error<InputError>([&] { load_scene(folder_ / "missing.json"); }, {"missing.json: ", "no such file"});
  expect_error<InputError>([&] { load_scene(folder_ / "."); }, {"found a folder"});
}

// ---- meaning ----------------------------------------------------------------------------------------------------------------

TEST_F(SceneFile, ValuesNoPictureCanBeMadeOfAreRefused) {
  const Json zero = {0, 0, 0};
  refuse("/meshes/0/scale", {1, 0, 1}, {": meshes[0].scale: ", "other than 0", "[1, 0, 1]"});
  refuse("/meshes/0/base_color", {1, -1, 1}, {": meshes[0].base_color: ", "at least 0"});
  refuse("/meshes/0/base_color", {1e300, 0, 0}, {": meshes[0].base_color: ", "finite"});
  refuse("/ambient", {-1, 0, 0}, {": ambient: ", "at least 0"});
  refuse("/camera/target", {0, 6, 9}, {": camera.target: ", "away from position"});
  refuse("/camera/position", {1e308, 0, 0}, {": camera.target: ", "out of reach"});
  refuse("/camera/up", zero, {": camera.up: ", "not along the line"});
  refuse("/camera/up", {0, 10, 19}, {": camera.up: ", "not along the line"});
  refuse("/camera/znear", 0, {": camera.znear: ", "above 0"});
  refuse("/camera/zfar", 0.1, {": camera.zfar: ", "above znear"});
  for (const double angle : {0.0, -10.0, 175.0, 360.0}) {
    refuse("/camera/yfov_deg", angle, {": camera.yfov_deg: ", "below 175"});
    refuse("/lights/0/cone_deg", angle, {": lights[0].cone_deg: ", "below 175"});
  }
  refuse("/camera/resolution", {0, 512}, {": camera.resolution: ", "from 1 to 16384", "[0, 512]"});
  refuse("/camera/resolution", {512, 16385}, {": camera.resolution: ", "from 1 to 16384"});
  refuse("/lights/0/radius", -1, {": lights[0].radius: ", "at least 0", "found -1"});
  refuse("/lights/0/intensity", -1, {": lights[0].intensity: ", "at least 0"});
  refuse("/lights/0/color", {-1, 0, 0}, {": lights[0].color: ", "at least 0"});
  refuse("/lights/0/target", {4, 9, 2}, {": lights[0].target: ", "away from position"});
  refuse("/lights/0/up", {-8, -16, -5}, {": lights[0].up: ", "not along the line"});
}

TEST_F(SceneFile, NamesAreUniqueAndFitForChannels) {
  refuse("/lights/0/name", std::string(400, 'k'), {": lights[0].name: ", "at most 246 letters", "found 400 letters"});
  refuse("/lights/0/name", std::string(247, 'k'), {": lights[0].name: ", "at most 246 letters"});
  Json longest = json_;
  longest["lights"][0]["name"] = std::string(246, 'k');
  EXPECT_EQ(load_scene(folder_.write("long.json", longest.dump())).lights[0].name.size(), 246u);
  longest["lights"].push_back(longest["lights"][0]);
  longest["lights"][1]["name"] = std::string(245, 'k') + "j";
  refuse_text(longest.dump(), {": lights[1].name: ", "first 239 letters"});
  refuse("/meshes", {{{"path", "box.obj"}}, {{"path", "box.obj"}}}, {": meshes[1].name: ", "no other mesh or light", "\"box\""});
  refuse("/lights/0/name", "box", {": lights[0].name: ", "no other mesh or light"});
  refuse("/lights/0/name", "camera", {": lights[0].name: ", "nor the camera"});
  for (const char* name : {"a.b", "a b", "\u00e4", "a/b"})
    refuse("/lights/0/name", name, {": lights[0].name: ", "letters, digits"});
}

TEST_F(SceneFile, TracksThatCannotBePlayedAreRefused) {
  const auto refuse_track = [&](const char* target, const Json& keys, std::initializer_list<std::string_view> parts) {
    refuse("/animation", {{"tracks", {{{"target", target}, {"keys", keys}}}}}, parts);
  };
  const Json good = {{1, {0, 0, 0}}, {2, {1, 1, 1}}};
  refuse_track("bx.translation", good,
               {": animation.tracks[0].target: ", "\"bx.translation\"", "did you mean \"box.translation\"?"});
  refuse_track("box.radius", good, {": animation.tracks[0].target: ", "<mesh>.translation|rotation_deg|scale"});
  refuse_track("camera.up", good, {": animation.tracks[0].target: ", "camera.position|target"});
  refuse_track("box", good, {": animation.tracks[0].target: "});
  refuse_track("box.translation", Json::array(), {": animation.tracks[0].keys: expected at least one key"});
  refuse_track("box.translation", {{1, 5}}, {": animation.tracks[0].keys[0][1]: expected an array of three numbers (found 5)"});
  refuse_track("light0.radius", good, {": animation.tracks[0].keys[0][1]: expected a number"});
  refuse_track("light0.radius", {{1}}, {": animation.tracks[0].keys[0]: expected [frame, number]"});
  refuse_track("light0.radius", {{1, -1}}, {": animation.tracks[0].keys[0]: ", "at least 0"});
  refuse_track("box.scale", good, {": animation.tracks[0].keys[0]: ", "other than 0"});
  refuse_track("box.translation", {{2, {0, 0, 0}}, {2, {1, 1, 1}}},
               {": animation.tracks[0].keys[1]: ", "after the one of the key before"});
  refuse("/animation/frames", {5, 4}, {": animation.frames: ", "not before the first", "[5, 4]"});
  refuse("/animation/frames", {-2147483647 - 1, 2147483647}, {": animation.frames: ", "from -1000000 to 1000000", "2147483647]"});
  refuse("/animation/frames", {-1000001, 4}, {": animation.frames: ", "from -1000000 to 1000000"});
  refuse("/animation/frames", {0, 1000001}, {": animation.frames: ", "from -1000000 to 1000000"});
  refuse("/animation/frames", {0, 4294967296}, {": animation.frames[1]: ", "whole number"});
  refuse_track("light0.intensity", {{1, 1}, {2, 1e39}}, {": animation.tracks[0].keys[1]: ", "at most 1e9", "1e+39"});
  const Json track = {{"target", "box.translation"}, {"keys", good}};
  refuse("/animation/tracks", {track, track}, {": animation.tracks[1].target: ", "one track for each"});
}

TEST_F(SceneFile, ValidateNeedsNoFileAndNoNames) {
  Scene scene;
  validate(scene, "here");
  scene.lights.resize(2);
  validate(scene, "here");
  scene.meshes.resize(1);
  expect_error<InputError>([&] { validate(scene, "here"); }, {"here: meshes[0].mesh: "});
  scene.meshes.clear();
  const auto refuse_number = [&](double& number, std::string_view place) {
    const double before = number;
    for (const double bad : {infinity, -infinity, std::nan("")}) {
      number = bad;
      expect_error<InputError>([&] { validate(scene, "here"); }, {"here: ", place});
    }
    number = before;
  };
  refuse_number(scene.camera.position.x, "camera.position");
  refuse_number(scene.camera.up.y, "camera.up");
  refuse_number(scene.camera.yfov_deg, "camera.yfov_deg");
  refuse_number(scene.camera.znear, "camera.znear");
  refuse_number(scene.camera.zfar, "camera.zfar");
  refuse_number(scene.lights[1].target.z, "lights[1].target");
  refuse_number(scene.lights[1].radius, "lights[1].radius");
  refuse_number(scene.lights[1].cone_deg, "lights[1].cone_deg");
  refuse_number(scene.lights[1].intensity, "lights[1].intensity");
  validate(scene, "here");
}

TEST_F(SceneFile, WhatIsBrighterThanPicturesCanShowIsRefused) {
  refuse("/lights/0/intensity", 1e39, {": lights[0].intensity: ", "at most 1e9", "1e+39"});
  refuse("/lights/0/color", {0, 0, 1e30}, {": lights[0].color: ", "at most 1e9"});
  refuse("/meshes/0/base_color", {1, 1e10, 1}, {": meshes[0].base_color: ", "at most 1e+06"});
  refuse("/ambient", {1, 1, 1e20}, {": ambient: ", "at most 1e+09"});
  json_["lights"][0]["intensity"] = 1e9;
  EXPECT_EQ(load().lights[0].intensity, 1e9);
}

TEST_F(SceneFile, TextThatNestsTooDeeplyIsRefusedWithItsPlace) {
  const auto nested = [](std::size_t depth) { return std::string(depth, '[') + std::string(depth, ']'); };
  refuse_text(nested(100'000), {": line 1, column 65: ", "at most 64 deep"});
  refuse_text(nested(64), {"expected an object"});
  std::string objects;
  for (int i = 0; i < 100'000; ++i) objects += "{\"a\":";
  refuse_text(objects, {": line 1, column 321: ", "at most 64 deep"});
  // Brackets in strings do not count, whatever stands before a quote.
  json_["lights"][0]["name"] = std::string(1000, '[') + "\"" + std::string(1000, '{');
  refuse_text(json_.dump(1), {"lights[0].name"});
  json_["lights"][0].erase("name");
  std::string text = json_.dump();
  text.insert(1, "\n\"ambient\": " + nested(70'000) + ",");
  refuse_text(text, {": line 2, column 75: ", "at most 64 deep"});
}

TEST_F(SceneFile, FilesOutsideOfTheScenesFolderAreReadOnlyIfAllowed) {
  const std::string box = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
  folder_.write("box.obj", box);
  folder_.write("inside/sub/box.obj", box);
  std::filesystem::create_symlink("../box.obj", folder_ / "inside/link.obj");
  std::filesystem::create_symlink("sub", folder_ / "inside/linked");
  const auto path = folder_ / "inside/scene.json";
  const auto load_with = [&](const std::string& mesh, halfshade::ScenePaths allowed) {
    json_["meshes"][0]["path"] = mesh;
    json_["meshes"][0]["name"] = "m";
    return load_scene(folder_.write("inside/scene.json", json_.dump()), {}, allowed);
  };
  for (const std::string& mesh : {std::string("../box.obj"), std::string("sub/../../box.obj"), std::string("link.obj"),
                                  (folder_ / "box.obj").string(), std::string("../inside2/../box.obj")}) {
    SCOPED_TRACE(mesh);
    expect_error<InputError>([&] { load_with(mesh, halfshade::ScenePaths::inside); },
                             {path.string() + ": meshes[0].path: ", "the scene's folder", "--allow-outside"});
    if (mesh != "../inside2/../box.obj") {
      EXPECT_EQ(load_with(mesh, halfshade::ScenePaths::anywhere).meshes.size(), 1u);
    }
  }
  for (const std::string& mesh : {std::string("sub/box.obj"), std::string("sub/../sub/box.obj"), std::string("linked/box.obj"),
                                  std::string("../inside/sub/box.obj"), (folder_ / "inside/sub/box.obj").string()}) {
    SCOPED_TRACE(mesh);
    EXPECT_EQ(load_with(mesh, halfshade::ScenePaths::inside).meshes.size(), 1u);
  }
  // A folder with the marker holds what belongs together; a name that only begins alike is another folder.
  folder_.write("inside-too/box.obj", box);
  expect_error<InputError>([&] { load_with("../inside-too/box.obj", halfshade::ScenePaths::inside); }, {"--allow-outside"});
  folder_.write(".halfshade-root", "");
  EXPECT_EQ(load_with("../box.obj", halfshade::ScenePaths::inside).meshes.size(), 1u);
  expect_error<InputError>([&] { load_with("/etc/hostname", halfshade::ScenePaths::inside); }, {"--allow-outside"});

  json_["meshes"][0]["path"] = "sub/box.obj";
  json_["lights"][0].update({{"shape", "rectangle"}, {"size", {1, 1}}, {"texture", "/etc/panel.exr"}});
  const auto textured = folder_.write("inside/scene.json", json_.dump());
  expect_error<InputError>([&] { load_scene(textured); }, {": lights[0].texture: ", "--allow-outside"});
}

TEST_F(SceneFile, TooManyMeshesOrLightsAreRefused) {
  Json json = json_;
  for (int i = 0; i < 1024; ++i) json["lights"].push_back(json_["lights"][0]);
  refuse_text(json.dump(), {": lights: ", "at most 1024", "1025"});
}

// ---- animation --------------------------------------------------------------------------------------------------------------

TEST_F(SceneFile, TracksAreLinearBetweenKeysAndHeldOutside) {
  json_["meshes"][0]["name"] = "dotted.name";
  json_["animation"] = Json::parse(R"({"frames": [1, 20], "tracks": [
    {"target": "dotted.name.translation", "keys": [[2, [0, 0, 0]], [6, [4, 8, -4]], [7, [0, 0, 0]]]},
    {"target": "camera.target", "keys": [[1, [1, 2, 3]]]},
    {"target": "light0.radius", "keys": [[0, 1], [10, 2]]}]})");
  const Scene scene = load();
  const auto translation = [&](int frame) { return glm::dvec3(scene_at_frame(scene, frame).meshes[0].world_from_mesh[3]); };
  EXPECT_EQ(translation(-100), glm::dvec3(0));
  EXPECT_EQ(translation(2), glm::dvec3(0));
  EXPECT_EQ(translation(3), glm::dvec3(1, 2, -1));
  EXPECT_EQ(translation(6), glm::dvec3(4, 8, -4));
  EXPECT_EQ(translation(7), glm::dvec3(0));
  EXPECT_EQ(translation(100), glm::dvec3(0));
  EXPECT_EQ(scene_at_frame(scene, 5).camera.target, glm::dvec3(1, 2, 3));
  EXPECT_EQ(scene_at_frame(scene, 5).lights[0].radius, 1.5);
  EXPECT_EQ(scene_at_frame(scene_at_frame(scene, 3), 5).lights[0].radius, 1.5) << "frames do not build on each other";
  EXPECT_EQ(scene.lights[0].radius, 0.1) << "the scene itself stays";
}

TEST_F(SceneFile, FramesThatCannotBeDrawnAreNamedWithTheirTracks) {
  const auto expect_refused = [&](const char* target, const Json& from, const Json& to,
                                  std::initializer_list<std::string_view> parts) {
    SCOPED_TRACE(target);
    json_["animation"] = {{"frames", {1, 9}}, {"tracks", {{{"target", target}, {"keys", {{1, from}, {9, to}}}}}}};
    const Scene scene = load();
    halfshade::check_frames(scene, 1, 4, "my.json");
    halfshade::check_frames(scene, 6, 9, "my.json");
    expect_error<InputError>([&] { halfshade::check_frames(scene, 1, 9, "my.json"); },
                             {"my.json: frame 5, moved by animation.tracks[0]: "});
    expect_error<InputError>([&] { halfshade::check_frames(scene, 1, 9, "my.json"); }, parts);
  };
  expect_refused("box.scale", {1, 1, 1}, {-1, 1, 1}, {"meshes[0].scale: ", "other than 0", "[0, 1, 1]"});
  expect_refused("camera.position", {-1, 1, -0.5}, {1, 1, -0.5}, {"camera.target: "});
  expect_refused("light0.target", {4, 9, 1}, {4, 9, 3}, {"lights[0].target: ", "away from position"});
}

}  // namespace
