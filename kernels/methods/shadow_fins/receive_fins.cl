// Shadow fins: Cai et al. 2006, in one layer (§3) and in many (§4), tile by tile of the light map.
//
// Pixels near fins are listed by the tile that their 2x2 footprint lies in (tiles overlap by a texel, see HsFinShape). A tile's
// work-group draws the fins of one layer after the other into the same few arrays, and adds each to what its pixels have seen so
// far: no fin buffer nor illuminance buffer need be in memory, and what no fin reaches costs nothing.

#include "methods/shadow_fins/illuminance.h"

// Stores what this tile knows of a run.
HS_INLINE void store_mine(const TileRun* run, vfloat value, __global float* plane) {
  plane += run->pixel;
  if (v_all(run->mine)) {
    v_store(value, plane);
  } else {
    for (int i = 0; i < HS_LANES; ++i)
      if (HS_LANE(run->mine, i)) plane[i] = HS_FLOAT_LANE(value, i);
  }
}

// Stores the result for those of a run that fins reach, within their horizon limits. The others keep what they have.
HS_INLINE void store_result(const TileRun* run, vfloat value, vint reached, __global const float* horizon_limits,
                            __global float* visibility) {
  const vint capped = (run->words & HS_WORD_LIMITED) != 0;
  if (v_any(capped & reached)) value = v_select(value, min(value, load_lanes(horizon_limits, run->pixel, run->valid)), capped);
  store_mine(run, v_select(load_lanes(visibility, run->pixel, run->valid), value, reached), visibility);
}

// Visits the tile's runs of receivers: `slot` in the list.
#define HS_FOR_LISTED(slot) for (uint slot = first_run + (uint)get_local_id(0); slot < last_run; slot += HS_TILE_ITEMS)

// states: HS_STATE_PLANES floats a pixel. Directions are kept as two 16-bit integers.
#define HS_DIRECTION_SCALE 32000.0f
HS_INLINE void store_seen(const TileRun* run, const Seen* seen, __global float* states, size_t pixels) {
  const vint x = v_int(seen->nx * HS_DIRECTION_SCALE), y = v_int(seen->ny * HS_DIRECTION_SCALE);
  store_mine(run, seen->part, states);
  store_mine(run, v_as_float((x & 0xffff) | (y << 16)), states + pixels);
}

HS_INLINE void load_seen(const TileRun* run, __global const float* states, size_t pixels, Seen* seen) {
  const vint packed = v_as_int(load_lanes(states + pixels, run->pixel, run->valid));
  seen->part = load_lanes(states, run->pixel, run->valid);
  seen->nx = v_float(packed << 16 >> 16) * (1.0f / HS_DIRECTION_SCALE);
  seen->ny = v_float(packed >> 16) * (1.0f / HS_DIRECTION_SCALE);
}

HS_INLINE void store_illuminance(const TileRun* run, const Illuminance* seen, __global float* states, size_t pixels) {
  store_seen(run, &seen->lit, states, pixels);
  store_seen(run, &seen->done, states + 2 * pixels, pixels);
  store_seen(run, &seen->at_hand, states + 4 * pixels, pixels);
  store_mine(run, seen->at_d, states + 6 * pixels);
}

HS_INLINE void load_illuminance(const TileRun* run, __global const float* states, size_t pixels, Illuminance* seen) {
  load_seen(run, states, pixels, &seen->lit);
  load_seen(run, states + 2 * pixels, pixels, &seen->done);
  load_seen(run, states + 4 * pixels, pixels, &seen->at_hand);
  seen->at_d = load_lanes(states + 6 * pixels, run->pixel, run->valid);
}

HS_INLINE void begin_illuminance(Illuminance* seen) {
  seen->lit.part = (vfloat)(1.0f);
  seen->lit.nx = seen->lit.ny = (vfloat)(0.0f);
  seen->done = seen->at_hand = seen->lit;
  seen->at_d = (vfloat)(0.0f);
}

// Where a tile's receivers keep what they have seen, and what they show.
typedef struct {
  __global const float* horizon_limits;
  __global float* states;
  __global float* visibility;  // of the plane
  size_t pixels;
} RunPlanes;

