// Potential silhouettes as method exact keeps them.

#pragma once

#include "base/lanes.h"

// Blocks of potential silhouettes, and the tiles' lists of them (bin_edges.cl).
#define HS_ARGS_EDGE_TILES \
  __global const EdgeBlock *edges, __global const uint *edge_offsets, __global const uint *edge_refs, const uint edge_capacity

// Potential silhouettes, a field an array: from a to b in light space, z >= 0. Seen from p the multiplicity of one is
// m + sum of o_i side_i(p), side_i = +1 where n_i . p >= n_i.w, else -1. Those that were collected together lie near each other
// on their mesh: a block of them is binned as one.
typedef struct {
  float ax[HS_LANES], ay[HS_LANES], az[HS_LANES];
  int m[HS_LANES];
  float bx[HS_LANES], by[HS_LANES], bz[HS_LANES];
  int orientations[HS_LANES];  // (o_0 + 1) | (o_1 + 1) << 2, each o 1, -1 or 0 for none
  float n0x[HS_LANES], n0y[HS_LANES], n0z[HS_LANES], n0w[HS_LANES];
  float n1x[HS_LANES], n1y[HS_LANES], n1z[HS_LANES], n1w[HS_LANES];
} EdgeBlock;
typedef char EdgeBlockHasAsManyNumbers[sizeof(EdgeBlock) == HS_EDGE_NUMBERS * HS_LANES * sizeof(float) ? 1 : -1];

HS_INLINE void store_edge(__global EdgeBlock* blocks, uint i, float3 a, float3 b, int m, int o0, float4 plane0, int o1,
                          float4 plane1) {
  __global EdgeBlock* block = blocks + i / HS_LANES;
  const uint lane = i % HS_LANES;
  block->ax[lane] = a.x;
  block->ay[lane] = a.y;
  block->az[lane] = a.z;
  block->m[lane] = m;
  block->bx[lane] = b.x;
  block->by[lane] = b.y;
  block->bz[lane] = b.z;
  block->orientations[lane] = (o0 + 1) | (o1 + 1) << 2;
  block->n0x[lane] = plane0.x;
  block->n0y[lane] = plane0.y;
  block->n0z[lane] = plane0.z;
  block->n0w[lane] = plane0.w;
  block->n1x[lane] = plane1.x;
  block->n1y[lane] = plane1.y;
  block->n1z[lane] = plane1.z;
  block->n1w[lane] = plane1.w;
}
