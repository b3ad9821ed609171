// Every hard case with every method: values are fractions; method exact has the samples that the reference in double precision
// has; the others are no farther off than docs/hard-cases.md says.
//
// With HALFSHADE_HARD_CASES_TABLE=<file> the figures measured are written to that file's table instead of being compared with it
// (scripts/update_hard_cases.sh).
#include <iostream>
#include <map>

#include "hard_cases/cases.hpp"
#include "hard_cases/figures_table.hpp"
#include "light/light_model.hpp"
#include "report/reference.hpp"
#include "support/draw.hpp"

namespace halfshade {
namespace {

/// A case's reference, on the pixels of a frame, for each light.
class CaseTruth {
 public:
  CaseTruth(const Scene& scene, const Frame& frame, unsigned samples) : scene_(scene), reference_(scene) {
    for (const Light& light : scene_.lights) {
      pixels_.push_back(reference_.surface_pixels(scene_.camera, frame.depth, frame.normal_ws, light));
      points_.push_back(light_points(light, disc_radius(light) > 0.0 ? samples : 1).points);
      planes_.push_back(reference_.visibility(light, pixels_.back(), points_.back()));
    }
  }

  std::size_t unplaced() const { return pixels_.empty() ? 0 : pixels_.front().unplaced; }
  ReferenceFigures figures(const Frame& frame, std::size_t light) const {
    return compare_with_reference(reference_, scene_.lights[light], pixels_[light], frame.visibility[light], points_[light]);
  }
  ErrorFigures error(const Frame& frame, std::size_t light) const {
    return compare_visibility(frame.visibility[light], planes_[light], pixels_[light].kinds);
  }

 private:
  const Scene& scene_;
  Reference reference_;
  std::vector<SurfacePixels> pixels_;
  std::vector<std::vector<glm::dvec2>> points_;
  std::vector<std::vector<float>> planes_;
};

/// What is wrong with a frame's values as such; empty if nothing is.
std::string unsound(const Frame& frame) {
  for (std::size_t l = 0; l < frame.visibility.size(); ++l)
    for (std::size_t i = 0; i < frame.visibility[l].size(); ++i)
      if (const float v = frame.visibility[l][i]; !(v >= 0.0f && v <= 1.0f))
        return fmt::format("light {}: visibility {} at pixel {}, expected 0 to 1", l, v, i);
  for (std::size_t i = 0; i < frame.rgb.size(); ++i)
    for (int c = 0; c < 3; ++c)
      if (!std::isfinite(frame.rgb[i][c])) return fmt::format("colour {} at pixel {}", frame.rgb[i][c], i);
  return {};
}

class HardCases : public testing::TestWithParam<HardCase> {
 protected:
  void SetUp() override { name_ = GetParam().name; }

  /// Collects what is wrong; what holds not yet is told, anything else fails.
  void complain(const std::string& what) { complaints_ += (complaints_.empty() ? "" : "\n") + what; }
  void TearDown() override {
    if (holds_not_yet(name_)) {
      GTEST_SKIP() << (complaints_.empty() ? "holds now: take it off the list of what does not" : complaints_);
    } else {
      EXPECT_EQ(complaints_, "");
    }
  }
  void check_promises(const std::string& method, const MethodFigures& figures) {
    for (const Promise& promise : promises()) {
      if (promise.hard_case != name_ || !promise.is_of(method)) continue;
      const bool is_kept =
          figures.false_lit <= promise.false_lit && figures.false_umbra <= promise.false_umbra && figures.rmse() <= promise.rmse;
      const std::string what =
          fmt::format("{}: false_lit {}, false_umbra {}, rmse {:.3f}; promised are {}, {}, {}", method, figures.false_lit,
                      figures.false_umbra, figures.rmse(), promise.false_lit, promise.false_umbra, promise.rmse);
      if (!holds_not_yet(name_ + "/" + method)) {
        if (!is_kept) complain(what);
      } else {
        std::cout << "not yet: " << (is_kept ? "holds now: take it off the list, " : "") << what << '\n';
      }
    }
  }

