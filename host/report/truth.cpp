#include "report/truth.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <span>
#include <system_error>
#include <type_traits>
#include <utility>

#include "image/whole_file.hpp"
#include "light/light_model.hpp"
#include "light/samples.hpp"
#include "report/parallel.hpp"
#include "report/ray_disc.hpp"
#include "report/rays.hpp"
#include "scene/placement.hpp"

namespace halfshade {

namespace fs = std::filesystem;

namespace {

constexpr std::uint32_t truth_version = 4;  // raised when tracing or the files change
constexpr std::uint32_t truth_seed = 0x7275'7468;

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
    if (size > 0) std::memcpy(&rest, bytes, size);  // an empty span may have no address
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

/// Values and a checksum before them: a file that has been cut, lengthened or damaged is no truth.
std::string checksum_of(const std::vector<float>& values) {
  Hasher hasher;
  hasher.add(std::span<const float>(values));
  return hasher.text();
}

std::optional<std::vector<float>> read_values(const fs::path& path, std::size_t count) {
  std::vector<float> values(count);
  std::string checksum(checksum_of({}).size(), ' ');
  std::ifstream file(path, std::ios::binary);
  file.read(checksum.data(), static_cast<std::streamsize>(checksum.size()));
  file.read(reinterpret_cast<char*>(values.data()), static_cast<std::streamsize>(count * sizeof(float)));
  if (!file || file.peek() != std::ifstream::traits_type::eof() || checksum != checksum_of(values)) return std::nullopt;
  return values;
}

void write_values(const fs::path& path, const std::vector<float>& values) {
  std::error_code error;
  fs::create_directories(path.parent_path(), error);
  if (error)
    throw InputError(fmt::format("{}: the truth cannot be kept ({}); choose another folder with --cache",
                                 path.parent_path().string(), error.message()));
  const std::string checksum = checksum_of(values);
  std::vector<unsigned char> bytes(checksum.begin(), checksum.end());
  const auto* begin = reinterpret_cast<const unsigned char*>(values.data());
  bytes.insert(bytes.end(), begin, begin + values.size() * sizeof(float));
  remove_abandoned_files(path.parent_path(), [&](std::string_view name) { return name == path.filename(); });
  write_file_whole(path, bytes);
}

}  // namespace

TruthSamples::TruthSamples(const Light& light, unsigned samples)
    : pattern_(pattern_of(light, {.samples = samples, .seed = truth_seed})), turns_(model_of(light.shape).is_round) {}

std::vector<glm::dvec2> TruthSamples::of(std::uint32_t pixel) const {
  std::vector<glm::dvec2> points = pattern_;
  if (!turns_) return points;
  const double angle = turn_of(pixel, truth_seed), c = std::cos(angle), s = std::sin(angle);
  for (glm::dvec2& p : points) p = {c * p.x - s * p.y, s * p.x + c * p.y};
  return points;
}

std::vector<float> trace_truth(const PreciseScene& scene, const Light& light, const RayReceivers& receivers, std::size_t first,
                               std::size_t last, unsigned samples, const std::function<void(double)>& progress) {
  constexpr std::size_t chunk = 64, packet_size = PreciseScene::packet_size;
  const TruthSamples points(light, samples);
  const RayDisc<double> disc = disc_of<double>(light, scene.origin_ws(), scene.unit());
  const auto seen_from = [&](const glm::dvec3& receiver, std::uint32_t pixel) {
    const DiscAxes<double> axes = axes_of(disc, receiver);
    const glm::dvec3 to_centre = disc.centre - disc.w * receiver;
    std::vector<glm::dvec3> directions;
    for (const glm::dvec2& p : points.of(pixel)) directions.push_back(to_centre + p.x * axes.x + p.y * axes.y);
    std::size_t blocked = 0;
    for (std::size_t s = 0; s < directions.size(); s += packet_size)
      blocked +=
          scene.blocked(receiver, std::span(directions).subspan(s, std::min(packet_size, directions.size() - s)), disc.w == 0.0);
    return static_cast<float>(directions.size() - blocked) / static_cast<float>(directions.size());
  };
  std::vector<float> seen(last - first);
  const auto make_worker = [&] {
    return [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i)
        seen[i] = seen_from((receivers.points_ws[first + i] - scene.origin_ws()) / scene.unit(), receivers.pixels[first + i]);
    };
  };
  for_each_chunk(seen.size(), chunk, scene.threads(), make_worker, progress);
  return seen;
}

std::string truth_key(const Scene& scene, const Light& light, const RayReceivers& receivers, unsigned samples) {
  Hasher hasher;
  hasher.add(truth_version);
  for (const SceneMesh& mesh : scene.meshes) {
    if (!mesh.casts_shadow) continue;
    hasher.add(world_from_local(mesh));
    hasher.add(std::span<const glm::vec3>(mesh.mesh->positions));
    hasher.add(std::span<const glm::uvec3>(mesh.mesh->triangles));
  }
  hasher.add(disc_of<double>(light, glm::dvec3(0.0), 1.0));
  hasher.add(samples);
  if (!model_of(light.shape).is_round)
    hasher.add(std::span<const glm::dvec2>(pattern_of(light, {.samples = samples, .seed = truth_seed})));
  hasher.add(receivers.resolution);
  hasher.add(std::span<const PixelKind>(receivers.kinds));
  hasher.add(std::span<const glm::dvec3>(receivers.points_ws));
  return hasher.text();
}

TruthCache::TruthCache(fs::path folder, std::size_t rays_a_tile)
    : folder_(folder.empty() ? default_cache_folder() : std::move(folder)), rays_a_tile_(rays_a_tile) {}

fs::path TruthCache::path(const std::string& key) const {
  return folder_ / fmt::format("truth-{}.f32", key);
}

std::optional<std::vector<float>> TruthCache::find(const std::string& key, std::size_t count) const {
  return read_values(path(key), count);
}

void TruthCache::keep(const std::string& key, const std::vector<float>& plane) const {
  write_values(path(key), plane);
}

std::vector<float> TruthCache::truth(const std::string& key, const PreciseScene& scene, const Light& light,
                                     const RayReceivers& receivers, unsigned samples,
                                     const std::function<void(double)>& progress) const {
  if (std::optional<std::vector<float>> stored = find(key, receivers.kinds.size())) return *stored;
  const std::size_t count = receivers.pixels.size(), tile_size = std::max<std::size_t>(1, rays_a_tile_ / samples);
  const fs::path tiles = folder_ / fmt::format("truth-{}.tiles", key);
  std::vector<float> plane = untraced_visibility(receivers);
  for (std::size_t first = 0; first < count; first += tile_size) {
    const std::size_t last = std::min(first + tile_size, count);
    const fs::path tile = tiles / fmt::format("{}-{}.f32", first, last);
    std::optional<std::vector<float>> seen = read_values(tile, last - first);
    if (!seen) {
      const auto done = [&](double part) {
        if (progress)
          progress((static_cast<double>(first) + part * static_cast<double>(last - first)) / static_cast<double>(count));
      };
      seen = trace_truth(scene, light, receivers, first, last, samples, done);
      if (tile_size < count) write_values(tile, *seen);
    }
    for (std::size_t i = first; i < last; ++i) plane[receivers.pixels[i]] = (*seen)[i - first];
  }
  keep(key, plane);
  std::error_code ignored;  // what is left does no harm
  fs::remove_all(tiles, ignored);
  return plane;
}

}  // namespace halfshade
