#include "image/image_io.hpp"

#include <OpenImageIO/imageio.h>
#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/file.h>
#include <sys/resource.h>
#include <unistd.h>

#include <csignal>
#include <fstream>
#include <limits>

#include "image/whole_file.hpp"

namespace halfshade {
namespace {

namespace fs = std::filesystem;

/// A folder of the test's own, gone afterwards.
class ImageIo : public testing::Test {
 protected:
  void SetUp() override {
    std::string pattern = (fs::temp_directory_path() / "halfshade-image-io-XXXXXX").string();
    ASSERT_NE(mkdtemp(pattern.data()), nullptr);
    folder_ = pattern;
  }
  void TearDown() override { fs::remove_all(folder_); }

  std::size_t file_count() const { return std::distance(fs::directory_iterator(folder_), fs::directory_iterator()); }

  fs::path folder_;
};

/// Every pixel of every plane holds another value. The width is no multiple of anything, the rows are more than one block.
Frame make_frame(glm::uvec2 resolution = {37, 131}, std::size_t lights = 2) {
  Frame frame;
  frame.resolution = resolution;
  const std::size_t pixels = std::size_t{resolution.x} * resolution.y;
  frame.visibility.resize(lights);
  for (std::size_t i = 0; i < pixels; ++i) {
    const float x = static_cast<float>(i);
    frame.rgb.emplace_back(x / pixels, 0.25f + x, 2e5f + x, 1.0f);
    frame.position_ws.emplace_back(x + 0.1f, -x - 0.2f, 1e-30f * x, 1.0f);
    frame.normal_ws.emplace_back(0.3f + x, 0.4f + x, 0.5f + x, 1.0f);
    frame.depth.push_back(x * 0.7f);
    for (std::size_t light = 0; light < lights; ++light) frame.visibility[light].push_back((x + light) / (pixels + lights));
  }
  return frame;
}

const std::vector<std::string> two_lights = {"key", "fill"};

TEST_F(ImageIo, ATextureIsReadByItsChannelsNames) {
  const Frame frame = make_frame();
  const fs::path path = folder_ / "panel.exr", grey = folder_ / "grey.exr", neither = folder_ / "neither.exr";
  write_frame_exr(path, frame, two_lights, false, {});
  const auto texture = read_light_texture(path);
  EXPECT_EQ(texture->name, "panel.exr");
  EXPECT_EQ(texture->resolution, frame.resolution);
  for (std::size_t i = 0; i < frame.rgb.size(); ++i) ASSERT_EQ(texture->texels[i], glm::vec3(frame.rgb[i]));

  write_light_buffers_exr(grey, {{1, 1}, {}, 1.0, 1.0, 2.0, {{"Y", {0.5f}}}}, {});
  EXPECT_EQ(read_light_texture(grey)->texels, std::vector<glm::vec3>{glm::vec3(0.5f)});
  write_light_buffers_exr(neither, {{1, 1}, {}, 1.0, 1.0, 2.0, {{"Z", {0.5f}}}}, {});
  EXPECT_THROW(read_light_texture(neither), InputError);
  EXPECT_THROW(read_light_texture(folder_ / "none.exr"), InputError);
}

TEST_F(ImageIo, ExrKeepsEveryChannelBitForBit) {
  const Frame frame = make_frame();
  const fs::path path = folder_ / "frame.exr";
  write_frame_exr(path, frame, two_lights, false, {{"method", "smoothies"}, {"device", "a, b: \"c\""}});

  const ExrImage image = read_exr(path);
  EXPECT_EQ(image.resolution, frame.resolution);
  ASSERT_EQ(image.channels.size(), 12u);
  for (std::size_t i = 0; i < frame.depth.size(); ++i) {
    for (int c = 0; c < 3; ++c) {
      const std::string rgb(1, "RGB"[c]), xyz(1, "XYZ"[c]);
      ASSERT_EQ(image.channels.at(rgb)[i], frame.rgb[i][c]);
      ASSERT_EQ(image.channels.at("P." + xyz)[i], frame.position_ws[i][c]);
      ASSERT_EQ(image.channels.at("N." + xyz)[i], frame.normal_ws[i][c]);
    }
    ASSERT_EQ(image.channels.at("depth.Z")[i], frame.depth[i]);
    ASSERT_EQ(image.channels.at("shadow_key.Y")[i], frame.visibility[0][i]);
    ASSERT_EQ(image.channels.at("shadow_fill.Y")[i], frame.visibility[1][i]);
  }
  EXPECT_EQ(image.metadata.at("method"), "smoothies");
  EXPECT_EQ(image.metadata.at("device"), "a, b: \"c\"");
  EXPECT_EQ(file_count(), 1u);
}

TEST_F(ImageIo, HalfIsForShadedAndVisibilityOnly) {
  Frame frame = make_frame({4, 4}, 1);
  frame.rgb[3] = glm::vec4(1.0f / 3);
  frame.visibility[0][3] = 1.0f / 3;
  frame.depth[3] = 1.0f / 3;
  const std::vector<std::string> lights = {"key"};
  write_frame_exr(folder_ / "half.exr", frame, lights, true, {});
  const ExrImage image = read_exr(folder_ / "half.exr");
  const float third_in_half = 1365.0f / 4096;
  EXPECT_EQ(image.channels.at("R")[3], third_in_half);
  EXPECT_EQ(image.channels.at("shadow_key.Y")[3], third_in_half);
  EXPECT_EQ(image.channels.at("depth.Z")[3], 1.0f / 3);
}

TEST_F(ImageIo, OnePixelWithoutLights) {
  write_frame_exr(folder_ / "one.exr", make_frame({1, 1}, 0), {}, false, {});
  EXPECT_EQ(read_exr(folder_ / "one.exr").channels.size(), 10u);
}

TEST_F(ImageIo, LightBuffersKeepPlanesAndMapping) {
  LightBuffers buffers;
  buffers.resolution = {3, 2};
  buffers.lm_from_px_origin = {-0.1, 0.30000000000000004};
  buffers.lm_from_px_scale = 1.0 / 3;
  buffers.znear = 0.5;
  buffers.zfar = 20;
  buffers.planes = {{"shadow_map.Z", {1, 2, 3, 4, 5, std::numeric_limits<float>::infinity()}}, {"fin.A", {0, 0, 0, 0, 0, 1}}};
  write_light_buffers_exr(folder_ / "light.exr", buffers, {{"light", "key"}});
  const ExrImage image = read_exr(folder_ / "light.exr");
  EXPECT_EQ(image.resolution, buffers.resolution);
  EXPECT_EQ(image.channels.at("shadow_map.Z"), buffers.planes[0].values);
  EXPECT_EQ(image.channels.at("fin.A"), buffers.planes[1].values);
  EXPECT_EQ(image.metadata.at("light_map_origin"), "-0.1 0.30000000000000004");
  EXPECT_EQ(std::stod(image.metadata.at("light_map_texel")), 1.0 / 3);
  EXPECT_EQ(image.metadata.at("light"), "key");
}

TEST_F(ImageIo, PngIsWrittenWhole) {
  Frame frame = make_frame({5, 3}, 0);
  frame.rgb[0] = glm::vec4(std::numeric_limits<float>::quiet_NaN());
  write_frame_png(folder_ / "frame.png", frame);
  std::ifstream file(folder_ / "frame.png", std::ios::binary);
  const std::string bytes((std::istreambuf_iterator<char>(file)), {});
  EXPECT_EQ(bytes.substr(0, 8), "\x89PNG\r\n\x1a\n");
  EXPECT_NE(bytes.find("IEND"), std::string::npos);
}

TEST_F(ImageIo, TwoChannelsOfOneNameAreAnError) {
  const std::vector<std::string> same = {"key", "key"};
  EXPECT_THROW(write_frame_exr(folder_ / "a.exr", make_frame(), same, false, {}), InputError);
  EXPECT_EQ(file_count(), 0u);
}

TEST_F(ImageIo, AFileInTheWayIsReplacedOnlyWhenTheNewOneIsWhole) {
  const fs::path path = folder_ / "frame.exr";
  std::ofstream(path) << "old";
  write_frame_exr(path, make_frame(), two_lights, false, {});
  EXPECT_EQ(read_exr(path).channels.size(), 12u);
  EXPECT_EQ(file_count(), 1u);
}

TEST_F(ImageIo, WhatCannotBeMadeIsAnInputError) {
  EXPECT_THROW(write_frame_exr(folder_ / "missing" / "a.exr", make_frame(), two_lights, false, {}), InputError);
  std::ofstream(folder_ / "file") << "x";
  EXPECT_THROW(write_frame_exr(folder_ / "file" / "a.exr", make_frame(), two_lights, false, {}), InputError);
  fs::create_directory(folder_ / "a.exr");
  EXPECT_THROW(write_frame_exr(folder_ / "a.exr", make_frame(), two_lights, false, {}), InputError);
  EXPECT_EQ(file_count(), 2u);
}

TEST_F(ImageIo, AFailedWriteLeavesTheOldFileAndNothingElse) {
  const fs::path path = folder_ / "frame.exr";
  std::ofstream(path) << "old";
  // A limit on the size of files makes writing fail half-way, as a full disk does.
  const auto old_handler = std::signal(SIGXFSZ, SIG_IGN);
  rlimit old_limit{};
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &old_limit), 0);
  rlimit limit = old_limit;
  limit.rlim_cur = 4096;
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &limit), 0);
  std::string message;
  try {
    write_frame_exr(path, make_frame(), two_lights, false, {});
  } catch (const DeviceError& error) {
    message = error.what();
  }
  setrlimit(RLIMIT_FSIZE, &old_limit);
  std::signal(SIGXFSZ, old_handler);

  EXPECT_NE(message.find(path.string()), std::string::npos) << message;
  EXPECT_EQ(fs::file_size(path), 3u);
  EXPECT_EQ(file_count(), 1u);
}

