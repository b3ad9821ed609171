// Lists of what touches each tile.
#pragma once

#include "device/launcher.hpp"
#include "kernels.hpp"

namespace halfshade {

/// The tile lists of one kind of primitive. Sizes are guesses with room to spare; where they do not hold, kernels go through all
/// primitives instead, and the next frame gets the capacity it needs (see bins_overflow in kernels/base/tiles.h).
struct Bins {
  Buffer<cl_ushort4> rects;  ///< a primitive: the tiles it may touch
  Buffer<cl_uint> counts;    ///< a tile: counts, then cursors
  Buffer<cl_uint> offsets;   ///< a tile and one: where a tile's references begin; the last is their total
  Buffer<cl_uint> refs;      ///< references to primitives, tile by tile
  std::size_t wanted_refs = 0;
  cl_uint capacity = 0;

  /// Makes room for so many primitives, tiles and references, and `copies` counts a tile.
  void reserve(const DeviceImpl& device, std::size_t primitives, std::size_t tiles, std::size_t refs_guess,
               std::size_t copies = 1) {
    rects.reserve(device, primitives, "tile rectangles");
    counts.reserve(device, tiles * copies, "tile counts");
    offsets.reserve(device, tiles + 1, "tile offsets");
    const std::size_t max_refs = device.device_info.largest_buffer_bytes / sizeof(cl_uint);
    refs.reserve(device, std::min(std::max(refs_guess, wanted_refs), max_refs), "tile references");
    capacity = static_cast<cl_uint>(std::min<std::size_t>(refs.bytes() / sizeof(cl_uint), 0xffffffffu));
  }

  /// Counts to where each tile's references begin.
  void scan(Launcher& launcher, cl_uint tiles, cl_uint copies = 1) const {
    launcher.launch(kernels::ScanTiles{.tile_count = tiles, .copies = copies, .counts = counts, .offsets = offsets},
                    cl::NDRange(64), cl::NDRange(64));
  }
};

}  // namespace halfshade
