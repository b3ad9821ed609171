// Wide types: the lanes of a work-item, masks, loads and stores.
//
// HS_TILE     texels a side of a tile
// HS_LANES    16 on CPU devices: one work-item owns a tile and walks its rows sixteen texels at a time
//              1 on GPU devices: a work-group of HS_TILE x HS_TILE work-items owns a tile, one texel each
// Both are the only build options; everything else is an argument.

#pragma once

#include "base/shared.h"

// Facing, coverage and crossings are decided by signs: a*b - b*a must be 0. PoCL contracts unless told not to. Where that costs
// time, what has a margin (bounds) or is the same whoever asks allows it.
#pragma OPENCL FP_CONTRACT OFF

// Wide values are passed in memory between functions that are not inlined.
#define HS_INLINE inline __attribute__((always_inline))

#if HS_LANES == 16
typedef float16 vfloat;
typedef int16 vint;
#define HS_TILE_ITEMS 1
// One padded row of a tile in private memory: a 16-wide access may begin at any texel of the row.
#define HS_ROW (HS_TILE + 16)
#define HS_TILE_STORAGE (HS_TILE * HS_ROW)
#define v_iota ((vint)(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15))
#define v_load(p) vload16(0, p)
// As vstore16, which PoCL 3.1 makes of four stores: four times as many, and what is loaded at once again has to wait for all.
typedef float16 HsUnalignedFloats __attribute__((aligned(4)));
typedef int16 HsUnalignedInts __attribute__((aligned(4)));
#define HS_STORE(Vector, Scalar, Unaligned, space)                                  \
  __attribute__((overloadable)) HS_INLINE void v_store(Vector v, space Scalar* p) { \
    *(space Unaligned*)p = v;                                                       \
  }
HS_STORE(float16, float, HsUnalignedFloats, __private)
HS_STORE(float16, float, HsUnalignedFloats, __global)
HS_STORE(int16, int, HsUnalignedInts, __private)
HS_STORE(int16, int, HsUnalignedInts, __global)
#undef HS_STORE
#define v_float convert_float16
#define v_int convert_int16
#define v_select(if_false, if_true, mask) select(if_false, if_true, mask)
// Of a mask. Not as !m: compilers make that an exclusive or with a vector of ones of one bit each, which Oclgrind 21.10 takes for
// 1 where its comparisons give -1: what was true comes out as -2, and what was false as 1.
#define v_not(m) v_select((vint)(-1), (vint)(0), m)
// Bit i for lane i of a mask. Compilers for x86 have one instruction for it, but do not see that this is what is meant.
HS_INLINE uint lane_bits(int16 mask) {
#if defined(__AVX512DQ__)
  return (ushort)__builtin_ia32_cvtd2mask512(mask);
#elif defined(__AVX2__)
  return (uint)__builtin_ia32_movmskps256(as_float8(mask.lo)) | (uint)__builtin_ia32_movmskps256(as_float8(mask.hi)) << 8;
#else
  const int16 bits = mask & (int16)(1, 2, 4, 8, 16, 32, 64, 128, 256, 512, 1024, 2048, 4096, 8192, 16384, 32768);
  const int8 a = bits.lo | bits.hi;
  const int4 b = a.lo | a.hi;
  const int2 c = b.lo | b.hi;
  return (uint)(c.x | c.y);
#endif
}
#define v_any(m) (lane_bits(m) != 0)
#define lane_count(m) ((int)popcount(lane_bits(m)))
HS_INLINE float16 v_gather(__global const float* p, int16 i) {
  return (float16)(p[i.s0], p[i.s1], p[i.s2], p[i.s3], p[i.s4], p[i.s5], p[i.s6], p[i.s7], p[i.s8], p[i.s9], p[i.sa], p[i.sb],
                   p[i.sc], p[i.sd], p[i.se], p[i.sf]);
}
#define v_all(m) (lane_bits(m) == 0xffffu)
HS_INLINE float v_reduce_min(float16 v) {
  const float8 a = min(v.lo, v.hi);
  const float4 b = min(a.lo, a.hi);
  const float2 c = min(b.lo, b.hi);
  return min(c.x, c.y);
}
#define v_first(v) ((v).s0)
#define v_as_int as_int16
#define v_as_float as_float16
// One lane of a mask or vector in memory.
#define HS_LANE(v, i) (((const int*)&(v))[i])
#define HS_FLOAT_LANE(v, i) (((const float*)&(v))[i])
HS_INLINE int v_reduce_min_int(int16 v) {
  const int8 a = min(v.lo, v.hi);
  const int4 b = min(a.lo, a.hi);
  const int2 c = min(b.lo, b.hi);
  return min(c.x, c.y);
}
HS_INLINE float v_reduce_add(float16 v) {
  const float8 a = v.lo + v.hi;
  const float4 b = a.lo + a.hi;
  const float2 c = b.lo + b.hi;
  return c.x + c.y;
}
// p[i] and p[i + 1]: one 8-byte load serves both.
HS_INLINE void v_gather_pair(__global const float* p, int16 i, float16* left, float16* right) {
#define HS_PAIR(k) as_ulong(vload2(0, p + i.k))
  const float16 a = as_float16(
      (ulong8)(HS_PAIR(s0), HS_PAIR(s1), HS_PAIR(s2), HS_PAIR(s3), HS_PAIR(s4), HS_PAIR(s5), HS_PAIR(s6), HS_PAIR(s7)));
  const float16 b = as_float16(
      (ulong8)(HS_PAIR(s8), HS_PAIR(s9), HS_PAIR(sa), HS_PAIR(sb), HS_PAIR(sc), HS_PAIR(sd), HS_PAIR(se), HS_PAIR(sf)));
#undef HS_PAIR
  *left = (float16)(a.even, b.even);
  *right = (float16)(a.odd, b.odd);
}
// Visits the texels x0..x1, y0..y1 of a tile: x is the first of 16 texels in row y, and may reach past x1 (mask or ignore).
#define HS_FOR_TEXELS(x, y, x0, y0, x1, y1) \
  for (int y = (y0); y <= (y1); ++y)        \
    for (int x = (x0); x <= (x1); x += 16)
