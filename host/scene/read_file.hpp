// Whole text files that a user named: read once, with a message for whatever goes wrong.
#pragma once

#include <fmt/format.h>

#include <cerrno>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>
#include <system_error>

#include "halfshade/halfshade.hpp"

namespace halfshade {

/// The file's bytes. `what` says what the file should be ("an OBJ file"). Throws InputError, also where there are more than
/// `max_bytes`.
inline std::string read_file(const std::filesystem::path& path, std::string_view what, std::uintmax_t max_bytes) {
  const std::string name = path.string();

  std::error_code error;
  const auto status = std::filesystem::status(path, error);
  if (status.type() == std::filesystem::file_type::not_found) {
    throw InputError(fmt::format("{}: expected {} (there is no such file); check the path", name, what));
  }
  const auto refuse_unreadable = [&](std::string_view reason) {
    throw InputError(fmt::format("{}: expected {} (cannot be read: {}); check its permissions", name, what, reason));
  };
  if (error) refuse_unreadable(error.message());
  if (std::filesystem::is_directory(status)) {
    throw InputError(fmt::format("{}: expected {} (found a folder); name a file in it", name, what));
  }
  if (!std::filesystem::is_regular_file(status)) {
    throw InputError(fmt::format("{}: expected {} (found a device, pipe or socket); copy it to a file", name, what));
  }
  const std::uintmax_t size = std::filesystem::file_size(path, error);
  if (!error && size > max_bytes) {
    throw InputError(
        fmt::format("{}: expected {} of at most {} MiB (found {} bytes); split it", name, what, max_bytes >> 20, size));
  }

  errno = 0;
  std::ifstream stream(path, std::ios::binary);
  std::string text(error ? 0 : size, '\0');
  if (error || !stream || !stream.read(text.data(), static_cast<std::streamsize>(text.size()))) {
    refuse_unreadable(errno != 0 ? std::strerror(errno) : "it ended early");
  }
  return text;
}

}  // namespace halfshade
