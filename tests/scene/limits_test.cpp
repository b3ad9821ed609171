#include "scene/limits.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <sstream>

#include "image/whole_file.hpp"
#include "scene/picture_names.hpp"

namespace {

namespace limits = halfshade::limits;

TEST(Limits, ThePageSaysWhatHolds) {
  std::ifstream file(std::filesystem::path(HALFSHADE_DATA_DIR).parent_path() / "docs/limits.md");
  std::ostringstream text;
  text << file.rdbuf();
  const std::string page = text.str();
  for (const std::string& row : {
           fmt::format("OBJ: size of a file | {} MiB |", limits::obj_bytes >> 20),
           fmt::format("OBJ: vertices, corners of faces | {}, {} |", limits::obj_vertices, limits::obj_corners),
           fmt::format("with {} steps of search for each corner", limits::ear_steps),
           fmt::format("scene: size of a file | {} MiB |", limits::scene_bytes >> 20),
           fmt::format("arrays and objects | {} deep |", limits::json_depth),
           fmt::format("scene: meshes, lights | {}, {} |", limits::scene_meshes, limits::scene_lights),
           fmt::format("of `--frames` | -{0} to {0}; 0 to {0} |", limits::last_frame),
           fmt::format("name of a light | {} letters: with what surrounds it in pictures, the {} that EXR allows |",
                       halfshade::max_light_name, limits::exr_name),
           fmt::format("pixels a side | {} |", limits::side_px),
           fmt::format("texture of a light: pixels | {} |", limits::texels),
           fmt::format("EXR: header, channels | {} MiB, {} |", limits::exr_header_bytes >> 20, limits::exr_channels),
           fmt::format("or a tile | {} MiB |", limits::exr_chunk_bytes >> 20),
           fmt::format("pixels times channels | {} |", limits::exr_values),
           fmt::format("file names that are written | {} bytes |", halfshade::max_output_name),
       })
    EXPECT_NE(page.find(row), page.npos) << row;
}

TEST(Limits, AllLightTogetherIsANumber) {
  const double brightest = limits::light_color * limits::intensity * limits::texel * limits::base_color * limits::scene_lights;
  EXPECT_LT(brightest, 3.4e38 / 10);
}

}  // namespace
