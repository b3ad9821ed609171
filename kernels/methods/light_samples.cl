// light-samples: Heckbert & Herf 1997. The mean of hard shadows from points of the light's disc, one shadow map at a time.

#include "base/receiver.h"

// weight: what this sample adds to the tint; w = 0 where the light has none (see methods/exact).
// visibility: float a pixel: the number of the samples before that see it, this one added; must be 0 before the first, as must
// tints. A sample behind the receiver's face sees nothing of it.
__kernel void receive_sample(const HsView light, const HsReceiverView view, HS_ARGS_GBUFFER, __global const float* shadow_map,
                             const uint casts, const float4 weight, HS_ARGS_TINTS, HS_ARGS_VISIBILITY) {
  HS_FOR_PIXELS(px, py, valid, view.width_px, view.height_px) {
    const Receiver r = locate(light, view, px, py, valid, depth_or_position, normal);
    vfloat seen = r.visibility;
    if (casts && !v_all(r.decided)) seen = v_select(visibility_hard(light, &r, shadow_map), r.visibility, r.decided);
    if (!casts) seen = v_select((vfloat)(1.0f), r.visibility, r.decided);
    seen = v_select(seen, (vfloat)(0.0f), r.elsewhere);
    const size_t first = ((size_t)plane * view.height_px + py) * view.width_px + px;
    if (weight.w > 0.0f) {
      const size_t tint = ((size_t)tint_plane * view.height_px + py) * view.width_px + px;
      vfloat red, green, blue, own;
      load_lanes4(tints, tint, valid, &red, &green, &blue, &own);
      store_lanes4(red + weight.x * seen, green + weight.y * seen, blue + weight.z * seen, (vfloat)(0.0f), tints, tint, valid);
    }
    store_lanes(load_lanes(visibility, first, valid) + seen, visibility, first, valid);
  }
}

// Counts to means. What the light's centre decides without a look-up, such as the cone's border, holds for all samples.
__kernel void receive_samples_end(const HsView light, const HsReceiverView view, HS_ARGS_GBUFFER, const uint count,
                                  const uint tinted, HS_ARGS_TINTS, HS_ARGS_VISIBILITY) {
  if (tinted) {
    HS_FOR_PIXELS(px, py, valid, view.width_px, view.height_px) {
      const Receiver r = locate(light, view, px, py, valid, depth_or_position, normal);
      const size_t tint = ((size_t)tint_plane * view.height_px + py) * view.width_px + px;
      const vfloat scale = (vfloat)(1.0f / (float)count), own = v_select((vfloat)(1.0f), (vfloat)(0.0f), r.decided);
      vfloat red, green, blue, unused;
      load_lanes4(tints, tint, valid, &red, &green, &blue, &unused);
      store_lanes4(red * scale, green * scale, blue * scale, own, tints, tint, valid);
    }
  }
  HS_FOR_RECEIVERS(load_lanes(visibility, ((size_t)plane * view.height_px + py) * view.width_px + px, valid) / (float)count)
}
