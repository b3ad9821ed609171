#include "cli/parse.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>

#include "halfshade/halfshade.hpp"

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
  long value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || value < min || value > max)
    throw InputError(fmt::format("{}: expected a whole number from {} to {} (found '{}')", option, min, max, text));
  return value;
}

}  // namespace halfshade
