// Everything that host and kernels must agree on, written once: constants, structs, and the meaning of packed values.
// 32-bit scalars and 16-byte vectors only, so that the layout is the same everywhere; the host asserts it, a test asks the
// device.
#ifndef HS_SHARED_H
#define HS_SHARED_H

#if defined(__OPENCL_VERSION__) || defined(__OPENCL_C_VERSION__)
typedef float4 hs_float4;
typedef uint hs_uint;
typedef int hs_int;
#else
#include <CL/cl_platform.h>
typedef cl_float4 hs_float4;
typedef cl_uint hs_uint;
typedef cl_int hs_int;
#endif

// Vertices, triangles and edges are launched in blocks: one work-group a block, one work-item an element.
#define HS_BLOCK_SIZE 256

// Screen positions are fixed point, 24.8: 8 bits below the pixel, relative to the middle of the map. Maps have at most
// HS_MAX_RESOLUTION pixels a side and vertices at most HS_GUARD_PX from the middle (triangles beyond are clipped), so that
// |coordinate| <= 2^22 and an edge function's step over a tile stays within 32 bits (raster/triangles.h).
#define HS_SUBPIXEL_BITS 8
#define HS_SUBPIXEL (1 << HS_SUBPIXEL_BITS)
#define HS_MAX_RESOLUTION 16384
#define HS_GUARD_PX 16384

// What an empty texel of a shadow map holds: beyond every receiver.
#define HS_EMPTY_Z 1e30f

// A run of consecutive elements that belong to one mesh of the scene.
typedef struct {
  hs_uint first;  // element in the scene-wide array
  hs_uint count;  // 1 .. HS_BLOCK_SIZE
  hs_uint mesh;   // index of the scene's mesh
  hs_uint cull;   // of triangles that are drawn: HS_CULL_; of casters' triangles: HS_CULL_ of the side (orient_faces) that the
                  // faces turned away from the light have, HS_CULL_NONE where the mesh does not tell inside from outside
} HsBlock;
// Triangles that a view need not draw, by the sign of their area in its pixels (y down): a solid seen from outside hides the
// faces that turn away.
#define HS_CULL_NONE 0u
#define HS_CULL_POSITIVE 1u
#define HS_CULL_NEGATIVE 2u

// What orient_faces says of a face.
#define HS_SIDE 1u
#define HS_SIDE_AWAY 2u

// Rows of view_from_mesh. The view is the camera's or a light's; row_w divides the others. It is (0, 0, 0, 1) but for directional
// lights: their view space is a projective image of the world that turns them into the disc of a light at its origin, so that
// lines, planes and what hides what stay as they are, and every kernel treats all lights alike (host/light_view.cpp).
typedef struct {
  hs_float4 row_x, row_y, row_z, row_w;
} HsTransform;

// A perspective view, camera or light, and the grid it is rasterized on. Pixel rows count downwards, view-space y upwards.
typedef struct {
  hs_float4 px_from_q;  // px = q.x * .x + .y,  py = q.y * .z + .w  with q = (x/z, y/z); .z < 0
  hs_float4 world_from_view_x, world_from_view_y, world_from_view_z;  // columns of the rotation, for normals
  float znear;                                                        // clip distance, > 0
  float d_far;                                                        // 1 / far distance
  hs_uint width_px, height_px;
  hs_uint tiles_x, tiles_y;
  hs_uint mid_x_px, mid_y_px;  // origin of the fixed-point coordinates
} HsView;

// Flags of a transformed vertex.
#define HS_VERTEX_NEEDS_CLIP 1u  // before the near plane or outside the guard band
#define HS_VERTEX_INVALID 2u     // not finite: its triangles are dropped

// A silhouette edge's quad or a corner's sector, in the light map's texels (y down).
//   edge:   from a to b; the outward normal is (t.y, -t.x) with t = (b - a)/|b - a|
//   corner: about a; covers r = p - a with r.h0 >= 0 and r.h1 >= 0, h0 = (b.x, b.y), h1 = (b.d, c); an inner one lies on the
//           covered side, and belongs to inner fins alone
// layer is 0 unless fins are drawn in layers. narrow: 0, or how wide the caster is there, where that is less than its penumbrae
// can be: 1 + its width in 1/HS_NARROW_STEPS texel. d is 1/z, linear along a projected edge.
typedef struct {
  float ax, ay, ad;
  float bx, by, bd;
  float c;
  hs_uint kind_and_layer;  // kind | layer << HS_FEATURE_KIND_BITS | narrow << HS_FEATURE_NARROW_SHIFT
} HsFeature;
#define HS_FEATURE_KIND_BITS 2
#define HS_FEATURE_NARROW_SHIFT 13  // behind HS_MAX_LAYERS
#define HS_NARROW_STEPS 512
#define HS_FEATURE_EDGE 0u
#define HS_FEATURE_CORNER 1u
#define HS_FEATURE_INNER_CORNER 2u
#define HS_FEATURE_OUTER_EDGE 3u  // an edge without an inner fin

