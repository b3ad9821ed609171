// Memory on the device, with the type that kernels see in it.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <utility>
#include <vector>

#include "device/device_impl.hpp"
#include "device/memory.hpp"

namespace halfshade {

/// Memory on the device as elements of T, or none. Copies share the memory.
template <class T>
class Buffer {
 public:
  Buffer() = default;
  explicit Buffer(cl::Buffer memory, std::size_t bytes = 0) : memory_(std::move(memory)), bytes_(bytes) {}
  Buffer(const Buffer&) = default;
  Buffer(Buffer&&) noexcept = default;
  /// By a copy: where cl::Buffer's own assignment fails to retain, it keeps the handle, and releases it later all the same.
  Buffer& operator=(Buffer other) noexcept {
    std::swap(memory_, other.memory_);
    std::swap(bytes_, other.bytes_);
    return *this;
  }
  ~Buffer() = default;
  /// A caller's buffer, which is retained; none where it is null.
  static Buffer of(cl_mem memory) { return memory ? Buffer(cl::Buffer(memory, true)) : Buffer(); }

  /// The same memory, read as another type.
  template <class U>
  Buffer<U> as() const {
    return Buffer<U>(memory_, bytes_);
  }

  const cl::Buffer& memory() const { return memory_; }
  explicit operator bool() const { return memory_() != nullptr; }
  std::size_t bytes() const { return bytes_; }

  /// Makes room for `count` elements at least; the contents are lost when it grows. Old memory lives on until the commands that
  /// use it are done (OpenCL retains it). Throws DeviceError and leaves all as it was where there is not enough memory.
  /// `what` it holds is for messages.
  void reserve(const DeviceImpl& device, std::size_t count, const char* what) { reserve_bytes(device, count * sizeof(T), what); }

  /// The same in bytes, for types that only kernels know.
  void reserve_bytes(const DeviceImpl& device, std::size_t bytes, const char* what) {
    if (bytes <= bytes_ && memory_()) return;
    check_size(device, bytes, what, "lower the resolution or split the scene");
    const std::size_t new_bytes = std::max<std::size_t>(bytes, 16);
    memory_ = allocate(device, CL_MEM_READ_WRITE, new_bytes, nullptr, what);
    bytes_ = new_bytes;
  }

  /// Memory on the device. Throws DeviceError where there is not as much.
  static cl::Buffer allocate(const DeviceImpl& device, cl_mem_flags flags, std::size_t bytes, void* values, const char* what) {
    const std::uint64_t held = buffer_bytes_held();
    if (held + bytes > device.memory_bytes)
      throw DeviceError(
          fmt::format("{}: {} needs {} MiB beside {} MiB that are in use; there are {} MiB ({}); lower the resolution "
                      "or split the scene",
                      device.device_info.name, what, (bytes + (1 << 20) - 1) >> 20, held >> 20, device.memory_bytes >> 20,
                      device.memory_limit));
    cl::Buffer buffer(device.cl_context_, flags, bytes, values);
    count_buffer(buffer(), bytes);
    return buffer;
  }

  static void check_size(const DeviceImpl& device, std::size_t bytes, const char* what, const char* remedy) {
    if (bytes > device.device_info.largest_buffer_bytes)
      throw DeviceError(fmt::format("{}: {} needs a buffer of {} MiB, the device allows {} MiB; {}", device.device_info.name,
                                    what, bytes >> 20, device.device_info.largest_buffer_bytes >> 20, remedy));
  }

 private:
  cl::Buffer memory_;
  std::size_t bytes_ = 0;
};

/// A read-only buffer with a copy of `values` as elements of T (vec3 as three floats each), made without a command on any queue.
template <class T, class Value>
Buffer<T> upload(const DeviceImpl& device, const std::vector<Value>& values, const char* what) {
  static_assert(sizeof(Value) % sizeof(T) == 0);
  const std::size_t bytes = std::max<std::size_t>(values.size() * sizeof(Value), 16);
  Buffer<T>::check_size(device, bytes, what, "split or simplify the scene's meshes");
  if (values.empty()) return Buffer<T>(Buffer<T>::allocate(device, CL_MEM_READ_ONLY, bytes, nullptr, what), bytes);
  return Buffer<T>(Buffer<T>::allocate(device, CL_MEM_READ_ONLY | CL_MEM_COPY_HOST_PTR, values.size() * sizeof(Value),
                                       const_cast<Value*>(values.data()), what),
                   bytes);
}

/// Elements `first` .. first + count, copied to the host; waits.
template <class Value, class T>
std::vector<Value> read(const cl::CommandQueue& queue, const Buffer<T>& buffer, std::size_t count, std::size_t first = 0) {
  std::vector<Value> values(count);
  if (count > 0) queue.enqueueReadBuffer(buffer.memory(), CL_TRUE, first * sizeof(Value), count * sizeof(Value), values.data());
  return values;
}

}  // namespace halfshade
