// The device as the renderer sees it: CLHPP objects, the compiled programs, and how its kernels are shaped.
#pragma once

#define CL_HPP_ENABLE_EXCEPTIONS
#define CL_HPP_MINIMUM_OPENCL_VERSION 120
#define CL_HPP_TARGET_OPENCL_VERSION 120
#include <fmt/format.h>
#include <CL/opencl.hpp>

#include <map>

#include "halfshade/halfshade.hpp"

namespace halfshade {

struct DeviceImpl final : Device {
  DeviceInfo device_info;
  cl::Device cl_device;
  cl::Context cl_context_;
  cl::CommandQueue cl_queue;
  bool profiles = false;
  bool owns_queue = false;  ///< made by Device::open
  /// For buffers: what there was when the device was opened, and what sets the limit, for messages.
  std::uint64_t memory_bytes = 0;
  std::string memory_limit;

  /// Shape of the tile kernels (kernels/base/lanes.h): work-items a tile and texels a work-item follow from the kind of device.
  unsigned tile_px = 0, lanes = 0;

  /// The program of one .cl file of kernels/, built with the first call. Throws DeviceError with the build log.
  const cl::Program& program(std::string_view file);
  /// A program of any source in the device's shape. Throws DeviceError with the build log.
  cl::Program build(const std::string& source) const;

  const DeviceInfo& info() const override { return device_info; }
  cl_context context() const override { return cl_context_(); }
  cl_command_queue queue() const override { return cl_queue(); }

 private:
  std::map<std::string, cl::Program, std::less<>> programs_;
};

/// A file of kernels/, embedded or from the folder HALFSHADE_KERNELS, with all that it includes, as one text with the files' own
/// line numbers.
std::string kernel_source(std::string_view file);

/// The name of an OpenCL error code, "CL_OUT_OF_RESOURCES (-5)".
std::string error_name(cl_int code);

/// OpenCL's errors as ours; `caller` begins the message.
template <class F>
auto guarded(std::string_view caller, F&& f) {
  try {
    return f();
  } catch (const cl::Error& error) {
    throw DeviceError(fmt::format("{}: {}: {}", caller, error.what(), error_name(error.err())));
  }
}

}  // namespace halfshade