TEST_F(ImageIo, OnlyAWholeExrIsRead) {
  const fs::path path = folder_ / "frame.exr";
  EXPECT_THROW(read_exr(path), InputError);
  EXPECT_THROW(read_exr(folder_), InputError);
  write_frame_exr(path, make_frame(), two_lights, false, {});
  fs::resize_file(path, fs::file_size(path) - 1000);
  EXPECT_THROW(read_exr(path), InputError);
  fs::resize_file(path, 0);
  EXPECT_THROW(read_exr(path), InputError);
  write_frame_png(folder_ / "picture.png", make_frame());
  fs::rename(folder_ / "picture.png", path);
  EXPECT_THROW(read_exr(path), InputError);
}

TEST_F(ImageIo, OnlyTheWantedChannelsAreKept) {
  const Frame frame = make_frame();
  write_frame_exr(folder_ / "frame.exr", frame, two_lights, false, {});
  const ExrImage image = read_exr(folder_ / "frame.exr", [](std::string_view name) { return name == "depth.Z" || name == "G"; });
  EXPECT_EQ(image.channel_names.size(), 12u);
  ASSERT_EQ(image.channels.size(), 2u);
  EXPECT_EQ(image.channels.at("depth.Z"), frame.depth);
  EXPECT_EQ(image.channels.at("G")[7], frame.rgb[7].g);
  EXPECT_TRUE(read_exr(folder_ / "frame.exr", [](std::string_view) { return false; }).channels.empty());
}

