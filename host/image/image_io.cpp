#include "image/image_io.hpp"

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <functional>
#include <mutex>
#include <set>

namespace halfshade {
namespace {

constexpr std::string_view metadata_prefix = "halfshade:";

// -------------------------------------------------------------------------------------------------------- whole files

// The temporary file that is being written, if any. Locked wherever one appears or goes.
std::mutex unfinished_mutex;
const std::filesystem::path* unfinished_path = nullptr;

/// The image library's messages can span lines; ours do not.
std::string one_line(std::string text) {
  while (!text.empty() && text.back() == '\n') text.pop_back();
  std::replace(text.begin(), text.end(), '\n', ' ');
  return text;
}

std::string reason(int error) {
  return std::strerror(error);
}

/// The temporary file. Whatever way the writing ends, it is gone afterwards: renamed or removed.
class TemporaryFile {
 public:
  explicit TemporaryFile(const std::filesystem::path& target) : target_(target) {
    const std::lock_guard lock(unfinished_mutex);
    for (unsigned attempt = 0; descriptor_ < 0; ++attempt) {
      path_ = target.parent_path() / fmt::format(".{}.{}.{}.part", target.filename().string(), getpid(), attempt);
      descriptor_ = open(path_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
      if (descriptor_ < 0 && errno != EEXIST) fail(errno);
    }
    unfinished_path = &path_;
  }
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;
  ~TemporaryFile() {
    if (descriptor_ >= 0) close(descriptor_);
    const std::lock_guard lock(unfinished_mutex);
    if (unfinished_path) unlink(path_.c_str());
    unfinished_path = nullptr;
  }

  void write_all(std::span<const unsigned char> bytes) {
    while (!bytes.empty()) {
      const ssize_t written = write(descriptor_, bytes.data(), bytes.size());
      if (written < 0 && errno == EINTR) continue;
      if (written < 0) fail(errno);
      bytes = bytes.subspan(static_cast<std::size_t>(written));
    }
  }

  /// Some file systems tell of a full disk only when the data is forced out or the file is closed.
  void finish() {
    if (fsync(descriptor_) != 0 && errno != EINVAL) fail(errno);
    const int closed = close(descriptor_);
    descriptor_ = -1;
    if (closed != 0) fail(errno);
    const std::lock_guard lock(unfinished_mutex);
    if (rename(path_.c_str(), target_.c_str()) != 0) fail(errno);
    unfinished_path = nullptr;
  }

 private:
  [[noreturn]] void fail(int error) const {
    constexpr std::array not_allowed = {EACCES, EPERM, EROFS, ENOENT, ENOTDIR, EISDIR, ENAMETOOLONG, ELOOP};
    if (std::find(not_allowed.begin(), not_allowed.end(), error) != not_allowed.end()) {
      throw InputError(fmt::format("{}: cannot be written ({}); choose another output folder", target_.string(), reason(error)));
    }
    throw DeviceError(fmt::format("{}: writing failed ({}); nothing of it was kept: make room or choose another output folder",
                                  target_.string(), reason(error)));
  }

  std::filesystem::path target_, path_;
  int descriptor_ = -1;
};

// ----------------------------------------------------------------------------------------------------------- encoding

struct Channel {
  std::string name;
  bool half = false;
  std::function<float(std::size_t pixel)> value;
};

/// Encodes an image of `channels` in the format of the path's extension. `fill_rows(first, count, out)` gives the pixels of rows.
template <typename Sample, typename FillRows>
std::vector<unsigned char> encode(const std::filesystem::path& path, const OIIO::ImageSpec& spec, FillRows fill_rows) {
  // The name only chooses the format: nothing is opened under it.
  const std::string format_name = "picture" + path.extension().string();
  std::vector<unsigned char> bytes;
  OIIO::Filesystem::IOVecOutput memory(bytes);
  const auto output = OIIO::ImageOutput::create(format_name, &memory);
  const auto check = [&](bool done) {
    if (!done)
      throw DeviceError(
          fmt::format("{}: encoding failed ({})", path.string(), one_line(output ? output->geterror() : OIIO::geterror())));
  };
  check(output != nullptr);
  check(output->set_ioproxy(&memory) && output->open(format_name, spec));
  constexpr int rows_at_once = 64;  // bounds the memory for interleaved pixels; a multiple of every EXR compression's block
  std::vector<Sample> pixels;
  for (int y = 0; y < spec.height; y += rows_at_once) {
    const int rows = std::min(rows_at_once, spec.height - y);
    pixels.resize(static_cast<std::size_t>(rows) * spec.width * spec.nchannels);
    fill_rows(y, rows, pixels.data());
    check(output->write_scanlines(y, y + rows, 0, OIIO::TypeDescFromC<Sample>::value(), pixels.data()));
  }
  check(output->close());
  return bytes;
}

void write_channels_exr(const std::filesystem::path& path, glm::uvec2 resolution, std::span<const Channel> channels,
                        const Metadata& metadata) {
  std::set<std::string_view> names;
  OIIO::ImageSpec spec(static_cast<int>(resolution.x), static_cast<int>(resolution.y), static_cast<int>(channels.size()),
                       OIIO::TypeFloat);
  spec.channelnames.clear();
  for (const Channel& channel : channels) {
    if (!names.insert(channel.name).second) {
      throw InputError(
          fmt::format("{}: two channels would be called '{}'; give the lights different names", path.string(), channel.name));
    }
    spec.channelnames.push_back(channel.name);
    spec.channelformats.push_back(channel.half ? OIIO::TypeHalf : OIIO::TypeFloat);
  }
  spec.attribute("compression", "zip");
  spec.attribute("Software", fmt::format("halfshade {}", version()));
  for (const auto& [name, text] : metadata) spec.attribute(fmt::format("{}{}", metadata_prefix, name), text);

  const auto fill_rows = [&](int first_row, int rows, float* out) {
    const std::size_t begin = static_cast<std::size_t>(first_row) * resolution.x;
    const std::size_t end = begin + static_cast<std::size_t>(rows) * resolution.x;
    for (std::size_t c = 0; c < channels.size(); ++c) {
      for (std::size_t pixel = begin; pixel < end; ++pixel) {
        out[(pixel - begin) * channels.size() + c] = channels[c].value(pixel);
      }
    }
  };
  write_file_whole(path, encode<float>(path, spec, fill_rows));
}

float srgb_from_linear(float linear) {
  const float clipped = linear > 0 ? std::min(linear, 1.0f) : 0.0f;  // not a number becomes black
  return clipped <= 0.0031308f ? 12.92f * clipped : 1.055f * std::pow(clipped, 1 / 2.4f) - 0.055f;
}

}  // namespace

void write_file_whole(const std::filesystem::path& path, std::span<const unsigned char> bytes) {
  TemporaryFile file(path);
  file.write_all(bytes);
  file.finish();
}

void stop_writing() noexcept {
  unfinished_mutex.lock();
  if (unfinished_path) unlink(unfinished_path->c_str());
}

void write_frame_exr(const std::filesystem::path& path, const Frame& frame, std::span<const std::string> light_names, bool half,
                     const Metadata& metadata) {
  std::vector<Channel> channels;
  const auto add_vector = [&](const std::string& layer, const char* components, const std::vector<glm::vec4>& plane,
                              bool as_half) {
    for (int i = 0; i < 3; ++i) {
      channels.push_back({layer + components[i], as_half, [&plane, i](std::size_t pixel) { return plane[pixel][i]; }});
    }
  };
  const auto add_scalar = [&](std::string name, const std::vector<float>& plane, bool as_half) {
    channels.push_back({std::move(name), as_half, [&plane](std::size_t pixel) { return plane[pixel]; }});
  };
  add_vector("", "RGB", frame.rgb, half);
  for (std::size_t light = 0; light < light_names.size(); ++light) {
    add_scalar(fmt::format("shadow_{}.Y", light_names[light]), frame.visibility.at(light), half);
  }
  add_vector("P.", "XYZ", frame.position_ws, false);
  add_vector("N.", "XYZ", frame.normal_ws, false);
  add_scalar("depth.Z", frame.depth, false);
  write_channels_exr(path, frame.resolution, channels, metadata);
}

void write_frame_png(const std::filesystem::path& path, const Frame& frame) {
  OIIO::ImageSpec spec(static_cast<int>(frame.resolution.x), static_cast<int>(frame.resolution.y), 3, OIIO::TypeUInt8);
  spec.attribute("oiio:ColorSpace", "sRGB");
  spec.attribute("Software", fmt::format("halfshade {}", version()));
  const auto fill_rows = [&](int first_row, int rows, unsigned char* out) {
    const std::size_t begin = static_cast<std::size_t>(first_row) * frame.resolution.x;
    const std::size_t end = begin + static_cast<std::size_t>(rows) * frame.resolution.x;
    for (std::size_t pixel = begin; pixel < end; ++pixel) {
      for (int c = 0; c < 3; ++c) *out++ = srgb_byte_from_linear(frame.rgb[pixel][c]);
    }
  };
  write_file_whole(path, encode<unsigned char>(path, spec, fill_rows));
}

unsigned char srgb_byte_from_linear(float linear) {
  return static_cast<unsigned char>(255 * srgb_from_linear(linear) + 0.5f);
}

std::vector<unsigned char> encode_png(glm::uvec2 resolution, int channels, std::span<const unsigned char> pixels) {
  const OIIO::ImageSpec spec(static_cast<int>(resolution.x), static_cast<int>(resolution.y), channels, OIIO::TypeUInt8);
  const std::size_t row_bytes = std::size_t{resolution.x} * static_cast<std::size_t>(channels);
  return encode<unsigned char>("picture.png", spec, [&](int first_row, int rows, unsigned char* out) {
    const auto part = pixels.subspan(static_cast<std::size_t>(first_row) * row_bytes, static_cast<std::size_t>(rows) * row_bytes);
    std::copy(part.begin(), part.end(), out);
  });
}

void write_light_buffers_exr(const std::filesystem::path& path, const LightBuffers& buffers, const Metadata& metadata) {
  std::vector<Channel> channels;
  for (const LightBuffers::Plane& plane : buffers.planes) {
    channels.push_back({plane.name, false, [&plane](std::size_t pixel) { return plane.values[pixel]; }});
  }
  Metadata all = metadata;
  all.emplace_back("light_map_origin", fmt::format("{} {}", buffers.lm_from_px_origin.x, buffers.lm_from_px_origin.y));
  all.emplace_back("light_map_texel", fmt::format("{}", buffers.lm_from_px_scale));
  all.emplace_back("light_znear", fmt::format("{}", buffers.znear));
  all.emplace_back("light_zfar", fmt::format("{}", buffers.zfar));
  write_channels_exr(path, buffers.resolution, channels, all);
}

ExrImage read_exr(const std::filesystem::path& path) {
  const auto fail = [&](std::string_view found) {
    throw InputError(fmt::format("{}: expected a whole EXR picture ({}); give a file that halfshade render has written",
                                 path.string(), found));
  };
  if (!std::filesystem::exists(path)) fail("no such file");
  if (!std::filesystem::is_regular_file(path)) fail("not a file");
  // The format is named, so that nothing but EXR is ever decoded.
  const auto input = OIIO::ImageInput::create("openexr");
  if (!input) fail(one_line(OIIO::geterror()));
  OIIO::ImageSpec spec;
  if (!input->open(path.string(), spec)) fail(one_line(input->geterror()));
  if (spec.deep || spec.depth > 1 || spec.width < 1 || spec.height < 1) fail("deep, or without pixels");

  const std::size_t channel_count = static_cast<std::size_t>(spec.nchannels);
  const std::size_t row_values = static_cast<std::size_t>(spec.width) * channel_count;
  const std::size_t pixel_count = static_cast<std::size_t>(spec.width) * spec.height;
  std::vector<float> interleaved(row_values * spec.height);
  if (!input->read_image(0, 0, 0, spec.nchannels, OIIO::TypeFloat, interleaved.data())) fail(one_line(input->geterror()));

  ExrImage image;
  image.resolution = {spec.width, spec.height};
  for (std::size_t c = 0; c < channel_count; ++c) {
    std::vector<float>& plane = image.channels[spec.channelnames[c]];
    plane.resize(pixel_count);
    for (std::size_t pixel = 0; pixel < pixel_count; ++pixel) plane[pixel] = interleaved[pixel * channel_count + c];
  }
  for (const OIIO::ParamValue& attribute : spec.extra_attribs) {
    const std::string name = attribute.name().string();
    if (name.starts_with(metadata_prefix)) image.metadata[name.substr(metadata_prefix.size())] = attribute.get_string();
  }
  return image;
}

std::shared_ptr<const LightTexture> read_light_texture(const std::filesystem::path& path) {
  const ExrImage image = read_exr(path);
  const auto channel = [&](const char* name) -> const std::vector<float>& {
    const auto found = image.channels.find(name), grey = image.channels.find("Y");
    if (found != image.channels.end()) return found->second;
    if (grey != image.channels.end()) return grey->second;
    throw InputError(fmt::format("{}: expected the channels R, G and B, or Y (there is no {})", path.string(), name));
  };
  const auto texture = std::make_shared<LightTexture>();
  texture->name = path.filename().string();
  texture->resolution = image.resolution;
  const std::vector<float>&red = channel("R"), &green = channel("G"), &blue = channel("B");
  for (std::size_t i = 0; i < red.size(); ++i) texture->texels.emplace_back(red[i], green[i], blue[i]);
  return texture;
}

}  // namespace halfshade
