// Layers of fins parallel to the light's plane: Cai et al. 2006 §4.1. Sub-layers of equal depth are merged so that each layer
// holds about the same number of silhouette edges; an edge goes where its midpoint lies.

// How far from the feature's edge, in texels, it can matter to the farthest receiver: the penumbra's half-width w(Lb, L0) there,
// which is where Chan & Durand's alpha' (Eq. 1) reaches 1, the radius of Wyman & Hansen's cone (§2.1), and the width of Cai's
// fins (Eq. 3).
HS_INLINE float reach_px(const HsFinShape shape, float d, float d_far) {
  const float beyond = max(d - d_far, 0.0f);
  return shape.width_px > 0.0f ? shape.width_px * beyond / d : shape.radius_px * beyond;
}

// How far before its silhouette the lit side of a caster may lie: nothing known, so four times as far as the penumbra is wide
// there, which holds for a sphere no larger than that, and for gently sloping surfaces.
HS_INLINE float caster_depth(const HsView view, const HsFinShape shape, float d) {
  return 4.0f * reach_px(shape, d, view.d_far) / (view.px_from_q.x * d);
}

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

// How many layers are used of those there is room for: follows the depths in caster_range.
HS_INLINE uint used_layers(const HsLayers layers, __global const float* caster_range) {
  return layers.automatic ? (uint)caster_range[2] : layers.count;
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

// The bit that a depth has in a texel's mask of casters.
HS_INLINE uint caster_bit(__global const float* caster_range, float z) {
  return (uint)clamp((z - caster_range[0]) * caster_range[1], 0.0f, HS_CASTER_BITS - 1.0f);
}

// near: uchar a tile of the features': 1 if it holds any. Must be 0 before. Any number of work-items.
__kernel void flag_feature_tiles(const HsFinShape shape, __global const HsStatus* status, __global const ushort4* rects,
                                 __global uchar* near) {
  for (uint i = get_global_id(0); i < status->feature_count; i += get_global_size(0)) {
    const ushort4 rect = rects[i];
    for (uint y = rect.y; y < rect.w; ++y)
      for (uint x = rect.x; x < rect.z; ++x) near[y * shape.tiles_x + x] = 1;
  }
}
