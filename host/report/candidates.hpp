// What a report measures: every method at its defaults and over its options, and ray tracing as the rival.
#pragma once

#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "halfshade/halfshade.hpp"
#include "report/rays.hpp"

namespace halfshade {

/// One row of a report: a method with its settings, or ray tracing.
struct Candidate {
  std::string name;                                           ///< "smoothies", "rays", "rays-adaptive"
  std::vector<std::pair<std::string, std::string>> settings;  ///< what tells it from others of its name
  std::variant<Settings, RaySettings> how;
  bool is_default = false;  ///< a method with all its options at their defaults

  bool is_rival() const { return std::holds_alternative<RaySettings>(how); }
  /// Name and settings: "smoothies light_resolution_px=1024 falloff=sine".
  std::string label() const;
};

/// Which candidates are measured.
struct CandidateSelection {
  std::vector<std::string> names = {};              ///< methods and rivals; empty or "all": all
  std::vector<unsigned> light_resolutions_px = {};  ///< empty: those that the option's declaration gives
  bool quick = false;                               ///< fewer values of each option
};

/// The selected candidates, in the order of the report. A method is measured with its defaults at each light map resolution, then
/// with each value that its other options' declarations give, one option at a time (Option::measured). Throws InputError for a
/// name that is neither a method's nor a rival's.
std::vector<Candidate> candidates(const CandidateSelection& selection);

}  // namespace halfshade
