// The shadow map: linear depth of the surface nearest to the light (Williams 1978).

#include "raster/triangles.h"

// shadow_map: float a texel: linear z of the nearest surface, HS_EMPTY_Z where there is none. One work-group a tile.
__kernel __attribute__((reqd_work_group_size(HS_TILE_ITEMS, 1, 1))) void raster_shadow_map(const HsView view,
                                                                                           HS_ARGS_TRIANGLE_TILES,
                                                                                           HS_ARGS_TRIANGLES,
                                                                                           __global float* shadow_map) {
  const int2 tile_px = tile_origin_px(view);
  float nearest_d[HS_TILE_STORAGE];
  for (int i = 0; i < HS_TILE_STORAGE; ++i) nearest_d[i] = 0.0f;

  HS_FOR_TILE_TRIANGLES(triangle) {
    const uint3 corner = vload3(triangle, triangles);
    TileTriangle t;
    HS_FOR_PIECES(view, corner, vertices_vs, vertices_px, tile_px, t) {
      HS_FOR_COLUMNS(x, t.x0, t.x1) {
        const Columns columns = columns_of(&t, x);
        HS_FOR_ROWS(y, t.y0, t.y1) {
          vfloat d;
          const vint covered = cover(&t, &columns, y, &d);
          float* slot = nearest_d + HS_SLOT(x, y);
          v_store(max(v_load(slot), v_select((vfloat)(0.0f), d, covered)), slot);
        }
      }
    }
  }

  const int x_end = min(HS_TILE, (int)view.width_px - tile_px.x), y_end = min(HS_TILE, (int)view.height_px - tile_px.y);
  HS_FOR_TEXELS(x, y, 0, 0, x_end - 1, y_end - 1) {
    const vfloat d = v_load(nearest_d + HS_SLOT(x, y));
    const vfloat z = v_select((vfloat)(HS_EMPTY_Z), 1.0f / d, d > 0.0f);
    store_lanes(z, shadow_map, (size_t)(tile_px.y + y) * view.width_px + tile_px.x + x, min(HS_LANES, x_end - x));
  }
}
