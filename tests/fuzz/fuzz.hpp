// What the fuzz targets share: bytes as a file, and errors of input as what is expected.
#pragma once

#include <sys/mman.h>
#include <unistd.h>

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <string>

#include "halfshade/halfshade.hpp"

/// A file in memory that holds some bytes.
class BytesAsFile {
 public:
  BytesAsFile(const std::uint8_t* data, std::size_t size) : descriptor_(memfd_create("fuzz", MFD_CLOEXEC)) {
    if (descriptor_ < 0 || write(descriptor_, data, size) != static_cast<ssize_t>(size)) std::abort();
  }
  ~BytesAsFile() { close(descriptor_); }
  BytesAsFile(const BytesAsFile&) = delete;
  BytesAsFile& operator=(const BytesAsFile&) = delete;

  std::filesystem::path path() const { return "/proc/self/fd/" + std::to_string(descriptor_); }

 private:
  int descriptor_;
};

/// Whatever is wrong with input is said by an InputError of one line; anything else is a finding.
template <class Action>
void refuse_or_do(Action&& action) {
  try {
    action();
  } catch (const halfshade::InputError& error) {
    if (std::string(error.what()).find('\n') != std::string::npos) std::abort();
  }
}
