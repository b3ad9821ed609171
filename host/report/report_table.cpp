#include "report/report_table.hpp"

#include <fmt/format.h>

#include "report/report_json.hpp"

namespace halfshade {

std::string report_table(const Scene& scene, const Light& light, double tree_build_ms, const std::vector<Measurement>& rows) {
  const Json results = results_of(rows);
  const ErrorFigures first = rows.empty() ? ErrorFigures{} : rows.front().figures;
  std::string text = fmt::format("\n{}, light {}, {}x{}; {} counted pixels, {} in penumbra; tree built in {:.1f} ms\n",
                                 scene.name, light.name, scene.camera.resolution.x, scene.camera.resolution.y,
                                 first.counted_pixels, first.penumbra_pixels, tree_build_ms);
  text += fmt::format("{:<80} {:>9} {:>9} {:>8} {:>9} {:>8} {:>7} {:>7} {:>7} {:>9} {:>11} {:>4} {:>7} {:>9}\n",
                      "  method, settings", "median ms", "min ms", "rmse", "pen. rmse", "bias", "max", "p99.9", "> 0.1",
                      "false lit", "false umbra", "NaN", "neg. px", "rays ms");
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const Measurement& row = rows[i];
    const ErrorFigures& f = row.figures;
    const Json& rays_ms = results[i]["rays_time_at_error_ms"];
    text += fmt::format(
        "{:<80} {:>9.2f} {:>9.2f} {:>8.5f} {:>9.5f} {:>+8.4f} {:>7.4f} {:>7.4f} {:>7.4f} {:>9} {:>11} {:>4} {:>7} {:>9}\n",
        (results[i]["pareto"].get<bool>() ? "* " : "  ") + row.candidate.label(), row.median_ms(), row.min_ms(), f.rmse,
        f.penumbra_rmse, f.bias, f.max_error, f.p999_error, f.bad_fraction, f.false_lit, f.false_umbra, f.nonfinite,
        row.negative_pixels ? fmt::format("{}", *row.negative_pixels) : "",
        rays_ms.is_null() ? "-" : fmt::format("{:.1f}", rays_ms.get<double>()));
  }
  return text;
}

std::string report_table_legend() {
  return "\n*: on the Pareto front of time and penumbra rmse: no other row is as fast and as accurate.\n"
         "rays ms: the time in which ray tracing reaches the same penumbra rmse; -: it does not with the rays measured.\n"
         "max, p99.9: largest and 99.9th percentile of absolute error. > 0.1: fraction of pixels with a larger error.\n"
         "false lit, false umbra: pixels at truth 0 shown above 0.5, at truth 1 shown below 0.5.\n"
         "NaN: values that are not finite. neg. px: pixels with a negative depth complexity, a sign of rounding.\n";
}

}  // namespace halfshade
