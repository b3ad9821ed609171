#include <gtest/gtest.h>

#include <cstdio>
#include <nlohmann/json.hpp>
#include <string>

#include "support/temp_folder.hpp"

namespace {

/// What `halfshade inspect` prints about a mesh with this text.
std::string inspect(std::string_view text, const std::string& options) {
  const TempFolder folder;
  const auto path = folder.write("mesh.obj", text);
  FILE* pipe = popen(("'" HALFSHADE_CLI "' inspect " + options + " '" + path.string() + "'").c_str(), "r");
  std::string output;
  char buffer[4096];
  for (std::size_t count; (count = fread(buffer, 1, sizeof buffer, pipe)) > 0;) output.append(buffer, count);
  EXPECT_EQ(pclose(pipe), 0);
  return output;
}

nlohmann::json inspect_json(std::string_view text) {
  const auto reports = nlohmann::json::parse(inspect(text, "--json"));
  EXPECT_EQ(reports.size(), 1u);
  return reports.at(0);
}

const std::string corners = "v 10 0 0\nv 12 0 0\nv 10 2 0\nv 10 0 3\n";
const std::string tetrahedron = corners + "f 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";

TEST(Inspect, ClosedMeshHasAVolumeAndAnOrientation) {
  const auto report = inspect_json(tetrahedron);
  EXPECT_EQ(report["vertices"], 4);
  EXPECT_EQ(report["triangles"], 4);
  EXPECT_EQ(report["edges"], 6);
  EXPECT_EQ(report["components"], 1);
  EXPECT_EQ(report["closed"], true);
  EXPECT_EQ(report["orientation"], "outward");
  EXPECT_NEAR(report["signed_volume"].get<double>(), 2.0, 1e-6);
  EXPECT_EQ(report["bounds"], nlohmann::json::parse("[[10, 0, 0], [12, 2, 3]]"));
}

TEST(Inspect, InsideOutIsInward) {
  const auto report = inspect_json(corners + "f 1 2 3\nf 1 4 2\nf 1 3 4\nf 2 4 3\n");
  EXPECT_EQ(report["orientation"], "inward");
  EXPECT_NEAR(report["signed_volume"].get<double>(), -2.0, 1e-6);
}

TEST(Inspect, WindingsThatDisagreeAreMixed) {
  const auto report = inspect_json(corners + "f 1 2 3\nf 1 2 4\nf 1 4 3\nf 2 3 4\n");
  EXPECT_EQ(report["closed"], true);
  EXPECT_EQ(report["inconsistent_edges"], 3);
  EXPECT_EQ(report["orientation"], "mixed");
}

TEST(Inspect, SheetOfTwoSidesIsFlat) {
  EXPECT_EQ(inspect_json(corners + "f 1 2 3\nf 3 2 1\n")["orientation"], "flat");
}

TEST(Inspect, OpenPartsDegenerateTrianglesAndWeldingAreCounted) {
  const auto report = inspect_json(corners + "v 12 0 0\nv 0 0 0\nv 1 1 1\nv 2 2 2\nf 1 5 3\nf 2 5 1\nf 6 7 8\n");
  EXPECT_EQ(report["source_vertices"], 8);
  EXPECT_EQ(report["vertices"], 6);
  EXPECT_EQ(report["triangles"], 2);
  EXPECT_EQ(report["collapsed_triangles"], 1);
  EXPECT_EQ(report["zero_area_triangles"], 1);
  EXPECT_EQ(report["boundary_edges"], 6);
  EXPECT_EQ(report["components"], 2);
  EXPECT_EQ(report["closed"], false);
  EXPECT_EQ(report["orientation"], "open");
}

TEST(Inspect, TextSaysTheSame) {
  const std::string text = inspect(tetrahedron, "");
  for (const char* part : {"mesh.obj\n", "4 (4 in the file)", "6 (0 boundary, 0 non-manifold", "yes, outward"}) {
    EXPECT_NE(text.find(part), std::string::npos) << "no '" << part << "' in:\n" << text;
  }
}

}  // namespace
