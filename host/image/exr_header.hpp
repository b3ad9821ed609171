// The header of EXR files, read before the image library does, which takes as much memory as a header asks for.
#pragma once

#include <filesystem>
#include <glm/glm.hpp>
#include <string>
#include <vector>

namespace halfshade {

/// What an EXR file says of its first picture.
struct ExrHeader {
  glm::uvec2 resolution{0, 0};
  std::vector<std::string> channels;
};

/// Throws InputError, which names the file, for what is no EXR file of flat pictures, or asks for more than limits.hpp allows.
/// Pixels are not looked at.
ExrHeader read_exr_header(const std::filesystem::path& path);

}  // namespace halfshade
