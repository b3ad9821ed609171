#include "report/report_csv.hpp"

#include <fmt/format.h>

namespace halfshade {
namespace {

using Json = nlohmann::ordered_json;

/// A cell of text. Spreadsheets take one that begins with certain characters for a formula and run it, unless an apostrophe is
/// first (OWASP, "CSV Injection").
std::string csv_field(std::string text) {
  const bool is_formula = text.find_first_of("=+-@\t\r") == 0;
  if (is_formula) text.insert(0, 1, '\'');
  if (!is_formula && text.find_first_of(",\"\n\r") == text.npos) return text;
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? "\"\"" : std::string(1, c);
  return quoted + '"';
}

std::string csv_value(const Json& value) {
  if (value.is_null()) return "";
  return value.is_string() ? csv_field(value.get<std::string>()) : value.dump();
}

std::string header_row(const Json& result) {
  std::string text = "scene,light,method,kind,settings,median_ms,min_ms,cold_ms,repeats";
  for (const auto& [name, value] : result.at("figures").items()) text += "," + name;
  return text + ",negative_pixels,pareto,rays_time_at_error_ms,stages_ms\n";
}

std::string row_of(const Json& scene, const Json& light, const Json& result) {
  std::string settings, stages;
  for (const auto& [name, value] : result.at("settings").items())
    settings += fmt::format("{}{}={}", settings.empty() ? "" : " ", name, value.get<std::string>());
  for (const auto& [name, value] : result.at("stages_ms").items())
    stages += fmt::format("{}{}={:.3f}", stages.empty() ? "" : " ", name, value.get<double>());
  const Json& time = result.at("time_ms");
  std::string text =
      fmt::format("{},{},{},{},{},{},{},{},{}", csv_value(scene.at("name")), csv_value(light.at("name")),
                  csv_value(result.at("method")), csv_value(result.at("kind")), csv_field(settings), csv_value(time.at("median")),
                  csv_value(time.at("min")), csv_value(time.at("cold")), time.at("runs").size());
  for (const auto& [name, value] : result.at("figures").items()) text += "," + csv_value(value);
  return text + fmt::format(",{},{},{},{}\n", csv_value(result.at("negative_pixels")), csv_value(result.at("pareto")),
                            csv_value(result.at("rays_time_at_error_ms")), csv_field(stages));
}

}  // namespace

std::string report_csv(const Json& report) {
  std::string text;
  for (const Json& scene : report.at("scenes")) {
    for (const Json& light : scene.at("lights")) {
      for (const Json& result : light.at("results")) {
        if (text.empty()) text = header_row(result);
        text += row_of(scene, light, result);
      }
    }
  }
  return text;
}

}  // namespace halfshade
