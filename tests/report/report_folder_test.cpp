// A report on disk: its page, its table, and how an interrupted run goes on.
#include "report/report_folder.hpp"

#include <gtest/gtest.h>

#include "halfshade/halfshade.hpp"
#include "report/report_csv.hpp"
#include "report/report_json.hpp"
#include "report/report_page.hpp"
#include "support/temp_folder.hpp"

namespace halfshade {
namespace {

Json head() {
  return {{"format", 1}, {"complete", false}, {"version", "1"}, {"commit", "c"}, {"device", "d"}, {"host", "h"}};
}

/// A row with a figure in every place.
Measurement measured_row() {
  Measurement row;
  row.candidate = {"fins", {{"light_resolution_px", "64"}}, Settings{.method = Method::fins}, true};
  row.cold_ms = 9.0;
  row.times_ms = {4.0, 2.0, 3.0};
  row.stages = {{"bin", 0.25}, {"raster", 0.5}};
  row.figures = {.counted_pixels = 11,
                 .penumbra_pixels = 10,
                 .rmse = 0.1,
                 .penumbra_rmse = 0.2,
                 .bias = -0.3,
                 .max_error = 0.4,
                 .p999_error = 0.5,
                 .bad_fraction = 0.6,
                 .false_lit = 7,
                 .false_umbra = 8,
                 .nonfinite = 9};
  row.negative_pixels = 12;
  row.picture = "pictures/fins.png";
  return row;
}

TEST(ReportJson, RestoresWhatItSaid) {
  const Json results = results_of({measured_row()});
  Measurement row;
  row.candidate = measured_row().candidate;
  restore(row, results.at(0));
  EXPECT_EQ(results_of({row}), results);
  EXPECT_EQ(row.median_ms(), 3.0);
  EXPECT_EQ(row.figures.false_umbra, 8u);
}

TEST(ReportCsv, HasARowAResult) {
  Json report = head();
  report["scenes"] = {
      {{"name", "a,b"}, {"lights", {{{"name", "key"}, {"results", results_of({measured_row(), measured_row()})}}}}}};
  const std::string text = report_csv(report);
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 3);
  EXPECT_NE(text.find("\n\"a,b\",key,fins,method,light_resolution_px=64,3.0,2.0,9.0,3,0.1,"), text.npos) << text;
}

TEST(ReportCsv, NoCellOfTextIsTakenForAFormula) {
  const auto row_of = [](const std::string& scene, const std::string& light) {
    Measurement row = measured_row();
    row.figures.bias = -0.25;
    Json report = head();
    report["scenes"] = {{{"name", scene}, {"lights", {{{"name", light}, {"results", results_of({row})}}}}}};
    const std::string text = report_csv(report);
    return text.substr(text.find('\n') + 1);
  };
  for (const char* scene : {"=1+1", "+1", "-1", "@SUM(A1)", "\t=1", "\r=1"}) {
    const std::string row = row_of(scene, "-");
    EXPECT_TRUE(row.starts_with(fmt::format("\"'{}\",\"'-\",fins,", scene))) << row;
    EXPECT_NE(row.find(",-0.25,"), row.npos) << "numbers stay numbers: " << row;
  }
  EXPECT_TRUE(row_of("=\"a\"", "k").starts_with("\"'=\"\"a\"\"\",k,"));
  EXPECT_TRUE(row_of("a=1", "k-2").starts_with("a=1,k-2,"));
}

TEST(ReportFolder, WhatAKilledProcessLeftIsRemoved) {
  const TempFolder temporary;
  const auto path = temporary / "report";
  const std::string dead = "4194303";  // beyond any process number of a default Linux
  for (const std::string& name : {".report.json." + dead + ".0.part", ".notes.txt." + dead + ".0.part"})
    temporary.write("report/" + name, "x");
  temporary.write("report/pictures/.a.png." + dead + ".0.part", "x");
  ReportFolder(path, head());
  EXPECT_FALSE(std::filesystem::exists(path / (".report.json." + dead + ".0.part")));
  EXPECT_FALSE(std::filesystem::exists(path / "pictures" / (".a.png." + dead + ".0.part")));
  EXPECT_TRUE(std::filesystem::exists(path / (".notes.txt." + dead + ".0.part")));
}

TEST(ReportFolder, KeepsWhatTheSameProgramMeasuredBeforeAnInterruption) {
  const TempFolder temporary;
  const auto path = temporary / "report";
  {
    ReportFolder folder(path, head());
    folder.begin_scene({{"name", "scene"}});
    folder.begin_light({{"name", "key"}, {"truth_key", "t"}});
    Measurement row = measured_row();
    row.picture = folder.save_plane("fins", {2, 1}, {0.0f, 1.0f});
    folder.set_results(results_of({row}));
    folder.save();
  }
  const std::string label = measured_row().candidate.label();
  ReportFolder again(path, head());
  ASSERT_NE(again.earlier_result("t", label), nullptr);
  EXPECT_EQ(again.earlier_result("other truth", label), nullptr);
  EXPECT_EQ(again.earlier_result("t", "other label"), nullptr);
  again.save();  // before it has come to the light: what is known of it stays
  EXPECT_NE(ReportFolder(path, head()).earlier_result("t", label), nullptr);

  Json other = head();
  other["commit"] = "another";
  EXPECT_EQ(ReportFolder(path, other).earlier_result("t", label), nullptr);
  again.save_all(true);
  EXPECT_EQ(ReportFolder(path, head()).earlier_result("t", label), nullptr) << "a finished report is made anew";
}

TEST(ReportPage, CannotBeEndedByANameInIt) {
  const std::string page =
      report_page({{"scenes", nlohmann::ordered_json::array()}, {"command", "</script><script>alert(1)"}}, ".");
  EXPECT_EQ(page.find("</script><script>alert"), page.npos);
  EXPECT_NE(page.find("\\u003c/script>"), page.npos);
  EXPECT_EQ(page.find("{{"), page.npos);
}

}  // namespace
}  // namespace halfshade
