// Frames and light buffers as image files. Belongs to the command line: the library itself reads and writes no pictures.
//
// A picture is encoded in memory, where the image library cannot meet a full disk, and then written as one (whole_file.hpp).
#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "halfshade/halfshade.hpp"

namespace halfshade {

/// What is said about a picture inside its file: name (without the prefix "halfshade:") and text.
using Metadata = std::vector<std::pair<std::string, std::string>>;

/// Writes a frame as EXR: R G B, shadow_<light>.Y for each of `light_names`, P.X P.Y P.Z, N.X N.Y N.Z, depth.Z, 32-bit float;
/// with `half`, the shaded and visibility channels in 16 bits. Throws InputError where the path cannot be written to or two
/// channels would have one name, DeviceError where writing fails.
void write_frame_exr(const std::filesystem::path& path, const Frame& frame, std::span<const std::string> light_names, bool half,
                     const Metadata& metadata);

/// Writes the shaded picture as an 8-bit PNG: exposure 1, values clipped to 0..1, then the sRGB transfer curve. Throws as above.
void write_frame_png(const std::filesystem::path& path, const Frame& frame);

/// An 8-bit PNG in memory: `channels` (1 or 3) interleaved bytes a pixel, stored as they are.
std::vector<unsigned char> encode_png(glm::uvec2 resolution, int channels, std::span<const unsigned char> pixels);

/// 0..1 linear to 0..255 through the sRGB transfer curve.
unsigned char srgb_byte_from_linear(float linear);

/// Writes a light's buffers as a 32-bit EXR, one channel a plane. The metadata also says how texels map to light space:
/// light_map_origin, light_map_texel (light map units a texel), light_znear, light_zfar. Throws as above.
void write_light_buffers_exr(const std::filesystem::path& path, const LightBuffers& buffers, const Metadata& metadata);

/// An EXR file in memory.
struct ExrImage {
  glm::uvec2 resolution{0, 0};
  std::vector<std::string> channel_names;              ///< of all channels of the file
  std::map<std::string, std::vector<float>> channels;  ///< those that were wanted, by name; row-major, first row at the top
  std::map<std::string, std::string> metadata;         ///< those under "halfshade:", without the prefix
};

/// Which channels are wanted, by name.
using ChannelChoice = std::function<bool(std::string_view name)>;

/// Reads every pixel of the wanted channels of an EXR file. Throws InputError for what is not a whole EXR file or larger than
/// limits.hpp allows, before it takes memory for it.
ExrImage read_exr(
    const std::filesystem::path& path, const ChannelChoice& is_wanted = [](std::string_view) { return true; });

/// A light's texture from an EXR file with channels R, G and B, or Y alone. Throws InputError.
std::shared_ptr<const LightTexture> read_light_texture(const std::filesystem::path& path);

}  // namespace halfshade
