#include "cli/draw_options.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <optional>

#include "cli/parse.hpp"
#include "methods/option.hpp"

namespace halfshade {
namespace {

/// A method and its declaration of an option.
struct Use {
  const MethodInfo* info;
  const Option* option;

  std::string default_text() const { return option->text({.method = info->method}); }
};

/// The methods that use an option, in the order of methods().
std::vector<Use> uses_of(std::string_view name) {
  std::vector<Use> uses;
  for (const MethodInfo& info : methods())
    if (const Option* option = find_option(info.method, name)) uses.push_back({&info, option});
  return uses;
}

std::vector<std::string_view> names_of(const std::vector<Use>& uses) {
  std::vector<std::string_view> names;
  for (const Use& use : uses) names.push_back(use.info->name);
  return names;
}

std::vector<Method> chosen_methods(const std::vector<std::string>& names) {
  std::vector<Method> chosen;
  const auto add = [&](Method method) {
    if (std::ranges::find(chosen, method) == chosen.end()) chosen.push_back(method);
  };
  for (const std::string& name : names) {
    if (name == "all") {
      for (const MethodInfo& info : methods()) add(info.method);
    } else {
      add(method_from_name(name));
    }
  }
  return chosen;
}

/// What a method says against a value of its option; nothing where it takes it.
std::optional<std::string> refusal(const Use& use, std::string_view text) {
  Settings settings{.method = use.info->method};
  try {
    use.option->set(settings, text);
    return {};
  } catch (const InputError& error) {
    return error.what();
  }
}

/// Throws InputError where none of the chosen methods uses an option that is given.
void check_is_used(const std::vector<Method>& chosen, std::string_view name, std::string_view text) {
  const auto uses = [&](Method method) { return find_option(method, name) != nullptr; };
  if (std::ranges::any_of(chosen, uses)) return;
  std::vector<std::string_view> names;
  for (const Method method : chosen) names.push_back(name_of(method));
  throw InputError(fmt::format("--{}: method {} has no use for it (found '{}'); leave it out or choose {}", name,
                               fmt::join(names, ", "), text, fmt::join(names_of(uses_of(name)), " or ")));
}

/// Sets an option of a method. Throws InputError, naming the option, and the method too where others would not say the same.
void set_option(Settings& settings, const Option& option, std::string_view text) {
  try {
    option.set(settings, text);
  } catch (const InputError& error) {
    const auto says_the_same = [&](const Use& use) { return refusal(use, text) == error.what(); };
    const bool all_say = std::ranges::all_of(uses_of(option.name), says_the_same);
    throw InputError(fmt::format("--{}: {}{}", option.name, all_say ? "" : fmt::format("method {}: ", name_of(settings.method)),
                                 error.what()));
  }
}

/// Text in lines of at most `width` columns, broken between words.
std::string wrapped(std::string_view text, std::size_t width) {
  std::string lines;
  std::size_t column = 0;
  for (const std::string& word : split(text, ' ')) {
    if (column > 0 && column + 1 + word.size() > width) {
      lines += '\n';
      column = 0;
    }
    lines += (column > 0 ? " " : "") + word;
    column += word.size() + (column > 0 ? 1 : 0);
  }
  return lines;
}

}  // namespace

std::vector<std::string_view> option_names() {
  std::vector<std::string_view> names;
  for (const MethodInfo& info : methods())
    for (const Option& option : options_of(info.method))
      if (std::ranges::find(names, option.name) == names.end()) names.push_back(option.name);
  return names;
}

std::string option_help(std::string_view name) {
  const std::vector<Use> uses = uses_of(name);
  const Option& first = *uses.front().option;
  std::vector<std::string> notes;
  if (uses.size() < methods().size()) notes.push_back(fmt::format("{}", fmt::join(names_of(uses), ", ")));
  const auto same = [&](const Use& use) {
    return use.default_text() == uses.front().default_text() && use.option->values == first.values;
  };
  if (!first.is_switch() && std::ranges::all_of(uses, same)) {
    notes.push_back(fmt::format("default: {}", uses.front().default_text()));
  } else if (!first.is_switch()) {
    // One default a method says which methods use the option. A method with other values than the first says them too.
    std::vector<std::string> defaults;
    for (const Use& use : uses) {
      const bool other_values = use.option->values != first.values;
      const std::string values = other_values ? fmt::format(" of {}", use.option->values) : "";
      defaults.push_back(fmt::format("{} {}{}", use.info->name, use.default_text(), values));
    }
    notes = {fmt::format("default: {}", fmt::join(defaults, ", "))};
  }
  return notes.empty() ? std::string(first.summary) : fmt::format("{} ({})", first.summary, fmt::join(notes, "; "));
}

void DrawOptions::add(CLI::App& command, std::string_view default_methods) {
  // One value an occurrence: otherwise an option that can repeat would swallow the scene's path.
  command.add_option("-m,--method", methods, fmt::format("Methods, or 'all' (default: {})", default_methods))
      ->delimiter(',')
      ->allow_extra_args(false)
      ->option_text("M[,M...]");
  constexpr std::size_t help_width = 72;
  for (const std::string_view name : option_names()) {
    const std::string flag = fmt::format("--{}", name), help = wrapped(option_help(name), help_width);
    const Option& option = *uses_of(name).front().option;
    if (option.is_switch()) {
      command.add_flag_callback(
          flag, [this, name] { values.insert_or_assign(std::string(name), "yes"); }, help);
    } else {
      const auto keep = [this, name](const std::string& text) { values.insert_or_assign(std::string(name), text); };
      command.add_option_function<std::string>(flag, keep, help)->option_text(std::string(option.values));
    }
  }
}

std::vector<Settings> DrawOptions::settings(std::string_view default_methods) const {
  const std::vector<Method> chosen = chosen_methods(methods.empty() ? split(default_methods, ',') : methods);
  for (const std::string_view name : option_names())
    if (const auto given = values.find(name); given != values.end()) check_is_used(chosen, name, given->second);

  std::vector<Settings> all;
  for (const Method method : chosen) {
    Settings& settings = all.emplace_back();
    settings.method = method;
    for (const Option& option : options_of(method))
      if (const auto given = values.find(option.name); given != values.end()) set_option(settings, option, given->second);
  }
  return all;
}

}  // namespace halfshade
