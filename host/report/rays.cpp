#include "report/rays.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>

#include "light/light_model.hpp"
#include "report/parallel.hpp"
#include "report/ray_disc.hpp"
#include "report/timing.hpp"

namespace halfshade {
namespace {

constexpr int packet_size = 16;

/// Embree's coordinates err by the rounding of the farthest corner, and its triangles with them: rays begin at least as high as
/// that over their surface, and end that much before the light, which a surface may bear.
constexpr float rounding = 0x1p-21f;
constexpr float light_end = 1.0f - 0x1p-14f;

/// A pattern as two arrays, padded to whole packets.
struct Pattern {
  std::vector<float> x, y;
  unsigned count = 0;
};

Pattern padded(const std::vector<glm::dvec2>& samples) {
  Pattern pattern;
  pattern.count = static_cast<unsigned>(samples.size());
  for (const glm::dvec2& sample : samples) {
    pattern.x.push_back(static_cast<float>(sample.x));
    pattern.y.push_back(static_cast<float>(sample.y));
  }
  pattern.x.resize((samples.size() + packet_size - 1) / packet_size * packet_size);
  pattern.y.resize(pattern.x.size());
  return pattern;
}

/// Traces one light's shadow rays in packets. One a thread.
class Tracer {
 public:
  Tracer(const RayScene& scene, const Light& light, const RayReceivers& receivers, std::optional<std::uint32_t> turn_seed)
      : scene_(scene),
        per_unit_(1.0 / scene.unit()),
        disc_(disc_of<float>(light, scene.origin_ws(), scene.unit())),
        receivers_(receivers),
        turn_seed_(turn_seed) {
    rtcInitIntersectContext(&context_);
    context_.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
    std::fill(std::begin(ray_.tnear), std::end(ray_.tnear), 0.0f);
    std::fill(std::begin(ray_.time), std::end(ray_.time), 0.0f);
    std::fill(std::begin(ray_.mask), std::end(ray_.mask), ~0u);
    std::fill(std::begin(ray_.flags), std::end(ray_.flags), 0u);
  }

  /// How many samples of the pattern receiver i sees: whole packets a pixel.
  unsigned lit_samples(std::size_t i, const Pattern& pattern) {
    const glm::vec3 p = origin_of(i);
    const DiscAxes<float> axes = turned_axes(p, receivers_.pixels[i]);
    unsigned lit = 0;
    for (unsigned first = 0; first < pattern.count; first += packet_size) {
      const int count = static_cast<int>(std::min<unsigned>(packet_size, pattern.count - first));
      for (int k = 0; k < packet_size; ++k) aim(k, p, axes, pattern.x[first + k], pattern.y[first + k]);
      lit += lit_of_packet(count);
    }
    return lit;
  }

  /// The same for receivers first .. last with a pattern of fewer than 16 samples: a packet holds several pixels.
  void lit_samples(std::size_t first, std::size_t last, const Pattern& pattern, unsigned* lit) {
    const std::size_t pixels_at_once = packet_size / pattern.count;
    for (std::size_t i = first; i < last; i += pixels_at_once) {
      const std::size_t end = std::min(i + pixels_at_once, last);
      int k = 0;
      for (std::size_t j = i; j < end; ++j) {
        const glm::vec3 p = origin_of(j);
        const DiscAxes<float> axes = turned_axes(p, receivers_.pixels[j]);
        for (unsigned s = 0; s < pattern.count; ++s) aim(k++, p, axes, pattern.x[s], pattern.y[s]);
      }
      lit_of_packet(k);
      k = 0;
      for (std::size_t j = i; j < end; ++j) {
        unsigned seen = 0;
        for (unsigned s = 0; s < pattern.count; ++s) seen += ray_.tfar[k++] >= 0.0f;
        lit[j - first] = seen;
      }
    }
  }

 private:
  glm::vec3 origin_of(std::size_t i) const {
    const glm::vec3 p((receivers_.points_ws[i] - scene_.origin_ws()) * per_unit_);
    const float needed = rounding * std::max({1.0f, std::abs(p.x), std::abs(p.y), std::abs(p.z)});
    return p + std::max(0.0f, needed - static_cast<float>(receivers_.lifts[i] * per_unit_)) * receivers_.normals_ws[i];
  }

  DiscAxes<float> turned_axes(const glm::vec3& p, std::uint32_t pixel) const {
    const DiscAxes<float> axes = axes_of(disc_, p);
    if (!turn_seed_) return axes;
    const auto angle = static_cast<float>(turn_of(pixel, *turn_seed_));
    const float c = std::cos(angle), s = std::sin(angle);
    return {c * axes.x + s * axes.y, c * axes.y - s * axes.x};
  }

