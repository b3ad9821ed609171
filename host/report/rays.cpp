#include "report/rays.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <limits>
#include <numbers>
#include <optional>
#include <thread>

#include "image/image_io.hpp"
#include "light/light_model.hpp"
#include "report/timing.hpp"
#include "scene/placement.hpp"

namespace halfshade {
namespace {

constexpr int packet_size = 16;
constexpr std::uint32_t truth_seed = 0x7275'7468;

/// A light's disc in Embree's coordinates: a point of it is centre + x right + y up, where x, y is of the unit disc. Of a
/// directional light (w = 0) these are directions, to where it comes from. A sphere light (radius > 0) shows each receiver a disc
/// of its own.
struct Disc {
  glm::vec3 centre, right, up;
  float w;
  float sphere_radius;
};

Disc disc_of(const Light& light, const glm::dvec3& origin_ws) {
  const LightModel& model = model_of(light.type);
  const glm::dvec4 centre = model.centre(light, origin_ws);
  if (model.is_sphere) return {glm::vec3(centre), {}, {}, 1.0f, static_cast<float>(disc_radius(light))};
  const glm::dmat4 light_from_world = light_axes(light);
  const auto axis = [&](int i) { return glm::dvec3(light_from_world[0][i], light_from_world[1][i], light_from_world[2][i]); };
  return {glm::vec3(centre), glm::vec3(axis(0) * disc_radius(light)), glm::vec3(axis(1) * disc_radius(light)),
          static_cast<float>(centre.w), 0.0f};
}

/// The disc of a sphere light that faces a receiver: the axes of the light's face that the receiver lies in, turned as little as
/// brings the face's axis to it.
void face_receiver(const glm::dvec3& from_light, double radius, glm::vec3* right, glm::vec3* up) {
  const glm::dmat3 world_from_face = world_from_sphere_face(from_light);
  const glm::dvec3 axis = world_from_face[2], towards = glm::normalize(from_light);
  const auto turned = [&](const glm::dvec3& v) {
    return glm::vec3(radius * (v - glm::dot(v, towards) / (1.0 + glm::dot(axis, towards)) * (axis + towards)));
  };
  *right = turned(world_from_face[0]);
  *up = turned(world_from_face[1]);
}

/// A pattern as two arrays, padded to whole packets.
struct Pattern {
  std::vector<float> x, y;
  unsigned count = 0;
};

Pattern pattern_of(const std::vector<glm::dvec2>& samples) {
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
  Tracer(const RayScene& scene, const Disc& disc, const RayReceivers& receivers, std::optional<std::uint32_t> turn_seed)
      : scene_(scene.handle()), disc_(disc), receivers_(receivers), turn_seed_(turn_seed) {
    rtcInitIntersectContext(&context_);
    context_.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
    std::fill(std::begin(ray_.tnear), std::end(ray_.tnear), 0.0f);
    std::fill(std::begin(ray_.time), std::end(ray_.time), 0.0f);
    std::fill(std::begin(ray_.mask), std::end(ray_.mask), ~0u);
    std::fill(std::begin(ray_.flags), std::end(ray_.flags), 0u);
  }

  /// How many samples of the pattern receiver i sees: whole packets a pixel.
  unsigned lit_samples(std::size_t i, const Pattern& pattern) {
    const glm::vec3 p = receivers_.origins[i];
    const Axes axes = axes_of(i);
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
        const Axes axes = axes_of(j);
        for (unsigned s = 0; s < pattern.count; ++s) aim(k++, receivers_.origins[j], axes, pattern.x[s], pattern.y[s]);
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
  struct Axes {
    glm::vec3 x, y;
  };

  Axes axes_of(std::size_t i) const {
    Axes axes{disc_.right, disc_.up};
    if (disc_.sphere_radius > 0.0f)
      face_receiver(glm::dvec3(receivers_.origins[i] - disc_.centre), disc_.sphere_radius, &axes.x, &axes.y);
    if (!turn_seed_) return axes;
    const auto angle = static_cast<float>(2.0 * std::numbers::pi * unit_of(hash_of(receivers_.pixels[i] ^ hash_of(*turn_seed_))));
    const float c = std::cos(angle), s = std::sin(angle);
    return {c * axes.x + s * axes.y, c * axes.y - s * axes.x};
  }

  void aim(int k, const glm::vec3& p, const Axes& axes, float x, float y) {
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
      ray_.tfar[k] = disc_.w != 0.0f ? 1.0f : std::numeric_limits<float>::infinity();
    }
    rtcOccluded16(valid, scene_, &context_, &ray_);
    unsigned lit = 0;
    for (int k = 0; k < count; ++k) lit += ray_.tfar[k] >= 0.0f;
    return lit;
  }

  RTCScene scene_;
  Disc disc_;
  const RayReceivers& receivers_;
  std::optional<std::uint32_t> turn_seed_;  ///< of each pixel's turn of the pattern; none: no turns
  RTCIntersectContext context_;
  alignas(64) RTCRay16 ray_;
};

/// Two words of a hash that is not meant to resist anyone.
class Hasher {
 public:
  template <class T>
  void add(std::span<const T> values) {
    static_assert(std::is_trivially_copyable_v<T>);
    add_bytes(reinterpret_cast<const char*>(values.data()), values.size_bytes());
  }
  template <class T>
  void add(const T& value) {
    add(std::span<const T>(&value, 1));
  }
  std::string text() const { return fmt::format("{:016x}{:016x}", a_, b_); }

