// Sample points of lights on the device.
#pragma once

#include <map>
#include <tuple>

#include "device/buffer.hpp"
#include "kernels.hpp"
#include "light/samples.hpp"

namespace halfshade {

/// A light's sample points on the device (SampleTable).
struct LightPointBuffer {
  Buffer<cl_float> samples, weights, cell_xy, window_xy;
  Buffer<cl_ushort> below, cells, windows;
  float per_turn = 0.0f;
  cl_uint cells_across = 0;

  kernels::args::Samples arguments() const {
    return {.samples = samples,
            .below = below,
            .weights = weights,
            .cell_xy = cell_xy,
            .cells = cells,
            .window_xy = window_xy,
            .windows = windows};
  }
};

/// Keeps those that were asked for.
class LightPointBuffers {
 public:
  /// `count` points of a light.
  const LightPointBuffer& of(const DeviceImpl& device, const Light& light, unsigned count);

 private:
  /// What a light's points depend on: number, shape, size, texture.
  using Key = std::tuple<unsigned, LightShape, double, double, std::shared_ptr<const LightTexture>>;
  std::map<Key, LightPointBuffer> kept_;
};

}  // namespace halfshade
