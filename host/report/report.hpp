// Speed against error: every method over its options, and ray tracing as the rival, measured in one process on the same pixels
// against the ray-traced truth.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "halfshade/halfshade.hpp"
#include "report/candidates.hpp"

namespace halfshade {

/// A scene to measure and the file that it came from.
struct ReportInput {
  std::filesystem::path path;
  Scene scene;
};

/// What a report is made of.
struct ReportOptions {
  CandidateSelection candidates;
  unsigned truth_samples = 1024;  ///< rays a pixel
  unsigned repeats = 11;          ///< timed runs after a warm-up
  unsigned threads = 0;           ///< for rays; 0: all cores
  std::filesystem::path cache;    ///< where truths are kept; empty: the user's cache
  std::filesystem::path folder;   ///< where the report is written; empty: nowhere
  std::string command;            ///< that makes the report, as it could be typed again
};

/// What a report tells while it is made.
struct ReportEvents {
  std::function<void(const std::string& text)> now;    ///< what is being done
  std::function<void(const std::string& text)> done;   ///< a light has been measured
  std::function<void(const std::string& text)> table;  ///< the figures of a light
};

/// Measures all lights of all scenes. What an interrupted run of the same program left in the folder is not measured again.
/// Throws InputError for a folder that cannot be written to or a name that is none of a method or rival.
void make_report(const std::vector<ReportInput>& inputs, const std::shared_ptr<Device>& device, const ReportOptions& options,
                 const ReportEvents& events);

}  // namespace halfshade
