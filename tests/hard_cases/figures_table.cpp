#include "hard_cases/figures_table.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <sstream>

#include "halfshade/halfshade.hpp"
#include "hard_cases/cases.hpp"

namespace halfshade {
namespace {

constexpr std::string_view begin_mark = "<!-- figures: scripts/update_hard_cases.sh -->";
constexpr std::string_view end_mark = "<!-- figures end -->";

/// A figure may be worse than the table by so much: devices round differently.
constexpr double rmse_slack = 0.01;
std::size_t with_slack(std::size_t pixels) {
  return pixels + pixels / 4 + 6;
}

std::vector<std::string> methods_best_first() {
  std::vector<std::string> names = {"exact"};
  for (const MethodInfo& info : methods())
    if (info.method != Method::exact) names.emplace_back(info.name);
  return names;
}

std::vector<std::string> cells_of(const std::string& line) {
  std::vector<std::string> cells;
  std::istringstream stream(line);
  for (std::string cell; std::getline(stream, cell, '|');) {
    const std::size_t first = cell.find_first_not_of(' '), last = cell.find_last_not_of(' ');
    cells.push_back(first == cell.npos ? "" : cell.substr(first, last - first + 1));
  }
  if (!cells.empty()) cells.erase(cells.begin());
  return cells;
}

std::string joined(const std::vector<std::string>& cells) {
  std::string line = "|";
  for (const std::string& cell : cells) line += " " + cell + " |";
  return line;
}

}  // namespace

void MethodFigures::add(const ErrorFigures& figures) {
  counted += figures.counted_pixels;
  false_lit += figures.false_lit;
  false_umbra += figures.false_umbra;
  squares += figures.rmse * figures.rmse * static_cast<double>(figures.counted_pixels);
}

double MethodFigures::rmse() const {
  return counted == 0 ? 0.0 : std::sqrt(squares / static_cast<double>(counted));
}

FiguresTable& FiguresTable::instance() {
  static FiguresTable table;
  return table;
}

FiguresTable::FiguresTable() {
  if (const char* path = std::getenv("HALFSHADE_HARD_CASES_TABLE"); path != nullptr)
    output_ = path;
  else
    read(HALFSHADE_TEST_DIR "/../docs/hard-cases.md");
}

void FiguresTable::read(const std::string& path) {
  std::ifstream file(path);
  std::vector<std::string> heads;
  bool is_inside = false;
  for (std::string line; std::getline(file, line);) {
    if (line == begin_mark) is_inside = true;
    if (line == end_mark) is_inside = false;
    if (!is_inside || !line.starts_with("| ")) continue;
    const std::vector<std::string> cells = cells_of(line);
    if (heads.empty()) {
      heads = cells;
      continue;
    }
    for (std::size_t i = 2; i < std::min(cells.size(), heads.size()); ++i) {
      Cell cell{};
      if (std::sscanf(cells[i].c_str(), "%lf %zu/%zu", &cell.rmse, &cell.false_lit, &cell.false_umbra) == 3)
        cells_[cells[0]][heads[i]] = cell;
    }
  }
}

void FiguresTable::record(const std::string& name, const std::string& expected, const CaseFigures& figures) {
  std::vector<std::string> cells = {name, expected};
  for (const std::string& method : methods_best_first()) {
    const auto found = figures.find(method);
    cells.push_back(found == figures.end()
                        ? "–"
                        : fmt::format("{:.3f} {}/{}", found->second.rmse(), found->second.false_lit, found->second.false_umbra));
  }
  rows_[name] = joined(cells);
}

std::string FiguresTable::worse(const std::string& name, const std::string& method, const MethodFigures& figures) const {
  const auto row = cells_.find(name);
  if (row == cells_.end() || !row->second.contains(method))
    return fmt::format("{}: docs/hard-cases.md has no figures of '{}'; run scripts/update_hard_cases.sh", method, name);
  const Cell& cell = row->second.at(method);
  if (figures.rmse() <= cell.rmse + rmse_slack && figures.false_lit <= with_slack(cell.false_lit) &&
      figures.false_umbra <= with_slack(cell.false_umbra))
    return {};
  return fmt::format("{}: rmse {:.3f}, false_lit {}, false_umbra {}; docs/hard-cases.md says {:.3f} {}/{}", method,
                     figures.rmse(), figures.false_lit, figures.false_umbra, cell.rmse, cell.false_lit, cell.false_umbra);
}

FiguresTable::~FiguresTable() {
  if (output_.empty()) return;
  // What stands around the table stays.
  std::ifstream before(output_);
  std::string head, tail;
  bool has_begun = false, has_ended = false;
  for (std::string line; std::getline(before, line);) {
    if (!has_begun) head += line + "\n";
    if (line == begin_mark) has_begun = true;
    if (line == end_mark) has_ended = true;
    if (has_ended) tail += line + "\n";
  }
  before.close();
  if (!has_begun) head += std::string(begin_mark) + "\n";
  if (!has_ended) tail = std::string(end_mark) + "\n";
  std::vector<std::string> heads = {"case", "expected"};
  for (const std::string& method : methods_best_first()) heads.push_back(method);
  std::ofstream file(output_);
  file << head << "\n"
       << joined(heads) << "\n|" <<
      [&] {
        std::string rule;
        for (std::size_t i = 0; i < heads.size(); ++i) rule += "---|";
        return rule;
      }()
       << "\n";
  for (const HardCase& one : hard_cases())
    if (const auto row = rows_.find(one.name); row != rows_.end()) file << row->second << "\n";
  file << "\n" << tail;
}

}  // namespace halfshade
