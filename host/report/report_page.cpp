#include "report/report_page.hpp"

#include <fmt/format.h>

#include <set>

#include "scene/limits.hpp"
#include "scene/read_file.hpp"

namespace halfshade {
namespace {

using Json = nlohmann::ordered_json;

std::string base64_of(std::string_view bytes) {
  constexpr std::string_view digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    std::uint32_t word = 0;
    for (std::size_t k = 0; k < 3; ++k) word = word << 8 | (i + k < bytes.size() ? static_cast<unsigned char>(bytes[i + k]) : 0u);
    for (std::size_t k = 0; k < 4; ++k) text += i + k > bytes.size() ? '=' : digits[word >> (18 - 6 * k) & 63];
  }
  return text;
}

/// Names of all pictures that a report mentions.
void collect_pictures(const Json& json, std::set<std::string>& names) {
  if (json.is_object() && json.contains("picture") && json["picture"].is_string())
    names.insert(json["picture"].get<std::string>());
  if (json.is_structured())
    for (const Json& child : json) collect_pictures(child, names);
}

/// JSON that can stand in a script element: nothing in it ends the element or begins a comment.
std::string for_script(const Json& json) {
  std::string text = json.dump();
  for (std::size_t at = 0; (at = text.find('<', at)) != text.npos; at += 6) text.replace(at, 1, "\\u003c");
  return text;
}

void fill(std::string& page, std::string_view place, std::string_view text) {
  const std::size_t at = page.find(place);
  if (at == page.npos) throw std::logic_error(fmt::format("report page: no place {}", place));
  page.replace(at, place.size(), text);
}

}  // namespace

std::string report_page(const Json& report, const std::filesystem::path& folder) {
  std::set<std::string> names;
  collect_pictures(report, names);
  Json pictures = Json::object();
  for (const std::string& name : names)
    pictures[name] = "data:image/png;base64," + base64_of(read_file(folder / name, "a picture", limits::report_bytes));
  std::string page(report_page_template());
  // Pictures first: nothing in base64 looks like the other place.
  fill(page, "{{pictures.json}}", for_script(pictures));
  fill(page, "{{report.json}}", for_script(report));
  return page;
}

}  // namespace halfshade