 private:
  void add_bytes(const char* bytes, std::size_t size) {
    mix(size);
    for (; size >= 8; bytes += 8, size -= 8) {
      std::uint64_t word;
      std::memcpy(&word, bytes, 8);
      mix(word);
    }
    std::uint64_t rest = 0;
    std::memcpy(&rest, bytes, size);
    mix(rest);
  }
  void mix(std::uint64_t word) {
    a_ = (a_ ^ word) * 0x9e3779b97f4a7c15u;
    a_ ^= a_ >> 29;
    b_ = (std::rotl(b_, 31) + word) * 0xbf58476d1ce4e5b9u;
    b_ ^= b_ >> 32;
  }
  std::uint64_t a_ = 0x243f6a8885a308d3u, b_ = 0x13198a2e03707344u;
};

std::filesystem::path default_cache_folder() {
  const char* cache = std::getenv("XDG_CACHE_HOME");
  if (cache != nullptr && *cache == '/') return std::filesystem::path(cache) / "halfshade";
  const char* home = std::getenv("HOME");
  if (home != nullptr && *home == '/') return std::filesystem::path(home) / ".cache" / "halfshade";
  throw InputError("truth cache: expected XDG_CACHE_HOME or HOME in the environment; set one, or name a folder with --cache");
}

}  // namespace

RayScene::RayScene(const Scene& scene, unsigned threads)
    : threads_(threads > 0 ? threads : std::max(1u, std::thread::hardware_concurrency())) {
  const Clock::time_point begin = Clock::now();
  device_ = rtcNewDevice(fmt::format("threads={}", threads_).c_str());
  if (device_ == nullptr)
    throw DeviceError(fmt::format("Embree: no device (error {})", static_cast<int>(rtcGetDeviceError(nullptr))));
  scene_ = rtcNewScene(device_);
  rtcSetSceneFlags(scene_, RTC_SCENE_FLAG_ROBUST);

  // Relative to the casters' middle, so that single precision holds far from the world's origin.
  glm::dvec3 low(1e300), high(-1e300);
  std::vector<std::vector<glm::dvec3>> placed;
  for (const SceneMesh& mesh : scene.meshes) {
    if (!mesh.casts_shadow) continue;
    const glm::dmat4 to_world = world_from_local(mesh);
    std::vector<glm::dvec3>& positions = placed.emplace_back();
    positions.reserve(mesh.mesh->positions.size());
    for (const glm::vec3& p : mesh.mesh->positions) {
      positions.emplace_back(to_world * glm::dvec4(p, 1.0));
      low = glm::min(low, positions.back());
      high = glm::max(high, positions.back());
    }
  }
  origin_ws_ = placed.empty() ? scene.camera.target : (low + high) / 2.0;

  std::size_t caster = 0;
  for (const SceneMesh& mesh : scene.meshes) {
    if (!mesh.casts_shadow) continue;
    const std::vector<glm::dvec3>& positions = placed[caster++];
    const std::vector<glm::uvec3>& triangles = mesh.mesh->triangles;
    RTCGeometry geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_TRIANGLE);
    auto* vertices = static_cast<glm::vec3*>(
        rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, sizeof(glm::vec3), positions.size()));
    auto* corners = static_cast<glm::uvec3*>(
        rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, sizeof(glm::uvec3), triangles.size()));
    if (vertices != nullptr && corners != nullptr) {
      for (std::size_t i = 0; i < positions.size(); ++i) vertices[i] = glm::vec3(positions[i] - origin_ws_);
      std::copy(triangles.begin(), triangles.end(), corners);
      rtcCommitGeometry(geometry);
      rtcAttachGeometry(scene_, geometry);
    }
    rtcReleaseGeometry(geometry);
  }
  rtcCommitScene(scene_);
  build_ms_ = ms_since(begin);
  if (const RTCError error = rtcGetDeviceError(device_); error != RTC_ERROR_NONE) {
    rtcReleaseScene(scene_);
    rtcReleaseDevice(device_);
    throw DeviceError(
        fmt::format("Embree: building the tree failed (error {}); is there enough memory?", static_cast<int>(error)));
  }
}

