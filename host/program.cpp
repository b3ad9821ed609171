// Kernel sources to a program.
#include <fmt/format.h>

#include <cstdlib>
#include <fstream>
#include <sstream>

#include "device_impl.hpp"
#include "embedded_kernels.hpp"

namespace halfshade {
namespace {

std::string text_of(const EmbeddedKernel& kernel) {
  const char* folder = std::getenv("HALFSHADE_KERNELS");
  if (!folder || !*folder) return std::string(kernel.text);
  const std::filesystem::path path = std::filesystem::path(folder) / kernel.file;
  std::ifstream in(path, std::ios::binary);
  std::ostringstream text;
  if (!(text << in.rdbuf()))
    throw InputError(fmt::format("{}: expected a kernel source (HALFSHADE_KERNELS={}); unset it to use the built-in kernels",
                                 path.string(), folder));
  return text.str();
}

}  // namespace

cl::Program build_program(const cl::Context& context, const cl::Device& device, unsigned tile_px, unsigned lanes) {
  // Headers first, each file once: kernels include nothing, so that the text needs no folder to compile.
  std::string source;
  for (const std::string_view file : {"shared.h", "common.h"})
    for (const EmbeddedKernel& kernel : embedded_kernels())
      if (kernel.file == file) source += fmt::format("#line 1 \"kernels/{}\"\n{}\n", kernel.file, text_of(kernel));
  for (const EmbeddedKernel& kernel : embedded_kernels())
    if (kernel.file.ends_with(".cl")) source += fmt::format("#line 1 \"kernels/{}\"\n{}\n", kernel.file, text_of(kernel));

  cl::Program program(context, source);
  try {
    program.build(device, fmt::format("-cl-std=CL1.2 -DHS_TILE={} -DHS_LANES={}", tile_px, lanes).c_str());
  } catch (const cl::Error& error) {
    throw DeviceError(fmt::format("{}: the kernels do not compile on this device: {}\n{}", device.getInfo<CL_DEVICE_NAME>(),
                                  error_name(error.err()), program.getBuildInfo<CL_PROGRAM_BUILD_LOG>(device)));
  }
  return program;
}

}  // namespace halfshade
