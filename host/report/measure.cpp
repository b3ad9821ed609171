#include "report/measure.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "report/timing.hpp"

namespace halfshade {
namespace {

/// The median of each pass over a few frames.
std::vector<StageTime> median_stages(ReportScene& scene, const LightCase& light_case, const Candidate& candidate,
                                     unsigned frames) {
  std::vector<StageTime> stages;
  std::vector<std::vector<double>> times_ms;
  for (unsigned frame = 0; frame < frames; ++frame) {
    stages = scene.stage_times(light_case, candidate);
    times_ms.resize(stages.size());
    for (std::size_t stage = 0; stage < stages.size(); ++stage) times_ms[stage].push_back(stages[stage].time_ms);
  }
  for (std::size_t stage = 0; stage < stages.size(); ++stage) stages[stage].time_ms = median_of(times_ms[stage]);
  return stages;
}

/// Warms a row up, and gives it figures and pass times unless it has them from an interrupted run.
void first_run(ReportScene& scene, const LightCase& light_case, Measurement& row, unsigned repeats, const MeasureEvents& events) {
  std::vector<float> visibility;
  const double first_ms = scene.run(light_case, row.candidate, &visibility);
  if (row.cold_ms > 0.0) return;
  row.cold_ms = first_ms;
  row.figures = compare_visibility(visibility, light_case.truth, light_case.receivers.kinds);
  events.has_figures(row, visibility);
  row.stages = median_stages(scene, light_case, row.candidate, std::min(repeats, 5u));
  row.negative_pixels = scene.negative_pixels(light_case, row.candidate);
  events.saved();
}

/// The time that the rounds from `round` on will take.
double time_left_ms(const std::vector<Measurement>& rows, unsigned round, unsigned repeats) {
  double left_ms = 0.0;
  for (const Measurement& row : rows) {
    const double run_ms = row.times_ms.empty() ? row.cold_ms : row.median_ms();
    const std::size_t done = std::min<std::size_t>(repeats, std::max<std::size_t>(round, row.times_ms.size()));
    left_ms += run_ms * static_cast<double>(repeats - done);
  }
  return left_ms;
}

}  // namespace

double Measurement::median_ms() const {
  return median_of(times_ms);
}

double Measurement::min_ms() const {
  return min_of(times_ms);
}

void measure(ReportScene& scene, const LightCase& light_case, std::vector<Measurement>& rows, unsigned repeats,
             const MeasureEvents& events) {
  for (std::size_t i = 0; i < rows.size(); ++i) {
    // Also for rows of an interrupted run: kernels and buffers are this process's.
    if (rows[i].times_ms.size() >= repeats) continue;
    events.now(fmt::format("first run {}/{}, {}", i + 1, rows.size(), rows[i].candidate.label()));
    first_run(scene, light_case, rows[i], repeats, events);
  }
  // In turns, so that drift of the machine affects all rows alike.
  for (unsigned round = 0; round < repeats; ++round) {
    events.now(fmt::format("round {}/{}, {} left for this light", round + 1, repeats,
                           duration_text(time_left_ms(rows, round, repeats))));
    bool ran = false;
    for (Measurement& row : rows) {
      if (row.times_ms.size() > round) continue;
      row.times_ms.push_back(scene.run(light_case, row.candidate));
      ran = true;
    }
    if (ran) events.saved();
  }
}

}  // namespace halfshade
