// halfshade, the program: reads the command line, runs one sub-command, and turns exceptions into messages and exit codes.
#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <csignal>
#include <cstdio>
#include <exception>
#include <iostream>
#include <new>
#include <string>
#include <system_error>
#include <thread>
#include <vector>

#include "cli/commands.hpp"
#include "cli/progress.hpp"
#include "halfshade/halfshade.hpp"
#include "image/whole_file.hpp"

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
  halfshade::print_message(fmt::format("halfshade: {}\n", message));
  return code;
}

/// What was asked for is on stdout, or the work has failed.
int end_of_output(int code) {
  std::cout.flush();
  const bool is_written = std::cout.good() && std::fflush(stdout) == 0 && std::ferror(stdout) == 0;
  return is_written ? code : fail(work_failed, "stdout: cannot be written; is it closed, or the disk full?");
}

/// A stream that whoever started the program has closed would be the first file that it opens, and take what is printed. Into
/// stderr's place goes one that takes everything, into the others' one that refuses.
void occupy_closed_streams() {
  for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO})
    if (fcntl(stream, F_GETFD) < 0) {
      const int null = open("/dev/null", stream == STDERR_FILENO ? O_WRONLY : O_RDONLY);
      if (null >= 0 && null != stream) {
        dup2(null, stream);
        close(null);
      }
    }
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
  occupy_closed_streams();
  clean_up_when_stopped();
  std::signal(SIGXFSZ, SIG_IGN);  // a file too large, and a reader that has gone, are errors of write(), with a message
  std::signal(SIGPIPE, SIG_IGN);

  CLI::App program("Soft shadows from area lights, computed with OpenCL", "halfshade");
  add_commands(program);
  if (argument_count < 2) {
    halfshade::print_message(program.help());
    return bad_usage_or_input;
  }

  try {
    program.parse(argument_count, arguments);
    return end_of_output(done);
  } catch (const CLI::Success& asked_for_help) {
    return end_of_output(program.exit(asked_for_help));
  } catch (const std::system_error& error) {  // of fmt::print
    return std::ferror(stdout) ? end_of_output(done) : fail(work_failed, error.what());
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