RayScene::~RayScene() {
  rtcReleaseScene(scene_);
  rtcReleaseDevice(device_);
}

RayReceivers RayScene::receivers(const Camera& camera, std::span<const float> depth, std::span<const glm::vec4> normal_ws,
                                 const Light& light) const {
  const Frustum frustum = camera_frustum(camera);
  const glm::dmat3 world_from_view = glm::transpose(glm::dmat3(frustum.view_from_world));
  const double q_per_px = 2.0 * frustum.tan_half_y / camera.resolution.y;
  std::vector<glm::dvec3> positions(depth.size());
  std::vector<double> footprints(depth.size());
  std::vector<glm::vec4> normals(normal_ws.begin(), normal_ws.end());
  for (std::size_t i = 0; i < depth.size(); ++i) {
    const double z = depth[i];
    if (!(z > 0.0)) {
      normals[i].w = 0.0f;
      continue;
    }
    const double qx = (static_cast<double>(i % camera.resolution.x) + 0.5) * q_per_px - frustum.tan_half_x;
    const double qy = frustum.tan_half_y - (static_cast<double>(i / camera.resolution.x) + 0.5) * q_per_px;
    positions[i] = camera.position + world_from_view * (z * glm::dvec3(qx, qy, 1.0));
    // The rasterizer snaps vertices to 1/256 of a pixel and keeps depth in single precision.
    footprints[i] = z * (q_per_px / 128.0 + 0x1p-21);
  }
  return receivers(camera.resolution, positions, normals, light, footprints);
}

RayReceivers RayScene::receivers(glm::uvec2 resolution, std::span<const glm::dvec3> position_ws,
                                 std::span<const glm::vec4> normal_ws, const Light& light,
                                 std::span<const double> footprint) const {
  RayReceivers receivers;
  receivers.resolution = resolution;
  receivers.kinds = pixel_kinds(position_ws, normal_ws, light);
  if (receivers.kinds.size() != std::size_t{resolution.x} * resolution.y)
    throw InputError(fmt::format("receivers: {} points, expected {}x{}", receivers.kinds.size(), resolution.x, resolution.y));
  constexpr unsigned tile = 8;
  for (unsigned tile_y = 0; tile_y < resolution.y; tile_y += tile)
    for (unsigned tile_x = 0; tile_x < resolution.x; tile_x += tile)
      for (unsigned y = tile_y; y < std::min(tile_y + tile, resolution.y); ++y)
        for (unsigned x = tile_x; x < std::min(tile_x + tile, resolution.x); ++x) {
          const std::size_t i = std::size_t{y} * resolution.x + x;
          if (receivers.kinds[i] != PixelKind::counted) continue;
          // Lifted by what the point, or its single-precision coordinates, may be off the surface.
          // kernels/methods/exact/edge_lists.h lifts as far: where they differ, so do the samples that are seen from near
          // contacts.
          const glm::dvec3 p = position_ws[i] - origin_ws_;
          const double largest = std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)});
          const double lift = std::max(footprint.empty() ? 0.0 : footprint[i], 0x1p-21 * largest);
          receivers.pixels.push_back(static_cast<std::uint32_t>(i));
          receivers.origins.emplace_back(p + lift * glm::dvec3(normal_ws[i]));
        }
  return receivers;
}

