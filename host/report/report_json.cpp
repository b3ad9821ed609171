#include "report/report_json.hpp"

#include "report/tradeoff.hpp"

namespace halfshade {
namespace {

ErrorFigures figures_from(const Json& json) {
  ErrorFigures figures;
  figures.rmse = json.at("rmse");
  figures.penumbra_rmse = json.at("penumbra_rmse");
  figures.bias = json.at("bias");
  figures.max_error = json.at("max_error");
  figures.p999_error = json.at("p999_error");
  figures.bad_fraction = json.at("bad_fraction");
  figures.false_lit = json.at("false_lit");
  figures.false_umbra = json.at("false_umbra");
  figures.nonfinite = json.at("nonfinite");
  figures.counted_pixels = json.at("counted_pixels");
  figures.penumbra_pixels = json.at("penumbra_pixels");
  return figures;
}

Json to_json(const Measurement& row) {
  Json settings = Json::object(), stages = Json::object();
  for (const auto& [name, value] : row.candidate.settings) settings[name] = value;
  for (const StageTime& stage : row.stages) stages[stage.stage] = stage.time_ms;
  return {{"method", row.candidate.name},
          {"kind", row.candidate.is_rival() ? "rival" : "method"},
          {"label", row.candidate.label()},
          {"is_default", row.candidate.is_default},
          {"settings", settings},
          {"time_ms", {{"median", row.median_ms()}, {"min", row.min_ms()}, {"cold", row.cold_ms}, {"runs", row.times_ms}}},
          {"stages_ms", stages},
          {"figures", to_json(row.figures)},
          {"negative_pixels", row.negative_pixels ? Json(*row.negative_pixels) : Json(nullptr)},
          {"picture", row.picture}};
}

}  // namespace

Json results_of(const std::vector<Measurement>& rows) {
  std::vector<Tradeoff> all, rays;
  for (const Measurement& row : rows) {
    all.push_back({row.median_ms(), row.figures.penumbra_rmse});
    if (row.candidate.is_rival()) rays.push_back(all.back());
  }
  const std::vector<bool> on_front = pareto_front(all);
  Json results = Json::array();
  for (std::size_t i = 0; i < rows.size(); ++i) {
    Json result = to_json(rows[i]);
    result["pareto"] = static_cast<bool>(on_front[i]);
    const std::optional<double> rays_ms = rays_time_at_error(rays, all[i].error);
    result["rays_time_at_error_ms"] = rays_ms ? Json(*rays_ms) : Json(nullptr);
    results.push_back(std::move(result));
  }
  return results;
}

void restore(Measurement& row, const Json& result) {
  row.cold_ms = result.at("time_ms").at("cold");
  row.times_ms = result.at("time_ms").at("runs").get<std::vector<double>>();
  for (const auto& [stage, ms] : result.at("stages_ms").items()) row.stages.push_back({stage, ms.get<double>()});
  row.figures = figures_from(result.at("figures"));
  if (!result.at("negative_pixels").is_null()) row.negative_pixels = result.at("negative_pixels").get<std::uint32_t>();
  row.picture = result.at("picture");
}

}  // namespace halfshade
