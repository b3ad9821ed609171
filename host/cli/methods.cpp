// The methods as they are declared: what each can do, and its options.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <memory>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

#include "cli/commands.hpp"
#include "halfshade/halfshade.hpp"
#include "methods/option.hpp"

namespace halfshade {
namespace {

using Json = nlohmann::ordered_json;

std::string default_text(Method method, const Option& option) {
  return option.text({.method = method});
}

/// "--samples 16|64|256|1024 (256)", or of a switch "--faithful".
std::string option_text(Method method, const Option& option) {
  if (option.is_switch()) return fmt::format("--{}", option.name);
  return fmt::format("--{} {} ({})", option.name, option.values, default_text(method, option));
}

void print_method(const MethodInfo& info, std::size_t name_width) {
  std::vector<std::string> options;
  for (const Option& option : options_of(info.method)) options.push_back(option_text(info.method, option));
  fmt::print("{:<{}}  {}\n", info.name, name_width, info.summary);
  const auto line = [&](std::string_view title, std::string_view text) {
    fmt::print("{:<{}}  {:<16} {}\n", "", name_width, fmt::format("{}:", title), text);
  };
  line("source", info.source);
  line("exact when", info.exact_when);
  line("receivers", info.receivers);
  line("lights", info.any_shape ? "discs and rectangles" : "discs");
  line("time grows with", info.time);
  line("options", fmt::format("{}", fmt::join(options, ", ")));
}

/// Words between spaces.
Json words_of(std::string_view text) {
  Json words = Json::array();
  std::istringstream stream{std::string(text)};
  for (std::string word; stream >> word;) words.push_back(word);
  return words;
}

Json to_json(Method method, const Option& option) {
  return {{"name", option.name},
          {"key", option.key},
          {"switch", option.is_switch()},
          {"values", option.values},
          {"default", default_text(method, option)},
          {"summary", option.summary},
          {"measured", words_of(option.measured)},
          {"measured_quickly", words_of(option.measured_quickly)}};
}

Json to_json(const MethodInfo& info) {
  Json options = Json::array();
  for (const Option& option : options_of(info.method)) options.push_back(to_json(info.method, option));
  return {{"name", info.name},           {"summary", info.summary},
          {"source", info.source},       {"exact_when", info.exact_when},
          {"receivers", info.receivers}, {"time", info.time},
          {"any_shape", info.any_shape}, {"is_default", info.method == Settings{}.method},
          {"options", options}};
}

void run_methods(bool json) {
  if (json) {
    Json all = Json::array();
    for (const MethodInfo& info : methods()) all.push_back(to_json(info));
    fmt::print("{}\n", all.dump(2));
    return;
  }
  std::size_t name_width = 0;
  for (const MethodInfo& info : methods()) name_width = std::max(name_width, info.name.size());
  for (const MethodInfo& info : methods()) print_method(info, name_width);
}

}  // namespace

void add_methods(CLI::App& program) {
  CLI::App* command = program.add_subcommand("methods", "List the shadow methods, what each can do, and its options");
  const auto json = std::make_shared<bool>(false);
  command->add_flag("--json", *json, "Print JSON");
  command->footer(
      "Exact when: where its penumbra is that of the area light. Receivers: what it can cast shadows on.\n"
      "In brackets: an option's default.\n\n"
      "Examples:\n"
      "  halfshade methods\n"
      "  halfshade methods --json\n");
  command->callback([json] { run_methods(*json); });
}

}  // namespace halfshade