  void aim(int k, const glm::vec3& p, const DiscAxes<float>& axes, float x, float y) {
    ray_.org_x[k] = p.x;
    ray_.org_y[k] = p.y;
    ray_.org_z[k] = p.z;
    ray_.dir_x[k] = disc_.centre.x + x * axes.x.x + y * axes.y.x - disc_.w * p.x;
    ray_.dir_y[k] = disc_.centre.y + x * axes.x.y + y * axes.y.y - disc_.w * p.y;
    ray_.dir_z[k] = disc_.centre.z + x * axes.x.z + y * axes.y.z - disc_.w * p.z;
  }

  /// Traces the first `count` rays, up to the light. tfar is negative where one is blocked.
  unsigned lit_of_packet(int count) {
    alignas(64) int valid[packet_size];
    for (int k = 0; k < packet_size; ++k) {
      valid[k] = k < count ? -1 : 0;
      ray_.tfar[k] = disc_.w != 0.0f ? light_end : std::numeric_limits<float>::infinity();
    }
    rtcOccluded16(valid, scene_.handle(), &context_, &ray_);
    unsigned lit = 0;
    for (int k = 0; k < count; ++k) lit += ray_.tfar[k] >= 0.0f;
    return lit;
  }

  const RayScene& scene_;
  double per_unit_;
  RayDisc<float> disc_;
  const RayReceivers& receivers_;
  std::optional<std::uint32_t> turn_seed_;  ///< of each pixel's turn of the pattern; none: no turns
  RTCIntersectContext context_;
  alignas(64) RTCRay16 ray_;
};

}  // namespace

RayScene::RayScene(const Scene& scene, unsigned threads) : threads_(thread_count(threads)), tree_(threads_) {
  const Clock::time_point begin = Clock::now();
  const PlacedMeshes placed = place_meshes(scene, true);
  origin_ws_ = placed.origin_ws;
  unit_ = placed.unit;
  for (const PlacedPositions& mesh : placed.meshes) {
    const std::vector<glm::uvec3>& triangles = mesh.mesh->triangles;
    RTCGeometry geometry = rtcNewGeometry(tree_.device(), RTC_GEOMETRY_TYPE_TRIANGLE);
    auto* vertices = static_cast<glm::vec3*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                                                     sizeof(glm::vec3), mesh.positions.size()));
    auto* corners = static_cast<glm::uvec3*>(
        rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, sizeof(glm::uvec3), triangles.size()));
    if (vertices != nullptr && corners != nullptr) {
      std::ranges::transform(mesh.positions, vertices, [](const glm::dvec3& p) { return glm::vec3(p); });
      std::ranges::copy(triangles, corners);
      rtcCommitGeometry(geometry);
      rtcAttachGeometry(tree_.scene(), geometry);
    }
    rtcReleaseGeometry(geometry);
  }
  tree_.commit();
  build_ms_ = ms_since(begin);
}

std::vector<glm::dvec2> pattern_of(const Light& light, const RaySettings& settings) {
  if (disc_radius(light) <= 0.0) return disc_samples(1);
  return settings.pattern.empty() ? light_points(light, settings.samples, settings.seed).points : settings.pattern;
}

std::vector<float> untraced_visibility(const RayReceivers& receivers) {
  std::vector<float> visibility(receivers.kinds.size());
  for (std::size_t i = 0; i < visibility.size(); ++i) visibility[i] = receivers.kinds[i] == PixelKind::away ? 0.0f : 1.0f;
  return visibility;
}

std::vector<float> trace_visibility(const RayScene& scene, const Light& light, const RayReceivers& receivers,
                                    const RaySettings& settings) {
  std::vector<float> visibility = untraced_visibility(receivers);
  const bool is_point = disc_radius(light) <= 0.0, turns = settings.rotate && model_of(light.shape).is_round;
  const Pattern first = padded(pattern_of(light, settings));
  const Pattern more =
      padded(is_point || settings.more_samples == 0 ? std::vector<glm::dvec2>()
                                                    : light_points(light, settings.more_samples, settings.seed).points);

  constexpr std::size_t chunk = 1024;
  for_each_chunk(receivers.pixels.size(), chunk, scene.threads(), [&] {
    return [&, tracer = Tracer(scene, light, receivers, turns ? std::optional(settings.seed) : std::nullopt)](
               std::size_t begin, std::size_t end) mutable {
      std::array<unsigned, chunk> lit;
      if (first.count < packet_size)
        tracer.lit_samples(begin, end, first, lit.data());
      else
        for (std::size_t i = begin; i < end; ++i) lit[i - begin] = tracer.lit_samples(i, first);
      for (std::size_t i = begin; i < end; ++i) {
        unsigned seen = lit[i - begin], traced = first.count;
        if (more.count > 0 && seen != 0 && seen != traced) {
          seen += tracer.lit_samples(i, more);
          traced += more.count;
        }
        visibility[receivers.pixels[i]] = static_cast<float>(seen) / static_cast<float>(traced);
      }
    };
  });
  return visibility;
}

}  // namespace halfshade
