// Methods and their options on the command line, as render and bench take them. The options are those that the methods declare
// (methods/option.hpp): none of them is named here.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "halfshade/halfshade.hpp"

namespace halfshade {

/// Texts as given. `add` declares the options; `settings` reads them.
struct DrawOptions {
  std::vector<std::string> methods;
  std::map<std::string, std::string, std::less<>> values;  ///< of the methods' options that are given, by name

  /// Declares --method and every option of every method. Both end when this does.
  void add(CLI::App& command, std::string_view default_methods);

  /// One a method, in the order given and without repeats; `default_methods` where none is given, "all" is every method.
  /// Throws InputError, naming the option, for a value that a chosen method refuses, and for an option that none of them uses.
  std::vector<Settings> settings(std::string_view default_methods) const;
};

/// The names of all methods' options, in order of first appearance.
std::vector<std::string_view> option_names();

/// The help of an option: what it is, which methods use it, and its default where it has one.
std::string option_help(std::string_view name);

}  // namespace halfshade
