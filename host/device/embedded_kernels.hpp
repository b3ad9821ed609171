// The kernel sources, as they were in kernels/ when the library was built.
#pragma once

#include <span>
#include <string_view>

namespace halfshade {

struct EmbeddedKernel {
  std::string_view file;  ///< name inside kernels/
  std::string_view text;  ///< the whole file, byte for byte
};

/// Every file of kernels/, ordered by name.
std::span<const EmbeddedKernel> embedded_kernels();

}  // namespace halfshade
