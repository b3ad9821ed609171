// Speed against error, measured: report.json, report.csv and a page.
#include "report/report.hpp"

#include <fmt/format.h>

#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "base/shared.h"
#include "cli/commands.hpp"
#include "cli/parse.hpp"
#include "cli/progress.hpp"
#include "cli/target_options.hpp"
#include "halfshade/halfshade.hpp"
#include "report/report_table.hpp"
#include "report/truth.hpp"

namespace halfshade {
namespace {

namespace fs = std::filesystem;

struct ReportArguments {
  std::vector<fs::path> scenes;
  std::vector<std::string> methods, light_res;
  std::string truth_samples, repeat;
  TargetOptions target;
  fs::path folder = "out/report", cache;
  bool quick = false, table = false;
};

ReportOptions report_options(const ReportArguments& arguments, const std::string& command) {
  constexpr long max_repeats = 10'000;
  const auto number = [](std::string_view option, const std::string& text, long max) {
    return static_cast<unsigned>(parse_integer(option, text, 1, max));
  };
  ReportOptions options;
  options.candidates.names = arguments.methods;
  options.candidates.quick = arguments.quick;
  for (const std::string& text : arguments.light_res)
    options.candidates.light_resolutions_px.push_back(number("--light-res", text, HS_MAX_RESOLUTION));
  if (arguments.quick) {
    options.truth_samples = 256;
    options.repeats = 5;
  }
  if (!arguments.truth_samples.empty())
    options.truth_samples = number("--truth-samples", arguments.truth_samples, max_truth_samples);
  if (!arguments.repeat.empty()) options.repeats = number("--repeat", arguments.repeat, max_repeats);
  options.threads = arguments.target.thread_count();
  options.cache = arguments.cache;
  if (!arguments.table) options.folder = arguments.folder;
  options.command = command;
  return options;
}

void run_report(const ReportArguments& arguments, const std::string& command) {
  const ReportOptions options = report_options(arguments, command);
  candidates(options.candidates);   // refuses unknown names
  std::vector<ReportInput> inputs;  // all read before any is measured: a long run must not fail at its end
  for (const fs::path& path : arguments.scenes) {
    inputs.push_back({path, arguments.target.load_first_frame(path)});
  }
  Progress progress;
  ReportEvents events;
  events.now = [&](const std::string& text) { progress.now(text); };
  events.done = [&](const std::string& text) { progress.note(text); };
  events.table = [&](const std::string& text) {
    progress.clear();
    fmt::print("{}", text);
    std::fflush(stdout);
  };
  make_report(inputs, arguments.target.open_device(), options, events);
  fmt::print("{}", report_table_legend());
  if (options.folder.empty()) return;
  fmt::print("\nThe page: {}\n", fs::absolute(options.folder / "index.html").lexically_normal().string());
}

/// The command line as it could be typed again.
std::string command_text(const CLI::App& program) {
  std::string text = "halfshade report";
  for (const CLI::Option* option : program.get_options()) {
    for (const std::string& result : option->results()) {
      const std::string name = option->get_positional() ? "" : option->get_name() + (option->get_expected_min() == 0 ? "" : " ");
      const std::string value = option->get_expected_min() == 0 && !option->get_positional() ? "" : result;
      text += " " + name + value;
    }
  }
  return text;
}

}  // namespace

void add_report(CLI::App& program) {
  CLI::App* command = program.add_subcommand("report", "Measure speed against error, with ray tracing as truth and rival");
  const auto arguments = std::make_shared<ReportArguments>();
  command->add_option("SCENE", arguments->scenes, "Scene files (JSON, see README)")->required()->option_text("...");
  command->add_option("-o,--output", arguments->folder, "Output folder, made if missing (default: out/report)")
      ->option_text("DIR");
  command->add_option("-m,--methods", arguments->methods, "Methods and rivals (rays, rays-adaptive) (default: all)")
      ->delimiter(',')
      ->allow_extra_args(false)
      ->option_text("M[,M...]");
  command->add_option("--light-res", arguments->light_res, "Light map resolutions (default: 256 to 4096)")
      ->delimiter(',')
      ->allow_extra_args(false)
      ->option_text("N[,N...]");
  command
      ->add_option("--truth-samples", arguments->truth_samples,
                   fmt::format("Rays a pixel of the truth, 1 to {} (default: 1024)", max_truth_samples))
      ->option_text("N");
  command->add_option("--repeat", arguments->repeat, "Timed runs after a warm-up (default: 11)")->option_text("N");
  command->add_flag("--quick", arguments->quick, "A minute: fewer settings, 256 rays, 5 runs");
  command->add_flag("--table", arguments->table, "Only print the table, write nothing");
  command->add_option("--cache", arguments->cache, "Where truths are kept (default: the user's cache)")->option_text("DIR");
  arguments->target.add(*command, "a CPU device and of rays");
  command->footer(
      "Writes DIR/report.json, report.csv and index.html, a page that needs nothing else. Interrupted, it goes\n"
      "on where it was when called again, its truth included. Times are whole paths, meshes and G-buffer being\n"
      "on the device. Each truth is traced again in part; where that disagrees, nothing is published.\n\n"
      "Examples:\n"
      "  halfshade report data/scenes/primitives.json --quick\n"
      "  halfshade report data/scenes/*.json -o out/all\n"
      "  halfshade report data/scenes/boxes.json -m exact,rays --light-res 512,1024 --table\n");
  command->callback([arguments, command] { run_report(*arguments, command_text(*command)); });
}

}  // namespace halfshade
