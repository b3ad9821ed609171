#include "report/truth_check.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "light/samples.hpp"
#include "report/parallel.hpp"
#include "report/truth.hpp"

namespace halfshade {
namespace {

/// Truth and reference are rounded differently, so that a segment through an edge may cross a triangle in one of them alone.
/// Measured over the scenes of data/ and the hard cases (docs/decisions/0034): no pixel differs.
constexpr double differing_samples = 4.0;

/// 1 % of the receivers, at least 100: those with the smallest hashes.
std::vector<std::size_t> chosen_receivers(std::size_t count) {
  constexpr std::uint32_t seed = 0x6368'6b21;
  std::vector<std::size_t> all(count);
  std::iota(all.begin(), all.end(), std::size_t{0});
  const std::size_t wanted = std::min(count, std::max<std::size_t>(100, (count + 99) / 100));
  const auto rank = [](std::size_t i) { return std::pair(hash_of(static_cast<std::uint32_t>(i) ^ seed), i); };
  std::ranges::nth_element(all, all.begin() + static_cast<std::ptrdiff_t>(wanted), {}, rank);
  all.resize(wanted);
  std::ranges::sort(all);  // neighbours meet the same triangles
  return all;
}

/// What a receiver sees of the truth's points.
double visibility_again(const Reference& reference, const Light& light, const glm::dvec3& receiver,
                        const std::vector<glm::dvec2>& points) {
  const LightDisc disc = disc_towards(light, receiver, reference.origin_ws());
  std::size_t seen = 0;
  for (const glm::dvec2& point : points) {
    const glm::dvec3 at = disc.at(point);
    seen += disc.centre.w == 0.0 ? !reference.is_occluded_towards(receiver, at)
                                 : !reference.is_occluded(receiver, receiver + (1.0 - PreciseScene::open_end) * (at - receiver));
  }
  return static_cast<double>(seen) / static_cast<double>(points.size());
}

}  // namespace

TruthCheck check_truth(const Reference& reference, const Light& light, const RayReceivers& receivers,
                       const std::vector<float>& truth, unsigned samples, unsigned threads,
                       const std::function<void(double)>& progress) {
  const std::vector<std::size_t> chosen = chosen_receivers(receivers.pixels.size());
  const TruthSamples points(light, samples);
  std::vector<double> again(chosen.size());
  const auto make_worker = [&] {
    return [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i)
        again[i] = visibility_again(reference, light, receivers.points_ws[chosen[i]] - reference.origin_ws(),
                                    points.of(receivers.pixels[chosen[i]]));
    };
  };
  constexpr std::size_t chunk = 16;
  for_each_chunk(chosen.size(), chunk, thread_count(threads), make_worker, progress);

  TruthCheck check;
  check.pixels = chosen.size();
  check.bound = differing_samples / static_cast<double>(points.size());
  double sum = 0.0;
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    const std::uint32_t pixel = receivers.pixels[chosen[i]];
    // The truth is in single precision. What is not a number differs by all that there can be.
    const float same = static_cast<float>(again[i]);
    const double difference = truth[pixel] == same ? 0.0 : std::isfinite(truth[pixel]) ? std::abs(truth[pixel] - again[i]) : 1.0;
    sum += difference;
    check.differing += difference > 0.0;
    if (difference > check.largest) {
      check.largest = difference;
      check.worst_pixel = pixel;
      check.truth = truth[pixel];
      check.reference = again[i];
    }
  }
  if (check.pixels > 0) check.mean = sum / static_cast<double>(check.pixels);
  return check;
}

void require(const TruthCheck& check, const std::string& scene, const std::string& light, glm::uvec2 resolution,
             const std::filesystem::path& file) {
  if (check.holds()) return;
  throw DeviceError(fmt::format(
      "{}, light {}: the truth is not what the same rays in double precision give: at pixel {},{} it is {:.6f}, they give "
      "{:.6f}; "
      "{} of {} pixels differ, expected at most 1 in 100 and none by more than {:.6f}. Nothing is published. Remove {} and try "
      "again; if that does not help, report the scene",
      scene, light, check.worst_pixel % resolution.x, check.worst_pixel / resolution.x, check.truth, check.reference,
      check.differing, check.pixels, check.bound, file.string()));
}

Json to_json(const TruthCheck& check) {
  return {{"pixels", check.pixels},
          {"differing", check.differing},
          {"largest_difference", check.largest},
          {"mean_difference", check.mean},
          {"bound", check.bound}};
}

}  // namespace halfshade
