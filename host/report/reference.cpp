#include "report/reference.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <numeric>
#include <thread>

#include "light/light_model.hpp"
#include "scene/placement.hpp"

namespace halfshade {
namespace {

/// More than all that rounding in double precision adds up to here, as a part of the largest coordinate.
constexpr double rounding = 0x1p-44;
/// Boxes are grown by as much, so that no triangle on their border is lost.
constexpr double box_slack = 0x1p-46;
constexpr std::uint32_t leaf_size = 4;
/// A pixel's surface is found where depth and normal are off by less, in what rounding explains.
constexpr double most_misfit = 8.0;

double largest_of(const glm::dvec3& v) {
  return std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)});
}

/// Calls body(i) for 0 <= i < count, on all cores.
template <class Body>
void for_each_index(std::size_t count, Body&& body) {
  constexpr std::size_t chunk = 64;
  std::atomic<std::size_t> next{0};
  const auto work = [&] {
    for (std::size_t begin; (begin = next.fetch_add(chunk)) < count;)
      for (std::size_t i = begin; i < std::min(begin + chunk, count); ++i) body(i);
  };
  std::vector<std::thread> helpers;
  for (unsigned i = 1; i < std::thread::hardware_concurrency() && i * chunk < count; ++i) helpers.emplace_back(work);
  work();
  for (std::thread& helper : helpers) helper.join();
}

}  // namespace

LightDisc disc_towards(const Light& light, const glm::dvec3& receiver, const glm::dvec3& origin_ws) {
  const LightModel& model = model_of(light.type);
  const glm::dvec4 centre = model.centre(light, origin_ws);
  const double radius = disc_radius(light);
  if (!model.is_sphere) {
    const glm::dmat4 axes = light_axes(light);
    return {centre, radius * row_of(axes, 0), radius * row_of(axes, 1)};
  }
  // The axes of the face that the receiver lies in, turned as little as brings the face's axis to it.
  const glm::dvec3 from_light = receiver - glm::dvec3(centre);
  if (from_light == glm::dvec3(0.0)) return {centre, glm::dvec3(0.0), glm::dvec3(0.0)};
  const glm::dmat3 face = world_from_sphere_face(from_light);
  const glm::dvec3 towards = from_light / largest_of(from_light) / glm::length(from_light / largest_of(from_light));
  const auto turned = [&](const glm::dvec3& v) {
    return radius * (v - glm::dot(v, towards) / (1.0 + glm::dot(face[2], towards)) * (face[2] + towards));
  };
  return {centre, turned(face[0]), turned(face[1])};
}

/// From a along `along`: to a + along, or for ever.
struct Reference::Segment {
  glm::dvec3 a, along, inverse;
  bool ends;

  Segment(const glm::dvec3& from, const glm::dvec3& direction, bool has_end)
      : a(from), along(direction), inverse(1.0 / direction), ends(has_end) {}

  /// Whether it may meet a box. A NaN, of a border that it lies in, is taken for a meeting.
  bool meets(const Node& node) const {
    double enter = 0.0, leave = ends ? 1.0 : std::numeric_limits<double>::infinity();
    for (int i = 0; i < 3; ++i) {
      double near = (node.low[i] - a[i]) * inverse[i], far = (node.high[i] - a[i]) * inverse[i];
      if (inverse[i] < 0.0) std::swap(near, far);
      if (near > enter) enter = near;
      if (far < leave) leave = far;
    }
    return !(enter * (1.0 - 0x1p-50) > leave * (1.0 + 0x1p-50));
  }

  /// Where it meets a triangle, its border included: 0 at a, 1 at a + along. By the volumes that it spans with the triangle's
  /// edges: neighbours decide alike about the edge they share. Nothing where it lies in the triangle's plane.
  std::optional<double> meet(const Triangle& t) const {
    const glm::dvec3 p = t.p - a, q = t.q - a, r = t.r - a;
    const double u = glm::dot(glm::cross(r, q), along), v = glm::dot(glm::cross(p, r), along),
                 w = glm::dot(glm::cross(q, p), along);
    if ((u < 0 || v < 0 || w < 0) && (u > 0 || v > 0 || w > 0)) return {};
    if (u + v + w == 0.0) return {};
    const glm::dvec3 normal = glm::cross(t.q - t.p, t.r - t.p);
    const double across = glm::dot(normal, along);
    if (across == 0.0) return {};
    // From the nearest corner, whose part in the rounding is least.
    const glm::dvec3& corner =
        largest_of(p) < largest_of(q) ? (largest_of(p) < largest_of(r) ? p : r) : (largest_of(q) < largest_of(r) ? q : r);
    return glm::dot(normal, corner) / across;
  }