  void check_exact(const std::string& how, const Drawn& drawn, const CaseTruth& truth, MethodFigures& total) {
    if (const std::string wrong = unsound(drawn.frame); !wrong.empty()) complain(how + ": " + wrong);
    for (std::size_t l = 0; l < drawn.frame.visibility.size(); ++l) {
      const ReferenceFigures figures = truth.figures(drawn.frame, l);
      total.add(figures.error);
      const std::size_t counted = figures.error.counted_pixels;
      if (figures.unexplained > counted / 2000)
        complain(
            fmt::format("{}, light {}: {} of {} pixels are off by more than their receiver's place explains (rmse {:.5f}, "
                        "largest {:.3f}, false_lit {}, false_umbra {})",
                        how, l, figures.unexplained, counted, figures.error.rmse, figures.error.max_error,
                        figures.error.false_lit, figures.error.false_umbra));
      if (static_cast<double>(figures.differing) > 2.0 + GetParam().limits.differing * static_cast<double>(counted))
        complain(
            fmt::format("{}, light {}: {} of {} pixels are off by more than 1.5 samples", how, l, figures.differing, counted));
      if (const std::uint32_t negative = drawn.stats.lights[l].negative_pixels.value_or(0); negative > 0)
        complain(fmt::format("{}, light {}: depth complexity is negative at {} pixels", how, l, negative));
    }
  }

  std::string name_, complaints_;
  Watchdog watchdog_;
};

/// Those that are drawn in both shapes, or the others. The sanitizers' build draws the few alone (CMakePresets.json).
std::vector<HardCase> cases_drawn_in_both_shapes(bool in_both) {
  std::vector<HardCase> some;
  for (const HardCase& one : hard_cases())
    if (one.limits.is_drawn_in_both_shapes == in_both) some.push_back(one);
  return some;
}

INSTANTIATE_TEST_SUITE_P(Few, HardCases, testing::ValuesIn(cases_drawn_in_both_shapes(true)),
                         [](const auto& info) { return info.param.name; });
INSTANTIATE_TEST_SUITE_P(Others, HardCases, testing::ValuesIn(cases_drawn_in_both_shapes(false)),
                         [](const auto& info) { return info.param.name; });

TEST_P(HardCases, AreDrawn) {
  const Scene scene = GetParam().scene();
  const HardCase::Limits& limits = GetParam().limits;
  validate(scene, name_);
  const Drawn first = draw(test_device(), scene, {.method = Method::hard, .light_resolution_px = 64});
  const CaseTruth truth(scene, first.frame, limits.samples);
  if (truth.unplaced() > 0) complain(fmt::format("{} pixels have a depth that no surface has", truth.unplaced()));

  CaseFigures measured;
  MethodFigures& exact = measured["exact"];
  std::vector<std::string> shapes = {""};
  if (limits.is_drawn_in_both_shapes) shapes = {"wide", "narrow"};
  for (const std::string& shape : shapes)
    for (const bool alias_free : {false, true}) {
      const Settings settings{.method = Method::exact,
                              .light_resolution_px = limits.light_resolution_px,
                              .samples = limits.samples,
                              .alias_free = alias_free};
      MethodFigures figures;
      check_exact(fmt::format("exact{}{}{}", shape.empty() ? "" : ", ", shape, alias_free ? ", alias-free" : ""),
                  draw(test_device(shape), scene, settings), truth, figures);
      if (!alias_free && shape != "narrow") exact = figures;
    }

  for (const Settings& settings : every_method(limits.light_resolution_px)) {
    if (settings.method == Method::exact || limits.is_for_exact_alone) continue;
    if (!std::all_of(scene.lights.begin(), scene.lights.end(), [&](const Light& l) { return can_draw(settings, l); })) continue;
    Settings with_samples = settings;
    with_samples.samples = limits.samples;
    const Frame frame = draw(test_device(), scene, with_samples).frame;
    const std::string method(name_of(settings.method));
    if (const std::string wrong = unsound(frame); !wrong.empty()) complain(method + ": " + wrong);
    for (std::size_t l = 0; l < scene.lights.size(); ++l) measured[method].add(truth.error(frame, l));
    check_promises(method, measured[method]);
  }
  FiguresTable& table = FiguresTable::instance();
  if (table.is_recording()) {
    table.record(name_, GetParam().expected, measured);
    return;
  }
  for (const auto& [method, figures] : measured)
    if (const std::string worse = table.worse(name_, method, figures); !worse.empty()) complain(worse);
}

}  // namespace
}  // namespace halfshade
