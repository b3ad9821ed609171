// The truth proves itself: some of its pixels traced again, by other code, in double precision throughout.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "halfshade/halfshade.hpp"
#include "report/figures_json.hpp"
#include "report/receivers.hpp"
#include "report/reference.hpp"

namespace halfshade {

/// How far a truth is from the reference at the pixels that were looked at.
struct TruthCheck {
  std::size_t pixels = 0;               ///< looked at: 1 % of the counted ones, at least 100 where there are as many
  std::size_t differing = 0;            ///< of these, those that are not equal
  double largest = 0.0, mean = 0.0;     ///< absolute difference
  std::uint32_t worst_pixel = 0;        ///< where it is largest
  double truth = 0.0, reference = 0.0;  ///< there
  double bound = 0.0;                   ///< what the difference may be at any pixel

  /// No pixel differs by more than the bound, and of a hundred not more than one differs at all.
  bool holds() const { return largest <= bound && 100 * differing <= pixels; }
};

/// Traces random pixels of a truth of so many samples again, the same ones each time, with the same points of the light.
/// `progress`, if given, is called with the fraction done, from the calling thread.
TruthCheck check_truth(const Reference& reference, const Light& light, const RayReceivers& receivers,
                       const std::vector<float>& truth, unsigned samples, unsigned threads = 0,
                       const std::function<void(double)>& progress = {});

/// Throws DeviceError, which says where and what, unless the check holds. `file` is where the truth is kept.
void require(const TruthCheck& check, const std::string& scene, const std::string& light, glm::uvec2 resolution,
             const std::filesystem::path& file);

Json to_json(const TruthCheck& check);

}  // namespace halfshade
