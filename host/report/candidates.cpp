#include "report/candidates.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <sstream>

#include "methods/option.hpp"

namespace halfshade {
namespace {

/// The values that a report measures of an option beside the default.
std::vector<std::string> measured_values(const Option& option, bool quick) {
  std::istringstream words{std::string(quick ? option.measured_quickly : option.measured)};
  std::vector<std::string> values;
  for (std::string value; words >> value;) values.push_back(value);
  return values;
}

/// The light map resolutions that are measured: those asked for, or the declared ones and the default, ascending.
std::vector<unsigned> light_resolutions_px(const CandidateSelection& selection) {
  if (!selection.light_resolutions_px.empty()) return selection.light_resolutions_px;
  std::vector<unsigned> resolutions_px{Settings{}.light_resolution_px};
  for (const std::string& value : measured_values(light_res_option, selection.quick)) {
    Settings settings;
    light_res_option.set(settings, value);
    resolutions_px.push_back(settings.light_resolution_px);
  }
  std::sort(resolutions_px.begin(), resolutions_px.end());
  return resolutions_px;
}

/// The method's settings as key and value, but for what all rows of it share: the name, and that it is not drawn as published.
std::vector<std::pair<std::string, std::string>> distinguishing(const Settings& settings) {
  auto entries = describe(settings);
  std::erase_if(entries, [](const auto& entry) {
    return entry.first == "method" || (entry.first == faithful_option.key && entry.second == "no");
  });
  return entries;
}

std::vector<Candidate> method_candidates(const MethodInfo& info, const CandidateSelection& selection) {
  std::vector<Candidate> all;
  const auto add = [&](const Settings& settings, bool is_default) {
    Candidate candidate{std::string(info.name), distinguishing(settings), settings, is_default};
    const auto known = [&](const Candidate& other) { return other.settings == candidate.settings; };
    if (std::none_of(all.begin(), all.end(), known)) all.push_back(std::move(candidate));
  };

  const std::vector<unsigned> resolutions_px = light_resolutions_px(selection);
  Settings defaults{.method = info.method};
  if (std::ranges::find(resolutions_px, defaults.light_resolution_px) == resolutions_px.end())
    defaults.light_resolution_px = resolutions_px.back();

  if (find_option(info.method, light_res_option.name) != nullptr) {
    for (const unsigned resolution_px : resolutions_px) {
      Settings settings = defaults;
      settings.light_resolution_px = resolution_px;
      add(settings, resolution_px == defaults.light_resolution_px);
    }
  }
  add(defaults, true);
  for (const Option& option : options_of(info.method)) {
    if (option.name == light_res_option.name) continue;
    for (const std::string& value : measured_values(option, selection.quick)) {
      Settings settings = defaults;
      option.set(settings, value);
      add(settings, false);
    }
  }
  return all;
}

/// A way of ray tracing that methods are measured against, and its settings.
struct Rival {
  std::string_view name;
  std::vector<RaySettings> settings, quick_settings;
};

const std::vector<Rival>& rivals() {
  static const std::vector<Rival> all{
      {"rays",
       {{.samples = 1}, {.samples = 4}, {.samples = 16}, {.samples = 64}, {.samples = 256}},
       {{.samples = 1}, {.samples = 4}, {.samples = 16}, {.samples = 64}}},
      {"rays-adaptive",
       {{.samples = 16, .more_samples = 64}, {.samples = 16, .more_samples = 256}},
       {{.samples = 16, .more_samples = 64}}},
  };
  return all;
}

std::vector<Candidate> rival_candidates(const Rival& rival, bool quick) {
  std::vector<Candidate> all;
  for (const RaySettings& settings : quick ? rival.quick_settings : rival.settings) {
    Candidate candidate{std::string(rival.name), {{"samples", fmt::format("{}", settings.samples)}}, settings};
    if (settings.more_samples > 0) candidate.settings.emplace_back("more_samples", fmt::format("{}", settings.more_samples));
    all.push_back(std::move(candidate));
  }
  return all;
}

/// Throws InputError for a name that is neither a method's nor a rival's.
void check_names(const std::vector<std::string>& names) {
  std::vector<std::string_view> known;
  for (const MethodInfo& info : methods()) known.push_back(info.name);
  for (const Rival& rival : rivals()) known.push_back(rival.name);
  for (const std::string& name : names) {
    if (name != "all" && std::ranges::find(known, name) == known.end())
      throw InputError(fmt::format("--methods: unknown method '{}'; use 'all' or some of: {}", name, fmt::join(known, ", ")));
  }
}

}  // namespace

std::string Candidate::label() const {
  std::string text = name;
  for (const auto& [key, value] : settings) text += fmt::format(" {}={}", key, value);
  return text;
}

std::vector<Candidate> candidates(const CandidateSelection& selection) {
  check_names(selection.names);
  const auto wanted = [&](std::string_view name) {
    return selection.names.empty() ||
           std::ranges::any_of(selection.names, [&](const std::string& asked) { return asked == "all" || asked == name; });
  };
  std::vector<Candidate> all;
  const auto append = [&](std::vector<Candidate> rows) { std::ranges::move(rows, std::back_inserter(all)); };
  for (const MethodInfo& info : methods())
    if (wanted(info.name)) append(method_candidates(info, selection));
  for (const Rival& rival : rivals())
    if (wanted(rival.name)) append(rival_candidates(rival, selection.quick));
  return all;
}

}  // namespace halfshade
