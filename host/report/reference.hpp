// Visibility by segments against triangles, all in double precision: what tells who is right where a tree in single precision and
// a method disagree, and the truth of the hard cases. Slower than rays.hpp by an order of magnitude, and
// sure from tiny scenes to huge ones, near the world's origin and far from it.
#pragma once

#include <array>
#include <glm/glm.hpp>
#include <optional>
#include <span>
#include <vector>

#include "halfshade/halfshade.hpp"
#include "light/samples.hpp"
#include "report/error_figures.hpp"

namespace halfshade {

/// A light as one receiver sees it: the point (x, y) of its unit disc is centre + x right + y up, where w = 1, or of w = 0 the
/// direction that leads to it.
struct LightDisc {
  glm::dvec4 centre;
  glm::dvec3 right, up;

  glm::dvec3 at(const glm::dvec2& point) const { return glm::dvec3(centre) + point.x * right + point.y * up; }
};

/// The disc of `light` that faces a receiver, both relative to `origin_ws`. Flat lights show the same to all.
LightDisc disc_towards(const Light& light, const glm::dvec3& receiver, const glm::dvec3& origin_ws);

/// Of points that belong to none, or to an unknown one.
inline constexpr std::uint32_t no_triangle = ~0u;

/// A point on a surface.
struct SurfacePoint {
  glm::dvec3 position;                   ///< relative to Reference::origin_ws, on the surface
  glm::dvec3 normal;                     ///< unit, on the side that is seen
  std::uint32_t triangle = no_triangle;  ///< whose point it is, if that is known
  double rounding = 0.0;                 ///< how far it may be off by arithmetic in double precision
};

/// The receivers of a frame for one light.
struct SurfacePixels {
  std::vector<PixelKind> kinds;       ///< of each pixel; those that rounding could make another kind of are ignored
  std::vector<std::uint32_t> pixels;  ///< the counted ones
  std::vector<SurfacePoint> points;   ///< of `pixels`
  std::vector<double> off_surface;    ///< of `pixels`: how far the frame's own positions may be off the surface
  std::vector<glm::dvec3> view;       ///< of `pixels`: unit, the direction in which the camera sees them
  /// Pixels whose depth is off the surfaces there by more than rounding explains, or that show something where no triangle is
  /// (those are left out). Expected 0.
  std::size_t unplaced = 0;
};

/// A scene's triangles in a tree. Coordinates are relative to `origin_ws`, where the camera is.
class Reference {
 public:
  explicit Reference(const Scene& scene);

  const glm::dvec3& origin_ws() const { return origin_ws_; }
  std::size_t triangle_count() const { return triangles_.size(); }

  /// Whether the open segment from a to b meets a triangle that casts shadows, its border included. Triangles that share an edge
  /// decide alike about it. What lies in a plane with the segment hides nothing. `own` is a triangle that a lies on: it hides
  /// what lies below it.
  bool is_occluded(const glm::dvec3& a, const glm::dvec3& b, std::uint32_t own = no_triangle) const;
  /// The same for the ray from a in a direction.
  bool is_occluded_towards(const glm::dvec3& a, const glm::dvec3& direction, std::uint32_t own = no_triangle) const;

  /// The fraction of `points` (in units of the light's disc_radius, see light_points) that a receiver sees.
  double visibility(const Light& light, const SurfacePoint& receiver, std::span<const glm::dvec2> points) const;

  /// Where the pixels of a frame lie: each on the triangle that the frame's depth and normal tell, in double precision.
  SurfacePixels surface_pixels(const Camera& camera, std::span<const float> depth, std::span<const glm::vec4> normal_ws,
                               const Light& light) const;

  /// A plane: the visibility of counted pixels, 1 for those ignored, 0 for those turned away.
  std::vector<float> visibility(const Light& light, const SurfacePixels& pixels, std::span<const glm::dvec2> points) const;

  /// The least and the largest visibility of a pixel (an index into pixels.points), its receiver anywhere that the renderer may
  /// take it to be: as far off its surface as its depth may be wrong, and lifted by as much again.
  std::array<double, 2> visibility_range(const Light& light, const SurfacePixels& pixels, std::size_t index,
                                         std::span<const glm::dvec2> points) const;

 private:
  struct Triangle {
    glm::dvec3 p, q, r;
    bool casts, receives;
  };
  /// A box with what it holds: two nodes, the first being the next; or `count` triangles.
  struct Node {
    glm::dvec3 low, high;
    std::uint32_t first = 0, count = 0;  ///< of triangles; where count is 0, `first` is the second child
  };
  struct Segment;

  void build(std::vector<glm::dvec3>& middles, std::uint32_t first, std::uint32_t last);
  template <class Visit>
  bool any_on(const Segment& segment, Visit&& visit) const;
  bool is_occluded(const Segment& segment, std::uint32_t own) const;
  struct Seen {
    SurfacePoint point;
    double misfit;  ///< of depth and normal, in what rounding explains
  };
  std::optional<Seen> point_seen(const glm::dvec3& ray, const glm::dvec3& side, const glm::dvec3& up, double depth,
                                 double tolerance, const glm::dvec3& normal) const;

  glm::dvec3 origin_ws_;
  std::vector<Triangle> triangles_;
  std::vector<Node> nodes_;
};

/// How a plane of visibility compares with the reference's at the same points of the light.
struct ReferenceFigures {
  ErrorFigures error;
  std::size_t differing = 0;    ///< pixels off by more than one and a half points
  std::size_t unexplained = 0;  ///< of these, those that no place of the receiver within the G-buffer's tolerance makes up for
};

ReferenceFigures compare_with_reference(const Reference& reference, const Light& light, const SurfacePixels& pixels,
                                        std::span<const float> visibility, std::span<const glm::dvec2> points);

}  // namespace halfshade
