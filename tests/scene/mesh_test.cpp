#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>

#include "halfshade/halfshade.hpp"
#include "support/temp_folder.hpp"

namespace {

using halfshade::InputError;
using halfshade::load_obj;
using halfshade::make_mesh;
using halfshade::Mesh;

constexpr double infinity = std::numeric_limits<double>::infinity();

class ObjFile : public testing::Test {
 protected:
  Mesh load(std::string_view text) { return load_obj(folder_.write("mesh.obj", text)); }

  /// Expects the text to be refused with a message that names the file and holds `parts`.
  void refuse(std::string_view text, std::initializer_list<std::string_view> parts) {
    SCOPED_TRACE(text);
    const auto path = folder_.write("mesh.obj", text);
    expect_error<InputError>([&] { load_obj(path); }, parts);
    expect_error<InputError>([&] { load_obj(path); }, {path.string() + ": "});
  }

  TempFolder folder_;
};

constexpr std::string_view square = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

/// Corners of a triangle in the mesh's own space.
std::array<glm::dvec3, 3> corners_of(const Mesh& mesh, std::size_t triangle) {
  std::array<glm::dvec3, 3> corners;
  for (int i = 0; i < 3; ++i) corners[i] = mesh.origin + glm::dvec3(mesh.positions[mesh.triangles[triangle][i]]);
  return corners;
}

/// Sum and least of the triangles' areas, each negative where it runs clockwise as seen along -z.
std::pair<double, double> areas_xy(const Mesh& mesh) {
  double sum = 0.0, least = infinity;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const auto [a, b, c] = corners_of(mesh, t);
    const double area = 0.5 * glm::cross(b - a, c - a).z;
    sum += area;
    least = std::min(least, area);
  }
  return {sum, least};
}

// ---- make_mesh --------------------------------------------------------------------------------------------------------------

TEST(MakeMesh, EqualPositionsBecomeOneVertexInOrderOfFirstAppearance) {
  const std::array<glm::dvec3, 5> positions{{{5, 0, 0}, {0, 0, -0.0}, {5, 0, 0}, {0, 4, 0}, {-0.0, 0, 0}}};
  const std::array<glm::uvec3, 2> triangles{{{0, 3, 1}, {2, 4, 3}}};
  const Mesh mesh = make_mesh("m", positions, triangles);
  EXPECT_EQ(mesh.name, "m");
  EXPECT_EQ(mesh.source_vertex_count, 5u);
  EXPECT_EQ(mesh.collapsed_count, 0u);
  ASSERT_EQ(mesh.positions.size(), 3u);
  ASSERT_EQ(mesh.triangles.size(), 2u);
  EXPECT_EQ(mesh.triangles[0], glm::uvec3(0, 2, 1));
  EXPECT_EQ(mesh.triangles[1], glm::uvec3(0, 1, 2));
  EXPECT_FALSE(std::signbit(mesh.positions[1].z));
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(mesh.origin + glm::dvec3(mesh.positions[i]), (std::array<glm::dvec3, 3>{{{5, 0, 0}, {0, 0, 0}, {0, 4, 0}}})[i]);
  }
}

TEST(MakeMesh, TrianglesThatCollapseAreDroppedAndCounted) {
  const std::array<glm::dvec3, 4> positions{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 0, 0}}};
  const std::array<glm::uvec3, 3> triangles{{{0, 1, 3}, {0, 1, 2}, {2, 2, 1}}};
  const Mesh mesh = make_mesh("m", positions, triangles);
  EXPECT_EQ(mesh.collapsed_count, 2u);
  ASSERT_EQ(mesh.triangles.size(), 1u);
  EXPECT_EQ(mesh.triangles[0], glm::uvec3(0, 1, 2));
}

TEST(MakeMesh, VerticesNoTriangleUsesAreLeftOut) {
  const std::array<glm::dvec3, 5> positions{{{1e30, 0, 0}, {0, 0, 0}, {2, 0, 0}, {0, 2, 0}, {7, 7, 7}}};
  const std::array<glm::uvec3, 1> triangles{{{1, 2, 3}}};
  const Mesh mesh = make_mesh("m", positions, triangles);
  EXPECT_EQ(mesh.positions.size(), 3u);
  EXPECT_EQ(mesh.source_vertex_count, 5u);
  EXPECT_EQ(mesh.origin, glm::dvec3(1, 1, 0));
}

