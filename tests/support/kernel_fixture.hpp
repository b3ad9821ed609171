// Kernels on literal arrays: the device, opened once a process, and one launch after another.
#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <cstdlib>
#include <cstring>
#include <iterator>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

// The public header comes first: it fixes the OpenCL version.
#include "halfshade/halfshade.hpp"

#include "device/launcher.hpp"
#include "kernels.hpp"
#include "light/fit.hpp"
#include "light/light_model.hpp"
#include "light/view.hpp"
#include "passes/receiver_view.hpp"
#include "scene/placement.hpp"

namespace halfshade {

/// Ends the process if the test takes longer than any should: a kernel that hangs must fail, also where no CTest watches.
class Watchdog {
 public:
  explicit Watchdog(unsigned limit_s = 100) { alarm(limit_s); }
  ~Watchdog() { alarm(0); }
  Watchdog(const Watchdog&) = delete;
  Watchdog& operator=(const Watchdog&) = delete;
};

/// The shapes of the kernels to test: those of CPU devices ("wide") and of GPUs ("narrow"). HALFSHADE_TEST_SHAPES names those
/// that do where the kernels are not what is tested: sanitizers see the host's code alone, which is the same for both.
inline std::vector<std::string> kernel_shapes() {
  const char* named = std::getenv("HALFSHADE_TEST_SHAPES");
  std::istringstream names(named != nullptr ? named : "wide narrow");
  return {std::istream_iterator<std::string>(names), {}};
}

/// Opens the device with its kernels in the shape of CPU devices ("wide") or of GPUs ("narrow").
inline std::shared_ptr<Device> open_device(const char* shape) {
  setenv("HALFSHADE_KERNEL_SHAPE", shape, 1);
  std::shared_ptr<Device> device = Device::open("");
  unsetenv("HALFSHADE_KERNEL_SHAPE");
  return device;
}

/// The device with its kernels in one of those shapes or its own (""). Opened once a process.
inline const std::shared_ptr<Device>& test_device(const std::string& shape = "") {
  if (shape == "wide") {
    static const std::shared_ptr<Device> wide = open_device("wide");
    return wide;
  }
  if (shape == "narrow") {
    static const std::shared_ptr<Device> narrow = open_device("narrow");
    return narrow;
  }
  static const std::shared_ptr<Device> own = Device::open("");
  return own;
}

/// Launches kernels, by the structs of the generated kernels.hpp, on literal arrays.
class KernelRunner {
 public:
  explicit KernelRunner(const std::string& shape = "")
      : device(std::dynamic_pointer_cast<DeviceImpl>(test_device(shape))), launcher(device) {}

  std::shared_ptr<DeviceImpl> device;
  mutable Launcher launcher;

  /// Values as elements of T, or of their own type.
  template <class T, class Value>
  Buffer<T> buffer(const std::vector<Value>& values) const {
    static_assert(sizeof(Value) % sizeof(T) == 0);
    const std::size_t bytes = values.size() * sizeof(Value);
    if (values.empty()) return Buffer<T>(cl::Buffer(device->cl_context_, CL_MEM_READ_WRITE, 16), 16);
    return Buffer<T>(
        cl::Buffer(device->cl_context_, CL_MEM_READ_WRITE | CL_MEM_COPY_HOST_PTR, bytes, const_cast<Value*>(values.data())),
        bytes);
  }
  template <class T>
  Buffer<T> filled(std::size_t count, T value) const {
    return buffer<T>(std::vector<T>(count, value));
  }
  template <class Value, class T>
  std::vector<Value> read(const Buffer<T>& from, std::size_t count) const {
    return halfshade::read<Value>(device->cl_queue, from, count);
  }

