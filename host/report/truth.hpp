// The truth that methods and rays are measured against: rays that are decided in double precision, and planes of them on disk.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "halfshade/halfshade.hpp"
#include "report/precise_scene.hpp"
#include "report/receivers.hpp"

namespace halfshade {

/// Most rays a pixel that a truth can have.
constexpr unsigned max_truth_samples = 65'536;

/// The points of a light that receivers look for in a truth, in units of disc_radius: a pattern of its own, which no rival has,
/// turned by another angle for each pixel where the light is round.
class TruthSamples {
 public:
  TruthSamples(const Light& light, unsigned samples);

  std::size_t size() const { return pattern_.size(); }
  std::vector<glm::dvec2> of(std::uint32_t pixel) const;

 private:
  std::vector<glm::dvec2> pattern_;
  bool turns_;
};

/// What receivers first .. last see of the light. `progress`, if given, is called with the fraction done, from the calling
/// thread.
std::vector<float> trace_truth(const PreciseScene& scene, const Light& light, const RayReceivers& receivers, std::size_t first,
                               std::size_t last, unsigned samples, const std::function<void(double)>& progress = {});

/// A name for all that a truth depends on: meshes, transforms, light, receivers, number of samples, and how it is traced.
std::string truth_key(const Scene& scene, const Light& light, const RayReceivers& receivers, unsigned samples);

/// Truth planes on disk, by their keys.
class TruthCache {
 public:
  /// `folder` empty: $XDG_CACHE_HOME/halfshade, or ~/.cache/halfshade.
  explicit TruthCache(std::filesystem::path folder = {}, std::size_t rays_a_tile = default_rays_a_tile);

  /// The plane as stored under the key, or traced now and stored. It is traced in tiles of about as many rays each, and each is
  /// stored when it is finished: an interrupted run goes on with the next. Throws InputError where the folder cannot be written
  /// to.
  std::vector<float> truth(const std::string& key, const PreciseScene& scene, const Light& light, const RayReceivers& receivers,
                           unsigned samples, const std::function<void(double)>& progress = {}) const;

  /// The stored values, if there are as many and they are as they were stored.
  std::optional<std::vector<float>> find(const std::string& key, std::size_t count) const;
  /// Stores a plane.
  void keep(const std::string& key, const std::vector<float>& plane) const;

  /// Where the plane of a key is.
  std::filesystem::path path(const std::string& key) const;

 private:
  static constexpr std::size_t default_rays_a_tile = std::size_t{1} << 27;

  std::filesystem::path folder_;
  std::size_t rays_a_tile_;
};

}  // namespace halfshade