TEST(MakeMesh, ShapeFarFromTheOriginKeepsItsPrecision) {
  const glm::dvec3 far(1e9, -2e9, 3e9);
  const std::array<glm::dvec3, 3> positions{{far, far + glm::dvec3(0.25, 0, 0), far + glm::dvec3(0, 0.25, 0)}};
  const std::array<glm::uvec3, 1> triangles{{{0, 1, 2}}};
  const Mesh mesh = make_mesh("m", positions, triangles);
  ASSERT_EQ(mesh.positions.size(), 3u);
  EXPECT_EQ(mesh.positions[1] - mesh.positions[0], glm::vec3(0.25f, 0, 0));
  EXPECT_EQ(mesh.origin + glm::dvec3(mesh.positions[0]), far);
}

TEST(MakeMesh, PositionsThatSinglePrecisionCannotTellApartAreOne) {
  const std::array<glm::dvec3, 4> positions{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1 + 1e-15, 0, 0}}};
  const std::array<glm::uvec3, 2> triangles{{{0, 1, 2}, {0, 2, 3}}};
  EXPECT_EQ(make_mesh("m", positions, triangles).positions.size(), 3u);
}

TEST(MakeMesh, RefusesWhatIsNoMesh) {
  const std::array<glm::dvec3, 3> good{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}};
  const std::array<glm::uvec3, 1> triangle{{{0, 1, 2}}};
  expect_error<InputError>([&] { make_mesh("my mesh", good, {}); }, {"my mesh: ", "at least one triangle"});
  const std::array<glm::uvec3, 2> out_of_range{{{0, 1, 2}, {0, 1, 3}}};
  expect_error<InputError>([&] { make_mesh("my mesh", good, out_of_range); }, {"my mesh: triangle 1: ", "below 3", "found 3"});
  const std::array<glm::uvec3, 1> collapsed{{{0, 1, 1}}};
  expect_error<InputError>([&] { make_mesh("my mesh", good, collapsed); }, {"my mesh: ", "three different corners"});
  for (const double bad : {infinity, -infinity, std::nan("")}) {
    auto positions = good;
    positions[1].y = bad;
    expect_error<InputError>([&] { make_mesh("my mesh", positions, triangle); }, {"my mesh: vertex 1: ", "finite"});
  }
  auto huge = good;
  huge[2].z = 1e300;
  expect_error<InputError>([&] { make_mesh("my mesh", huge, triangle); }, {"my mesh: vertex 2: ", "single precision", "1e+300"});
}

// ---- load_obj: what is read -------------------------------------------------------------------------------------------------

TEST_F(ObjFile, EveryWayToWriteACornerMeansTheSameTriangle) {
  const std::string vertices = "# comment\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvn 0 0 1\n";
  for (const char* face :
       {"f 1 2 3", "f 1/1 2/1 3/1", "f 1//1 2//1 3//1", "f 1/1/1 2/1/1 3/1/1", "f -3 -2 -1", "\tf  1\t2 3  "}) {
    SCOPED_TRACE(face);
    const Mesh mesh = load(vertices + face);
    ASSERT_EQ(mesh.triangles.size(), 1u);
    const auto corners = corners_of(mesh, 0);
    EXPECT_EQ(corners[0], glm::dvec3(0, 0, 0));
    EXPECT_EQ(corners[1], glm::dvec3(1, 0, 0));
    EXPECT_EQ(corners[2], glm::dvec3(0, 1, 0));
  }
}

TEST_F(ObjFile, EveryKindOfLineEndIsUnderstood) {
  for (const char* end : {"\n", "\r\n", "\r"}) {
    std::string text;
    for (const char* line : {"v 0 0 0", "v 1 0 0", "", "v 0 1 0", "f 1 2 3"}) text += std::string(line) + end;
    EXPECT_EQ(load(text).triangles.size(), 1u);
    refuse(text + "f 1 2 x", {"line 6: "});
  }
}

TEST_F(ObjFile, AByteOrderMarkHidesNothing) {
  EXPECT_EQ(load("\xef\xbb\xbf" + std::string(square) + "f 1 2 3 4\n").source_vertex_count, 4u);
}

TEST_F(ObjFile, NumbersMayCarryPlusSignsExponentsColoursAndWeights) {
  const Mesh mesh = load("v +1 -1.5e0 .5\nv 2. 0 0 1.0\nv 0 1E+1 1e-400 0.1 0.2 0.3\nf 1 2 3\n");
  EXPECT_EQ(corners_of(mesh, 0)[0], glm::dvec3(1, -1.5, 0.5));
  EXPECT_EQ(corners_of(mesh, 0)[2], glm::dvec3(0, 10, 0));
}

