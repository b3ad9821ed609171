// A few tiny pictures, kept to notice change (scripts/update_golden.sh makes them anew). Whether they are right is for the other
// tests to say, and for whoever looks at them.
#include <OpenImageIO/imageio.h>
#include <fmt/format.h>

#include "image/image_io.hpp"
#include "support/comparator.hpp"
#include "support/kernel_fixture.hpp"
#include "support/temp_folder.hpp"

namespace halfshade {
namespace {

namespace fs = std::filesystem;

struct Picture {
  const char* scene;
  Method method;
};

class Golden : public testing::TestWithParam<Picture> {
 protected:
  Watchdog watchdog_;
};

/// Red, green, blue, 0 .. 1. Empty where there is no such picture.
std::vector<float> read_png(const fs::path& path, glm::ivec2* resolution) {
  const auto file = OIIO::ImageInput::open(path.string());
  if (!file) return {};
  *resolution = {file->spec().width, file->spec().height};
  std::vector<float> pixels(std::size_t(3) * resolution->x * resolution->y);
  if (file->spec().nchannels != 3 || !file->read_image(0, 0, 0, 3, OIIO::TypeDesc::FLOAT, pixels.data())) return {};
  return pixels;
}

TEST_P(Golden, LooksAsItDid) {
  const auto [name, method] = GetParam();
  Scene scene = load_scene(fs::path(HALFSHADE_DATA_DIR) / "scenes" / (std::string(name) + ".json"));
  scene.camera.resolution = {96, 96};
  Renderer renderer(test_device());
  renderer.set_scene(scene);
  renderer.render({.method = method, .light_resolution_px = 256});

  const std::string file = fmt::format("{}.{}.png", name, name_of(method));
  const fs::path golden = fs::path(HALFSHADE_TEST_DIR) / "golden" / file;
  if (std::getenv("HALFSHADE_UPDATE_GOLDEN")) {
    fs::create_directories(golden.parent_path());
    write_frame_png(golden, renderer.read_frame());
    return;
  }
  const TempFolder folder;
  write_frame_png(folder / file, renderer.read_frame());
  glm::ivec2 size(0), golden_size(0);
  const std::vector<float> pixels = read_png(folder / file, &size), expected = read_png(golden, &golden_size);
  ASSERT_EQ(size, glm::ivec2(96, 96));
  ASSERT_EQ(golden_size, size) << golden << ": missing or of another size; scripts/update_golden.sh makes it";
  // Devices round differently: a few pixels at the borders of shadows and of things may fall to the other side.
  EXPECT_EQ(image_difference(pixels, expected, 3, {.percent = 0.5, .threshold = 3.0 / 255, .hard = 0.6}), "")
      << golden << ": if the change is meant, make it anew with scripts/update_golden.sh and look at it";
}

/// One scene by every method, and those that are hard for the look-ups that all share.
std::vector<Picture> pictures() {
  std::vector<Picture> all;
  for (const MethodInfo& info : methods()) all.push_back({"boxes", info.method});
  for (const char* scene : {"near-boxes", "sharp-corner"})
    for (const Method method : {Method::hard, Method::pcf, Method::smoothies}) all.push_back({scene, method});
  return all;
}

INSTANTIATE_TEST_SUITE_P(Scenes, Golden, testing::ValuesIn(pictures()), [](const auto& info) {
  std::string name = fmt::format("{}_{}", info.param.scene, name_of(info.param.method));
  std::replace(name.begin(), name.end(), '-', '_');
  return name;
});

}  // namespace
}  // namespace halfshade
