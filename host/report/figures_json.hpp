// Error figures as JSON, as `compare` and reports write them.
#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>

#include "report/error_figures.hpp"

namespace halfshade {

/// JSON that keeps the order of its keys.
using Json = nlohmann::ordered_json;

/// The figures by their names.
inline Json to_json(const ErrorFigures& figures) {
  Json json = Json::object();
  for (const NamedFigure& figure : named_figures(figures)) {
    if (figure.is_count)
      json[std::string(figure.name)] = static_cast<std::uint64_t>(figure.value);
    else
      json[std::string(figure.name)] = figure.value;
  }
  return json;
}

}  // namespace halfshade