TEST_F(ObjFile, CommentsMayFollowVerticesAndFaces) {
  for (const char* comment : {" # x", "#x 7/8/9/1", " # 3 \\", "\t#"}) {
    SCOPED_TRACE(comment);
    const std::string end = std::string(comment) + "\n";
    const Mesh mesh = load("v 0 0 0" + end + "v 1 0 0" + end + "g part#1\nv 0 1 0" + end + "f 1 2 3" + end + "f 3 2 1\n");
    ASSERT_EQ(mesh.triangles.size(), 2u);
    EXPECT_EQ(mesh.triangles[0], glm::uvec3(0, 1, 2));
    EXPECT_EQ(mesh.triangles[1], glm::uvec3(2, 1, 0));
  }
}

TEST_F(ObjFile, ABackslashContinuesALine) {
  for (const char* end : {"\n", "\r\n", "\r"}) {
    SCOPED_TRACE(end[0] == '\r');
    const auto text = [&](std::string lines) {
      std::string result;
      for (const char c : lines) result += c == '\n' ? end : std::string(1, c);
      return result;
    };
    const std::string joined = text("v 0 0 0\nv 1 \\\n0 \\ \n 0\nv 1 1 0\nv 0 1 0\nf 1 2\\\n3 \\\n4\n");
    const Mesh mesh = load(joined);
    ASSERT_EQ(mesh.triangles.size(), 2u);
    EXPECT_EQ(mesh.source_vertex_count, 4u);
    EXPECT_EQ(corners_of(mesh, 0)[1], glm::dvec3(1, 0, 0));
    EXPECT_EQ(mesh.triangles[1], glm::uvec3(0, 2, 3));
    // Lines are those of the file.
    refuse(joined + text("f 1 \\\n2 \\\nx\n"), {"line 12: ", "\"x\""});
    refuse(joined + text("f 1 \\\n2 \\\n3\nf 1 2 y\n"), {"line 13: ", "\"y\""});
    refuse(joined + text("f 1 2 \\\n\\\n9\n"), {"line 12: ", "no higher than 4", "found 9"});
    EXPECT_EQ(load(joined + text("f 1 2 3 \\")).triangles.size(), 3u) << "at the end of the file";
  }
}

TEST_F(ObjFile, OfAMeshThatIsTooLargeTheOutermostVertexIsNamed) {
  refuse("# c\nv 0 0 0\nv 1 \\\n0 0\nv 0 1 1e39\nv 1 1 1\nf 1 2 3\nf 1 2 4\n", {"line 5: ", "single precision", "1e+39"});
  refuse("v 7 7 -1e300\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 2e38 0\nf 1 2 3\nf 2 3 5\n", {"line 1: ", "-1e+300"});
}

TEST_F(ObjFile, FacesMayComeBeforeTheirVertices) {
  EXPECT_EQ(load("f 1 2 3 4\n" + std::string(square)).triangles.size(), 2u);
}

TEST_F(ObjFile, RelativeIndicesCountFromTheirOwnLine) {
  const Mesh mesh = load("v 0 0 0\nv 1 0 0\nv 0 1 0\nf -3 -2 -1\nv 0 0 5\nf -4 -3 -1\n");
  ASSERT_EQ(mesh.triangles.size(), 2u);
  EXPECT_EQ(corners_of(mesh, 1)[0], glm::dvec3(0, 0, 0));
  EXPECT_EQ(corners_of(mesh, 1)[2], glm::dvec3(0, 0, 5));
}

TEST_F(ObjFile, VerticesSplitAtSeamsAreWelded) {
  const Mesh mesh = load(std::string(square) + "v 0 0 0\nv 1 1 0\nf 1 2 3\nf 5 6 4\n");
  EXPECT_EQ(mesh.source_vertex_count, 6u);
  EXPECT_EQ(mesh.positions.size(), 4u);
}

TEST_F(ObjFile, MaterialLibrariesAreNeverOpened) {
  // A pipe that nobody writes to would stop whoever opened it.
  ASSERT_EQ(mkfifo((folder_ / "trap.mtl").c_str(), 0600), 0);
  EXPECT_EQ(load("mtllib trap.mtl\nusemtl x\n" + std::string(square) + "f 1 2 3 4\n").triangles.size(), 2u);
}

// ---- load_obj: polygons -----------------------------------------------------------------------------------------------------

