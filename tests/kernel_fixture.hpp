// Kernels on literal arrays: the device, opened once a process, and one launch after another.
#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <string>
#include <vector>

#include "device_impl.hpp"
#include "embedded_kernels.hpp"
#include "light_view.hpp"

namespace halfshade {

/// Ends the process if the test takes longer than any should: a kernel that hangs must fail, also where no CTest watches.
class Watchdog {
 public:
  explicit Watchdog(unsigned limit_s = 100) { alarm(limit_s); }
  ~Watchdog() { alarm(0); }
  Watchdog(const Watchdog&) = delete;
  Watchdog& operator=(const Watchdog&) = delete;
};

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

/// Launches kernels by name.
class KernelRunner {
 public:
  explicit KernelRunner(const std::string& shape = "") : device(std::dynamic_pointer_cast<DeviceImpl>(test_device(shape))) {}

  std::shared_ptr<DeviceImpl> device;

  template <class T>
  cl::Buffer buffer(const std::vector<T>& values) const {
    if (values.empty()) return cl::Buffer(device->cl_context_, CL_MEM_READ_WRITE, 16);
    return cl::Buffer(device->cl_context_, CL_MEM_READ_WRITE | CL_MEM_COPY_HOST_PTR, values.size() * sizeof(T),
                      const_cast<T*>(values.data()));
  }
  template <class T>
  cl::Buffer filled(std::size_t count, T value) const {
    return buffer(std::vector<T>(count, value));
  }
  template <class T>
  std::vector<T> read(const cl::Buffer& from, std::size_t count) const {
    std::vector<T> values(count);
    if (count > 0) device->cl_queue.enqueueReadBuffer(from, CL_TRUE, 0, count * sizeof(T), values.data());
    return values;
  }

  /// The kernels' sources with one more kernel behind them, which may call their functions.
  cl::Program program_with(const std::string& source) const {
    std::string text;
    for (const bool headers : {true, false})
      for (const char* header : {"shared.h", "common.h", ""})
        for (const EmbeddedKernel& kernel : embedded_kernels())
          if (headers ? kernel.file == header : *header == '\0' && kernel.file.ends_with(".cl"))
            text += std::string(kernel.text) + "\n";
    cl::Program program(device->cl_context_, text + source);
    const std::string options =
        "-cl-std=CL1.2 -DHS_TILE=" + std::to_string(device->tile_px) + " -DHS_LANES=" + std::to_string(device->lanes);
    try {
      program.build(device->cl_device, options.c_str());
    } catch (const cl::Error&) {
      ADD_FAILURE() << program.getBuildInfo<CL_PROGRAM_BUILD_LOG>(device->cl_device);
    }
    return program;
  }

  template <class... Args>
  void run(const char* name, cl::NDRange global, cl::NDRange local, const Args&... args) const {
    run(device->program, name, global, local, args...);
  }
  template <class... Args>
  void run(const cl::Program& program, const char* name, cl::NDRange global, cl::NDRange local, const Args&... args) const {
    cl::Kernel kernel(program, name);
    EXPECT_EQ(kernel.getInfo<CL_KERNEL_NUM_ARGS>(), sizeof...(args)) << name;
    cl_uint index = 0;
    (kernel.setArg(index++, args), ...);
    device->cl_queue.enqueueNDRangeKernel(kernel, cl::NullRange, global, local);
  }
  /// One work-group a block.
  template <class... Args>
  void run_blocks(const char* name, std::size_t blocks, const Args&... args) const {
    run(name, cl::NDRange(blocks * HS_BLOCK_SIZE), cl::NDRange(HS_BLOCK_SIZE), args...);
  }
  /// One work-group a tile.
  template <class... Args>
  void run_tiles(const char* name, const HsView& view, const Args&... args) const {
    const std::size_t items = device->lanes == 1 ? std::size_t{device->tile_px} * device->tile_px : 1;
    run(name, cl::NDRange(view.tiles_x * view.tiles_y * items), cl::NDRange(items), args...);
  }
  /// A pixel a work-item, or a strip of them (kernels/visibility.cl).
  template <class... Args>
  void run_receivers(const char* name, glm::uvec2 size_px, const Args&... args) const {
    const auto cover = [](std::size_t n) { return (n + 15) / 16; };
    if (device->lanes == 1)
      run(name, cl::NDRange(cover(size_px.x) * 16, cover(size_px.y) * 16), cl::NDRange(16, 16), args...);
    else
      run(name, cl::NDRange(cover(size_px.x), cover(size_px.y)), cl::NDRange(1, 1), args...);
  }
};

/// A fixture for tests of single kernels, in the device's own shape.
class KernelTest : public testing::Test {
 protected:
  Watchdog watchdog_;
  KernelRunner runner_;
};

/// A fixture for tests that must hold in both shapes.
class ShapedKernelTest : public testing::TestWithParam<const char*> {
 protected:
  Watchdog watchdog_;
  KernelRunner runner_{GetParam()};
};

#define HS_IN_BOTH_SHAPES(fixture)                                            \
  INSTANTIATE_TEST_SUITE_P(Shape, fixture, testing::Values("wide", "narrow"), \
                           [](const auto& info) { return std::string(info.param); })

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

/// Elements 0 .. count of mesh 0, cut into blocks.
inline std::vector<HsBlock> blocks_of(std::uint32_t count) {
  std::vector<HsBlock> blocks;
  for (std::uint32_t i = 0; i < count; i += HS_BLOCK_SIZE)
    blocks.push_back({i, std::min<std::uint32_t>(HS_BLOCK_SIZE, count - i), 0, 0});
  return blocks;
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