std::vector<float> trace_visibility(const RayScene& scene, const Light& light, const RayReceivers& receivers,
                                    const RaySettings& settings, const std::function<void(double)>& progress) {
  std::vector<float> visibility(receivers.kinds.size());
  for (std::size_t i = 0; i < visibility.size(); ++i) visibility[i] = receivers.kinds[i] == PixelKind::away ? 0.0f : 1.0f;
  // All samples of a point are one.
  const bool is_point = disc_radius(light) <= 0.0, turns = settings.rotate && model_of(light.shape).is_round;
  const Pattern first = pattern_of(is_point                   ? disc_samples(1)
                                   : settings.pattern.empty() ? light_points(light, settings.samples, settings.seed).points
                                                              : settings.pattern);
  const Pattern more =
      pattern_of(is_point || settings.more_samples == 0 ? std::vector<glm::dvec2>()
                                                        : light_points(light, settings.more_samples, settings.seed).points);
  const Disc disc = disc_of(light, scene.origin_ws());

  constexpr std::size_t chunk = 1024;
  const std::size_t count = receivers.pixels.size();
  std::atomic<std::size_t> next{0};
  const auto work = [&](bool reports) {
    Tracer tracer(scene, disc, receivers, turns ? std::optional(settings.seed) : std::nullopt);
    std::array<unsigned, chunk> lit;
    for (std::size_t begin; (begin = next.fetch_add(chunk)) < count;) {
      if (reports && progress) progress(static_cast<double>(begin) / static_cast<double>(count));
      const std::size_t end = std::min(begin + chunk, count);
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
    }
  };
  if (progress) progress(0.0);
  std::vector<std::thread> helpers;
  for (unsigned i = 1; i < scene.threads(); ++i) helpers.emplace_back(work, false);
  work(true);
  for (std::thread& helper : helpers) helper.join();
  return visibility;
}

TruthCache::TruthCache(std::filesystem::path folder) : folder_(folder.empty() ? default_cache_folder() : std::move(folder)) {}

std::string truth_key(const Scene& scene, const RayScene& rays, const Light& light, const RayReceivers& receivers,
                      unsigned samples) {
  Hasher hasher;
  hasher.add(std::uint32_t{3});  // raised when tracing changes
  for (const SceneMesh& mesh : scene.meshes) {
    if (!mesh.casts_shadow) continue;
    hasher.add(world_from_local(mesh));
    hasher.add(std::span<const glm::vec3>(mesh.mesh->positions));
    hasher.add(std::span<const glm::uvec3>(mesh.mesh->triangles));
  }
  hasher.add(disc_of(light, rays.origin_ws()));
  hasher.add(samples);
  if (!model_of(light.shape).is_round) hasher.add(std::span<const glm::dvec2>(light_points(light, samples, truth_seed).points));
  hasher.add(receivers.resolution);
  hasher.add(std::span<const PixelKind>(receivers.kinds));
  hasher.add(std::span<const glm::vec3>(receivers.origins));
  return hasher.text();
}

std::vector<float> TruthCache::truth(const Scene& scene, const RayScene& rays, const Light& light, const RayReceivers& receivers,
                                     unsigned samples, const std::function<void(double)>& progress) const {
  const std::filesystem::path path = folder_ / fmt::format("truth-{}.f32", truth_key(scene, rays, light, receivers, samples));

  const std::size_t bytes = receivers.kinds.size() * sizeof(float);
  std::vector<float> plane(receivers.kinds.size());
  std::ifstream stored(path, std::ios::binary);
  std::error_code error;
  if (stored && std::filesystem::file_size(path, error) == bytes &&
      stored.read(reinterpret_cast<char*>(plane.data()), static_cast<std::streamsize>(bytes)))
    return plane;

  plane = trace_visibility(rays, light, receivers, {.samples = samples, .seed = truth_seed}, progress);
  std::filesystem::create_directories(folder_, error);
  if (error)
    throw InputError(
        fmt::format("{}: the truth cannot be kept ({}); choose another folder with --cache", folder_.string(), error.message()));
  write_file_whole(path, {reinterpret_cast<const unsigned char*>(plane.data()), bytes});
  return plane;
}

}  // namespace halfshade
