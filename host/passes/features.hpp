// Silhouettes as a light's centre sees them, and their fins: the geometry that smoothies, penumbra maps and shadow fins share
// (Chan & Durand 2003 §3 step 3; Cai et al. 2006 §3.1).
#pragma once

#include "passes/triangles.hpp"

namespace halfshade {

/// Fins of a light: as wide as its radius asks for, on their outer side.
HsFinShape fin_shape(const Light& light, const LightView& fitted, unsigned tile_px);

/// Owns silhouettes, features and their tile lists. The lights of a frame take turns with it.
class FeaturesPass {
 public:
  explicit FeaturesPass(Launcher& launcher) : launcher_(launcher) {}

  /// orient_faces and classify_edges: which edges are silhouettes. `mark_others`: faces of meshes that cast nothing count as
  /// turned away (for raster_casters).
  void classify(const TrianglesPass& triangles, const ResidentScene& resident, const DrawList& list, bool mark_others);

  /// build_features to fill_features. `sublayer_layers` tells which layer each depth goes to (kernels/silhouettes/layers.h); not
  /// read for one layer.
  void build(const TrianglesPass& triangles, const ResidentScene& resident, const DrawList& list, const HsFinShape& shape,
             const Buffer<cl_float>& shadow_map, cl_uint layers, const Buffer<cl_uint>& sublayer_layers);

  kernels::args::FeatureTiles tiles(const TrianglesPass& triangles) const;

  const Buffer<cl_uchar>& sides() const { return sides_; }
  const Buffer<cl_uint>& silhouettes() const { return silhouettes_; }
  const Buffer<cl_uchar>& tile_near_fins() const { return tile_near_fins_; }
  const Bins& bins() const { return bins_; }
  void learn(std::size_t wanted_refs) { bins_.wanted_refs = std::max(bins_.wanted_refs, wanted_refs); }

 private:
  Launcher& launcher_;
  Buffer<cl_uchar> sides_;          // a triangle of the scene
  Buffer<cl_char> multiplicities_;  // an edge of the scene
  Buffer<cl_uint> silhouettes_;     // indices of edges
  Buffer<HsFeature> features_;
  Buffer<cl_uchar> tile_near_fins_;  // a tile
  Bins bins_;
};

}  // namespace halfshade
