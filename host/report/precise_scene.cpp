#include "report/precise_scene.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "report/parallel.hpp"

// The test of sixteen segments at once, compiled for what the processor has.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define HALFSHADE_VECTOR_CLONES __attribute__((target_clones("avx512f", "avx2", "default")))
#else
#define HALFSHADE_VECTOR_CLONES
#endif

namespace halfshade {
namespace {

constexpr unsigned packet_size = PreciseScene::packet_size;

/// What boxes are padded by. Rays begin within 2 of the origin and hit within 4 of that, so that in single precision they are off
/// by less than a quarter of this.
constexpr float padding = 0x1p-19f;
/// Where rays begin at most.
constexpr double farthest_origin = 2.0;

/// Segments from one point, a field an array.
struct alignas(64) Directions {
  std::array<double, packet_size> x{}, y{}, z{};
};

/// A triangle relative to a point.
struct Corners {
  glm::dvec3 p, q, r;
};

/// Möller & Trumbore's volumes, as Platis & Theoharis use them: those that a segment spans with the triangle's edges have one
/// sign where it crosses. Two triangles compute that of a shared edge from the same numbers, and with opposite signs.
HALFSHADE_VECTOR_CLONES std::uint32_t crossings(const Corners& t, const Directions& d, double end) {
  const glm::dvec3 a = glm::cross(t.r, t.q), b = glm::cross(t.p, t.r), c = glm::cross(t.q, t.p);
  const glm::dvec3 n = glm::cross(t.q - t.p, t.r - t.p);
  const double height = glm::dot(n, t.p);
  std::array<std::uint32_t, packet_size> crosses;
  for (unsigned k = 0; k < packet_size; ++k) {
    const double u = a.x * d.x[k] + a.y * d.y[k] + a.z * d.z[k], v = b.x * d.x[k] + b.y * d.y[k] + b.z * d.z[k],
                 w = c.x * d.x[k] + c.y * d.y[k] + c.z * d.z[k], along = n.x * d.x[k] + n.y * d.y[k] + n.z * d.z[k];
    const bool inside = ((u >= 0.0) & (v >= 0.0) & (w >= 0.0)) | ((u <= 0.0) & (v <= 0.0) & (w <= 0.0));
    // At height / along of the segment, more than 0 and less than end; edge-on, nowhere.
    const bool within = (height * along > 0.0) & (std::abs(height) < end * std::abs(along)) & (u + v + w != 0.0);
    crosses[k] = (inside & within) ? 1u << k : 0u;
  }
  std::uint32_t bits = 0;
  for (const std::uint32_t bit : crosses) bits |= bit;
  return bits;
}

/// The segments that are traced, for Embree's callback. Embree hands `embree` back.
struct SegmentContext {
  RTCIntersectContext embree;
  glm::dvec3 point;
  const Directions* directions;
  double end;
};

/// A question for the height over a surface, in the scene's coordinates, and its answer.
struct HeightQuery {
  const PlacedMeshes* scene;
  glm::dvec3 point, normal;
  double reach, height;
  bool found;
};

Corners corners_of(const PlacedPositions& mesh, unsigned triangle, const glm::dvec3& from) {
  const glm::uvec3& t = mesh.mesh->triangles[triangle];
  return {mesh.positions[t.x] - from, mesh.positions[t.y] - from, mesh.positions[t.z] - from};
}

void bound_triangle(const RTCBoundsFunctionArguments* args) {
  const Corners t = corners_of(*static_cast<const PlacedPositions*>(args->geometryUserPtr), args->primID, glm::dvec3(0.0));
  const glm::vec3 low(glm::min(glm::min(t.p, t.q), t.r)), high(glm::max(glm::max(t.p, t.q), t.r));
  *args->bounds_o = {low.x - padding,  low.y - padding,  low.z - padding,  0.0f,
                     high.x + padding, high.y + padding, high.z + padding, 0.0f};
}

void block_segments(const RTCOccludedFunctionNArguments* args) {
  const auto& mesh = *static_cast<const PlacedPositions*>(args->geometryUserPtr);
  if (!mesh.casts_shadow) return;
  const auto& segments = *reinterpret_cast<const SegmentContext*>(args->context);
  const std::uint32_t bits = crossings(corners_of(mesh, args->primID, segments.point), *segments.directions, segments.end);
  if (bits == 0) return;
  for (unsigned i = 0; i < args->N; ++i)
    if (args->valid[i] != 0 && (bits >> RTCRayN_id(args->ray, args->N, i) & 1u) != 0)
      RTCRayN_tfar(args->ray, args->N, i) = -std::numeric_limits<float>::infinity();
}

/// Takes the triangle's answer if it is the nearest so far. Returns false: the radius of the search stays.
bool answer_height(RTCPointQueryFunctionArguments* args) {
  auto& query = *static_cast<HeightQuery*>(args->userPtr);
  Corners t = corners_of(query.scene->meshes[args->geomID], args->primID, query.point);
  glm::dvec3 n = glm::cross(t.q - t.p, t.r - t.p);
  const double length = glm::length(n);
  if (!(length > 0.0)) return false;
  if (glm::dot(n, query.normal) < 0.0) {  // seen from its other side
    std::swap(t.q, t.r);
    n = -n;
  }
  n /= length;
  const double height = -glm::dot(n, t.p);
  if (glm::dot(n, query.normal) < 0.99 || std::abs(height) > (query.found ? std::abs(query.height) : query.reach)) return false;
  // Beside the triangle by as little as it may be over it, a point still is this one's.
  const auto beside = [&](const glm::dvec3& from, const glm::dvec3& to) {
    return -glm::dot(glm::cross(from, to), n) > query.reach * glm::length(to - from);
  };
  if (beside(t.p, t.q) || beside(t.q, t.r) || beside(t.r, t.p)) return false;
  query.height = height;
  query.found = true;
  return false;
}

}  // namespace

PreciseScene::PreciseScene(const Scene& scene, unsigned threads)
    : placed_(place_meshes(scene, false)), threads_(thread_count(threads)), tree_(threads_) {
  for (PlacedPositions& mesh : placed_.meshes) {
    RTCGeometry geometry = rtcNewGeometry(tree_.device(), RTC_GEOMETRY_TYPE_USER);
    rtcSetGeometryUserPrimitiveCount(geometry, static_cast<unsigned>(mesh.mesh->triangles.size()));
    rtcSetGeometryUserData(geometry, &mesh);
    rtcSetGeometryBoundsFunction(geometry, bound_triangle, nullptr);
    rtcSetGeometryOccludedFunction(geometry, block_segments);
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(tree_.scene(), geometry);
    rtcReleaseGeometry(geometry);
  }
  tree_.commit();
}

double PreciseScene::height_over_surface(const glm::dvec3& point_ws, const glm::dvec3& normal_ws, double reach) const {
  HeightQuery asked{&placed_, (point_ws - origin_ws()) / unit(), normal_ws, reach / unit(), 0.0, false};
  const glm::vec3 at(asked.point);
  RTCPointQuery query{at.x, at.y, at.z, 0.0f, static_cast<float>(asked.reach)};
  RTCPointQueryContext context;
  rtcInitPointQueryContext(&context);
  rtcPointQuery(tree_.scene(), &query, &context, answer_height, &asked);
  return asked.height * unit();
}

unsigned PreciseScene::blocked(const glm::dvec3& point, std::span<const glm::dvec3> directions, bool endless) const {
  constexpr double infinity = std::numeric_limits<double>::infinity();
  Directions fields;
  SegmentContext context{{}, point, &fields, endless ? infinity : 1.0 - open_end};
  rtcInitIntersectContext(&context.embree);
  context.embree.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;

  // From far away rays begin nearer, still before all that there is, where single precision is finer than the padding.
  const double distance = glm::length(point), ahead = distance > farthest_origin ? distance - std::sqrt(3.0) - padding : 0.0;
  RTCRay16 ray{};
  alignas(64) int valid[packet_size] = {};
  for (unsigned k = 0; k < directions.size(); ++k) {
    const glm::dvec3& direction = directions[k];
    fields.x[k] = direction.x;
    fields.y[k] = direction.y;
    fields.z[k] = direction.z;
    const double begin = ahead > 0.0 ? ahead / glm::length(direction) : 0.0;
    const glm::dvec3 origin = point + begin * direction;
    ray.org_x[k] = static_cast<float>(origin.x);
    ray.org_y[k] = static_cast<float>(origin.y);
    ray.org_z[k] = static_cast<float>(origin.z);
    ray.dir_x[k] = static_cast<float>(direction.x);
    ray.dir_y[k] = static_cast<float>(direction.y);
    ray.dir_z[k] = static_cast<float>(direction.z);
    ray.tfar[k] = static_cast<float>(endless ? infinity : 1.0 - begin);
    ray.mask[k] = ~0u;
    ray.id[k] = k;
    valid[k] = ray.tfar[k] > 0.0f ? -1 : 0;
  }
  rtcOccluded16(valid, tree_.scene(), &context.embree, &ray);
  unsigned blocked = 0;
  for (unsigned k = 0; k < directions.size(); ++k) blocked += valid[k] != 0 && ray.tfar[k] < 0.0f;
  return blocked;
}

}  // namespace halfshade