TEST_F(ObjFile, ConvexPolygonBecomesAFan) {
  const Mesh mesh = load(std::string(square) + "f 1 2 3 4\n");
  ASSERT_EQ(mesh.triangles.size(), 2u);
  EXPECT_EQ(mesh.triangles[0], glm::uvec3(0, 1, 2));
  EXPECT_EQ(mesh.triangles[1], glm::uvec3(0, 2, 3));
}

TEST_F(ObjFile, ConcavePolygonsAreCoveredExactlyWhereverTheyLieAndWhicheverWayTheyFace) {
  struct Shape {
    std::vector<glm::dvec2> corners;
    double area;
  };
  const std::vector<Shape> shapes{
      {{{0, 0}, {4, 0}, {1, 1}, {0, 4}}, 4.0},                                                   // arrow head: a concave quad
      {{{0, 0}, {3, 0}, {3, 1}, {1, 1}, {1, 3}, {0, 3}}, 5.0},                                   // L
      {{{0, 0}, {5, 0}, {5, 3}, {4, 3}, {4, 1}, {1, 1}, {1, 3}, {0, 3}}, 9.0},                   // U
      {{{0, 0}, {1, 0}, {2, 0}, {2, 2}, {0, 2}}, 4.0},                                           // a corner in a straight side
      {{{0, 0}, {6, 0}, {6, 6}, {0, 6}, {0, 0}, {2, 2}, {2, 4}, {4, 4}, {4, 2}, {2, 2}}, 32.0},  // a hole, by a bridge
  };
  for (const Shape& shape : shapes) {
    for (const double offset : {0.0, -37.0, 1e6}) {
      for (std::size_t first = 0; first < shape.corners.size(); ++first) {
        for (const bool reversed : {false, true}) {
          std::string vertices, face = "f";
          const std::size_t count = shape.corners.size();
          for (std::size_t i = 0; i < count; ++i) {
            const glm::dvec2 p = shape.corners[(first + (reversed ? count - 1 - i : i)) % count] + offset;
            vertices += "v " + std::to_string(p.x) + " " + std::to_string(p.y) + " 0\n";
            face += " " + std::to_string(i + 1);
          }
          const Mesh mesh = load(vertices + face + "\n");
          const auto [sum, least] = areas_xy(mesh);
          EXPECT_EQ(mesh.triangles.size() + mesh.collapsed_count, count - 2);
          EXPECT_NEAR(sum, reversed ? -shape.area : shape.area, 1e-6);
          EXPECT_TRUE(reversed || least > 0.0) << least;
        }
      }
    }
  }
}

TEST_F(ObjFile, PolygonsKeepTheirSidesWhateverTheirShape) {
  // Crossing itself, all on a line, bent in space: each side stays a side of one triangle, so neighbours stay joined.
  for (const char* vertices : {"v 0 0 0\nv 2 2 0\nv 2 0 0\nv 0 2 0\nv -1 1 0\n", "v 0 0 0\nv 1 0 0\nv 2 0 0\nv 3 0 0\nv 4 0 0\n",
                               "v 0 0 0\nv 2 0 1\nv 1 1 -3\nv 2 2 1\nv 0 2 5\n"}) {
    const Mesh mesh = load(vertices + std::string("f 1 2 3 4 5\n"));
    ASSERT_EQ(mesh.triangles.size(), 3u);
    std::map<std::pair<std::uint32_t, std::uint32_t>, int> sides;
    for (const glm::uvec3& t : mesh.triangles) {
      for (int i = 0; i < 3; ++i) ++sides[{t[i], t[(i + 1) % 3]}];
    }
    for (std::uint32_t i = 0; i < 5; ++i) {
      EXPECT_EQ((sides[{i, (i + 1) % 5}]), 1);
      EXPECT_EQ((sides[{(i + 1) % 5, i}]), 0);
    }
  }
}

// ---- load_obj: what is refused ----------------------------------------------------------------------------------------------

TEST_F(ObjFile, NumbersThatWouldBeReadWrongAreRefusedWithTheirLine) {
  const std::string rest = "\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
  for (const char* bad : {"nan", "inf", "-inf", "1,5", "1.5abc", "0x10", "1e999", "--1", "+-1", "1e", "-", "."}) {
    refuse("# c\nv 0 " + std::string(bad) + " 0" + rest, {"line 2: ", "three finite numbers", "\"" + std::string(bad) + "\""});
  }
  for (const char* bad : {"v", "v ", "v 1", "v 1 2"}) refuse(bad + rest, {"line 1: ", "three finite numbers", "end of the line"});
}

