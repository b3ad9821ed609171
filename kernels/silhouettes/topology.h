#pragma once

#include "base/lanes.h"

// Which faces meet at which edge (host/scene/topology.hpp): uint2 end points an edge; its faces, (face << 1) | against, and a
// vertex's edges, each as offsets and a list.
#define HS_ARGS_TOPOLOGY                                                                                \
  __global const uint2 *edges, __global const uint *edge_face_offsets, __global const uint *edge_faces, \
      __global const uint *vertex_edge_offsets, __global const uint *vertex_edges
