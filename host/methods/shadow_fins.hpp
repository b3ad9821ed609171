// Shadow fins: Cai et al. 2006, "Shadow Fins" in one layer (§3) and in many (§4). Shared by the methods fins and layered-fins.
#pragma once

#include "methods/method.hpp"

namespace halfshade {

/// How many layers of fins there are, and how they are chosen and combined.
class ShadowFinsPasses : public FinMethodPasses {
 public:
  using FinMethodPasses::FinMethodPasses;

  FeatureTotal draw_buffers(const LightFrame& frame, const LightFace& face) override;

 protected:
  virtual HsLayers layers_of(const Settings& settings) const;
  void receive(const LightFrame& frame, const LightFace& face) override;

 private:
  HsFinShape shape_of(const LightFrame& frame, const LightFace& face) const;
  /// Which layer the silhouettes of each depth go to: §4.1.
  void merge_sublayers(const LightFrame& frame, const DrawList& list, const HsFinShape& shape, const HsLayers& layers);
  /// At which depths casters stand, texel by texel.
  void draw_casters(const LightFrame& frame, const DrawList& list, const HsFinShape& shape);
  /// Hard shadows; the pixels near fins into the tiles of these.
  void list_receivers(const LightFrame& frame, const LightFace& face, const HsFinShape& shape, const HsLayers& layers);

  Buffer<cl_uint> sublayer_counts_;  // HS_SUBLAYERS
  Buffer<cl_uint> sublayer_layers_;  // HS_SUBLAYERS + 1
  Buffer<cl_float> caster_range_;    // 3
  Buffer<cl_uint> other_casters_;    // a texel
  Buffer<cl_uint> receiver_words_;   // a pixel
  Buffer<cl_float> horizon_limits_;  // a pixel
  Buffer<cl_uint> receivers_;        // runs of pixels, tile by tile
  Buffer<cl_int> tile_far_;          // a tile, bits of a float
  Buffer<cl_float> illuminances_;    // HS_STATE_PLANES a pixel, for more than one layer
  Bins receiver_bins_;
};

}  // namespace halfshade
