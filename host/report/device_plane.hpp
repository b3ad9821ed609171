// Memory on the device for those who use the library from outside, as report and bench do: through its public interface alone.
#pragma once

#include <fmt/format.h>

#include <cstddef>
#include <vector>

#include "halfshade/halfshade.hpp"
// The public header comes first: it fixes the OpenCL version.
#include <CL/cl.h>

namespace halfshade {

/// Throws DeviceError, naming the call, unless it succeeded.
inline void check(cl_int status, const char* call) {
  if (status != CL_SUCCESS) throw DeviceError(fmt::format("{}: failed with OpenCL error {}", call, status));
}

/// Waits for all commands of the device's queue.
inline void finish(const Device& device) {
  check(clFinish(device.queue()), "clFinish");
}

/// `count` elements, copied from the device; waits.
template <class T>
std::vector<T> read_elements(const Device& device, cl_mem from, std::size_t count) {
  std::vector<T> values(count);
  if (count > 0)
    check(clEnqueueReadBuffer(device.queue(), from, CL_TRUE, 0, count * sizeof(T), values.data(), 0, nullptr, nullptr),
          "clEnqueueReadBuffer");
  return values;
}

/// A plane of elements on the device.
template <class T>
class DevicePlane {
 public:
  DevicePlane(const Device& device, std::size_t count) {
    cl_int status = CL_SUCCESS;
    buffer_ = clCreateBuffer(device.context(), CL_MEM_READ_WRITE, count * sizeof(T), nullptr, &status);
    check(status, "clCreateBuffer");
  }
  /// With a copy of `values`.
  DevicePlane(const Device& device, const std::vector<T>& values) : DevicePlane(device, values.size()) {
    check(
        clEnqueueWriteBuffer(device.queue(), buffer_, CL_TRUE, 0, values.size() * sizeof(T), values.data(), 0, nullptr, nullptr),
        "clEnqueueWriteBuffer");
  }
  ~DevicePlane() { clReleaseMemObject(buffer_); }
  DevicePlane(const DevicePlane&) = delete;
  DevicePlane& operator=(const DevicePlane&) = delete;

  cl_mem get() const { return buffer_; }

 private:
  cl_mem buffer_ = nullptr;
};

}  // namespace halfshade
