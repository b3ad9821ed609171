// Scalar twins of the kernels' stages: plain loops in double precision, from the formulas of docs/design.md ("Exact soft
// shadows", "Silhouettes") and of Cai et al. 2006. A stage that differs from its twin is at fault by itself, whatever the
// picture.
//
// Light space throughout: the light's centre is the origin, its disc lies in the plane z = 0, and receivers have z > 0.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <glm/glm.hpp>
#include <iterator>
#include <limits>
#include <map>
#include <utility>
#include <vector>

namespace halfshade::twins {

inline double cross(const glm::dvec2& a, const glm::dvec2& b) {
  return a.x * b.y - a.y * b.x;
}

/// The distance from a point to a segment.
inline double distance_to_segment(const glm::dvec2& p, const glm::dvec2& a, const glm::dvec2& b) {
  const glm::dvec2 along = b - a;
  const double length2 = glm::dot(along, along);
  const double t = length2 > 0.0 ? std::clamp(glm::dot(p - a, along) / length2, 0.0, 1.0) : 0.0;
  return glm::distance(p, a + t * along);
}

// ---------------------------------------------------------------------------------------------------------------- planes

/// Points x with n . x = w.
struct Plane {
  glm::dvec3 n{0.0};
  double w = 0.0;

  double value_at(const glm::dvec3& p) const { return glm::dot(n, p) - w; }
  int side_of(const glm::dvec3& p) const { return value_at(p) >= 0.0 ? 1 : -1; }
};

inline Plane plane_of(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c) {
  const glm::dvec3 n = glm::normalize(glm::cross(b - a, c - a));
  return {n, glm::dot(n, a)};
}

/// The side of a face's plane on which receivers lie whose segments to the disc cross it: 1 or -1, or 0 where that depends on the
/// point of the disc. On the disc the plane's value goes from -w - R |(n.x, n.y)| to -w + R |(n.x, n.y)|.
inline int receivers_side(const Plane& plane, double radius) {
  const double reach = radius * std::hypot(plane.n.x, plane.n.y);
  if (-plane.w - reach > 0.0) return -1;
  if (-plane.w + reach < 0.0) return 1;
  return 0;
}

// ------------------------------------------------------------------------------------------------- potential silhouettes

/// A potential silhouette: from a to b. Decided faces are summed in m; o is +1 for a face that runs along the edge, else -1.
struct Edge {
  struct Face {
    int o;
    Plane plane;
  };
  glm::dvec3 a{0.0}, b{0.0};
  int m = 0;
  std::vector<Face> faces = {};
};

/// m_p(e) = sum of o(e, f) side_f(p).
inline int multiplicity(const Edge& edge, const glm::dvec3& p) {
  int m = edge.m;
  for (const Edge::Face& face : edge.faces) m += face.o * face.plane.side_of(p);
  return m;
}

struct Triangles {
  std::vector<glm::dvec3> positions;
  std::vector<glm::uvec3> corners;

