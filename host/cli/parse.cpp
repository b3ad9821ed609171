#include "cli/parse.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include "methods/option.hpp"

namespace halfshade {

std::vector<std::string> split(std::string_view text, char separator) {
  std::vector<std::string> parts;
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t end = std::min(text.find(separator, begin), text.size());
    parts.emplace_back(text.substr(begin, end - begin));
    begin = end + 1;
  }
  return parts;
}

long parse_integer(std::string_view option, const std::string& text, long min, long max) {
  const std::optional<long long> value = whole_number(text);
  if (!value || *value < min || *value > max)
    throw InputError(fmt::format("{}: expected a whole number from {} to {} (found '{}')", option, min, max, text));
  return static_cast<long>(*value);
}

}  // namespace halfshade
