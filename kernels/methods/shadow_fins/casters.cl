// At which depths a caster stands, texel by texel. The shadow map knows the nearest alone; what stands behind it matters where
// fins brighten the nearest one's shadow (Cai et al. 2006 §4, Fig. 7).

#include "methods/shadow_fins/caster_bits.h"
#include "raster/triangles.h"

// other_casters: uint a texel: a caster_bit for the surface that the light sees, and for each face beneath it that is turned to
// the light, or may be; in tiles that share texels with one that holds fins. sides: see orient_faces; HS_SIDE_AWAY for faces that
// cast no shadow, too.
__kernel __attribute__((reqd_work_group_size(HS_TILE_ITEMS, 1, 1))) void raster_casters(
    const HsView view, const HsFinShape shape, HS_ARGS_TRIANGLE_TILES, HS_ARGS_TRIANGLES, __global const uchar* sides,
    __global const float* shadow_map, __global const float* caster_range, __global const uchar* near,
    __global uint* other_casters) {
  const int2 tile_px = tile_origin_px(view);
  const int step = (int)shape.tile_step;
  const int2 first = max(tile_px - (HS_TILE - step), 0) / step;
  const int2 last = min((tile_px + HS_TILE - 1) / step, (int2)((int)shape.tiles_x, (int)shape.tiles_y) - 1);
  bool any = false;  // for one layer none is needed
  for (int y = caster_range[2] > 1.0f ? first.y : last.y + 1; y <= last.y; ++y)
    for (int x = first.x; x <= last.x; ++x) any |= near[y * (int)shape.tiles_x + x] != 0;
  if (any) {
    int casters[HS_TILE_STORAGE];
    for (int i = 0; i < HS_TILE_STORAGE; ++i) casters[i] = 0;

    HS_FOR_TILE_TRIANGLES(triangle) {
      if (sides[triangle] & HS_SIDE_AWAY) continue;
      const uint3 corner = vload3(triangle, triangles);
      TileTriangle t;
      HS_FOR_PIECES(view, corner, vertices_vs, vertices_px, tile_px, t) {
        const uint near_bit = caster_bit(caster_range, 1.0f / t.d_max);
        const uint far_bit = caster_bit(caster_range, 1.0f / t.d_min);
        HS_FOR_COLUMNS(x, t.x0, t.x1) {
          const Columns columns = columns_of(&t, x);
          HS_FOR_ROWS(y, t.y0, t.y1) {
            vfloat d;
            const vint covered = cover(&t, &columns, y, &d);
            int* slot = casters + HS_SLOT(x, y);
            if (near_bit == far_bit) {
              v_store(v_load(slot) | v_select((vint)(0), (vint)(1 << near_bit), covered), slot);
            } else {
              for (int i = 0; i < HS_LANES; ++i)
                if (((const int*)&covered)[i]) slot[i] |= 1 << caster_bit(caster_range, 1.0f / ((const float*)&d)[i]);
            }
          }
        }
      }
    }

    const int x_end = min(HS_TILE, (int)view.width_px - tile_px.x), y_end = min(HS_TILE, (int)view.height_px - tile_px.y);
    HS_FOR_TEXELS(x, y, 0, 0, x_end - 1, y_end - 1) {
      const size_t first = (size_t)(tile_px.y + y) * view.width_px + tile_px.x + x;
      for (int i = 0; i < HS_LANES && x + i < x_end; ++i) {
        const float z = shadow_map[first + i];
        const uint seen = z < HS_EMPTY_Z ? 1u << caster_bit(caster_range, z) : 0u;
        other_casters[first + i] = (uint)casters[HS_SLOT(x, y) + i] | seen;
      }
    }
  }
}
