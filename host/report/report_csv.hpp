// A report as a table for spreadsheets.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

namespace halfshade {

/// `report` is report.json's content; one row a result.
std::string report_csv(const nlohmann::ordered_json& report);

}  // namespace halfshade
