#include "image/image_io.hpp"

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <new>
#include <set>

#include "image/exr_header.hpp"
#include "image/whole_file.hpp"
#include "scene/limits.hpp"
#include "scene/picture_names.hpp"

namespace halfshade {
namespace {

/// The image library's messages can span lines; ours do not.
std::string one_line(std::string text) {
  while (!text.empty() && text.back() == '\n') text.pop_back();
  std::replace(text.begin(), text.end(), '\n', ' ');
  return text;
}

// ----------------------------------------------------------------------------------------------------------- encoding

/// The largest number of 16 bits; what is larger would become infinite.
constexpr float max_half = 65504.0f;

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
        const float value = channels[c].value(pixel);
        out[(pixel - begin) * channels.size() + c] = channels[c].half ? std::clamp(value, -max_half, max_half) : value;
      }
    }
  };
  write_file_whole(path, encode<float>(path, spec, fill_rows));
}

/// Channels of a file, in its order: those from `first` to `last` (not included) hold all that are wanted.
struct ChannelRange {
  int first = 0, last = 0;
  std::size_t wanted_count = 0;
  std::vector<bool> is_wanted;
};

ChannelRange range_of(std::span<const std::string> names, const ChannelChoice& is_wanted) {
  ChannelRange range;
  for (std::size_t c = 0; c < names.size(); ++c) {
    range.is_wanted.push_back(is_wanted(names[c]));
    if (!range.is_wanted.back()) continue;
    if (range.wanted_count++ == 0) range.first = static_cast<int>(c);
    range.last = static_cast<int>(c) + 1;
  }
  return range;
}

/// Reads the wanted channels, some rows at a time. Returns whether all went well.
bool read_channels(OIIO::ImageInput& input, const OIIO::ImageSpec& spec, const ChannelRange& range, ExrImage& image) {
  constexpr std::size_t values_at_once = std::size_t{16} << 20;
  const auto width = static_cast<std::size_t>(spec.width), count = static_cast<std::size_t>(range.last - range.first);
  for (int c = range.first; c < range.last; ++c)
    if (range.is_wanted[static_cast<std::size_t>(c)])
      image.channels[spec.channelnames[static_cast<std::size_t>(c)]].reserve(width * static_cast<std::size_t>(spec.height));
  if (count == 0) return true;

  const bool is_tiled = spec.tile_width > 0;
  const int rows_at_once =
      is_tiled ? spec.tile_height : static_cast<int>(std::clamp<std::size_t>(values_at_once / (width * count), 1, 64));
  std::vector<float> pixels;
  for (int y = 0; y < spec.height; y += rows_at_once) {
    const int rows = std::min(rows_at_once, spec.height - y), begin = spec.y + y, end = begin + rows;
    pixels.resize(width * static_cast<std::size_t>(rows) * count);
    const bool is_read = is_tiled
                             ? input.read_tiles(0, 0, spec.x, spec.x + spec.width, begin, end, 0, 1, range.first, range.last,
                                                OIIO::TypeFloat, pixels.data())
                             : input.read_scanlines(0, 0, begin, end, 0, range.first, range.last, OIIO::TypeFloat, pixels.data());
    if (!is_read) return false;
    for (std::size_t c = 0; c < count; ++c) {
      const std::size_t channel = static_cast<std::size_t>(range.first) + c;
      if (!range.is_wanted[channel]) continue;
      // Appended, so that a file that ends early takes no more memory than it has pixels.
      std::vector<float>& plane = image.channels[spec.channelnames[channel]];
      for (std::size_t i = c; i < pixels.size(); i += count) plane.push_back(pixels[i]);
    }
  }
  return true;
}

float srgb_from_linear(float linear) {
  const float clipped = linear > 0 ? std::min(linear, 1.0f) : 0.0f;  // not a number becomes black
  return clipped <= 0.0031308f ? 12.92f * clipped : 1.055f * std::pow(clipped, 1 / 2.4f) - 0.055f;
}

}  // namespace

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
    add_scalar(visibility_channel(light_names[light]), frame.visibility.at(light), half);
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

ExrImage read_exr(const std::filesystem::path& path, const ChannelChoice& is_wanted) {
  const auto fail = [&](std::string_view found) {
    throw InputError(fmt::format("{}: expected a whole EXR picture ({}); give a file that halfshade render has written",
                                 path.string(), found));
  };
  if (!std::filesystem::exists(path)) fail("no such file");
  if (!std::filesystem::is_regular_file(path)) fail("not a file");
  const ExrHeader header = read_exr_header(path);
  const ChannelRange range = range_of(header.channels, is_wanted);
  const std::size_t pixel_count = std::size_t{header.resolution.x} * header.resolution.y;
  if (range.wanted_count * pixel_count > limits::exr_values)
    throw InputError(
        fmt::format("{}: expected at most {} values to read (found {} channels of {}x{} pixels); choose fewer channels",
                    path.string(), limits::exr_values, range.wanted_count, header.resolution.x, header.resolution.y));

  // The format is named, so that nothing but EXR is ever decoded.
  const auto input = OIIO::ImageInput::create("openexr");
  if (!input) fail(one_line(OIIO::geterror()));
  OIIO::ImageSpec spec;
  if (!input->open(path.string(), spec)) fail(one_line(input->geterror()));
  if (spec.deep || spec.depth > 1 || spec.width < 1 || spec.height < 1 ||
      glm::uvec2(spec.width, spec.height) != header.resolution)
    fail("deep, or without pixels");

  const ChannelRange read_range = range_of(spec.channelnames, is_wanted);
  if (spec.tile_width > 0 && std::size_t(read_range.last - read_range.first) * spec.tile_height * spec.width > limits::exr_values)
    fail("a row of tiles that is too large");

  ExrImage image;
  image.resolution = header.resolution;
  image.channel_names = spec.channelnames;
  try {
    if (!read_channels(*input, spec, read_range, image)) fail(one_line(input->geterror()));
  } catch (const std::bad_alloc&) {
    throw DeviceError(fmt::format("{}: {} channels of {}x{} pixels do not fit into memory; choose fewer with --channel",
                                  path.string(), range.wanted_count, header.resolution.x, header.resolution.y));
  }
  for (const auto& [name, plane] : image.channels)
    if (plane.size() != pixel_count) fail("two channels of one name");
  for (const OIIO::ParamValue& attribute : spec.extra_attribs) {
    const std::string_view name(attribute.name().c_str());
    if (name.starts_with(metadata_prefix))
      image.metadata[std::string(name.substr(metadata_prefix.size()))] = attribute.get_string();
  }
  return image;
}

std::shared_ptr<const LightTexture> read_light_texture(const std::filesystem::path& path) {
  if (std::filesystem::is_regular_file(path)) {
    const glm::uvec2 size = read_exr_header(path).resolution;
    if (std::size_t{size.x} * size.y > limits::texels)
      throw InputError(fmt::format("{}: expected a light's picture of at most {} pixels (found {}x{}); make it smaller",
                                   path.string(), limits::texels, size.x, size.y));
  }
  const ExrImage image =
      read_exr(path, [](std::string_view name) { return name == "R" || name == "G" || name == "B" || name == "Y"; });
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
  texture->texels.reserve(red.size());
  for (std::size_t i = 0; i < red.size(); ++i) texture->texels.emplace_back(red[i], green[i], blue[i]);
  return texture;
}

}  // namespace halfshade
