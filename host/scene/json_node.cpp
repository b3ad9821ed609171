#include "scene/json_node.hpp"

#include <fmt/ranges.h>

#include <algorithm>
#include <set>

#include "scene/limits.hpp"
#include "scene/suggestion.hpp"

namespace halfshade {

using Json = nlohmann::json;

std::string shown(const Json& value) {
  std::string text = value.dump(-1, ' ', true, Json::error_handler_t::replace);
  if (text.size() > 60) text = text.substr(0, 57) + "...";
  return text;
}

std::optional<std::string> place_too_deep(std::string_view text) {
  std::size_t depth = 0, line = 1, line_begin = 0;
  bool in_string = false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (in_string) {
      if (c == '\\') ++i;
      if (c == '"') in_string = false;
    } else if (c == '"') {
      in_string = true;
    } else if (c == '[' || c == '{') {
      if (++depth > limits::json_depth) return fmt::format("line {}, column {}", line, i - line_begin + 1);
    } else if (c == ']' || c == '}') {
      depth -= depth > 0;
    } else if (c == '\n') {
      ++line;
      line_begin = i + 1;
    }
  }
  return {};
}

Json parse_json(const std::string& text, const std::string& file) {
  if (const std::optional<std::string> place = place_too_deep(text))
    throw InputError(
        fmt::format("{}: {}: expected arrays and objects at most {} deep (found one deeper)", file, *place, limits::json_depth));
  // The parser keeps the last of two equal keys and says nothing; it tells us of each key, though.
  std::vector<std::set<std::string>> open_objects;
  std::string last_key;
  const auto watch = [&](int, Json::parse_event_t event, Json& value) {
    if (event == Json::parse_event_t::object_start) open_objects.emplace_back();
    if (event == Json::parse_event_t::object_end) open_objects.pop_back();
    if (event == Json::parse_event_t::key) {
      last_key = shown(value);
      if (!open_objects.back().insert(value.get<std::string>()).second) {
        throw InputError(fmt::format("{}: expected every key once in an object (found {} twice); remove one", file, last_key));
      }
    }
    return true;
  };
  try {
    return Json::parse(text, watch);
  } catch (const Json::parse_error& error) {
    // "[json.exception.parse_error.101] parse error at line 3, column 5: ..."
    const std::string_view what = error.what();
    const std::size_t line = what.find("line ");
    throw InputError(fmt::format("{}: {} (this is not valid JSON)", file, line == what.npos ? what : what.substr(line)));
  } catch (const Json::out_of_range& error) {
    const std::string_view what = error.what();
    throw InputError(fmt::format("{}: after the key {}: expected a number that fits into double precision ({})", file, last_key,
                                 what.substr(what.find("] ") + 2)));
  }
}

void Node::fail(std::string_view expected, std::string_view remedy) const {
  throw InputError(fmt::format("{}expected {} (found {}){}", start_of_message(), expected, shown(*value_), remedy));
}

const Node& Node::object(const std::vector<std::string_view>& known_keys) const {
  object();
  for (const auto& [key, value] : value_->items()) {
    if (std::ranges::find(known_keys, key) != known_keys.end()) continue;
    throw InputError(fmt::format("{}expected one of the keys {} (found {}){}", start_of_message(), fmt::join(known_keys, ", "),
                                 shown(key), suggestion(key, known_keys)));
  }
  return *this;
}

Node Node::at(std::string_view key) const {
  const auto found = value_->find(key);
  if (found != value_->end()) return {*found, file_, child_place(key)};
  throw InputError(fmt::format("{}expected the key \"{}\" (it is missing); add it", start_of_message(), key));
}

std::vector<Node> Node::items() const {
  if (!value_->is_array()) fail("an array");
  std::vector<Node> nodes;
  for (std::size_t i = 0; i < value_->size(); ++i) nodes.push_back({(*value_)[i], file_, fmt::format("{}[{}]", place_, i)});
  return nodes;
}

std::vector<Node> Node::items(std::size_t count, std::string_view expected) const {
  if (!value_->is_array() || value_->size() != count) fail(expected);
  return items();
}

std::string Node::start_of_message() const {
  return place_.empty() ? fmt::format("{}: ", file_) : fmt::format("{}: {}: ", file_, place_);
}

std::string Node::child_place(std::string_view key) const {
  return place_.empty() ? std::string(key) : fmt::format("{}.{}", place_, key);
}

}  // namespace halfshade
