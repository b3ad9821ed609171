// Measures candidates for one light of a scene: error and pass times once, wall times in turns.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "halfshade/halfshade.hpp"
#include "report/candidates.hpp"
#include "report/error_figures.hpp"
#include "report/report_scene.hpp"

namespace halfshade {

/// Times and error of one candidate for one light.
struct Measurement {
  Candidate candidate;
  double cold_ms = 0.0;           ///< the first run: kernels are built or loaded, buffers grow
  std::vector<double> times_ms;   ///< of warm runs: from meshes and G-buffer on the device to the finished plane
  std::vector<StageTime> stages;  ///< median of each pass, from OpenCL events; none for rays
  ErrorFigures figures;
  std::optional<std::uint32_t> negative_pixels;  ///< FrameStats::PerLight::negative_pixels

  std::string picture;  ///< file name of the visibility as 8-bit PNG, in the report's folder

  double median_ms() const;
  double min_ms() const;
};

/// What happens while rows are measured.
struct MeasureEvents {
  std::function<void(const std::string& text)> now = [](const std::string&) {};  ///< what is being done
  /// A row has its figures; this was its plane.
  std::function<void(Measurement& row, const std::vector<float>& visibility)> has_figures = [](auto&&...) {};
  std::function<void()> saved = [] {};  ///< after each step that should outlast an interruption
};

/// Runs each row until it has `repeats` times. A row that has figures and times already, from an interrupted run, keeps them.
void measure(ReportScene& scene, const LightCase& light_case, std::vector<Measurement>& rows, unsigned repeats,
             const MeasureEvents& events);

}  // namespace halfshade
