// Kernel sources to programs: a program is one .cl file of kernels/ with what it includes.
#include <fmt/format.h>

#include <cstdlib>
#include <fstream>
#include <set>
#include <sstream>

#include "device/device_impl.hpp"
#include "device/embedded_kernels.hpp"

namespace halfshade {
namespace {

/// A file of kernels/: from the folder HALFSHADE_KERNELS if it is set, else as embedded.
std::string text_of(std::string_view file) {
  if (const char* folder = std::getenv("HALFSHADE_KERNELS"); folder && *folder) {
    const std::filesystem::path path = std::filesystem::path(folder) / file;
    std::ifstream in(path, std::ios::binary);
    std::ostringstream text;
    if (!(text << in.rdbuf()))
      throw InputError(fmt::format("{}: expected a kernel source (HALFSHADE_KERNELS={}); unset it to use the built-in kernels",
                                   path.string(), folder));
    return text.str();
  }
  for (const EmbeddedKernel& kernel : embedded_kernels())
    if (kernel.file == file) return std::string(kernel.text);
  throw std::logic_error(fmt::format("kernels/{}: no such file", file));
}

/// Adds a file and what it includes, each once, with their own names and line numbers for the compiler's messages. The text needs
/// no folder to compile.
void append_resolved(std::string_view file, std::set<std::string>& included, std::string& text) {
  constexpr std::string_view include = "#include \"";
  if (!included.emplace(file).second) return;
  std::istringstream lines(text_of(file));
  text += fmt::format("#line 1 \"kernels/{}\"\n", file);
  std::size_t number = 0;
  for (std::string line; std::getline(lines, line);) {
    ++number;
    if (line.starts_with(include)) {
      append_resolved(line.substr(include.size(), line.find('"', include.size()) - include.size()), included, text);
      text += fmt::format("#line {} \"kernels/{}\"\n", number + 1, file);
    } else if (line == "#pragma once") {
      text += '\n';  // compilers warn about it in a main file
    } else {
      text += line + '\n';
    }
  }
}

}  // namespace

std::string kernel_source(std::string_view file) {
  std::set<std::string> included;
  std::string text;
  append_resolved(file, included, text);
  return text;
}

cl::Program DeviceImpl::build(const std::string& source) const {
  cl::Program program(cl_context_, source);
  const std::string options = fmt::format("-cl-std=CL1.2 -DHS_TILE={} -DHS_LANES={}", tile_px, lanes);
  const cl_device_id device = cl_device();
  // Not cl::Program::build, whose own question for the log may fail in its place.
  if (const cl_int code = clBuildProgram(program(), 1, &device, options.c_str(), nullptr, nullptr); code != CL_SUCCESS) {
    std::string log;
    try {
      log = program.getBuildInfo<CL_PROGRAM_BUILD_LOG>(cl_device);
    } catch (const cl::Error&) {  // there is none where the build did not begin
    }
    throw DeviceError(
        fmt::format("{}: the kernels do not compile on this device: {}\n{}", device_info.name, error_name(code), log));
  }
  return program;
}

const cl::Program& DeviceImpl::program(std::string_view file) {
  auto found = programs_.find(file);
  if (found == programs_.end()) found = programs_.emplace(file, build(kernel_source(file))).first;
  return found->second;
}

}  // namespace halfshade
