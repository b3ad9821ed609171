#include "hard_cases/cases.hpp"

#include <algorithm>
#include <limits>

#include "hard_cases/shapes.hpp"

namespace halfshade {
namespace {

/// What is known not to hold. An entry goes when it does.
constexpr std::string_view not_yet[] = {
    "floor_1e5",  // its corners, in single precision, are 6e-3 and more off in the camera's space, so that the G-buffer's depth
                  // is
    "floor_1e6",
    "just_below_the_light_1e_5_over_a_floor_of_1e6",
    "hovering_of_900_at_0_3/pcss",
};

// ---- what most cases stand in -----------------------------------------------------------------------------------------------

constexpr glm::uvec2 size_px(64, 64);

SceneMesh floor_of(double half_size = 6.0, double y = 0.0) {
  return sheet_of(glm::dvec2(-half_size), glm::dvec2(half_size), y).mesh("floor");
}

/// A floor, a spot light to the side above it, a camera that looks down at it.
Scene side_lit(std::vector<SceneMesh> casters, SceneMesh floor = floor_of()) {
  Scene scene;
  scene.name = "hard-case";
  scene.meshes = {std::move(floor)};
  for (SceneMesh& caster : casters) scene.meshes.push_back(std::move(caster));
  scene.camera = {.position = {0, 6, 9}, .target = {0, 0.5, 0}, .yfov_deg = 40, .znear = 0.1, .zfar = 100, .resolution = size_px};
  scene.lights = {{.name = "key", .position = {3, 8, 2}, .target = {0, 0.3, 0}, .up = {}, .radius = 0.5, .cone_deg = 80}};
  return scene;
}

/// The same below a lamp: a spot at height 8 that looks straight down.
Scene lamp_lit(std::vector<SceneMesh> casters, double radius = 0.5) {
  Scene scene = side_lit(std::move(casters));
  scene.lights = {
      {.name = "lamp", .position = {0, 8, 0}, .target = {0, 0, 0}, .up = glm::dvec3(0, 0, 1), .radius = radius, .cone_deg = 80}};
  return scene;
}

/// The same below a ball of light at height 2.
Scene ball_lit(std::vector<SceneMesh> casters, double radius = 0.2) {
  Scene scene = side_lit(std::move(casters));
  scene.lights = {{.name = "ball", .type = LightType::point, .position = {0, 2, 0}, .up = {}, .radius = radius}};
  return scene;
}

/// The same under the sun, `height_deg` above the horizon.
Scene sun_lit(std::vector<SceneMesh> casters, double height_deg, double angular_radius_deg) {
  Scene scene = side_lit(std::move(casters));
  const double height = glm::radians(height_deg);
  scene.lights = {{.name = "sun",
                   .type = LightType::directional,
                   .direction = {-std::cos(height) * 0.9, -std::sin(height), -std::cos(height) * std::sqrt(1 - 0.81)},
                   .up = {},
                   .angular_radius_deg = angular_radius_deg}};
  return scene;
}

Scene with_radius(Scene scene, double radius) {
  scene.lights[0].radius = radius;
  return scene;
}

Scene with_resolution(Scene scene, const glm::uvec2& resolution) {
  scene.camera.resolution = resolution;
  return scene;
}

Scene with_cone(Scene scene, double cone_deg) {
  scene.lights[0].cone_deg = cone_deg;
  return scene;
}

Shape turned_box() {
  return box_of({0, 1.2, 0}, glm::dvec3(1), {20, 30, 10});
}

Shape room(const glm::dvec3& low, const glm::dvec3& high) {
  return Shape().box(low, high).reverse();
}

/// A light of the grazing angle, low over the floor, and a wall across its way.
Scene grazing(double height_deg) {
  const double height = glm::radians(height_deg);
  Scene scene = side_lit({box_of({0.5, 0.5, 0}, {0.2, 1.0, 2.0}).mesh("wall")});
  scene.lights[0].position = 9.0 * glm::dvec3(std::cos(height), std::sin(height), 0.02);
  scene.lights[0].target = {0, 0, 0};
  scene.lights[0].radius = 0.1;
  return scene;
}

/// A camera close above the floor: what stands on it to 1e-6, or not, is seen.
Scene contact(double gap) {
  Scene scene = side_lit({box_of({0, 0.5 + gap, 0}, glm::dvec3(1), {0, 30, 0}).mesh("box")});
  scene.camera.position = {-2.5, 0.8, 1.0};
  scene.camera.target = {-0.5, 0.1, 0};
  return scene;
}

/// Wires over the floor, 16 of them, `width` across.
Scene wires(double width) {
  Shape shape;
  for (int i = 0; i < 16; ++i) {
    const double x = -1.5 + 0.2 * i;
    shape.wire({x, 1.5, -1.3}, {x + 0.4, 1.1, 1.3}, width);
  }
  return side_lit({shape.mesh("wires")});
}

/// Triangles whose corners lie on a line.
Scene triangles_without_area() {
  Shape shape;
  for (int i = 0; i < 16; ++i)
    shape.triangle({-1.5 + 0.25 * i, 1.5, -1.25}, {-1.5 + 0.25 * i, 1.5, 0.0}, {-1.5 + 0.25 * i, 1.5, 1.25});
  return side_lit({shape.also(turned_box()).mesh("wires")});
}

Scene fence() {
  Shape shape;
  for (int i = 0; i < 30; ++i) shape.box({-2 + 0.13 * i, 0, -0.03}, {-1.96 + 0.13 * i, 1.2, 0.03});
  shape.box({-2.1, 0.9, -0.05}, {2, 1.0, 0.05});
  return side_lit({shape.mesh("fence")});
}

/// A quad whose plane leads through the light's centre, but for `off` at its far edge.
Scene edge_on(double off) {
  Scene scene = lamp_lit({});
  const double x = 0.25 + off;
  scene.meshes.push_back(Shape().quad({0.125, 4, -1}, {0.125, 4, 1}, {x, 0.5, 1}, {x, 0.5, -1}).mesh("quad"));
  scene.lights[0].position = {0, 7.5, 0};  // x = 0.125 at y = 4 and 0.25 at y = 0.5 lie on a line through (0, 7.5)
  return scene;
}

Scene moebius() {
  const auto at = [](int i, double across) {
    const double around = 2 * std::numbers::pi * i / 48, twist = around / 2;
    const double r = 1.2 + across * std::cos(twist);
    return glm::dvec3(r * std::cos(around), 1.4 + across * std::sin(twist), r * std::sin(around));
  };
  Shape shape;
  for (int i = 0; i < 48; ++i) {
    const double end = i == 47 ? -0.35 : 0.35;  // where it closes its sides have changed places
    const int next = (i + 1) % 48;
    shape.quad(at(i, -0.35), at(i, 0.35), at(next, end), at(next, -end));
  }
  return side_lit({shape.mesh("moebius")});
}

/// Three, or five, sheets that meet at one edge.
Scene fan(int sheets) {
  const unsigned count = static_cast<unsigned>(sheets);
  Shape shape;
  shape.corner({-1, 1.2, 0});
  shape.corner({1, 1.4, 0.2});
  for (unsigned i = 0; i < count; ++i) {
    const double around = 2 * std::numbers::pi * i / count + 0.3;
    shape.corner({0.1 * i, 1.3 + std::sin(around), std::cos(around)});
    shape.triangles.emplace_back(i % 2, 1 - i % 2, 2 + i);
  }
  return side_lit({shape.mesh("fan")});
}

/// A sheet of large cells beside one of small ones: corners in the middle of edges.
Scene t_junctions() {
  Shape shape;
  shape.sheet_of_cells({-1.5, -1}, {0, 1}, 1.5, 1, 2).sheet_of_cells({0, -1}, {1.5, 1}, 1.5, 3, 7);
  return side_lit({shape.mesh("sheet")});
}

/// A disc as a fan of triangles that are 1e4 times as long as wide.
Scene slivers() {
  Shape shape;
  constexpr int count = 2000;
  for (int i = 0; i < count; ++i) {
    const double a = 2 * std::numbers::pi * i / count, b = 2 * std::numbers::pi * ((i + 1) % count) / count;
    shape.triangle({0, 1.5, 0}, {std::cos(a), 1.5, std::sin(a)}, {std::cos(b), 1.5, std::sin(b)});
  }
  for (int i = 0; i < 20; ++i) shape.triangle({-2, 1, -1}, {2, 1, 1 + 1e-5 * i}, {2, 1, 1 + 1e-5 * (i + 1)});
  return side_lit({shape.mesh("slivers")});
}

/// An open staircase of boxes in one another, through one another, and along one another's faces.
Scene interpenetrating() {
  return side_lit({box_of({0, 0.6, 0}, glm::dvec3(1.2), {0, 20, 0}).mesh("large"),
                   box_of({0.5, 0.9, 0.2}, {1.4, 0.4, 0.4}, {0, 20, 30}).mesh("bar"),
                   box_of({0, 1.2, 0}, {0.3, 2.4, 0.3}, {5, 20, 5}).mesh("post"),
                   box_of({0, 0.6, 0}, glm::dvec3(0.6), {0, 20, 0}).mesh("inner")});
}

Scene nested() {
  std::vector<SceneMesh> boxes;
  for (int i = 0; i < 6; ++i)
    boxes.push_back(box_of({0, 1.3, 0}, glm::dvec3(1.6 - 0.25 * i), {10, 30, 0}).mesh("box" + std::to_string(i)));
  return side_lit(std::move(boxes));
}

/// Sheets in one plane that overlap.
Scene coplanar() {
  return side_lit({sheet_of({-1.2, -0.8}, {0.4, 0.8}, 1.5).mesh("a"), sheet_of({-0.3, -0.5}, {1.2, 1.1}, 1.5).mesh("b"),
                   sheet_of({-0.3, -0.5}, {1.2, 1.1}, 1.5).reverse().mesh("c")});
}

Scene nonplanar() {
  return side_lit({Shape()
                       .quad({-1, 1, -1}, {-1, 2, 1}, {1, 1, 1}, {1, 2, -1})
                       .quad({-1.5, 0.4, 0}, {-0.5, 1.4, 0.5}, {0, 0.4, 1}, {-1, 0.9, 1.5})
                       .mesh("quads")});
}

Scene doubled(bool reversed) {
  Shape copy = turned_box();
  if (reversed) copy.reverse();
  return side_lit({turned_box().mesh("box"), copy.mesh("copy"), turned_box().mesh("again")});
}

Scene many_under_a_texel() {
  return side_lit({Shape().sphere({0.2, 1.5, 0.1}, 0.004, 224).mesh("dense"), turned_box().mesh("box")});
}

Scene ten_thousand_meshes() {
  Scene scene = side_lit({});
  const auto mesh = box_mesh();
  for (int i = 0; i < 10000; ++i)
    scene.meshes.push_back(placed("box" + std::to_string(i), mesh,
                                  {-2.5 + 0.05 * (i % 100), 0.1 + 0.00003 * (i * 7919 % 10000), -2.5 + 0.05 * (i / 100)},
                                  glm::dvec3(0.02)));
  return scene;
}

/// A chain of sheets with holes, one under the other.
Scene chain() {
  std::vector<SceneMesh> sheets;
  for (int i = 0; i < 8; ++i) {
    const double x = 0.12 * i - 0.4, y = 0.5 + 0.55 * i;
    Shape shape;
    shape.sheet({x - 1, -1}, {x - 0.2, 1}, y)
        .sheet({x + 0.2, -1}, {x + 1, 1}, y)
        .sheet({x - 0.2, -1}, {x + 0.2, -0.2}, y)
        .sheet({x - 0.2, 0.2}, {x + 0.2, 1}, y);
    sheets.push_back(shape.mesh("sheet" + std::to_string(i)));
  }
  return lamp_lit(std::move(sheets));
}

/// Two sheets that hide complementary halves of the lamp from what lies at x = 0, at different heights.
Scene halves(double overlap) {
  return lamp_lit({sheet_of({-6, -6}, {overlap, 6}, 4).mesh("left"), sheet_of({-overlap, -6}, {6, 6}, 2).mesh("right")});
}

Scene sixteen_lights() {
  Scene scene = side_lit({turned_box().mesh("box")});
  const Light key = scene.lights[0];
  scene.lights.clear();
  for (int i = 0; i < 16; ++i) {
    Light light = key;
    const double around = 2 * std::numbers::pi * i / 16;
    light.name = "light" + std::to_string(i);
    light.position = {4 * std::cos(around), 3.0 + 0.4 * i, 4 * std::sin(around)};
    light.radius = 0.1 * i;
    scene.lights.push_back(light);
  }
  return scene;
}

/// A site of `extent` with a post of 8 cm and a slab before the camera.
Scene site(double extent, bool has_tower) {
  Scene scene = side_lit({Shape().box({-0.04, 0, -0.04}, {0.04, 1.0, 0.04}).mesh("post"),
                          Shape().box({0.5, 0.3, 0}, {0.98, 0.36, 0.48}).mesh("slab")},
                         floor_of(extent / 2));
  if (has_tower)
    scene.meshes.push_back(
        Shape().box({extent * 0.4, 0, -extent * 0.45}, {extent * 0.402, extent * 0.01, -extent * 0.448}).mesh("tower"));
  scene.camera = {
      .position = {-1.5, 2, 2.5}, .target = {0.2, 0.2, 0}, .yfov_deg = 45, .znear = 0.1, .zfar = 20, .resolution = size_px};
  scene.lights = {
      {.name = "sun", .type = LightType::directional, .direction = {-1, -1.5, 0.4}, .up = {}, .angular_radius_deg = 1.5}};
  return scene;
}

/// A sheet that hovers over the floor at a small part of its size, the light behind it, the camera before its edge.
Scene hovering(double half_size, double gap, double light_height_deg) {
  const double height = glm::radians(light_height_deg);
  Scene scene = side_lit({sheet_of(glm::dvec2(-half_size), glm::dvec2(half_size), gap).mesh("sheet")}, floor_of(4 * half_size));
  scene.camera.position = glm::dvec3(-1.3, 0.5, 0.3) * half_size;
  scene.camera.target = glm::dvec3(-1.0, 0, 0) * half_size;
  scene.camera.znear = 0.05 * half_size;
  scene.camera.zfar = 50 * half_size;
  scene.lights[0].position = 4.5 * half_size * glm::dvec3(std::cos(height), std::sin(height), 0);
  scene.lights[0].target = {0, 0, 0};
  scene.lights[0].radius = 0.025 * half_size;
  return scene;
}

/// Beside a wide light's post, a sheet hovering at 1/1000 of the floor's size seen from above.
Scene hovering_wide() {
  Scene scene = side_lit({sheet_of(glm::dvec2(-450), glm::dvec2(450), 0.3).mesh("sheet")}, floor_of(900));
  scene.camera.position = {-452, 1.5, 1};
  scene.camera.target = {-450.3, 0, 0};
  scene.lights[0].position = {300, 700, 0};
  scene.lights[0].target = {-300, 0, 0};
  scene.lights[0].radius = 50;
  return scene;
}

Scene lit_ceiling(double gap) {
  Scene scene = lamp_lit({turned_box().mesh("box"), sheet_of(glm::dvec2(-2), glm::dvec2(2), 8 - gap).reverse().mesh("ceiling")});
  scene.camera.position = {0, 3, 4};
  return scene;
}

/// A wall whose top edge lies `above` the light's plane, across a part of the disc.
Scene edge_in_light_plane(double above) {
  return lamp_lit({Shape().quad({0.1, 6, -3}, {0.1, 6, 3}, {0.1, 8 + above, 3}, {0.1, 8 + above, -3}).mesh("wall")});
}

Scene box_top_in_light_plane(double above) {
  return lamp_lit(
      {box_of({1, 0.4, 1}, glm::dvec3(0.8)).mesh("below"), Shape().box({0.125, 7, -1}, {2, 8 + above, 1}).mesh("box")});
}

Scene lampshade() {
  return lamp_lit({box_of({0, 0.5, 0}, glm::dvec3(1)).mesh("box"), Shape().tube({0, 7.2, 0}, 0.9, 1.4, 40).mesh("shade")});
}

/// A ball of light in a small box that is open below.
Scene ball_in_box() {
  return ball_lit({Shape().box({-0.3, 1.7, -0.3}, {0.3, 2.3, 0.3}).mesh("dummy")});
}

Scene ball_in_open_box() {
  const glm::dvec3 low(-0.3, 1.75, -0.3), high(0.3, 2.3, 0.3);
  Shape shape;
  shape.quad({low.x, low.y, low.z}, {low.x, high.y, low.z}, {high.x, high.y, low.z}, {high.x, low.y, low.z});
  shape.quad({low.x, low.y, high.z}, {low.x, high.y, high.z}, {high.x, high.y, high.z}, {high.x, low.y, high.z});
  shape.quad({low.x, low.y, low.z}, {low.x, high.y, low.z}, {low.x, high.y, high.z}, {low.x, low.y, high.z});
  shape.quad({high.x, low.y, low.z}, {high.x, high.y, low.z}, {high.x, high.y, high.z}, {high.x, low.y, high.z});
  shape.quad({low.x, high.y, low.z}, {low.x, high.y, high.z}, {high.x, high.y, high.z}, {high.x, high.y, low.z});
  return ball_lit({shape.mesh("shade")});
}

/// Bars in a room about a ball of light, whose cube's faces meet on the walls.
Scene ball_in_room() {
  Shape bars;
  for (const double side : {-1.0, 1.0})
    bars.box({side - 0.05, -1.5, 0.9}, {side + 0.05, 1.5, 1.1}).box({-1.5, side - 0.05, -1.1}, {1.5, side + 0.05, -0.9});
  Scene scene = ball_lit({bars.mesh("bars")}, 0.25);
  scene.meshes[0] = room(glm::dvec3(-3), glm::dvec3(3)).mesh("room");
  scene.lights[0].position = {0, 0, 0};
  scene.camera = {.position = {-2.7, -2.5, -2.8},
                  .target = {1.5, 1.5, 1.5},
                  .yfov_deg = 90,
                  .znear = 0.01,
                  .zfar = 50,
                  .resolution = size_px};
  return scene;
}

Scene abutting(bool as_one) {
  std::vector<SceneMesh> walls;
  if (as_one)
    walls.push_back(Shape().box({-1, 0, -0.1}, {1, 1.2, 0.1}).mesh("wall"));
  else
    walls = {Shape().box({-1, 0, -0.1}, {0, 1.2, 0.1}).mesh("left"), Shape().box({0, 0, -0.1}, {1, 1.2, 0.1}).mesh("right")};
  Scene scene = side_lit(std::move(walls));
  scene.camera.position = {-1.5, 4, -6};
  scene.lights[0].position = {0.8, 2.2, 4};
  scene.lights[0].radius = 0.35;
  return scene;
}

Scene rectangle_lit(const glm::dvec2& size) {
  Scene scene = side_lit({turned_box().mesh("box")});
  scene.lights[0].shape = LightShape::rectangle;
  scene.lights[0].size = size;
  return scene;
}

Scene in_a_room(bool rotated) {
  Scene scene = side_lit({turned_box().mesh("box")});
  scene.meshes[0] = room({-6, 0, -6}, {6, 10, 6}).mesh("room");
  scene.camera.position = {0, 5, 5.5};
  if (!rotated) return scene;
  const glm::dmat4 turn = matrix_of({.rotation_deg = {33, -20, 40}});
  const auto turned = [&](const glm::dvec3& p) { return glm::dvec3(turn * glm::dvec4(p, 1.0)); };
  for (SceneMesh& mesh : scene.meshes) mesh.world_from_mesh = turn * mesh.world_from_mesh;
  scene.camera.up = turned(scene.camera.up);
  scene.camera.position = turned(scene.camera.position);
  scene.camera.target = turned(scene.camera.target);
  scene.lights[0].position = turned(scene.lights[0].position);
  scene.lights[0].target = turned(scene.lights[0].target);
  scene.lights[0].up = turned({0, 1, 0});
  return scene;
}

Scene mirrored(const glm::dvec3& scale) {
  Scene scene = side_lit({});
  Shape l;
  l.box({-0.6, -0.6, -0.2}, {-0.2, 0.6, 0.2}).box({-0.2, -0.6, -0.2}, {0.6, -0.2, 0.2});
  scene.meshes.push_back(
      placed("l", std::make_shared<Mesh>(make_mesh("l", l.corners, l.triangles)), {0, 1, 0}, scale, {10, 30, 5}));
  return scene;
}

Scene tilted_floor() {
  return side_lit({turned_box().mesh("box")}, Shape().sheet(glm::dvec2(-6), glm::dvec2(6), 0).move({20, 0, 15}).mesh("floor"));
}

Scene big_floor(double half_size) {
  Scene scene = side_lit({turned_box().mesh("box")}, floor_of(half_size));
  scene.camera.resolution = size_px;
  return scene;
}

/// A small quad a hair before the light, over a floor of the given size.
Scene just_below_the_light(double gap, double floor_half_size) {
  Scene scene = lamp_lit({sheet_of({-0.2, -0.2}, {0.15, 0.3}, 8 - gap).mesh("quad")});
  scene.meshes[0] = floor_of(floor_half_size);
  return scene;
}

Scene through_the_disc() {
  return lamp_lit(
      {box_of({0.1, 8, 0.1}, {0.05, 1.5, 0.6}, {5, 30, 10}).mesh("wall"), box_of({0, 0.5, 0}, glm::dvec3(1)).mesh("box")});
}

Scene centre_on(const glm::dvec3& low, const glm::dvec3& high) {
  return lamp_lit({box_of({1, 0.4, 0.5}, glm::dvec3(0.8)).mesh("below"), Shape().box(low, high).mesh("box")});
}

Scene centre_on_quad(const glm::dvec3& offset) {
  Shape shape;
  shape.quad(glm::dvec3(0, 7.5, -2) + offset, glm::dvec3(0, 7.5, 2) + offset, glm::dvec3(0, 8.5, 2) + offset,
             glm::dvec3(0, 8.5, -2) + offset);
  return lamp_lit({shape.mesh("quad")});
}

Scene one_triangle_over_all() {
  Scene scene = side_lit({Shape().triangle({-400, 3, -300}, {500, 3, -250}, {1, 3, 0.3}).mesh("triangle")});
  return scene;
}

Scene checkerboard() {
  Shape shape;
  for (int i = 0; i < 8; ++i)
    for (int j = 0; j < 8; ++j)
      if ((i + j) % 2 == 0) shape.sheet({-1 + 0.25 * i, -1 + 0.25 * j}, {-0.75 + 0.25 * i, -0.75 + 0.25 * j}, 1.5);
  return side_lit({shape.mesh("checkers")});
}

/// Counts are pixels of 64 x 64.
constexpr Promise all_promises[] = {
    {"floor_1e6", "", 4, 12},
    {"hovering_of_900_at_0_3", "", 100, 100},
    {"site_of_200_m", "", 20, 20},
    {"site_of_2_km", "", 20, 20},
    {"site_of_20_km", "", 20, 20},
    {"site_of_20_km_without_tower", "", 20, 20},
    {"room", "light-samples", 0, 0, 0.03},
    {"room_rotated", "light-samples", 0, 0, 0.03},
    {"lampshade", "light-samples", 0, 0, 0.1},
    {"lampshade", "pcss", 4, 0, 0.1},
    {"lit_ceiling_recessed", "pcss", 4, 0},
    {"wires_of_1e_6", "smoothies penumbra-maps fins layered-fins", 0, 2},
};

constexpr double ulp = std::numeric_limits<double>::epsilon();

}  // namespace

bool Promise::is_of(std::string_view method) const {
  return methods.empty() || (" " + std::string(methods) + " ").find(" " + std::string(method) + " ") != std::string::npos;
}

std::span<const Promise> promises() {
  return all_promises;
}

bool holds_not_yet(std::string_view name) {
  const auto has = [](std::string_view entry) {
    return std::find(std::begin(not_yet), std::end(not_yet), entry) != std::end(not_yet);
  };
  return has(name) || (name.find('/') != name.npos && has(std::string(name.substr(0, name.find('/'))) + "/*"));
}

const std::vector<HardCase>& hard_cases() {
  static const std::string as_rays = "as rays";
  static const std::vector<HardCase> cases = {
      // ---- extents
      {"floor_1e3", as_rays, [] { return big_floor(1e3); }},
      {"floor_1e4", as_rays, [] { return big_floor(1e4); }},
      {"floor_1e5", as_rays, [] { return big_floor(1e5); }},
      {"floor_1e6", as_rays, [] { return big_floor(1e6); }},
      {"floor_tilted", as_rays, [] { return tilted_floor(); }},
      {"just_below_the_light_1e_3", as_rays, [] { return just_below_the_light(1e-3, 6); }},
      {"just_below_the_light_1e_5", as_rays, [] { return just_below_the_light(1e-5, 6); }, {.is_drawn_in_both_shapes = true}},
      {"just_below_the_light_1e_3_over_a_floor_of_1e4", as_rays, [] { return just_below_the_light(1e-3, 1e4); }},
      {"just_below_the_light_1e_5_over_a_floor_of_1e6", as_rays, [] { return just_below_the_light(1e-5, 1e6); }},
      {"hovering_at_1_500", "a shadow as wide as the gap says", [] { return hovering(2, 0.008, 30); }},
      {"hovering_at_1_2000_grazing", "a shadow", [] { return hovering(2, 0.002, 1); }, {.differing = 0.15}},
      {"hovering_at_1_1000_grazing",
       "a shadow",
       [] { return hovering(2, 0.004, 1); },
       {.differing = 0.15, .is_drawn_in_both_shapes = true}},
      {"hovering_at_1_10000", "a thin shadow", [] { return hovering(2, 0.0004, 2); }},
      {"hovering_of_900_at_0_3", "a shadow below it", [] { return hovering_wide(); }},
      {"site_of_200_m", as_rays, [] { return site(200, true); }},
      {"site_of_2_km", as_rays, [] { return site(2000, true); }},
      {"site_of_20_km", as_rays, [] { return site(20000, true); }},
      {"site_of_20_km_without_tower", as_rays, [] { return site(20000, false); }},

      // ---- geometry
      {"box_turned",
       as_rays,
       [] { return side_lit({turned_box().mesh("box")}); },
       {.samples = 256, .is_drawn_in_both_shapes = true}},
      {"doubled", "as one", [] { return doubled(false); }},
      {"doubled_and_reversed", "as one", [] { return doubled(true); }},
      {"open_box", as_rays,
       [] {
         return side_lit({Shape().tube({0, 0.5, 0}, 0.7, 1.0, 4).mesh("tube")});
       }},
      {"three_faces_at_an_edge", as_rays, [] { return fan(3); }},
      {"five_faces_at_an_edge", as_rays, [] { return fan(5); }, {.is_drawn_in_both_shapes = true}},
      {"moebius_strip", as_rays, [] { return moebius(); }, {.is_drawn_in_both_shapes = true}},
      {"t_junctions", "as one sheet", [] { return t_junctions(); }},
      {"slivers", as_rays, [] { return slivers(); }},
      {"edge_on", as_rays, [] { return edge_on(0); }},
      {"edge_on_plus_an_ulp", as_rays, [] { return edge_on(0.25 * ulp); }},
      {"edge_on_minus_an_ulp", as_rays, [] { return edge_on(-0.25 * ulp); }},
      {"edge_on_plus_an_ulp_of_float", as_rays, [] { return edge_on(0x1p-25); }},
      {"edge_on_minus_an_ulp_of_float", as_rays, [] { return edge_on(-0x1p-25); }},
      {"contact", "no gap of light", [] { return contact(0); }},
      {"contact_above_by_1e_6", "no gap of light", [] { return contact(1e-6); }},
      {"contact_below_by_1e_6", "no gap of light", [] { return contact(-1e-6); }},
      {"grazing_half_a_degree", as_rays, [] { return grazing(0.5); }},
      {"grazing_2_degrees", as_rays, [] { return grazing(2); }},
      {"grazing_10_degrees", as_rays, [] { return grazing(10); }},
      {"grazing_45_degrees", as_rays, [] { return grazing(45); }},
      {"grazing_89_5_degrees", as_rays, [] { return grazing(89.5); }},
      {"wires_of_10_texels", as_rays, [] { return wires(0.12); }},
      {"wires_of_a_texel", as_rays, [] { return wires(0.012); }, {.differing = 0.1}},
      {"wires_of_a_tenth_of_a_texel", "their width's share", [] { return wires(0.0012); }},
      {"wires_of_1e_6", "nothing", [] { return wires(1e-6); }},
      {"triangles_without_area", "nothing", [] { return triangles_without_area(); }},
      {"fence", as_rays, [] { return fence(); }, {.differing = 0.1}},
      {"checkerboard", as_rays, [] { return checkerboard(); }},
      {"interpenetrating", as_rays, [] { return interpenetrating(); }},
      {"nested", "as the outermost", [] { return nested(); }},
      {"coplanar_overlapping", "as one", [] { return coplanar(); }},
      {"nonplanar_quads", as_rays, [] { return nonplanar(); }},
      {"one_triangle_over_the_whole_map", as_rays, [] { return one_triangle_over_all(); }},
      {"200000_triangles_under_a_texel", as_rays, [] { return many_under_a_texel(); }},
      {"10000_meshes", as_rays, [] { return ten_thousand_meshes(); }, {.differing = 0.15, .is_for_exact_alone = true}},
      {"abutting_boxes", "as one box", [] { return abutting(false); }},
      {"abutting_boxes_as_one", as_rays, [] { return abutting(true); }},
      {"mirrored", as_rays,
       [] {
         return mirrored({-1, 1, 1});
       }},
      {"mirrored_thrice", as_rays,
       [] {
         return mirrored({-1, -1, -1});
       }},

      // ---- lights among meshes
      {"room", as_rays, [] { return in_a_room(false); }, {.is_drawn_in_both_shapes = true}},
      {"room_rotated", as_rays, [] { return in_a_room(true); }},
      {"light_inside_a_box", "dark",
       [] {
         return centre_on({-1, 7, -1}, {1, 9, 1});
       }},
      {"light_partly_inside_a_box", as_rays,
       [] {
         return centre_on({0.125, 7.5, -1}, {1, 9, 1});
       }},
      {"light_larger_than_a_box_in_it", as_rays,
       [] {
         return centre_on({-0.125, 7.75, -0.125}, {0.25, 8.25, 0.25});
       }},
      {"centre_on_the_face_of_a_box",
       as_rays,
       [] {
         return centre_on({0, 7, -1}, {1, 9, 1});
       },
       {.is_drawn_in_both_shapes = true}},
      {"centre_on_the_edge_of_a_box", as_rays,
       [] {
         return centre_on({0, 7, 0}, {1, 9, 1});
       }},
      {"centre_on_the_corner_of_a_box", as_rays,
       [] {
         return centre_on({0, 7, 0}, {1, 8, 1});
       }},
      {"centre_1e_6_beside_the_face_of_a_box", as_rays,
       [] {
         return centre_on({1e-6, 7, -1}, {1, 9, 1});
       }},
      {"centre_on_a_quad", as_rays, [] { return centre_on_quad(glm::dvec3(0)); }},
      {"centre_1e_5_beside_a_quad", as_rays,
       [] {
         return centre_on_quad({1e-5, 0, 0});
       }},
      {"through_the_disc", as_rays, [] { return through_the_disc(); }},
      {"edge_in_the_lights_plane", as_rays, [] { return edge_in_light_plane(0); }, {.is_drawn_in_both_shapes = true}},
      {"edge_1e_3_before_the_lights_plane", as_rays, [] { return edge_in_light_plane(-1e-3); }},
      {"edge_1e_3_behind_the_lights_plane", as_rays, [] { return edge_in_light_plane(1e-3); }},
      {"box_top_in_the_lights_plane", as_rays, [] { return box_top_in_light_plane(0); }},
      {"box_top_1e_3_before_the_lights_plane", as_rays, [] { return box_top_in_light_plane(-1e-3); }},
      {"lit_ceiling_flush", "a flush lamp shines", [] { return lit_ceiling(0); }, {.is_drawn_in_both_shapes = true}},
      {"lit_ceiling_recessed", "dark", [] { return lit_ceiling(1e-3); }},
      {"lampshade", as_rays, [] { return lampshade(); }},

      // ---- sizes of lights
      {"radius_0", "hard", [] { return with_radius(side_lit({turned_box().mesh("box")}), 0); }},
      {"radius_1e_4", "hard", [] { return with_radius(side_lit({turned_box().mesh("box")}), 1e-4); }},
      {"radius_3", as_rays, [] { return with_radius(side_lit({turned_box().mesh("box")}), 3); }},
      {"radius_30", as_rays, [] { return with_radius(lamp_lit({turned_box().mesh("box")}), 30); }},
      {"radius_600", as_rays, [] { return with_radius(lamp_lit({turned_box().mesh("box")}), 600); }},
      {"cone_1_degree", as_rays, [] { return with_cone(side_lit({turned_box().mesh("box")}), 1); }},
      {"cone_20_degrees", as_rays, [] { return with_cone(side_lit({turned_box().mesh("box")}), 20); }},
      {"cone_150_degrees", as_rays, [] { return with_cone(side_lit({turned_box().mesh("box")}), 150); }},
      {"cone_174_degrees", as_rays, [] { return with_cone(side_lit({turned_box().mesh("box")}), 174); }},
      {"rectangle_2_by_1", as_rays,
       [] {
         return rectangle_lit({2, 1});
       }},
      {"rectangle_10_by_1e_4", as_rays,
       [] {
         return rectangle_lit({10, 1e-4});
       }},
      {"rectangle_4_by_0", as_rays,
       [] {
         return rectangle_lit({4, 0});
       }},
      {"halves_that_complement", "dark where they meet", [] { return halves(0); }},
      {"halves_that_overlap", as_rays, [] { return halves(0.05); }},
      {"halves_that_leave_a_slit", as_rays, [] { return halves(-0.05); }},
      {"chain_of_eight_sheets_with_holes", as_rays, [] { return chain(); }},
      {"sixteen_lights", as_rays, [] { return sixteen_lights(); }, {.is_for_exact_alone = true}},

      // ---- suns
      {"sun_of_a_tenth_of_a_degree", as_rays, [] { return sun_lit({turned_box().mesh("box")}, 40, 0.1); }},
      {"sun_of_10_degrees",
       as_rays,
       [] { return sun_lit({turned_box().mesh("box")}, 40, 10); },
       {.is_drawn_in_both_shapes = true}},
      {"sun_of_40_degrees", as_rays, [] { return sun_lit({turned_box().mesh("box")}, 60, 40); }},
      {"sun_2_degrees_high", as_rays,
       [] {
         return sun_lit({box_of({0.5, 0.1, 0}, {0.2, 0.2, 1.0}).mesh("wall")}, 2, 0.27);
       }},
      {"sun_over_a_fence",
       as_rays,
       [] {
         Scene scene = fence();
         scene.lights = sun_lit({}, 25, 0.27).lights;
         return scene;
       },
       {.differing = 0.1}},

      // ---- balls of light
      {"ball_over_a_box", as_rays,
       [] {
         return ball_lit({box_of({0, 0.5, 0}, glm::dvec3(0.6), {0, 30, 0}).mesh("box")});
       }},
      {"ball_in_a_closed_box", "dark", [] { return ball_in_box(); }},
      {"ball_in_a_small_open_box", as_rays, [] { return ball_in_open_box(); }, {.is_drawn_in_both_shapes = true}},
      {"ball_in_a_tube", as_rays,
       [] {
         return ball_lit({Shape().tube({0, 1.7, 0}, 0.25, 0.6, 24).mesh("tube")});
       }},
      {"ball_beside_a_box_behind_it", as_rays,
       [] {
         return ball_lit({Shape().box({-0.1, 2.05, -0.1}, {0.3, 2.15, 0.3}).mesh("box")});
       }},
      {"ball_touching_a_box", as_rays,
       [] {
         return ball_lit({Shape().box({0.2, 1.5, -0.5}, {0.6, 2.5, 0.5}).mesh("box")});
       }},
      {"ball_cut_by_a_sheet", as_rays,
       [] {
         return ball_lit({sheet_of({0.05, -1}, {1, 1}, 1.95).mesh("sheet")});
       }},
      {"ball_over_a_sheet_of_200_triangles", "as one of two",
       [] {
         Scene scene = ball_lit({Shape().sheet_of_cells({-1, -1}, {1, 1}, 1.5, 10, 10).mesh("sheet")}, 0.3);
         scene.meshes[0] = Shape().sheet_of_cells({-5, -5}, {5, 5}, 0, 10, 10).mesh("floor");
         scene.camera.position = {0.5, 6, 8};
         scene.camera.target = {0, 0.5, 0};
         scene.lights[0].position = {1.3, 5, 1.2};
         return scene;
       }},
      {"ball_in_a_room", as_rays, [] { return ball_in_room(); }},

      // ---- sizes of pictures and maps
      {"picture_1x1", as_rays,
       [] {
         return with_resolution(side_lit({turned_box().mesh("box")}), {1, 1});
       }},
      {"picture_17x3",
       as_rays,
       [] {
         return with_resolution(side_lit({turned_box().mesh("box")}), {17, 3});
       },
       {.differing = 0.2}},
      {"picture_16384x1", as_rays,
       [] {
         Scene scene = with_resolution(side_lit({turned_box().mesh("box")}), {16384, 1});
         scene.camera.yfov_deg = 0.004;
         return scene;
       }},
      {"light_map_1", as_rays, [] { return side_lit({turned_box().mesh("box")}); }, {.light_resolution_px = 1}},
      {"light_map_17", as_rays, [] { return side_lit({turned_box().mesh("box")}); }, {.light_resolution_px = 17}},
      {"light_map_8192",
       as_rays,
       [] { return side_lit({turned_box().mesh("box")}); },
       {.light_resolution_px = 8192, .is_for_exact_alone = true}},
  };
  return cases;
}

}  // namespace halfshade