  /// Whether a triangle lies flush with its end: then it does not hide that.
  bool ends_on(const Triangle& t) const {
    const glm::dvec3 b = a + along, normal = glm::cross(t.q - t.p, t.r - t.p);
    const double size = std::max({largest_of(t.p - b), largest_of(t.q - b), largest_of(t.r - b), largest_of(along)});
    return std::abs(glm::dot(normal, t.p - b)) <= rounding * size * glm::length(normal);
  }
};

Reference::Reference(const Scene& scene) : origin_ws_(scene.camera.position) {
  for (const SceneMesh& mesh : scene.meshes) {
    glm::dmat4 to_world = world_from_local(mesh);
    to_world[3] -= glm::dvec4(origin_ws_, 0.0);
    std::vector<glm::dvec3> corners;
    for (const glm::vec3& p : mesh.mesh->positions) corners.emplace_back(to_world * glm::dvec4(p, 1.0));
    for (const glm::uvec3& t : mesh.mesh->triangles)
      triangles_.push_back({corners[t.x], corners[t.y], corners[t.z], mesh.casts_shadow, mesh.receives_shadow});
  }
  std::vector<glm::dvec3> middles;
  for (const Triangle& t : triangles_) middles.push_back((t.p + t.q + t.r) / 3.0);
  if (!triangles_.empty()) build(middles, 0, static_cast<std::uint32_t>(triangles_.size()));
}

/// Splits at the middle triangle along the widest axis.
void Reference::build(std::vector<glm::dvec3>& middles, std::uint32_t first, std::uint32_t last) {
  const std::size_t index = nodes_.size();
  Node node{.low = glm::dvec3(1e300), .high = glm::dvec3(-1e300), .first = first, .count = last - first};
  glm::dvec3 low(1e300), high(-1e300);
  for (std::uint32_t i = first; i < last; ++i) {
    const Triangle& t = triangles_[i];
    node.low = glm::min(node.low, glm::min(t.p, glm::min(t.q, t.r)));
    node.high = glm::max(node.high, glm::max(t.p, glm::max(t.q, t.r)));
    low = glm::min(low, middles[i]);
    high = glm::max(high, middles[i]);
  }
  const double slack = box_slack * std::max(largest_of(node.low), largest_of(node.high));
  node.low -= slack;
  node.high += slack;
  nodes_.push_back(node);
  const glm::dvec3 size = high - low;
  if (node.count <= leaf_size || largest_of(size) == 0.0) return;

  const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
  std::vector<std::uint32_t> order(node.count);
  std::iota(order.begin(), order.end(), first);
  const std::uint32_t half = node.count / 2;
  std::nth_element(order.begin(), order.begin() + half, order.end(),
                   [&](std::uint32_t a, std::uint32_t b) { return middles[a][axis] < middles[b][axis]; });
  std::vector<Triangle> triangles;
  std::vector<glm::dvec3> in_order;
  for (const std::uint32_t i : order) {
    triangles.push_back(triangles_[i]);
    in_order.push_back(middles[i]);
  }
  std::copy(triangles.begin(), triangles.end(), triangles_.begin() + first);
  std::copy(in_order.begin(), in_order.end(), middles.begin() + first);
  build(middles, first, first + half);
  nodes_[index].first = static_cast<std::uint32_t>(nodes_.size());
  nodes_[index].count = 0;
  build(middles, first + half, last);
}

/// Calls visit(number of a triangle) for those that a segment may meet, until one returns true.
template <class Visit>
bool Reference::any_on(const Segment& segment, Visit&& visit) const {
  if (nodes_.empty()) return false;
  std::array<std::uint32_t, 64> stack;  // halves: no deeper than the bits of a count
  std::size_t depth = 0;
  for (std::uint32_t at = 0;;) {
    const Node& node = nodes_[at];
    if (segment.meets(node)) {
      if (node.count == 0) {
        stack[depth++] = node.first;
        ++at;
        continue;
      }
      for (std::uint32_t i = node.first; i < node.first + node.count; ++i)
        if (visit(i)) return true;
    }
    if (depth == 0) return false;
    at = stack[--depth];
  }
}

bool Reference::is_occluded(const Segment& segment, std::uint32_t own) const {
  return any_on(segment, [&](std::uint32_t i) {
    const Triangle& t = triangles_[i];
    if (!t.casts || i == own) return false;
    const std::optional<double> at = segment.meet(t);
    if (!at || !(*at > 0.0)) return false;
    return !segment.ends || (*at < 1.0 && !segment.ends_on(t));
  });
}

bool Reference::is_occluded(const glm::dvec3& a, const glm::dvec3& b, std::uint32_t own) const {
  return is_occluded(Segment(a, b - a, true), own);
}

bool Reference::is_occluded_towards(const glm::dvec3& a, const glm::dvec3& direction, std::uint32_t own) const {
  return is_occluded(Segment(a, direction, false), own);
}

