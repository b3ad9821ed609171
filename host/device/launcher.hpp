// Kernels on a queue: launched by name, over blocks, tiles or pixels, and timed.
#pragma once

#include <glm/glm.hpp>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "device/kernel_arguments.hpp"

namespace halfshade {

/// Elements of some meshes in blocks, ready to launch.
struct Blocks {
  Buffer<HsBlock> blocks;
  std::uint32_t count = 0;

  /// The elements, those of blocks that are not full included.
  cl_uint slots() const { return count * HS_BLOCK_SIZE; }
};

inline cl_uint tiles_of(const HsView& view) {
  return view.tiles_x * view.tiles_y;
}
inline std::size_t pixels_of(const HsView& view) {
  return std::size_t{view.width_px} * view.height_px;
}

class Launcher {
 public:
  explicit Launcher(std::shared_ptr<DeviceImpl> device) : device_(std::move(device)) {}

  const DeviceImpl& device() const { return *device_; }
  const cl::CommandQueue& queue() const { return device_->cl_queue; }

  /// A kernel with its arguments, a struct of the generated kernels.hpp. Its program is built, or taken from the cache, with the
  /// first launch. Throws DeviceError.
  template <class Kernel>
  void launch(const Kernel& arguments, const cl::NDRange& global, const cl::NDRange& local) {
    cl::Kernel& kernel = kernel_of(Kernel::kernel);
    try {
      cl_uint index = 0;
      arguments.for_each_argument([&](const auto& argument) { kernel.setArg(index++, argument.argument()); });
      enqueue(kernel, Kernel::kernel.name, global, local);
    } catch (const cl::Error& error) {
      fail(Kernel::kernel.name, error, global, local);
    }
  }

  /// One work-item.
  template <class Kernel>
  void launch_once(const Kernel& arguments) {
    launch(arguments, cl::NDRange(1), cl::NDRange(1));
  }

  /// One work-group a block, one work-item an element.
  template <class Kernel>
  void launch_blocks(const Blocks& blocks, const Kernel& arguments) {
    if (blocks.count > 0) launch(arguments, cl::NDRange(blocks.slots()), cl::NDRange(HS_BLOCK_SIZE));
  }

  /// One work-group a tile.
  template <class Kernel>
  void launch_tiles(cl_uint tiles, const Kernel& arguments) {
    launch(arguments, cl::NDRange(tiles * tile_items()), cl::NDRange(tile_items()));
  }

  /// Enough work-items to fill the device, each taking every n-th element.
  template <class Kernel>
  void launch_strided(const Kernel& arguments) {
    launch(arguments, cl::NDRange(64 * 256), cl::NDRange(64));
  }

  /// Pixels: 16 x 16 a work-item on CPU devices, one on GPU devices (HS_FOR_PIXELS in kernels/base/lanes.h).
  template <class Kernel>
  void launch_pixels(glm::uvec2 size_px, const Kernel& arguments) {
    const std::size_t across = (size_px.x + 15) / 16, down = (size_px.y + 15) / 16;
    if (one_lane())
      launch(arguments, cl::NDRange(across * 16, down * 16), cl::NDRange(16, 16));
    else
      launch(arguments, cl::NDRange(across, down), cl::NDRange(1, 1));
  }

  /// Fills elements first .. first + count.
  template <class T>
  void fill(const Buffer<T>& buffer, T value, std::size_t count, std::size_t first = 0) {
    queue().enqueueFillBuffer(buffer.memory(), value, first * sizeof(T), count * sizeof(T));
  }
  template <class T>
  void zero(const Buffer<T>& buffer, std::size_t count) {
    zero_bytes(buffer, count * sizeof(T));
  }
  /// The same in bytes, a multiple of four.
  template <class T>
  void zero_bytes(const Buffer<T>& buffer, std::size_t bytes) {
    queue().enqueueFillBuffer(buffer.memory(), cl_uint{0}, 0, bytes);
  }

  /// Kernels of GPU devices: a work-item a texel.
  bool one_lane() const { return device_->lanes == 1; }
  std::size_t tile_items() const { return one_lane() ? std::size_t{device_->tile_px} * device_->tile_px : 1; }

  /// Whose stages are launched from now on: the light's name, or "camera".
  void set_label(std::string label) { label_ = std::move(label); }

  /// Times what is launched until it is called with false, where the queue profiles; forgets what was timed before.
  void time(bool on);
  /// Stages that were timed, "<label>/<kernel>", in order.
  const std::vector<std::pair<std::string, cl::Event>>& timed() const { return timed_; }

 private:
  cl::Kernel& kernel_of(const kernels::KernelName& name);
  void enqueue(const cl::Kernel& kernel, std::string_view name, const cl::NDRange& global, const cl::NDRange& local);
  [[noreturn]] static void fail(std::string_view name, const cl::Error& error, const cl::NDRange& global,
                                const cl::NDRange& local);

  std::shared_ptr<DeviceImpl> device_;
  std::map<std::string_view, cl::Kernel> kernels_;
  std::string label_;
  bool timing_ = false;
  std::vector<std::pair<std::string, cl::Event>> timed_;
};

}  // namespace halfshade
