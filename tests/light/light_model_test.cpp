// What holds for every kind and shape of light that is declared.
#include "light/light_model.hpp"

#include <gtest/gtest.h>

#include <set>

#include "support/light_round_trip.hpp"

namespace halfshade {
namespace {

TEST(LightModels, AreDeclaredOnceAndWhole) {
  std::set<std::string_view> names;
  for (const LightType type : light_types()) {
    SCOPED_TRACE(name_of(type));
    EXPECT_TRUE(names.insert(name_of(type)).second);
    const LightModel& model = model_of(type);
    EXPECT_EQ(&model, &model_of(type));
    EXPECT_FALSE(model.keys.empty());
    ASSERT_FALSE(model.shapes.empty());
    ASSERT_FALSE(model.faces.empty());
    EXPECT_EQ(model.has_shape_key, model.shapes.size() > 1);
    EXPECT_EQ(model.has_cone, model.tan_half_cone(Light{.type = type}) > 0.0);
    std::set<std::string_view> keys;
    for (const LightKey& key : keys_of(Light{.type = type, .shape = model.shapes.front()}))
      EXPECT_TRUE(keys.insert(name_of(key)).second) << name_of(key);
    std::set<std::string_view> faces;
    for (const std::string_view face : model.faces) EXPECT_TRUE(faces.insert(face).second) << face;
  }
}

TEST(LightModels, WithTheirDefaultsAreScenesAndGoToMetadataAndBack) {
  for (const LightType type : light_types())
    for (const LightShape shape : model_of(type).shapes) {
      SCOPED_TRACE(std::string(name_of(type)) + " " + std::string(name_of(shape)));
      const Light light{.name = "light", .type = type, .shape = shape};
      Scene scene;
      scene.lights = {light};
      EXPECT_NO_THROW(validate(scene, "here"));
      expect_round_trip(light);
      EXPECT_EQ(faces_of(light).size(), model_of(type).faces.size());
    }
}

TEST(LightModels, ForgetNoKeyInFiles) {
  // Each animated key of each kind can be the target of a track.
  for (const LightType type : light_types()) {
    Scene scene;
    scene.lights = {{.name = "light", .type = type}};
    for (const LightKey& key : keys_of(scene.lights[0])) {
      scene.animation.tracks = {{"light." + std::string(name_of(key)), {{1.0, {0.5, 0.5, 0.5}}}}};
      if (is_animated(key))
        EXPECT_NO_THROW(validate(scene, "here")) << name_of(type) << "." << name_of(key);
      else
        EXPECT_THROW(validate(scene, "here"), InputError) << name_of(type) << "." << name_of(key);
    }
  }
}

TEST(LightModels, AnUnknownKindOrShapeIsNoOther) {
  const auto unknown = static_cast<LightType>(light_types().size());
  expect_error<InputError>([&] { model_of(unknown); }, {"light type", "declared"});
  expect_error<InputError>([&] { name_of(unknown); }, {"light type"});
  expect_error<InputError>([&] { faces_of(Light{.type = unknown}); }, {"light type"});
  expect_error<InputError>([&] { disc_radius(Light{.type = unknown}); }, {"light type"});
  expect_error<InputError>([&] { model_of(static_cast<LightShape>(light_shapes().size())); }, {"light shape"});
  Scene scene;
  scene.lights = {{.type = unknown}};
  expect_error<InputError>([&] { validate(scene, "here"); },
                           {"here: lights[0].type: expected", "number " + std::to_string(light_types().size())});

  ExrImage image;
  image.metadata["light.key"] = R"({"type":"area","position":[0,5,0],"target":[0,0,0]})";
  expect_error<InputError>([&] { light_from_metadata(image, "key", "a.exr"); },
                           {"a.exr: metadata halfshade:light.key: expected what halfshade render writes", "area",
                            "one of the light types spot, directional, point"});
}

TEST(LightModels, RefuseAShapeThatTheyDoNotHave) {
  Scene scene;
  scene.lights = {{.type = LightType::point, .shape = LightShape::rectangle}};
  expect_error<InputError>([&] { validate(scene, "here"); },
                           {"here: lights[0].shape: expected a shape of a point light: disc (found rectangle)"});
}

}  // namespace
}  // namespace halfshade
