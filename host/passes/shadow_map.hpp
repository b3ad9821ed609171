// The shadow map of one light, or one face of it.
#pragma once

#include "passes/triangles.hpp"

namespace halfshade {

/// Owns the shadow map: linear light-space z of the nearest surface, HS_EMPTY_Z where there is none.
class ShadowMapPass {
 public:
  explicit ShadowMapPass(Launcher& launcher) : launcher_(launcher) {}

  void run(TrianglesPass& triangles, const ResidentScene& resident, const DrawList& list,
           Coverage coverage = Coverage::texel_centres) {
    map_.reserve(launcher_.device(), pixels_of(list.view), "shadow map");
    triangles.run(resident, list, coverage);
    launcher_.launch_tiles(tiles_of(list.view), kernels::RasterShadowMap{.view = list.view,
                                                                         .triangle_tiles = triangles.tiles(list),
                                                                         .triangles = triangles.triangles(resident),
                                                                         .shadow_map = map_});
  }

  const Buffer<cl_float>& map() const { return map_; }

 private:
  Launcher& launcher_;
  Buffer<cl_float> map_;
};

}  // namespace halfshade
