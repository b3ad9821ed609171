#include "report/report_folder.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <utility>

#include "halfshade/halfshade.hpp"
#include "image/image_io.hpp"
#include "image/whole_file.hpp"
#include "report/report_csv.hpp"
#include "report/report_page.hpp"
#include "scene/json_node.hpp"
#include "scene/limits.hpp"
#include "scene/read_file.hpp"

namespace halfshade {

namespace fs = std::filesystem;

ReportFolder::ReportFolder(fs::path folder, Json head) : folder_(std::move(folder)), json_(std::move(head)) {
  json_["scenes"] = Json::array();
  prepare_output_folder(folder_);
  prepare_output_folder(folder_ / "pictures");
  remove_abandoned_files(
      folder_, [](std::string_view name) { return name == "report.json" || name == "report.csv" || name == "index.html"; });
  remove_abandoned_files(folder_ / "pictures", [](std::string_view name) { return name.ends_with(".png"); });
  read_earlier();
}

void ReportFolder::read_earlier() {
  const fs::path path = folder_ / "report.json";
  if (!fs::exists(path)) return;
  const std::string text = read_file(path, "a report", limits::report_bytes);
  if (place_too_deep(text)) return;  // no report of this program
  const Json before = Json::parse(text, nullptr, false);
  if (!before.is_object() || before.value("complete", true)) return;
  // Only what the same program has measured is kept. Kernels read from a folder can be any.
  if (const char* folder = std::getenv("HALFSHADE_KERNELS"); folder && *folder) return;
  const auto same = [&](const char* key) { return before.contains(key) && before[key] == json_[key]; };
  if (!(same("format") && same("version") && same("commit") && same("device") && same("host"))) return;
  for (const Json& scene : before.at("scenes"))
    for (const Json& light : scene.at("lights")) earlier_.push_back(light);
  if (before.contains("earlier")) earlier_.insert(earlier_.end(), before["earlier"].begin(), before["earlier"].end());
}

const Json* ReportFolder::earlier_result(const std::string& truth_key, const std::string& label) const {
  for (const Json& light : earlier_) {
    if (light.at("truth_key") != truth_key) continue;
    for (const Json& result : light.at("results"))
      if (result.at("label") == label && fs::exists(folder_ / result.at("picture").get<std::string>())) return &result;
  }
  return nullptr;
}

void ReportFolder::begin_scene(Json scene) {
  scene["lights"] = Json::array();
  json_["scenes"].push_back(std::move(scene));
}

void ReportFolder::begin_light(Json light) {
  light["results"] = Json::array();
  json_["scenes"].back()["lights"].push_back(std::move(light));
}

void ReportFolder::set_results(Json results) {
  last_light()["results"] = std::move(results);
}

void ReportFolder::save() const {
  Json all = json_;
  if (!json_.at("complete").get<bool>()) {
    // What the interrupted run has of lights that this one has not come to yet stays until it has.
    Json waiting = Json::array();
    std::copy_if(earlier_.begin(), earlier_.end(), std::back_inserter(waiting),
                 [this](const Json& light) { return !has_light(light.at("truth_key")); });
    if (!waiting.empty()) all["earlier"] = std::move(waiting);
  }
  write("report.json", all.dump(1) + "\n");
}

void ReportFolder::save_all(bool complete) {
  json_["complete"] = complete;
  write("report.csv", report_csv(json_));
  write("index.html", report_page(json_, folder_));
  save();
}

void ReportFolder::withdraw() const {
  for (const char* name : {"index.html", "report.csv"}) {
    std::error_code error;
    fs::remove(folder_ / name, error);
    if (error) throw DeviceError(fmt::format("{}: cannot be removed ({})", (folder_ / name).string(), error.message()));
  }
}

std::string ReportFolder::save_plane(const std::string& name, glm::uvec2 resolution, const std::vector<float>& plane) const {
  std::vector<unsigned char> bytes(plane.size());
  for (std::size_t i = 0; i < plane.size(); ++i)
    bytes[i] = static_cast<unsigned char>(255.0f * std::clamp(plane[i] > 0.0f ? plane[i] : 0.0f, 0.0f, 1.0f) + 0.5f);
  return save_picture(name, resolution, 1, bytes);
}

std::string ReportFolder::save_shaded(const std::string& name, glm::uvec2 resolution, const std::vector<glm::vec4>& rgb) const {
  std::vector<unsigned char> bytes;
  bytes.reserve(rgb.size() * 3);
  for (const glm::vec4& pixel : rgb)
    for (int c = 0; c < 3; ++c) bytes.push_back(srgb_byte_from_linear(pixel[c]));
  return save_picture(name, resolution, 3, bytes);
}

std::string ReportFolder::save_picture(const std::string& name, glm::uvec2 resolution, int channels,
                                       std::span<const unsigned char> bytes) const {
  const std::string file = "pictures/" + name + ".png";
  write_file_whole(folder_ / file, encode_png(resolution, channels, bytes));
  return file;
}

bool ReportFolder::has_light(const Json& truth_key) const {
  for (const Json& scene : json_.at("scenes"))
    for (const Json& light : scene.at("lights"))
      if (light.at("truth_key") == truth_key) return true;
  return false;
}

void ReportFolder::write(const char* name, const std::string& text) const {
  write_file_whole(folder_ / name, {reinterpret_cast<const unsigned char*>(text.data()), text.size()});
}

}  // namespace halfshade