TEST_F(ImageIo, TiledPicturesAreRead) {
  const fs::path path = folder_ / "tiled.exr";
  OIIO::ImageSpec spec(37, 21, 3, OIIO::TypeFloat);
  spec.tile_width = spec.tile_height = 16;
  spec.x = 5;  // where the data begins within a larger picture
  std::vector<float> pixels(37 * 21 * 3);
  for (std::size_t i = 0; i < pixels.size(); ++i) pixels[i] = static_cast<float>(i);
  const auto output = OIIO::ImageOutput::create("picture.exr");
  ASSERT_TRUE(output && output->open(path.string(), spec) && output->write_image(OIIO::TypeFloat, pixels.data()) &&
              output->close());
  const auto texture = read_light_texture(path);
  ASSERT_EQ(texture->resolution, glm::uvec2(37, 21));
  for (std::size_t i = 0; i < texture->texels.size(); ++i)
    ASSERT_EQ(texture->texels[i], glm::vec3(pixels[3 * i], pixels[3 * i + 1], pixels[3 * i + 2]));
}

/// Puts numbers of 32 bits into a file, at `offset` from the end of the first occurrence of `after`.
void patch(const fs::path& path, std::string_view after, std::size_t offset, std::vector<std::uint32_t> numbers) {
  std::ifstream in(path, std::ios::binary);
  std::string bytes((std::istreambuf_iterator<char>(in)), {});
  const std::size_t at = bytes.find(after) + after.size() + offset;
  for (std::size_t i = 0; i < 4 * numbers.size(); ++i) bytes.at(at + i) = static_cast<char>(numbers[i / 4] >> 8 * (i % 4));
  std::ofstream(path, std::ios::binary) << bytes;
}

