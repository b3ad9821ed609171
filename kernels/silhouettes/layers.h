// Layers of fins parallel to the light's plane: Cai et al. 2006 §4.1. Sub-layers of equal depth are merged so that each layer
// holds about the same number of silhouette edges; an edge goes where its midpoint lies.

#pragma once

#include "base/lanes.h"

HS_INLINE uint sublayer_at(const HsView view, float z) {
  const float zfar = 1.0f / view.d_far;
  return min((uint)clamp((z - view.znear) / (zfar - view.znear) * HS_SUBLAYERS, 0.0f, HS_SUBLAYERS - 1.0f), HS_SUBLAYERS - 1u);
}

HS_INLINE uint layer_at(const HsView view, __global const uint* sublayer_layers, float z) {
  return sublayer_layers[sublayer_at(view, z)];
}

HS_INLINE float middle_z(uint2 ends, __global const float4* vertices_ls) {
  return 0.5f * (vertices_ls[ends.x].z + vertices_ls[ends.y].z);
}

// How many layers are used of the capacity: follows the depths in caster_range.
HS_INLINE uint used_layers(const HsLayers layers, __global const float* caster_range) {
  return layers.automatic ? (uint)caster_range[2] : layers.count;
}
