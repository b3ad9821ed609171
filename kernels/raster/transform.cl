// Vertices into a view: view space for silhouettes and clipping, fixed point for rasterization.

#include "base/view.h"

// positions:   float[3 * vertex_count], relative to each mesh's origin
// vertices_vs: float4 a vertex: x, y, z in view space, 1/z (meaningless for z <= 0)
// vertices_px: int4 a vertex: x, y in 24.8 fixed point from the middle of the map, bits of 1/z, HS_VERTEX_ flags
__kernel void transform(const HsView view, __global const HsBlock* blocks, __global const HsTransform* transforms,
                        __global const float* positions, __global float4* vertices_vs, __global int4* vertices_px) {
  const HsBlock block = blocks[get_group_id(0)];
  if (get_local_id(0) < block.count) {
    const uint vertex = block.first + get_local_id(0);
    const HsTransform transform = transforms[block.mesh];
    const float4 p = (float4)(vload3(vertex, positions), 1.0f);
    // What may lie in the view's own plane, as far as can be told, lies there: what is flush with a light does not hide it.
    const float4 terms = fabs(transform.row_z * p);
    const float z = dot(transform.row_z, p), rounding = (terms.x + terms.y + terms.z + terms.w) * 0x1p-21f;
    const float3 p_vs =
        (float3)(dot(transform.row_x, p), dot(transform.row_y, p), fabs(z) < rounding ? 0.0f : z) / dot(transform.row_w, p);
    uint flags = 0;
    int2 fixed_px = (int2)(0);
    float d = 0.0f;
    if (!(isfinite(p_vs.x) && isfinite(p_vs.y) && isfinite(p_vs.z))) {
      flags = HS_VERTEX_INVALID;
    } else if (!(p_vs.z >= view.znear)) {
      flags = HS_VERTEX_NEEDS_CLIP;
    } else {
      const float3 from_mid = homogeneous_px(view, p_vs);
      const float guard = (float)HS_GUARD_PX * p_vs.z;
      d = 1.0f / p_vs.z;
      if (fabs(from_mid.x) <= guard && fabs(from_mid.y) <= guard)
        fixed_px = snap_px(from_mid);
      else
        flags = HS_VERTEX_NEEDS_CLIP;
    }
    vertices_vs[vertex] = (float4)(p_vs, d);
    vertices_px[vertex] = (int4)(fixed_px, as_int(d), as_int(flags));
  }
}
