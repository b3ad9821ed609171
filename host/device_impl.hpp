// The device as the renderer sees it: CLHPP objects, the compiled program, and how its kernels are shaped.
#pragma once

#define CL_HPP_ENABLE_EXCEPTIONS
#define CL_HPP_MINIMUM_OPENCL_VERSION 120
#define CL_HPP_TARGET_OPENCL_VERSION 120
#include "halfshade/halfshade.hpp"
// The public header comes first: it fixes the OpenCL version.
#include <CL/opencl.hpp>

namespace halfshade {

struct DeviceImpl final : Device {
  DeviceInfo device_info;
  cl::Device cl_device;
  cl::Context cl_context_;
  cl::CommandQueue cl_queue;
  bool profiles = false;
  bool owns_queue = false;  ///< made by Device::open

  /// Shape of the tile kernels (kernels/common.h): work-items a tile and texels a work-item follow from the kind of device.
  unsigned tile_px = 0, lanes = 0;
  cl::Program program;

  const DeviceInfo& info() const override { return device_info; }
  cl_context context() const override { return cl_context_(); }
  cl_command_queue queue() const override { return cl_queue(); }
};

/// Kernel sources, embedded or from the folder HALFSHADE_KERNELS, as one text with the files' own line numbers, built for the
/// device. Throws DeviceError with the build log.
cl::Program build_program(const cl::Context& context, const cl::Device& device, unsigned tile_px, unsigned lanes);

/// The name of an OpenCL error code, "CL_OUT_OF_RESOURCES (-5)".
std::string error_name(cl_int code);

}  // namespace halfshade
