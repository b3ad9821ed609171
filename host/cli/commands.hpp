// The sub-commands of the program. Each add_* describes one to the parser; it runs as the parser's callback.
//
// Errors leave as exceptions: InputError and CLI::ParseError become exit code 2, everything else 1 (main.cpp). Results go to
// stdout, messages to stderr.
#pragma once

#include <CLI/CLI.hpp>

namespace halfshade {

void add_render(CLI::App& program);
void add_bench(CLI::App& program);
void add_compare(CLI::App& program);
void add_inspect(CLI::App& program);
void add_devices(CLI::App& program);
void add_methods(CLI::App& program);
#ifdef HALFSHADE_HAS_REPORT
void add_report(CLI::App& program);
#endif

}  // namespace halfshade
