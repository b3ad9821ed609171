#include <fmt/format.h>

#include <algorithm>

#include "cli/commands.hpp"
#include "halfshade/halfshade.hpp"

namespace halfshade {

void add_methods(CLI::App& program) {
  CLI::App* command = program.add_subcommand("methods", "List the shadow methods and the options each uses");
  command->footer("Example:\n  halfshade methods\n");
  command->callback([] {
    std::size_t width = 0;
    for (const MethodInfo& info : methods()) width = std::max(width, info.name.size());
    for (const MethodInfo& info : methods()) {
      fmt::print("{:<{}}  {}\n", info.name, width, info.summary);
      fmt::print("{:<{}}  source: {}\n", "", width, info.source);
      fmt::print("{:<{}}  options: {}\n", "", width, info.options);
    }
  });
}

}  // namespace halfshade
