// A view's vertices and triangles, ready to be rasterized: transformed, and listed by tile.
#pragma once

#include "passes/bins.hpp"
#include "passes/resident_scene.hpp"

namespace halfshade {

/// How triangles are put into tiles.
enum class Coverage {
  texel_centres,  ///< tiles where a triangle covers the centre of a texel: for rasterization
  conservative,   ///< every tile that it touches: for questions about any point of the map
};

/// Owns what a view's rasterization reads. The views of a frame take turns with it.
class TrianglesPass {
 public:
  explicit TrianglesPass(Launcher& launcher) : launcher_(launcher) {}

  /// transform, bound_triangles, scan_tiles, fill_triangles. Zeroes `status`.
  void run(const ResidentScene& resident, const DrawList& list, Coverage coverage);

  kernels::args::TriangleTiles tiles(const DrawList& list) const;
  kernels::args::Triangles triangles(const ResidentScene& resident) const;

  const Buffer<cl_float4>& vertices_vs() const { return vertices_vs_; }
  const Buffer<cl_int4>& vertices_px() const { return vertices_px_; }
  const Buffer<HsStatus>& status() const { return status_; }  ///< one; counters of what was drawn last
  const Bins& bins() const { return bins_; }
  /// Room for the next frame where this one had to go without tile lists.
  void learn(std::size_t wanted_refs) { bins_.wanted_refs = std::max(bins_.wanted_refs, wanted_refs); }

 private:
  Launcher& launcher_;
  Buffer<cl_float4> vertices_vs_;  // a vertex of the scene
  Buffer<cl_int4> vertices_px_;    // a vertex of the scene
  Buffer<HsStatus> status_;
  Bins bins_;
};

}  // namespace halfshade