  glm::dvec3 corner(std::size_t triangle, int i) const { return positions[corners[triangle][i]]; }
  Plane plane(std::size_t triangle) const { return plane_of(corner(triangle, 0), corner(triangle, 1), corner(triangle, 2)); }
};

/// The part of a segment with z >= 0; false if there is none.
inline bool clip_to_light_plane(glm::dvec3& a, glm::dvec3& b) {
  if (a.z <= 0.0 && b.z <= 0.0) return false;
  const glm::dvec3 cut = a + (b - a) * (a.z / (a.z - b.z));
  if (a.z < 0.0) a = cut;
  if (b.z < 0.0) b = cut;
  return true;
}

/// Edges that are a silhouette for some point of the disc: those with a face that is not decided, or whose decided faces do not
/// cancel out. By their vertices, in ascending order, which is the direction they are stored in.
inline std::map<std::pair<unsigned, unsigned>, Edge> potential_silhouettes(const Triangles& mesh, double radius) {
  std::map<std::pair<unsigned, unsigned>, Edge> all;
  for (std::size_t t = 0; t < mesh.corners.size(); ++t)
    for (int i = 0; i < 3; ++i) {
      const unsigned from = mesh.corners[t][i], to = mesh.corners[t][(i + 1) % 3];
      Edge& edge = all[{std::min(from, to), std::max(from, to)}];
      edge.a = mesh.positions[std::min(from, to)];
      edge.b = mesh.positions[std::max(from, to)];
      const int o = from < to ? 1 : -1;
      const Plane plane = mesh.plane(t);
      const int side = receivers_side(plane, radius);
      if (side == 0)
        edge.faces.push_back({o, plane});
      else
        edge.m += o * side;
    }
  for (auto item = all.begin(); item != all.end();) {
    Edge& edge = item->second;
    const bool drop = (edge.m == 0 && edge.faces.empty()) || !clip_to_light_plane(edge.a, edge.b);
    item = drop ? all.erase(item) : std::next(item);
  }
  return all;
}

/// Whether face t touches a disc of `radius`: what of it lies before the light's plane begins at a cut that comes within.
inline bool touches_disc(const Triangles& mesh, std::size_t t, double radius) {
  glm::dvec2 cuts[2];
  int found = 0;
  for (int i = 0; i < 3; ++i) {
    const glm::dvec3 from = mesh.corner(t, i), to = mesh.corner(t, (i + 1) % 3);
    if ((from.z > 0.0) == (to.z > 0.0)) continue;
    cuts[found++] = glm::dvec2(from + (to - from) * (from.z / (from.z - to.z)));
  }
  return found == 2 && distance_to_segment({0, 0}, cuts[0], cuts[1]) <= radius;
}

// -------------------------------------------------------------------------------------------------- as a receiver sees it

/// A segment in the light's plane, as projected from a receiver.
struct Projected {
  glm::dvec2 a{0.0}, b{0.0};
  bool seen = false;  ///< some of it lies before the receiver
};

/// A = (a_xy p_z - p_xy a_z) / (p_z - a_z), with the part of the edge beyond p clipped away.
inline Projected project(glm::dvec3 a, glm::dvec3 b, const glm::dvec3& p) {
  const double limit = p.z * (1.0 - std::ldexp(1.0, -20));
  if (a.z > limit && b.z > limit) return {};
  const glm::dvec3 cut = a + (b - a) * ((limit - a.z) / (b.z - a.z));
  if (a.z > limit) a = cut;
  if (b.z > limit) b = cut;
  const auto on_plane = [&](const glm::dvec3& x) { return (glm::dvec2(x) * p.z - glm::dvec2(p) * x.z) / (p.z - x.z); };
  return {on_plane(a), on_plane(b), true};
}

/// Whether an edge may hide something of the disc from p.
inline bool hides_some(const Edge& edge, const glm::dvec3& p, double radius) {
  const Projected shadow = project(edge.a, edge.b, p);
  return shadow.seen && multiplicity(edge, p) != 0 && distance_to_segment({0, 0}, shadow.a, shadow.b) < radius;
}

/// A count, and how near it is to being another one: the smallest of the numbers by whose signs it was decided, 0 .. 1.
struct Count {
  int value = 0;
  double margin = 1.0;
  void decide(double number, double scale) { margin = std::min(margin, std::abs(number) / std::max(scale, 1e-30)); }
};

/// What the edges that the segment from the light's centre to s crosses add to the depth complexity: each m_p(e), less where it
/// is crossed from its left to its right. With A and B its ends, the centre is left of it where A x B > 0, and s where
/// A x B + s x A - s x B > 0; the segment passes between its ends where s x A and s x B differ in sign, and in front.
inline Count crossings(const std::vector<Edge>& edges, const glm::dvec3& p, const glm::dvec2& s) {
  Count sum;
  for (const Edge& edge : edges) {
    const int m = multiplicity(edge, p);
    for (const Edge::Face& face : edge.faces) sum.decide(face.plane.value_at(p), glm::length(p));
    const Projected shadow = project(edge.a, edge.b, p);
    if (!shadow.seen || m == 0) continue;
    const double k = cross(shadow.a, shadow.b), by_a = cross(s, shadow.a), by_b = cross(s, shadow.b);
    const double scale = glm::length(shadow.a) * glm::length(shadow.b) + glm::length(s) * glm::length(shadow.b - shadow.a);
    const bool between = (by_a > 0.0) != (by_b > 0.0), centre_left = k > 0.0, s_left = k + by_a - by_b > 0.0;
    sum.decide(by_a, glm::length(s) * glm::length(shadow.a));
    sum.decide(by_b, glm::length(s) * glm::length(shadow.b));
    sum.decide(k, scale);
    sum.decide(k + by_a - by_b, scale);
    if (between && centre_left != s_left) sum.value += centre_left ? -m : m;
  }
  return sum;
}

/// The number of triangles that the open segment from p to q crosses: those whose plane parts its ends, and about whose three
/// edges it turns alike.
inline Count surfaces_between(const Triangles& mesh, const glm::dvec3& p, const glm::dvec3& q) {
  Count count;
  const glm::dvec3 along = q - p;
  for (std::size_t t = 0; t < mesh.corners.size(); ++t) {
    const glm::dvec3 a = mesh.corner(t, 0) - p, b = mesh.corner(t, 1) - p, c = mesh.corner(t, 2) - p;
    const double u = glm::dot(glm::cross(a, b), along), v = glm::dot(glm::cross(b, c), along),
                 w = glm::dot(glm::cross(c, a), along);
    const auto scale = [&](const glm::dvec3& from, const glm::dvec3& to) {
      return glm::length(along) * std::max(glm::length(from), glm::length(to)) * glm::distance(from, to);
    };
    count.decide(u, scale(a, b));
    count.decide(v, scale(b, c));
    count.decide(w, scale(c, a));
    const Plane plane = mesh.plane(t);
    const double at_p = plane.value_at(p), at_q = plane.value_at(q);
    for (const double number : {at_p, at_q}) count.decide(number, glm::length(along));
    const bool inside = (u > 0.0) == (v > 0.0) && (v > 0.0) == (w > 0.0);
    count.value += inside && (at_p > 0.0) != (at_q > 0.0);
  }
  return count;
}

// ------------------------------------------------------------------------------------------------------------- light map

/// An edge in the light map: q and d = 1/z are linear between its ends.
struct MapEdge {
  glm::dvec2 a{0.0}, b{0.0};  ///< texels
  double da = 0.0, db = 0.0;
};

/// How far receivers within a square of the map, at 1/d_far and nearer, are from having an edge before their disc: from a point
/// of it at 1/d their distance less R (d - d_far), the minimum along the edge. Not above 0 where some have it. In steps along the
/// edge, so that it is a little too large.
inline double gap_to_square(const MapEdge& edge, const glm::dvec2& low, const glm::dvec2& high, double radius_px, double d_far) {
  double gap = std::numeric_limits<double>::infinity();
  constexpr int steps = 400;
  for (int i = 0; i <= steps; ++i) {
    const double t = static_cast<double>(i) / steps, d = edge.da + t * (edge.db - edge.da);
    if (d < d_far) continue;
    const glm::dvec2 at = edge.a + t * (edge.b - edge.a);
    gap = std::min(gap, glm::distance(at, glm::clamp(at, low, high)) - radius_px * (d - d_far));
  }
  return gap;
}

// ------------------------------------------------------------------------------------------------------------ shadow fins

/// A fin's half-width w(Lb, Lr) = R (1/Lb - 1/Lr) (Cai et al. 2006 Eq. 3, over Lb).
inline double half_width(double radius, double d_fin, double d_receiver) {
  return radius * (d_fin - d_receiver);
}

/// Cai et al. 2006 Eq. 5: the weight for this receiver, from the one for the reference plane at 1/d_far. 0 for receivers before
/// the fin.
inline double refined_weight(double s0, double d_fin, double d_receiver, double d_far) {
  if (d_receiver >= d_fin) return 0.0;
  return std::clamp(0.5 + half_width(1.0, d_fin, d_far) / half_width(1.0, d_fin, d_receiver) * (s0 - 0.5), 0.0, 0.5);
}

/// What two fins hide together that hide a and b of the light each: the same part where they face in the same direction (cosine
/// 0.3 and more), independent parts at a right angle, opposite parts where they face each other; linear in the cosine between
/// these.
inline double hidden_by_both(double a, double b, double cosine) {
  const double same = std::max(a, b), independent = 1.0 - (1.0 - a) * (1.0 - b), opposite = std::min(1.0, a + b);
  if (cosine < 0.0) return independent + (opposite - independent) * -cosine;
  return independent + (same - independent) * std::min(1.0, cosine / 0.3);
}

/// How deep one caster's outline may be: four times as far as its penumbra is wide on the far plane, at its own depth.
inline double caster_depth(double radius, double z, double zfar) {
  return 7.0 * half_width(radius, 1.0 / z, 1.0 / zfar) * z;
}

/// Cai et al. 2006 §4.1: sub-layers to layers that hold as many edges each, by where a sub-layer's middle edge stands in the
/// order of all.
inline std::vector<unsigned> equal_layers(const std::vector<unsigned>& counts, unsigned layers) {
  double total = 0.0, before = 0.0;
  for (const unsigned count : counts) total += count;
  std::vector<unsigned> out;
  for (const unsigned count : counts) {
    const double middle = before + 0.5 * count;
    out.push_back(std::min(layers - 1, static_cast<unsigned>(std::floor(middle * layers / std::max(total, 1.0) + 1e-9))));
    before += count;
  }
  return out;
}

/// Layers that end where the outline of the caster that begins each may end, times `thickness`: greedily, near to far.
inline std::vector<unsigned> layers_by_depth(const std::vector<unsigned>& counts, double znear, double zfar, double radius,
                                             double thickness) {
  std::vector<unsigned> out;
  unsigned layer = 0;
  double end = -1.0;
  const double step = (zfar - znear) / static_cast<double>(counts.size());
  for (std::size_t i = 0; i < counts.size(); ++i) {
    const double z = znear + (static_cast<double>(i) + 0.5) * step;
    if (counts[i] > 0 && z > end) {
      if (end >= 0.0) ++layer;
      end = z + thickness * caster_depth(radius, z, zfar);
    }
    out.push_back(layer);
  }
  return out;
}

}  // namespace halfshade::twins