double Reference::visibility(const Light& light, const SurfacePoint& receiver, std::span<const glm::dvec2> points) const {
  const LightDisc disc = disc_towards(light, receiver.position, origin_ws_);
  const glm::dvec3 lifted = receiver.position + receiver.rounding * receiver.normal;
  const bool is_hidden_by_own = receiver.triangle != no_triangle && triangles_[receiver.triangle].casts;
  std::size_t seen = 0;
  for (const glm::dvec2& point : points) {
    const glm::dvec3 to = disc.at(point);
    const glm::dvec3 along = disc.centre.w == 0.0 ? to : to - lifted;
    if (is_hidden_by_own && glm::dot(receiver.normal, along) < 0.0) continue;  // below its horizon
    seen += !is_occluded(Segment(lifted, along, disc.centre.w != 0.0), receiver.triangle);
  }
  return static_cast<double>(seen) / static_cast<double>(points.size());
}

/// The place on a ray from the origin whose view-space z grows by 1, on the triangle that best explains what a pixel shows: whose
/// plane is at its depth and has its normal, and which covers the pixel's centre, or comes so near that the rasterizer's grid may
/// have taken it there.
std::optional<Reference::Seen> Reference::point_seen(const glm::dvec3& ray, const glm::dvec3& side, const glm::dvec3& up,
                                                     double depth, double tolerance, const glm::dvec3& normal) const {
  std::optional<Seen> best;
  for (const glm::dvec2 offset : {glm::dvec2(0, 0), glm::dvec2(1, 1), glm::dvec2(1, -1), glm::dvec2(-1, 1), glm::dvec2(-1, -1)}) {
    const double apart = offset == glm::dvec2(0, 0) ? 0.0 : 0.01;
    const Segment probe(glm::dvec3(0.0), ray + offset.x * side + offset.y * up, false);
    any_on(probe, [&](std::uint32_t i) {
      const Triangle& t = triangles_[i];
      if (!probe.meet(t)) return false;
      const glm::dvec3 cross = glm::cross(t.q - t.p, t.r - t.p);
      const double area = glm::length(cross), across = glm::dot(cross, ray);
      if (!(area > 0.0) || across == 0.0) return false;
      const glm::dvec3 n = across > 0.0 ? -cross / area : cross / area;
      const double at = glm::dot(cross, t.p) / across, slope = std::max(std::abs(across) / area / glm::length(ray), 1e-3);
      const double misfit = std::abs(at - depth) / (tolerance / slope) + 20.0 * glm::length(n - normal) + apart;
      if (best && misfit >= best->misfit) return false;
      const double size = std::max({largest_of(t.p), largest_of(t.q), largest_of(t.r), largest_of(at * ray)});
      best = Seen{{at * ray, n, i, rounding * size}, misfit};
      return false;
    });
  }
  return best;
}

SurfacePixels Reference::surface_pixels(const Camera& camera, std::span<const float> depth, std::span<const glm::vec4> normal_ws,
                                        const Light& light) const {
  const Frustum frustum = camera_frustum(camera);
  const glm::dmat3 world_from_view = glm::transpose(glm::dmat3(frustum.view_from_world));
  const double q_per_px = 2.0 * frustum.tan_half_y / camera.resolution.y;
  const std::size_t count = depth.size();
  std::vector<SurfacePoint> points(count);
  std::vector<double> off_surface(count);
  std::vector<glm::dvec3> views(count);
  std::vector<glm::vec4> normals(count, glm::vec4(0.0f));
  std::vector<char> placed(count, 1);
  for_each_index(count, [&](std::size_t i) {
    if (!(depth[i] > 0.0f)) return;
    const double qx = (static_cast<double>(i % camera.resolution.x) + 0.5) * q_per_px - frustum.tan_half_x;
    const double qy = frustum.tan_half_y - (static_cast<double>(i / camera.resolution.x) + 0.5) * q_per_px;
    // The rasterizer snaps vertices to 1/256 of a pixel and keeps depth in single precision.
    off_surface[i] = depth[i] * (q_per_px / 128.0 + 0x1p-21);
    const glm::dvec3 ray = world_from_view * glm::dvec3(qx, qy, 1.0);
    const double step = q_per_px / 128.0;
    const std::optional<Seen> seen =
        point_seen(ray, step * world_from_view[0], step * world_from_view[1], depth[i], off_surface[i], glm::dvec3(normal_ws[i]));
    placed[i] = seen && seen->misfit < most_misfit;
    if (!seen) return;
    points[i] = seen->point;
    views[i] = glm::normalize(ray);
    normals[i] = glm::vec4(glm::vec3(points[i].normal), triangles_[points[i].triangle].receives ? 1.0f : 0.0f);
  });

  // What rounding might make another kind of is left out.
  SurfacePixels result;
  for (const double sign : {0.0, -1.0, 1.0}) {
    std::vector<glm::dvec3> position_ws(count);
    for (std::size_t i = 0; i < count; ++i) {
      const double along = off_surface[i] / std::max(std::abs(glm::dot(views[i], points[i].normal)), 0.05);
      position_ws[i] = origin_ws_ + points[i].position + sign * along * views[i];
    }
    std::vector<PixelKind> kinds = pixel_kinds(position_ws, normals, light);
    if (sign == 0.0) result.kinds = kinds;
    for (std::size_t i = 0; i < count; ++i)
      if (kinds[i] != result.kinds[i]) result.kinds[i] = PixelKind::ignored;
  }
  for (std::size_t i = 0; i < count; ++i) {
    result.unplaced += !placed[i];
    if (result.kinds[i] != PixelKind::counted) continue;
    const glm::dvec3 travel = model_of(light.type).travel(light, origin_ws_ + points[i].position);
    if (!(-glm::dot(glm::normalize(travel), points[i].normal) > 1e-5)) {
      result.kinds[i] = PixelKind::ignored;
      continue;
    }
    result.pixels.push_back(static_cast<std::uint32_t>(i));
    result.points.push_back(points[i]);
    result.off_surface.push_back(off_surface[i]);
    result.view.push_back(views[i]);
  }
  return result;
}

