// Which layer the silhouettes of each depth go to: Cai et al. 2006 §4.1.

#include "silhouettes/fin_shape.h"
#include "silhouettes/layers.h"

// counts: uint[HS_SUBLAYERS], must be 0. Any number of work-items.
__kernel void count_sublayers(const HsView view, __global const uint* silhouettes, __global const uint2* edges,
                              __global const float4* vertices_ls, __global const HsStatus* status, __global uint* counts) {
  for (uint i = get_global_id(0); i < status->silhouette_count; i += get_global_size(0))
    atomic_inc(&counts[sublayer_at(view, middle_z(edges[silhouettes[i]], vertices_ls))]);
}

// Layers no thicker than `thickness` times the depth that one caster's outline may have (caster_depth): what lies closer together
// is taken for one caster however many layers there are. Returns their number.
HS_INLINE uint layers_by_depth(const HsView view, const HsFinShape shape, float thickness, float sublayer_depth,
                               __global const uint* counts, __global uint* sublayer_layers) {
  uint layer = 0;
  float end_z = 0.0f;
  for (uint i = 0; i < HS_SUBLAYERS; ++i) {
    const float z = view.znear + ((float)i + 0.5f) * sublayer_depth;
    if (counts[i] != 0 && z > end_z) {
      layer += end_z > 0.0f ? 1 : 0;
      end_z = z + thickness * caster_depth(view, shape, 1.0f / z);
    }
    sublayer_layers[i] = layer;
  }
  return layer + 1;
}

// sublayer_layers: uint[HS_SUBLAYERS + 1]: the layer that each sub-layer is merged into, and how many are used. caster_range:
// float[3]: where the silhouettes begin, caster_bits to a unit of depth, and how many layers are used. One work-item.
__kernel void merge_sublayers(const HsView view, const HsFinShape shape, const HsLayers layers, __global const HsStatus* status,
                              __global const uint* counts, __global uint* sublayer_layers, __global float* caster_range) {
  const float sublayer_depth = (1.0f / view.d_far - view.znear) / HS_SUBLAYERS;
  const ulong total = max(status->silhouette_count, 1u);
  ulong before = 0;
  uint first = HS_SUBLAYERS, last = 0;
  for (uint i = 0; i < HS_SUBLAYERS; ++i) {
    // By where the sub-layer's middle edge lies in the order of all.
    sublayer_layers[i] = min((uint)((2 * before + counts[i]) * layers.count / (2 * total)), layers.count - 1);
    before += counts[i];
    if (counts[i] != 0) {
      first = min(first, i);
      last = i;
    }
  }
  uint used = layers.count;
  if (layers.automatic) {
    float thickness = 1.0f;
    for (int i = 0; i < 32; ++i) {
      used = layers_by_depth(view, shape, thickness, sublayer_depth, counts, sublayer_layers);
      if (used <= layers.count) break;
      thickness *= 1.5f;
    }
    for (uint i = 0; i < HS_SUBLAYERS; ++i) sublayer_layers[i] = min(sublayer_layers[i], layers.count - 1);
    used = min(used, layers.count);
  }
  sublayer_layers[HS_SUBLAYERS] = used;
  caster_range[0] = view.znear + (float)first * sublayer_depth;
  caster_range[1] = (HS_CASTER_BITS - 1) / ((float)(last + 1 - min(first, last)) * sublayer_depth);
  caster_range[2] = (float)used;
}
