// The hard cases: scenes in which arithmetic, geometry or the light's place is at a limit, each with what is right.
#pragma once

#include <ostream>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "halfshade/halfshade.hpp"

namespace halfshade {

struct HardCase {
  std::string name;      ///< what it holds, as part of a test's name
  std::string expected;  ///< what is right, in words
  Scene (*scene)();
  struct Limits {
    unsigned samples = 64;  ///< of method exact
    unsigned light_resolution_px = 256;
    double differing = 0.03;  ///< pixels that may differ by more than 1.5 samples: their receiver is elsewhere
    bool is_drawn_in_both_shapes = false;
    bool is_for_exact_alone = false;  ///< too much for nine methods
  } limits = {};
};

/// For messages of tests.
inline void PrintTo(const HardCase& one, std::ostream* out) {
  *out << one.name;
}

/// All of them, in the order of docs/hard-cases.md.
const std::vector<HardCase>& hard_cases();

/// What a method other than exact must do in a case, whatever it does now: what it owes to its own definition.
struct Promise {
  std::string_view hard_case;
  std::string_view methods;  ///< names, separated by spaces; empty for all
  std::size_t false_lit, false_umbra;
  double rmse = 1.0;
  bool is_of(std::string_view method) const;
};
std::span<const Promise> promises();

/// What does not hold yet: a case with method exact by its name, a promise as "case/method" or, whatever the
/// method, "case/*", a property of a method as
/// "Property/method". The list is to become empty.
bool holds_not_yet(std::string_view name);

}  // namespace halfshade