// How wide features are, in texels: from the radius (radius_px > 0), or smoothies of a fixed t (width_px > 0). And the tiles they
// are binned to, HS_TILE texels wide: the map's own, or, where receivers are listed tile by tile, overlapping by a texel, so that
// every 2x2 footprint lies in one.
typedef struct {
  float radius_px;      // light radius R in light map texels at unit distance
  float width_px;       // 0 where the width follows from the radius
  hs_uint two_sided;    // 1: inner fins too
  hs_uint drop_hidden;  // 1: no features for silhouettes that their own caster, or what abuts it, hides; 2: that anything hides;
                        // and casters narrower than their penumbrae know their width
  float sphere_q_per_px;  // light map units a texel where the light is a sphere, else 0: see sphere_q in silhouettes/fin_shape.h
  hs_uint tile_step;      // texels from tile to tile: HS_TILE or one less
  hs_uint tiles_x, tiles_y;
} HsFinShape;

// The numbers of a potential silhouette of methods/exact: EdgeBlock in methods/exact/edge_block.h.
#define HS_EDGE_NUMBERS 16

// The light's disc as methods/exact counts it.
#define HS_MAX_SAMPLES 1024
typedef struct {
  float radius;
  float radius_px;       // in light map texels at unit distance
  float reach2;          // an edge that stays farther from the centre than its root hides no sample
  float near_q;          // HS_NEAR_PX in light map coordinates
  float table_per_turn;  // steps of SampleTable's `below` a quarter turn
  hs_uint sample_count;  // 16, 64, 256 or 1024
  hs_uint rotated;       // 1: the samples are turned by an angle of each pixel's own
  hs_uint sphere;        // 1: each receiver sees the disc that faces it
  hs_uint tinted;        // 1: the samples have weights a channel, and a tint is counted too
  hs_uint cells_across;  // of the grid that the samples are sorted into
} HsDisc;

// The windows of the light's samples (host/light/samples.hpp), each of so many columns and rows, and of at most so many
// samples.
#define HS_WINDOW_CELLS 3
#define HS_WINDOW_SAMPLES 16
#define HS_WINDOW_FULL 65535  // in place of the first number: there are more

// Silhouettes this near to a receiver, in texels, leave the question whether the light's centre sees it to counting.
#define HS_NEAR_PX 2.25f

// Texels a side of the tiles of the light map that bound the searches of methods/pcss.cl: the same for both shapes of kernels, so
// that both search alike.
#define HS_SEARCH_TILE 32

// Layers of fins, parallel to the light's plane (Cai et al. 2006 §4.1): merged from equally deep sub-layers. Where casters stand
// is kept as bits: the last for what lies beyond all silhouettes, the others for equal parts of the depth that holds these.
#define HS_SUBLAYERS 1024
#define HS_CASTER_BITS 32
#define HS_MAX_LAYERS 1024  // see HS_FEATURE_NARROW_SHIFT
// Floats a receiver while layers are added up: see methods/shadow_fins.
#define HS_STATE_PLANES 7

#define HS_AUTO_LAYERS 16  // the most that are chosen from the scene
// `faithful` combines overlapping fins as published.
typedef struct {
  hs_uint count;
  hs_uint falloff;
  hs_uint faithful;
  hs_uint automatic;  // as many of them are used as the depths of silhouettes call for
} HsLayers;

// From where in the penumbra to visibility; the values of Falloff in halfshade.hpp.
#define HS_FALLOFF_LINEAR 0u
#define HS_FALLOFF_BERNSTEIN 1u
#define HS_FALLOFF_SINE 2u
#define HS_FALLOFF_DISC 3u

// Counters of one light's frame. Zeroed before it; kernels add, the host reads after the frame if it likes.
typedef struct {
  hs_uint silhouette_count;
  hs_uint feature_count;
  hs_uint dropped_triangle_count;  // not finite
  hs_uint negative_count;          // exact: pixels where some depth complexity came out below 0
} HsStatus;

// Camera pixel to light space, times a w that divides it (HsTransform): z_vs * (ray0 + px * ray_dx + py * ray_dy) + origin for
// pixel (px, py) with view depth z_vs, or rows . (position_ws, 1) where the G-buffer holds positions.
typedef struct {
  hs_float4 ray0, ray_dx, ray_dy, origin;
  hs_float4 from_world_x, from_world_y, from_world_z, from_world_w;  // rows of light_from_world
  hs_float4 axis_ws;            // xyz: the light's axis; w: 0 for a directional light, else 1
  hs_uint width_px, height_px;  // of the G-buffer
  hs_uint has_depth;            // 1: depth plane, 0: position plane
  float tan_half_cone;          // of the square that is lit
  hs_uint is_face;              // 1: what lies outside of it is lit by another face of the light, and keeps what it has
  float error_per_distance;     // receivers may be off their surface, in light space, by so much times their view depth, or,
                                // where positions are given, their distance from the light
  float unit;                   // of light space, in the world's: a power of two
  float error;                  // and by so much more
} HsReceiverView;

// One light as shading sees it.
typedef struct {
  hs_float4 position_ws;  // relative to the camera, in its unit, times w; w = 0: a directional light, xyz is where it comes from
  hs_float4 color;        // colour times intensity
  hs_float4 from_camera_x, from_camera_y, from_camera_z;  // rows of light_from_(world relative to the camera)
  float tan_half_cone;                                    // 0 for lights that shine everywhere
  hs_int tint_plane;                                      // its plane among the tints (methods/exact), or -1
  float padding0, padding1;
} HsShadeLight;

#endif
