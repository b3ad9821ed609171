// The report as one page that needs nothing besides itself.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

namespace halfshade {

/// host/report/page/page.html with its style, its script and the D3 library inside.
std::string_view report_page_template();

/// The page of a report: `report` is report.json's content, whose "picture" entries name files in `folder`; they go into the page
/// as data URIs.
std::string report_page(const nlohmann::ordered_json& report, const std::filesystem::path& folder);

}  // namespace halfshade
