// halfshade, the program: reads the command line, runs one sub-command, and turns exceptions into messages and exit codes.
#include <fmt/format.h>

#include <csignal>
#include <exception>
#include <new>
#include <string>
#include <thread>
#include <vector>

#include "cli/commands.hpp"
#include "halfshade/halfshade.hpp"
#include "image/image_io.hpp"

namespace {

enum ExitCode { done = 0, work_failed = 1, bad_usage_or_input = 2 };

/// A file half-written when the program is stopped would stay under its temporary name. A thread of its own waits for the signals
/// that stop it, but for those that whoever started it chose to ignore; all others leave them to it.
void clean_up_when_stopped() {
  sigset_t stops;
  sigemptyset(&stops);
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
    struct sigaction chosen {};
    if (sigaction(signal, nullptr, &chosen) == 0 && chosen.sa_handler != SIG_IGN) sigaddset(&stops, signal);
  }
  pthread_sigmask(SIG_BLOCK, &stops, nullptr);
  std::thread([stops] {
    int signal = 0;
    if (sigwait(&stops, &signal) != 0) return;
    halfshade::stop_writing();
    pthread_sigmask(SIG_UNBLOCK, &stops, nullptr);
    std::raise(signal);
  }).detach();
}

int fail(ExitCode code, std::string_view message) {
  fmt::print(stderr, "halfshade: {}\n", message);
  return code;
}

/// Describes every command to the parser.
void add_commands(CLI::App& program) {
  program.set_version_flag("--version", fmt::format("halfshade {}", halfshade::version()));
  program.require_subcommand(1);
  program.get_formatter()->column_width(30);
  program.footer(
      "halfshade COMMAND --help tells more. Exit codes: 0 done, 1 the work failed, 2 bad usage or input.\n"
      "Environment: HALFSHADE_DEVICE (as --device), HALFSHADE_KERNELS (folder to read kernels from).\n\n"
      "Examples:\n"
      "  halfshade render data/scenes/primitives.json --png\n"
      "  halfshade render data/scenes/turntable.json --method all --frames 1-24 -o frames\n"
      "  halfshade bench data/scenes/primitives.json --repeat 21\n"
      "  halfshade report data/scenes/primitives.json --quick\n"
      "  halfshade inspect data/meshes/torus.obj\n");
  halfshade::add_render(program);
  halfshade::add_bench(program);
  halfshade::add_compare(program);
#ifdef HALFSHADE_HAS_REPORT
  halfshade::add_report(program);
#endif
  halfshade::add_inspect(program);
  halfshade::add_devices(program);
  halfshade::add_methods(program);
}

}  // namespace

int main(int argument_count, char** arguments) {
  clean_up_when_stopped();
  std::signal(SIGXFSZ, SIG_IGN);  // a file too large is an error of write(), with a message

  CLI::App program("Soft shadows from area lights, computed with OpenCL", "halfshade");
  add_commands(program);
  if (argument_count < 2) {
    fmt::print(stderr, "{}", program.help());
    return bad_usage_or_input;
  }

  try {
    program.parse(argument_count, arguments);
    return std::fflush(stdout) == 0 ? done : fail(work_failed, "stdout: cannot be written; is the disk full?");
  } catch (const CLI::Success& asked_for_help) {
    return program.exit(asked_for_help);
  } catch (const CLI::ParseError& error) {
    const auto chosen = program.get_subcommands();
    const std::vector<std::string> unknown = program.remaining();
    if (chosen.empty() && !unknown.empty()) {
      return fail(bad_usage_or_input, fmt::format("{}: no such command; see halfshade --help", unknown.front()));
    }
    const std::string command = chosen.empty() ? "" : " " + chosen.front()->get_name();
    return fail(bad_usage_or_input, fmt::format("{}; see halfshade{} --help", error.what(), command));
  } catch (const halfshade::InputError& error) {
    return fail(bad_usage_or_input, error.what());
  } catch (const std::bad_alloc&) {
    return fail(work_failed, "out of memory; choose a smaller --resolution or --light-res");
  } catch (const std::exception& error) {
    return fail(work_failed, error.what());
  }
}
