// How large files and the numbers in them may be. docs/limits.md says the same to users; a test compares the two.
//
// Each limit keeps the time and memory that a file can ask for in proportion to its size, or within what a large scene needs.
#pragma once

#include <cstddef>
#include <cstdint>

#include "base/shared.h"

namespace halfshade::limits {

// Meshes.
constexpr std::uintmax_t obj_bytes = std::uintmax_t{4} << 30;
constexpr std::size_t obj_vertices = std::size_t{1} << 28;
constexpr std::size_t obj_corners = std::size_t{1} << 29;  ///< of all faces together
/// Steps of the search for corners to cut off, for each corner of a concave face. A drawn face needs some tens.
constexpr std::size_t ear_steps = 4096;

// Scene files, and JSON anywhere else.
constexpr std::uintmax_t scene_bytes = std::uintmax_t{32} << 20;
constexpr std::size_t json_depth = 64;
constexpr std::size_t scene_meshes = 65'536, scene_lights = 1024;
constexpr int last_frame = 1'000'000;  ///< and, negative, the first
/// What becomes a name in an EXR file, a channel or an attribute, may be as long as this.
constexpr std::size_t exr_name = 255;

// What is multiplied in shading. The product of all, times scene_lights, is well below the largest float, 3.4e38.
constexpr double light_color = 1e9, intensity = 1e9, texel = 1e9, base_color = 1e6;

// Pictures.
constexpr unsigned side_px = HS_MAX_RESOLUTION;       ///< of pictures, textures and light maps
constexpr std::size_t texels = std::size_t{1} << 24;  ///< of a light's texture
constexpr std::size_t exr_channels = 4096;
constexpr std::size_t exr_values = std::size_t{1} << 30;         ///< that are read of a picture: pixels times channels
constexpr std::size_t exr_chunk_bytes = std::size_t{128} << 20;  ///< what is unpacked at once: some rows, or a tile
constexpr std::size_t exr_header_bytes = std::size_t{4} << 20;

// Other files that the program has written itself.
constexpr std::uintmax_t report_bytes = std::uintmax_t{4} << 30;

}  // namespace halfshade::limits
