// A report on disk: report.json, report.csv, index.html and pictures, saved after every step, so that an interrupted run can go
// on.
#pragma once

#include <filesystem>
#include <glm/glm.hpp>
#include <span>
#include <string>
#include <vector>

#include "report/figures_json.hpp"

namespace halfshade {

/// The folder of a report that is being made.
class ReportFolder {
 public:
  /// Makes the folder if it is missing and reads what an interrupted run of the same program on the same machine has left there.
  /// `head` is the report without its scenes. Throws InputError where the folder cannot be written to.
  ReportFolder(std::filesystem::path folder, Json head);

  const std::filesystem::path& path() const { return folder_; }

  /// What an interrupted run has measured of a row, by its label, for the light with this truth; null where nothing.
  const Json* earlier_result(const std::string& truth_key, const std::string& label) const;

  /// Adds a scene; the lights that follow are its own.
  void begin_scene(Json scene);
  /// Adds a light to the last scene; the results that follow are its own.
  void begin_light(Json light);
  /// Replaces the results of the last light.
  void set_results(Json results);

  /// Writes report.json.
  void save() const;
  /// Writes report.json, report.csv and the page.
  void save_all(bool complete);
  /// Removes the page and report.csv: what has been measured is not to be looked at. An interrupted run's rows stay.
  void withdraw() const;

  /// Write a picture and return its file name within the folder: values 0..1 as grey levels, linear colours as sRGB.
  std::string save_plane(const std::string& name, glm::uvec2 resolution, const std::vector<float>& plane) const;
  std::string save_shaded(const std::string& name, glm::uvec2 resolution, const std::vector<glm::vec4>& rgb) const;

 private:
  Json& last_light() { return json_["scenes"].back()["lights"].back(); }
  bool has_light(const Json& truth_key) const;
  void read_earlier();
  void write(const char* name, const std::string& text) const;
  std::string save_picture(const std::string& name, glm::uvec2 resolution, int channels,
                           std::span<const unsigned char> bytes) const;

  std::filesystem::path folder_;
  Json json_;
  std::vector<Json> earlier_;  ///< lights of the interrupted run
};

}  // namespace halfshade