TEST_F(ObjFile, BadIndicesAreRefusedWithTheirLine) {
  const std::string text(square);
  refuse(text + "f 1 2 5\n", {"line 5: ", "no higher than 4", "found 5"});
  refuse("f 1 2 9\n" + text, {"line 1: ", "no higher than 4", "found 9"});
  refuse(text + "f 1 2 -5\n", {"line 5: ", "no lower than -4", "\"-5\""});
  for (const char* bad : {"0",      "x",    "1.5",    "2147483648000000000000",
                          "3;",     "/3",   "3/a",    "3/1/1/1",
                          "1///2",  "3/",   "3//",    "3/1/",
                          "3/1/1/", "//3",  "3/1//1", "3/1x1",
                          "3 /1",   "+3",   "3/+1",   "3/1.0/1",
                          "3/-/1",  "3--1", "3\\1",   "3/2147483648"}) {
    const std::string_view word = std::string_view(bad).substr(std::string_view(bad).find(' ') + 1);
    refuse(text + "f 1 2 " + bad + "\n", {"line 5: ", "corners as 7, 7/1, 7//3 or 7/1/3", "\"" + std::string(word) + "\""});
  }
}

TEST_F(ObjFile, FacesOfFewerThanThreeVerticesAreRefused) {
  for (const char* face : {"f", "f 1", "f 1 2", "f 1 2 # 3", "f # 1 2 3"})
    refuse(std::string(square) + face + "\n", {"line 5: ", "at least three vertices"});
}

TEST_F(ObjFile, FilesWithoutAMeshAreRefused) {
  refuse("", {"empty"});
  refuse("v 0 0 0\n", {"expected faces", "1 vertices"});
  refuse("hello\n", {"expected faces"});
  refuse(std::string("v 0 0 0\0\0", 9), {"binary"});
  refuse(std::string(square) + "f 1 1 2\n", {"three different corners"});
}

TEST_F(ObjFile, LongOrUnprintableWordsDoNotSpoilTheMessage) {
  const std::string text(square);
  refuse(text + "v " + std::string(100000, 'a') + "\n", {"line 5: ", "aaa..."});
  refuse(text + "v \x1b[31m\x80 0 0\n", {"line 5: ", "?[31m?"});
}

TEST_F(ObjFile, LargeFacesAreCutWhetherConvexOrNot) {
  std::string vertices, face = "f";
  for (int i = 0; i < 5000; ++i) {
    const double angle = i * 2.0 * M_PI / 5000, radius = 1e5;
    vertices += "v " + std::to_string(radius * std::cos(angle)) + " " + std::to_string(radius * std::sin(angle)) + " 0\n";
    face += " " + std::to_string(i + 1);
  }
  EXPECT_EQ(load(vertices + face + "\n").triangles.size(), 4998u);
  EXPECT_EQ(load(vertices + "v 0 0 0\n" + face + " 5001\n").triangles.size(), 4999u);
}

TEST_F(ObjFile, WhatIsNoReadableFileIsRefused) {
  const auto refuse_path = [](const std::filesystem::path& path, std::initializer_list<std::string_view> parts) {
    expect_error<InputError>([&] { load_obj(path); }, {path.string() + ": "});
    expect_error<InputError>([&] { load_obj(path); }, parts);
  };
  refuse_path(folder_ / "missing.obj", {"no such file"});
  refuse_path(folder_ / "no/such/folder.obj", {"no such file"});
  refuse_path(folder_ / ".", {"found a folder"});
  refuse_path("/dev/null", {"device"});

  const auto large = folder_.write("large.obj", "v 0 0 0\n");
  std::filesystem::resize_file(large, (std::uintmax_t{4} << 30) + 1);  // a hole: takes no space
  refuse_path(large, {"at most 4096 MiB"});
}

TEST_F(ObjFile, UnreadableFilesAreRefused) {
  const auto secret = folder_.write("secret.obj", square);
  std::filesystem::permissions(secret, std::filesystem::perms::owner_write);
  using std::filesystem::perms;
  std::filesystem::permissions(folder_ / ".", perms::group_all | perms::others_all, std::filesystem::perm_options::add);
  // Root may read everything, so be somebody else for a moment.
  const bool is_root = geteuid() == 0;
  ASSERT_TRUE(!is_root || seteuid(65534) == 0);
  expect_error<InputError>([&] { load_obj(secret); }, {secret.string() + ": ", "Permission denied", "check its permissions"});
  ASSERT_TRUE(!is_root || seteuid(0) == 0);
}

}  // namespace
