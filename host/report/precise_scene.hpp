// A scene's triangles for rays that decide in double precision: Embree finds, by boxes that are padded for its single precision,
// which triangles a segment may cross; whether it does is decided here, relative to the segment's beginning.
//
// Embree's own test errs by the rounding of the triangle's corners, however near the ray is: a floor of 10,000 units shadows what
// stands on it. Here a floor of any size does not, and neighbours decide alike about the edge that they share.
#pragma once

#include <glm/glm.hpp>
#include <span>

#include "halfshade/halfshade.hpp"
#include "report/embree_tree.hpp"

namespace halfshade {

/// All triangles of a scene in a tree, in the coordinates of PlacedMeshes. It stays where it is: Embree points into it.
class PreciseScene {
 public:
  /// Builds the tree on `threads` threads, 0 for all cores. Throws DeviceError for Embree's errors.
  explicit PreciseScene(const Scene& scene, unsigned threads = 0);
  PreciseScene(const PreciseScene&) = delete;
  PreciseScene& operator=(const PreciseScene&) = delete;

  const glm::dvec3& origin_ws() const { return placed_.origin_ws; }
  double unit() const { return placed_.unit; }
  unsigned threads() const { return threads_; }

  /// How high a point lies over the triangle that it is on, along the unit normal of its side: that of all within `reach` whose
  /// own normal is as good as this which is nearest. World space. 0 where there is none.
  double height_over_surface(const glm::dvec3& point_ws, const glm::dvec3& normal_ws, double reach) const;

  /// How many segments are traced together.
  static constexpr unsigned packet_size = 16;

  /// How many of the segments from `point` to point + direction cross a triangle of a caster, of packet_size at most. `point` and
  /// the directions are in this scene's coordinates. Segments are open: what they begin on or end on does not count, nor does
  /// what is nearer to their end than open_end of them. `endless`: they do not end.
  unsigned blocked(const glm::dvec3& point, std::span<const glm::dvec3> directions, bool endless) const;

  /// The part of a segment before the light within which a surface is taken to bear the light, not to block it. A lamp lies in
  /// its ceiling by the rounding of single-precision coordinates.
  static constexpr double open_end = 0x1p-20;

 private:
  PlacedMeshes placed_;  ///< by Embree's numbers of them
  unsigned threads_;
  EmbreeTree tree_;
};

}  // namespace halfshade