  /// A kernel of the test's own, which may call the functions of a file of kernels/.
  cl::Kernel kernel_with(const std::string& file, const std::string& source, const char* name) const {
    return cl::Kernel(device->build(kernel_source(file) + source), name);
  }
  /// Launches one of those; its arguments in order.
  template <class... Args>
  void run(cl::Kernel kernel, cl::NDRange global, cl::NDRange local, const Args&... args) const {
    EXPECT_EQ(kernel.getInfo<CL_KERNEL_NUM_ARGS>(), sizeof...(args));
    cl_uint index = 0;
    (set_argument(kernel, index++, args), ...);
    device->cl_queue.enqueueNDRangeKernel(kernel, cl::NullRange, global, local);
  }

 private:
  template <class T>
  static void set_argument(cl::Kernel& kernel, cl_uint index, const Buffer<T>& buffer) {
    kernel.setArg(index, buffer.memory());
  }
  template <class T>
  static void set_argument(cl::Kernel& kernel, cl_uint index, const T& value) {
    kernel.setArg(index, value);
  }
};

/// A fixture for tests of single kernels, in the device's own shape.
class KernelTest : public testing::Test {
 protected:
  Watchdog watchdog_;
  KernelRunner runner_;
};

/// A fixture for tests that must hold in both shapes.
class ShapedKernelTest : public testing::TestWithParam<std::string> {
 protected:
  Watchdog watchdog_;
  KernelRunner runner_{GetParam()};
};

#define HS_IN_BOTH_SHAPES(fixture) \
  INSTANTIATE_TEST_SUITE_P(Shape, fixture, testing::ValuesIn(kernel_shapes()), [](const auto& info) { return info.param; })

/// A view that looks along +z from the origin, its axis through the middle of the map, `px_per_q` texels a unit of x/z and y/z.
inline HsView straight_view(const DeviceImpl& device, glm::uvec2 size_px, float px_per_q, float znear = 0.125f,
                            float zfar = 1024.0f) {
  HsView view{};
  view.px_from_q = {{px_per_q, static_cast<float>(size_px.x / 2), -px_per_q, static_cast<float>(size_px.y / 2)}};
  view.world_from_view_x = {{1, 0, 0, 0}};
  view.world_from_view_y = {{0, 1, 0, 0}};
  view.world_from_view_z = {{0, 0, 1, 0}};
  view.znear = znear;
  view.d_far = 1.0f / zfar;
  view.width_px = size_px.x;
  view.height_px = size_px.y;
  view.tiles_x = (size_px.x + device.tile_px - 1) / device.tile_px;
  view.tiles_y = (size_px.y + device.tile_px - 1) / device.tile_px;
  view.mid_x_px = size_px.x / 2;
  view.mid_y_px = size_px.y / 2;
  return view;
}

inline Blocks blocks_of(const KernelRunner& runner, const std::vector<HsBlock>& blocks) {
  return {runner.buffer<HsBlock>(blocks), static_cast<std::uint32_t>(blocks.size())};
}

/// Elements 0 .. count of mesh 0, cut into blocks.
inline Blocks blocks_of(const KernelRunner& runner, std::uint32_t count, cl_uint cull = HS_CULL_NONE) {
  std::vector<HsBlock> blocks;
  for (std::uint32_t i = 0; i < count; i += HS_BLOCK_SIZE)
    blocks.push_back({i, std::min<std::uint32_t>(HS_BLOCK_SIZE, count - i), 0, cull});
  return blocks_of(runner, blocks);
}

/// Counts to offsets and cursors.
inline void scan_tiles(const KernelRunner& runner, cl_uint tile_count, cl_uint copies, const Buffer<cl_uint>& counts,
                       const Buffer<cl_uint>& offsets) {
  runner.launcher.launch(kernels::ScanTiles{.tile_count = tile_count, .copies = copies, .counts = counts, .offsets = offsets},
                         cl::NDRange(64), cl::NDRange(64));
}

/// One-sided fins of a light that is a disc: as wide as its radius asks for, or of a fixed width.
inline HsFinShape fin_shape(float radius_px, float width_px = 0.0f) {
  HsFinShape shape{};
  shape.radius_px = radius_px;
  shape.width_px = width_px;
  return shape;
}

inline HsTransform identity_transform() {
  return transform_rows(glm::dmat4(1.0));
}

}  // namespace halfshade
