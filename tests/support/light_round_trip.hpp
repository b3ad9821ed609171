// A light through every form that its declaration gives it: scene file, Light, picture metadata, Light.
#pragma once

#include <gtest/gtest.h>

#include <string>

#include "cli/light_metadata.hpp"
#include "light/light_model.hpp"
#include "support/temp_folder.hpp"

namespace halfshade {

/// The light of a scene file that has no other and no mesh.
inline Light light_of_file(const std::string& light_json) {
  const TempFolder folder;
  const std::string text =
      R"({"meshes": [], "camera": {"position": [0, 6, 9], "target": [0, 1, 0]}, "lights": [)" + light_json + "]}";
  return load_scene(folder.write("scene.json", text)).lights.at(0);
}

/// What `compare` reads of what `render` writes of a light.
inline Light light_of_metadata(const Light& light) {
  const auto [key, text] = light_metadata(light);
  ExrImage image;
  image.metadata[key] = text;
  return light_from_metadata(image, light.name, "picture.exr").value();
}

/// All that places a light and gives it its size, bit for bit.
inline void expect_same_place(const Light& a, const Light& b) {
  EXPECT_EQ(a.name, b.name);
  EXPECT_EQ(a.type, b.type);
  EXPECT_EQ(a.position, b.position);
  EXPECT_EQ(a.target, b.target);
  EXPECT_EQ(a.direction, b.direction);
  EXPECT_EQ(a.up, b.up);
  EXPECT_EQ(a.radius, b.radius);
  EXPECT_EQ(a.angular_radius_deg, b.angular_radius_deg);
  EXPECT_EQ(a.cone_deg, b.cone_deg);
  EXPECT_EQ(a.shape, b.shape);
  EXPECT_EQ(a.size, b.size);
}

/// Metadata holds all of the light that the file told.
inline void expect_round_trip(const Light& from_file) {
  expect_same_place(light_of_metadata(from_file), from_file);
}

}  // namespace halfshade