std::vector<float> Reference::visibility(const Light& light, const SurfacePixels& pixels,
                                         std::span<const glm::dvec2> points) const {
  std::vector<float> plane(pixels.kinds.size());
  for (std::size_t i = 0; i < plane.size(); ++i) plane[i] = pixels.kinds[i] == PixelKind::away ? 0.0f : 1.0f;
  for_each_index(pixels.pixels.size(), [&](std::size_t i) {
    plane[pixels.pixels[i]] = static_cast<float>(visibility(light, pixels.points[i], points));
  });
  return plane;
}

std::array<double, 2> Reference::visibility_range(const Light& light, const SurfacePixels& pixels, std::size_t index,
                                                  std::span<const glm::dvec2> points) const {
  const SurfacePoint& on = pixels.points[index];
  const glm::dvec3& view = pixels.view[index];
  const double off = pixels.off_surface[index];
  // Its depth may be wrong along the view ray by as much as takes it off the surface by `off`.
  const double along = off / std::max(std::abs(glm::dot(view, on.normal)), 0.02);
  // Sideways, single precision alone.
  const glm::dvec3 centre(disc_towards(light, on.position, origin_ws_).centre);
  const glm::dvec3 tangent = glm::cross(view, on.normal);
  const double length = glm::length(tangent);
  const glm::dvec3 side = length > 1e-6 ? tangent / length : glm::dvec3(0.0);
  const double sideways = 0x1p-21 * std::max(largest_of(on.position), largest_of(centre - on.position));
  std::array<double, 2> range{2.0, -1.0};
  for (const double depth_error : {-1.0, 0.0, 1.0})
    for (const double lift : {0.0, 1.0, 2.0})
      for (const double aside : {-1.0, 0.0, 1.0}) {
        SurfacePoint moved = on;
        moved.position += depth_error * along * view;
        // Never below its own surface: the renderer lifts it above.
        const double below = std::max(0.0, -glm::dot(moved.position - on.position, on.normal));
        moved.position += (lift * off + below) * on.normal + aside * sideways * side;
        // So far above it that it can see past its own triangle's border.
        if (lift > 0.0) moved.triangle = no_triangle;
        const double seen = visibility(light, moved, points);
        range = {std::min(range[0], seen), std::max(range[1], seen)};
      }
  return range;
}

ReferenceFigures compare_with_reference(const Reference& reference, const Light& light, const SurfacePixels& pixels,
                                        std::span<const float> visibility, std::span<const glm::dvec2> points) {
  const std::vector<float> truth = reference.visibility(light, pixels, points);
  ReferenceFigures figures;
  figures.error = compare_visibility(visibility, truth, pixels.kinds);
  const double allowed = 1.5 / static_cast<double>(points.size());
  std::atomic<std::size_t> differing{0}, unexplained{0};
  for_each_index(pixels.pixels.size(), [&](std::size_t i) {
    const double seen = visibility[pixels.pixels[i]];
    if (std::abs(seen - truth[pixels.pixels[i]]) <= allowed) return;
    ++differing;
    const std::array<double, 2> range = reference.visibility_range(light, pixels, i, points);
    if (!(seen >= range[0] - allowed && seen <= range[1] + allowed)) ++unexplained;
  });
  figures.differing = differing;
  figures.unexplained = unexplained;
  return figures;
}

}  // namespace halfshade