// The same, column blocks outside, rows inside: what depends on x alone is worked out once a block.
#define HS_FOR_COLUMNS(x, x0, x1) for (int x = (x0); x <= (x1); x += 16)
#define HS_FOR_ROWS(y, y0, y1) for (int y = (y0); y <= (y1); ++y)
#define HS_SLOT(x, y) ((y)*HS_ROW + (x))
#else
typedef float vfloat;
typedef int vint;
#define HS_TILE_ITEMS (HS_TILE * HS_TILE)
#define HS_TILE_STORAGE 1
#define v_iota 0
#define v_load(p) (*(p))
#define v_store(v, p) (*(p) = (v))
#define v_float (float)
#define v_int (int)
#define v_select(if_false, if_true, mask) ((mask) ? (if_true) : (if_false))
#define v_not(m) (!(m))
#define v_any(m) ((m) != 0)
#define v_gather(p, i) ((p)[i])
HS_INLINE void v_gather_pair(__global const float* p, int i, float* left, float* right) {
  *left = p[i];
  *right = p[i + 1];
}
#define v_all(m) ((m) != 0)
#define v_reduce_min(v) (v)
#define v_first(v) (v)
#define v_as_int as_int
#define v_as_float as_float
#define HS_LANE(v, i) (v)
#define HS_FLOAT_LANE(v, i) (v)
#define v_reduce_min_int(v) (v)
#define v_reduce_add(v) (v)
#define lane_count(mask) ((mask) != 0)
#define lane_bits(mask) ((uint)((mask) != 0))
// A loop of no or one step: over the work-item's own texel, if it lies between.
#define HS_FOR_OWN(i, own, first, last) \
  for (int i = (own), hs_once_##i = i >= (first) && i <= (last); hs_once_##i; hs_once_##i = 0)
#define HS_FOR_COLUMNS(x, x0, x1) HS_FOR_OWN(x, (int)get_local_id(0) % HS_TILE, x0, x1)
#define HS_FOR_ROWS(y, y0, y1) HS_FOR_OWN(y, (int)get_local_id(0) / HS_TILE, y0, y1)
#define HS_FOR_TEXELS(x, y, x0, y0, x1, y1) HS_FOR_ROWS(y, y0, y1) HS_FOR_COLUMNS(x, x0, x1)
#define HS_SLOT(x, y) 0
#endif

// Prefetches a value, where the compiler can: where there is one address space. What lies past a buffer's
// end may be prefetched.
HS_INLINE void prefetch(__global const float* p) {
#if defined(__x86_64__) || defined(__aarch64__)
  __builtin_prefetch((const void*)(size_t)p);
#endif
}

// Prefetches HS_LANES pixels of a plane of four channels. Processors read ahead along rows, but work-items go down a strip: they
// prefetch the next row themselves.
HS_INLINE void prefetch_lanes4(__global const float4* plane, size_t first) {
  for (int i = 0; i < HS_LANES; i += 4) prefetch((__global const float*)(plane + first + i));
}

// The first lane of lane_bits that are not 0.
HS_INLINE int first_lane(uint bits) {
  return 31 - (int)clz(bits & -bits);
}

// Stores the lanes that `bits` has (as lane_bits), one behind the other; as many places as a vector has may be written.
HS_INLINE void v_store_chosen(vfloat v, uint bits, float* p) {
#if HS_LANES == 16 && defined(__AVX512F__)
  v_store(__builtin_ia32_compresssf512_mask(v, v, (ushort)bits), p);
#else
  for (; bits != 0; bits &= bits - 1) *p++ = HS_FLOAT_LANE(v, first_lane(bits));
#endif
}
#define v_store_chosen_ints(v, bits, p) v_store_chosen(v_as_float(v), bits, (float*)(p))

// Appends those lanes to a list, which has the capacity for a vector more.
HS_INLINE void append_chosen(vint v, uint bits, int* list, int* count) {
  v_store_chosen_ints(v, bits, list + *count);
  *count += (int)popcount(bits);
}

// Screen pixels: a work-item outputs HS_LANES pixels at a time along HS_STRIP rows (16 x 16 on CPU devices, one on GPU devices).
// Visits them: (px, py) is the first of `valid` <= HS_LANES pixels of a row.
#if HS_LANES == 16
#define HS_STRIP 16
#else
#define HS_STRIP 1
#endif
#define HS_FOR_PIXELS(px, py, valid, width_px, height_px)                                                                     \
  const int px = (int)get_global_id(0) * HS_LANES, valid = min(HS_LANES, (int)(width_px)-px);                                 \
  for (int py = (int)get_global_id(1) * HS_STRIP, hs_end = valid > 0 ? min(py + HS_STRIP, (int)(height_px)) : 0; py < hs_end; \
       ++py)

// Index of the first pixel that HS_FOR_PIXELS is at.
#define HS_PIXEL ((size_t)py * view.width_px + px)

// Stores past the cache where the compiler can: screen planes are larger than any, and reading lines only to overwrite them costs
// half of the bandwidth.
HS_INLINE void stream_float4(float4 value, __global float4* to) {
#if HS_LANES == 16 && defined(__has_builtin)
#if __has_builtin(__builtin_nontemporal_store)
  __builtin_nontemporal_store(value, to);
  return;
#endif
#endif
  *to = value;
}

// Loads a plane's HS_LANES values from pixel `first`, repeating the last of `valid`.
HS_INLINE vfloat load_lanes(__global const float* plane, size_t first, int valid) {
#if HS_LANES == 16
  if (valid >= 16) return vload16(0, plane + first);
  float lanes[16];
  for (int i = 0; i < 16; ++i) lanes[i] = plane[first + min(i, valid - 1)];
  return vload16(0, lanes);
#else
  return plane[first];
#endif
}

// The same, of integers.
HS_INLINE vint load_int_lanes(__global const int* p, size_t first, int valid) {
  return v_as_int(load_lanes((__global const float*)p, first, valid));
}

// Every fourth value.
HS_INLINE vfloat strided_lanes(const float* p) {
#if HS_LANES == 16
  return (float16)(p[0], p[4], p[8], p[12], p[16], p[20], p[24], p[28], p[32], p[36], p[40], p[44], p[48], p[52], p[56], p[60]);
#else
  return p[0];
#endif
}

#if HS_LANES == 16
// Four interleaved channels of sixteen pixels, four pixels a vector, to a vector a channel.
HS_INLINE void part_channels(float16 a, float16 b, float16 c, float16 d, float16* x, float16* y, float16* z, float16* w) {
  *x = (float16)(a.s048c, b.s048c, c.s048c, d.s048c);
  *y = (float16)(a.s159d, b.s159d, c.s159d, d.s159d);
  *z = (float16)(a.s26ae, b.s26ae, c.s26ae, d.s26ae);
  *w = (float16)(a.s37bf, b.s37bf, c.s37bf, d.s37bf);
}
#endif

// Loads four interleaved channels of HS_LANES pixels.
HS_INLINE void load_lanes4(__global const float4* plane, size_t first, int valid, vfloat* x, vfloat* y, vfloat* z, vfloat* w) {
#if HS_LANES == 16
  if (valid >= 16) {
    __global const float* p = (__global const float*)(plane + first);
    const float16 a = vload16(0, p), b = vload16(1, p), c = vload16(2, p), d = vload16(3, p);
    part_channels(a, b, c, d, x, y, z, w);
    return;
  }
  float lanes[4][16];
  for (int i = 0; i < 16; ++i) {
    const float4 value = plane[first + min(i, valid - 1)];
    lanes[0][i] = value.x;
    lanes[1][i] = value.y;
    lanes[2][i] = value.z;
    lanes[3][i] = value.w;
  }
  *x = vload16(0, lanes[0]);
  *y = vload16(0, lanes[1]);
  *z = vload16(0, lanes[2]);
  *w = vload16(0, lanes[3]);
#else
  const float4 value = plane[first];
  *x = value.x;
  *y = value.y;
  *z = value.z;
  *w = value.w;
#endif
}

// Four interleaved channels of some pixels.
HS_INLINE void v_gather4(__global const float4* plane, vint i, vfloat* x, vfloat* y, vfloat* z, vfloat* w) {
#if HS_LANES == 16
  const float16 a = (float16)(plane[i.s0], plane[i.s1], plane[i.s2], plane[i.s3]),
                b = (float16)(plane[i.s4], plane[i.s5], plane[i.s6], plane[i.s7]),
                c = (float16)(plane[i.s8], plane[i.s9], plane[i.sa], plane[i.sb]),
                d = (float16)(plane[i.sc], plane[i.sd], plane[i.se], plane[i.sf]);
  part_channels(a, b, c, d, x, y, z, w);
#else
  const float4 value = plane[i];
  *x = value.x;
  *y = value.y;
  *z = value.z;
  *w = value.w;
#endif
}

// Stores the first `valid` values to a plane from pixel `first`.
HS_INLINE void store_lanes(vfloat value, __global float* plane, size_t first, int valid) {
#if HS_LANES == 16
  if (valid < 16) {
    for (int i = 0; i < valid; ++i) plane[first + i] = ((const float*)&value)[i];
    return;
  }
#endif
  v_store(value, plane + first);
}

// The same, past the cache.
HS_INLINE void stream_lanes(vfloat value, __global float* plane, size_t first, int valid) {
#if HS_LANES == 16
  if (valid == 16 && first % 4 == 0) {
    __global float4* to = (__global float4*)(plane + first);
    stream_float4(value.s0123, to);
    stream_float4(value.s4567, to + 1);
    stream_float4(value.s89ab, to + 2);
    stream_float4(value.scdef, to + 3);
    return;
  }
#endif
  store_lanes(value, plane, first, valid);
}

// Stores four interleaved channels.
HS_INLINE void store_lanes4(vfloat x, vfloat y, vfloat z, vfloat w, __global float4* plane, size_t first, int valid) {
#if HS_LANES == 16
  float4 pixels[16];
  for (int i = 0; i < 16; ++i)
    pixels[i] = (float4)(((const float*)&x)[i], ((const float*)&y)[i], ((const float*)&z)[i], ((const float*)&w)[i]);
  for (int i = 0; i < valid; ++i) stream_float4(pixels[i], plane + first + i);
#else
  plane[first] = (float4)(x, y, z, w);
#endif
}

HS_INLINE vfloat along_axis(float3 axis, vfloat x, vfloat y, vfloat z) {
  return axis.x * x + axis.y * y + axis.z * z;
}

HS_INLINE vfloat lerp(vfloat a, vfloat b, vfloat t) {
  return a + (b - a) * t;
}