// What one layer's fins make of a run of receivers. reached: cells that fins of the layers before reach.
HS_INLINE void receive_layer(const HsView view, const HsFinShape shape, const HsLayers layers, HS_SHARED TileFins* fins,
                             const RunPlanes* planes, const TileRun* run, const TileReceiver* r, bool varied, bool single,
                             uint reached) {
  FinTaps taps;
  load_fins(fins, r, varied, single, layers.faithful, &taps);
  if (single) {
    if (!v_any(taps.any)) return;
    vfloat value = one_layer(view, layers, r, &taps);
    if (layers.faithful) value = falloff_of(value, layers.falloff);
    store_result(run, value, taps.any, planes->horizon_limits, planes->visibility);
  } else {
    const bool first = !meets_cells(run, reached);
    if (!first && !v_any(taps.any)) return;
    Illuminance seen;
    begin_illuminance(&seen);
    if (!first) load_illuminance(run, planes->states, planes->pixels, &seen);
    add_layer(view, shape, layers, fins, r, &taps, &seen);
    store_illuminance(run, &seen, planes->states, planes->pixels);
  }
}

// One work-group a tile of the features. other_casters: see raster_casters; states: float[HS_STATE_PLANES * pixels]; both only
// for more than one layer.
__kernel __attribute__((reqd_work_group_size(HS_TILE_ITEMS, 1, 1))) void receive_fins(
    const HsView view, const HsFinShape shape, const HsLayers layers, HS_ARGS_FEATURE_TILES, __global const float* shadow_map,
    __global const uint* other_casters, __global const float* caster_range, HS_ARGS_FIN_RECEIVERS, const HsReceiverView camera,
    __global const float* depth_or_position, __global float* states, HS_ARGS_VISIBILITY) {
  HS_SHARED TileFins fins;
#if HS_LANES == 1
  __local uint all_cells;
#endif
  const size_t pixels = (size_t)camera.width_px * camera.height_px;
  visibility += (size_t)plane * pixels;
  const RunPlanes planes = {horizon_limits, states, visibility, pixels};
  const uint used = used_layers(layers, caster_range);
  const bool single = used == 1;
  FeatureTile tile = feature_tile(view, shape, 0, layers.count, status, feature_offsets, feature_capacity);
  const uint first_run = receiver_offsets[get_group_id(0)], last_run = receiver_offsets[get_group_id(0) + 1];
  const bool any = first_run < last_run;
  float d_receiver[HS_TILE_STORAGE];
  if (any) {
    for (int i = 0; i < HS_TILE_STORAGE; ++i) d_receiver[i] = 0.0f;
    if (!layers.faithful) load_receivers(view, tile, shadow_map, d_receiver);
    if (!single) {
      HS_FOR_TEXELS(x, y, 0, 0, HS_TILE - 1, HS_TILE - 1) v_store((vint)(0), fins.own_casters + y * HS_TILE + x);
    }
  }
  HsView bounded = view;
  if (any && !layers.faithful)
    bounded.d_far = max(view.d_far, 0.999999f / as_float(tile_far[get_group_id(0)]) - 1.5f / shape.radius_px);
  uint reached = 0;  // by fins of any layer so far
  for (uint layer = 0; layer < used; ++layer) {
    bool varied = false;
    uint cells = 0;
    HS_TILE_BARRIER();
#if HS_LANES == 1
    if (get_local_id(0) == 0) all_cells = 0;
    HS_TILE_BARRIER();
#endif
    if (any && (tile.overflow || layer_touches(shape, layer, feature_offsets))) {
      tile = feature_tile(view, shape, layer, layers.count, status, feature_offsets, feature_capacity);
      cells = draw_tile_fins(view, bounded, shape, layers, single, tile, feature_refs, feature_rects, features, shadow_map,
                             d_receiver, caster_range, &fins, &varied);
    }
#if HS_LANES == 1
    if (cells != 0) atomic_or(&all_cells, cells);
    HS_TILE_BARRIER();
    cells = all_cells;
#endif
    if (cells != 0) {
      HS_FOR_LISTED(slot) {
        TileRun run;
        TileReceiver r;
        if (!load_in_cells(view, camera, tile.px, listed[slot], depth_or_position, receiver_words, cells, layers.faithful, &run,
                           &r))
          continue;
        receive_layer(view, shape, layers, &fins, &planes, &run, &r, varied, single, reached);
      }
    }
    reached |= cells;
  }
  HS_TILE_BARRIER();
  if (!single) {
    HS_FOR_LISTED(slot) {
      TileRun run;
      TileReceiver r;
      if (!load_in_cells(view, camera, tile.px, listed[slot], depth_or_position, receiver_words, reached, layers.faithful, &run,
                         &r))
        continue;
      Illuminance seen;
      load_illuminance(&run, states, pixels, &seen);
      vfloat value = end_layers(view, shadow_map, other_casters, caster_range, &fins, tile.px, layers.faithful, &r, &seen);
      if (layers.faithful) value = falloff_of(value, layers.falloff);
      store_result(&run, value, r.mine, horizon_limits, visibility);
    }
  }
}