TEST_F(ImageIo, HeadersThatAskForTooMuchAreRefusedBeforeMemoryIsTaken) {
  const fs::path path = folder_ / "frame.exr";
  const auto refuse = [&](std::string_view expected) {
    for (const bool as_texture : {false, true}) {
      try {
        if (as_texture)
          read_light_texture(path);
        else
          read_exr(path, [](std::string_view name) { return name == "R"; });
        ADD_FAILURE() << "nothing was thrown: " << expected;
      } catch (const InputError& error) {
        const std::string_view what = error.what();
        EXPECT_TRUE(what.starts_with(path.string() + ": ")) << what;
        EXPECT_NE(what.find(expected), what.npos) << what;
      }
    }
  };
  const auto with_window = [&](std::uint32_t width, std::uint32_t height) {
    write_frame_exr(path, make_frame({4, 4}, 0), {}, false, {});
    using namespace std::string_view_literals;
    patch(path, "dataWindow\0box2i\0"sv, 4, {0, 0, width - 1, height - 1});
  };
  with_window(20'000, 4);
  refuse("at most 16384x16384 pixels (found 20000x4)");
  with_window(4, 2'000'000'000);
  refuse("at most 16384x16384 pixels");
  with_window(0, 4);
  refuse("whole EXR");
  with_window(16384, 16384);
  refuse("expected a");
  using namespace std::string_view_literals;
  write_frame_exr(path, make_frame({4, 4}, 0), {}, false, {});
  patch(path, "channels\0chlist\0"sv, 0, {0x7fffffff});
  refuse("a whole header");
}

TEST_F(ImageIo, ALightsPictureIsOfALimitedSize) {
  // 25 million pixels of one colour: a small file.
  const fs::path path = folder_ / "large.exr";
  OIIO::ImageSpec spec(5000, 5000, 1, OIIO::TypeHalf);
  spec.channelnames = {"Y"};
  spec.attribute("compression", "zip");
  const std::vector<float> row(5000, 1.0f);
  const auto output = OIIO::ImageOutput::create("picture.exr");
  ASSERT_TRUE(output && output->open(path.string(), spec));
  for (int y = 0; y < 5000; ++y) ASSERT_TRUE(output->write_scanline(y, 0, OIIO::TypeFloat, row.data()));
  ASSERT_TRUE(output->close());
  EXPECT_THROW(read_light_texture(path), InputError);
  EXPECT_EQ(read_exr(path).resolution, glm::uvec2(5000, 5000));
}

TEST_F(ImageIo, HalfHoldsTheLargestNumberInsteadOfInfinity) {
  Frame frame = make_frame({4, 4}, 1);
  frame.rgb[3] = glm::vec4(1e9f, std::numeric_limits<float>::quiet_NaN(), 2.0f, 1.0f);
  const std::vector<std::string> lights = {"key"};
  write_frame_exr(folder_ / "half.exr", frame, lights, true, {});
  const ExrImage image = read_exr(folder_ / "half.exr");
  EXPECT_EQ(image.channels.at("R")[3], 65504.0f);
  EXPECT_TRUE(std::isnan(image.channels.at("G")[3]));
  EXPECT_EQ(image.channels.at("B")[3], 2.0f);
}

TEST_F(ImageIo, WhatAKilledProcessLeftIsRemovedAndNothingElse) {
  const std::string dead = "4194303";  // beyond any process number of a default Linux
  const std::vector<std::string> stale{".a.exr." + dead + ".0.part", ".a.exr." + dead + ".12.part"};
  const std::vector<std::string> kept{".b.exr." + dead + ".0.part",  // not asked for
                                      ".a.exr." + std::to_string(getpid()) + ".0.part",
                                      ".a.exr.1.0.part",
                                      ".a.exr." + dead + ".part",
                                      ".a.exr.x.0.part",
                                      ".a.exr." + dead + ".0.parts",
                                      "a.exr." + dead + ".0.part",
                                      ".a.exr." + dead + ".-1.part",
                                      ".a.exr.0.0.part",
                                      "a.exr"};
  for (const auto& names : {stale, kept})
    for (const std::string& name : names) std::ofstream(folder_ / name) << "x";
  const fs::path locked = folder_ / (".a.exr." + dead + ".7.part"), link = folder_ / (".a.exr." + dead + ".8.part");
  std::ofstream(locked) << "x";
  fs::create_symlink(folder_ / "a.exr", link);
  const int descriptor = open(locked.c_str(), O_RDONLY | O_CLOEXEC);
  ASSERT_EQ(flock(descriptor, LOCK_EX), 0);
  remove_abandoned_files(folder_, [](std::string_view name) { return name == "a.exr"; });
  for (const std::string& name : stale) EXPECT_FALSE(fs::exists(folder_ / name)) << name;
  for (const std::string& name : kept) EXPECT_TRUE(fs::exists(folder_ / name)) << name;
  EXPECT_TRUE(fs::exists(locked));
  EXPECT_TRUE(fs::is_symlink(link));
  close(descriptor);
  remove_abandoned_files(folder_ / "no such folder", [](std::string_view) { return true; });
}

TEST_F(ImageIo, ErrorsAreOneLine) {
  try {
    read_exr(folder_ / "nothing.exr");
    FAIL();
  } catch (const InputError& error) {
    EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
  }
}

}  // namespace
}  // namespace halfshade
