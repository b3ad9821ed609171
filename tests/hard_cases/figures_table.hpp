// The figures of docs/hard-cases.md: each method's error in each hard case. One table is read by people and by the tests, which
// fail where a figure is worse than it says by more than a little.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "report/error_figures.hpp"

namespace halfshade {

/// Of one method in one case, over its lights.
struct MethodFigures {
  std::size_t counted = 0, false_lit = 0, false_umbra = 0;
  double squares = 0.0;

  void add(const ErrorFigures& figures);
  double rmse() const;
};
using CaseFigures = std::map<std::string, MethodFigures>;

class FiguresTable {
 public:
  /// The table of docs/hard-cases.md; or, with HALFSHADE_HARD_CASES_TABLE, one that is recorded and written to that file when the
  /// process ends.
  static FiguresTable& instance();
  ~FiguresTable();

  bool is_recording() const { return !output_.empty(); }
  void record(const std::string& name, const std::string& expected, const CaseFigures& figures);
  /// What is worse than the table says; empty if nothing is, or the table has no such case.
  std::string worse(const std::string& name, const std::string& method, const MethodFigures& figures) const;

 private:
  FiguresTable();
  struct Cell {
    double rmse;
    std::size_t false_lit, false_umbra;
  };
  void read(const std::string& path);

  std::string output_;
  std::map<std::string, std::string> rows_;                   ///< recorded, as written, by case
  std::map<std::string, std::map<std::string, Cell>> cells_;  ///< read: by case and method
};

}  // namespace halfshade
