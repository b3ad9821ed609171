// Layers of fins parallel to the light's plane: Cai et al. 2006 §4.1. Sub-layers of equal depth are merged so that each layer
// holds about the same number of silhouette edges; an edge goes where its midpoint lies.

HS_INLINE uint sublayer_at(const HsView view, float z) {
  const float zfar = 1.0f / view.d_far;
  return (uint)clamp((z - view.znear) / (zfar - view.znear) * HS_SUBLAYERS, 0.0f, HS_SUBLAYERS - 1.0f);
}

HS_INLINE uint layer_at(const HsView view, __global const uint* sublayer_layers, float z) {
  return sublayer_layers[sublayer_at(view, z)];
}

HS_INLINE float middle_z(uint2 ends, __global const float4* vertices_ls) {
  return 0.5f * (vertices_ls[ends.x].z + vertices_ls[ends.y].z);
}

// counts: uint[HS_SUBLAYERS], must be 0. Any number of work-items.
__kernel void count_sublayers(const HsView view, __global const uint* silhouettes, __global const uint2* edges,
                              __global const float4* vertices_ls, __global const HsStatus* status, __global uint* counts) {
  for (uint i = get_global_id(0); i < status->silhouette_count; i += get_global_size(0))
    atomic_inc(&counts[sublayer_at(view, middle_z(edges[silhouettes[i]], vertices_ls))]);
}

// sublayer_layers: uint[HS_SUBLAYERS]: the layer that each sub-layer is merged into. caster_range: float[2]: where the
// silhouettes begin, and caster_bits to a unit of depth. One work-item.
__kernel void merge_sublayers(const HsView view, const uint layer_count, __global const HsStatus* status,
                              __global const uint* counts, __global uint* sublayer_layers, __global float* caster_range) {
  const ulong total = max(status->silhouette_count, 1u);
  ulong before = 0;
  uint first = HS_SUBLAYERS, last = 0;
  for (uint i = 0; i < HS_SUBLAYERS; ++i) {
    // By where the sub-layer's middle edge lies in the order of all.
    sublayer_layers[i] = min((uint)((2 * before + counts[i]) * layer_count / (2 * total)), layer_count - 1);
    before += counts[i];
    if (counts[i] != 0) {
      first = min(first, i);
      last = i;
    }
  }
  const float sublayer_depth = (1.0f / view.d_far - view.znear) / HS_SUBLAYERS;
  caster_range[0] = view.znear + (float)first * sublayer_depth;
  caster_range[1] = (HS_CASTER_BITS - 1) / ((float)(last + 1 - min(first, last)) * sublayer_depth);
}

// The bit that a depth has in a texel's mask of casters.
HS_INLINE uint caster_bit(__global const float* caster_range, float z) {
  return (uint)clamp((z - caster_range[0]) * caster_range[1], 0.0f, HS_CASTER_BITS - 1.0f);
}

// near_layers: uchar a tile and layer: 1 if a 2x2 footprint that begins in the tile can meet a fin of that layer. near_any: uchar
// a tile: of any. Both must be 0 before. Any number of work-items.
__kernel void flag_near_layers(const HsView view, __global const HsStatus* status, __global const HsFeature* features,
                               __global const ushort4* rects, __global uchar* near_layers, __global uchar* near_any) {
  for (uint i = get_global_id(0); i < status->feature_count; i += get_global_size(0)) {
    const uint layer = features[i].kind_and_layer >> HS_FEATURE_KIND_BITS;
    const ushort4 rect = rects[i];
    // Footprints that begin in the last row or column of the tiles before reach into these.
    for (uint y = rect.y > 0 ? rect.y - 1 : 0; y < rect.w; ++y)
      for (uint x = rect.x > 0 ? rect.x - 1 : 0; x < rect.z; ++x) {
        const uint tile = y * view.tiles_x + x;
        near_layers[layer * (view.tiles_x * view.tiles_y) + tile] = 1;
        near_any[tile] = 1;
      }
  }
}
