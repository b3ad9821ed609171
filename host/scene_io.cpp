// Scenes: read from JSON, checked, and animated.
//
// Reading complains about the file's form (keys, types), `validate` about what the values mean, for scenes made by a program too.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <span>
#include <type_traits>
#include <variant>

#include "halfshade/halfshade.hpp"
#include "read_file.hpp"

namespace halfshade {
namespace {

using Json = nlohmann::json;

/// What the "type" of a light may be, in the order of LightType, and which keys each has.
constexpr std::array<std::string_view, 3> light_types{"spot", "directional", "point"};
constexpr std::string_view spot_keys[] = {"name", "type",   "color",    "intensity", "position", "target",
                                          "up",   "radius", "cone_deg", "shape",     "size",     "texture"};
constexpr std::string_view directional_keys[] = {"name", "type", "color", "intensity", "direction", "up", "angular_radius_deg"};
constexpr std::string_view point_keys[] = {"name", "type", "color", "intensity", "position", "radius"};

std::span<const std::string_view> light_keys(LightType type) {
  if (type == LightType::directional) return directional_keys;
  if (type == LightType::point) return point_keys;
  return spot_keys;
}

/// What its "shape" may be.
constexpr std::array<std::string_view, 2> light_shapes{"disc", "rectangle"};

constexpr unsigned max_resolution_px = 16384;
constexpr double max_angle_deg = 175.0;
constexpr double max_angular_radius_deg = 45.0;

/// The least sine of the angle between an axis and its up direction.
constexpr double min_up_sine = 1e-6;

/// A value as a message can show it: on one line and not too long.
std::string shown(const Json& value) {
  std::string text = value.dump(-1, ' ', true, Json::error_handler_t::replace);
  if (text.size() > 60) text = text.substr(0, 57) + "...";
  return text;
}

// ---- near misses ------------------------------------------------------------------------------------------------------------

/// Letters to insert, remove or replace to get from a to b.
std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) row[j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t replaced = diagonal + (a[i - 1] == b[j - 1] ? 0 : 1);
      diagonal = row[j];
      row[j] = std::min({replaced, row[j] + 1, row[j - 1] + 1});
    }
  }
  return row.back();
}

/// "; did you mean "x"?" where one of `known` resembles `word`, else nothing.
template <class Words>
std::string suggestion(std::string_view word, const Words& known) {
  std::string_view best;
  std::size_t best_distance = word.size() / 3 + 2;
  if (word.size() > 64) return "";
  for (const std::string_view candidate : known) {
    const std::size_t distance = edit_distance(word, candidate);
    if (distance < best_distance) {
      best_distance = distance;
      best = candidate;
    }
  }
  return best.empty() ? "" : fmt::format("; did you mean \"{}\"?", best);
}

// ---- reading ----------------------------------------------------------------------------------------------------------------

/// A JSON value that knows where it stands, so that whatever is wrong with it is reported with file and place.
class Node {
 public:
  Node(const Json& value, std::string_view file, std::string place) : value_(&value), file_(file), place_(std::move(place)) {}

  [[noreturn]] void fail(std::string_view expected, std::string_view remedy = "") const {
    throw InputError(fmt::format("{}expected {} (found {}){}", start_of_message(), expected, shown(*value_), remedy));
  }

  /// This value, once it is an object.
  const Node& object() const {
    if (!value_->is_object()) fail("an object");
    return *this;
  }
  const Node& object(std::initializer_list<std::string_view> known_keys) const {
    return object(std::span(known_keys.begin(), known_keys.size()));
  }
  /// The same, with no other keys than these.
  const Node& object(std::span<const std::string_view> known_keys) const {
    object();
    for (const auto& [key, value] : value_->items()) {
      if (std::ranges::find(known_keys, key) != known_keys.end()) continue;
      throw InputError(fmt::format("{}expected one of the keys {} (found {}){}", start_of_message(), fmt::join(known_keys, ", "),
                                   shown(key), suggestion(key, known_keys)));
    }
    return *this;
  }

  bool has(std::string_view key) const { return value_->contains(key); }

  Node at(std::string_view key) const {
    const auto found = value_->find(key);
    if (found != value_->end()) return {*found, file_, child_place(key)};
    throw InputError(fmt::format("{}expected the key \"{}\" (it is missing); add it", start_of_message(), key));
  }

  std::vector<Node> items() const {
    if (!value_->is_array()) fail("an array");
    std::vector<Node> nodes;
    for (std::size_t i = 0; i < value_->size(); ++i) nodes.push_back({(*value_)[i], file_, fmt::format("{}[{}]", place_, i)});
    return nodes;
  }

  /// The items of an array of exactly `count`.
  std::vector<Node> items(std::size_t count, std::string_view expected) const {
    if (!value_->is_array() || value_->size() != count) fail(expected);
    return items();
  }

  template <class T>
  T as() const {
    if constexpr (std::is_same_v<T, bool>) {
      if (!value_->is_boolean()) fail("true or false");
      return value_->get<bool>();
    } else if constexpr (std::is_same_v<T, std::string>) {
      if (!value_->is_string()) fail("a string");
      return value_->get<std::string>();
    } else if constexpr (std::is_same_v<T, double>) {
      if (!value_->is_number()) fail("a number");
      return value_->get<double>();
    } else if constexpr (std::is_integral_v<T>) {
      using Limits = std::numeric_limits<T>;
      const double value = value_->is_number_integer() ? value_->get<double>() : NAN;
      if (!(value >= Limits::min() && value <= Limits::max())) {
        fail(fmt::format("a whole number from {} to {}", Limits::min(), Limits::max()));
      }
      return value_->get<T>();
    } else if constexpr (std::is_same_v<T, glm::uvec2>) {
      const auto parts = items(2, "an array of two whole numbers");
      return {parts[0].as<std::uint32_t>(), parts[1].as<std::uint32_t>()};
    } else if constexpr (std::is_same_v<T, glm::dvec2>) {
      const auto parts = items(2, "an array of two numbers");
      return {parts[0].as<double>(), parts[1].as<double>()};
    } else {
      static_assert(std::is_same_v<T, glm::dvec3> || std::is_same_v<T, glm::vec3>);
      const auto parts = items(3, "an array of three numbers");
      return T(parts[0].as<double>(), parts[1].as<double>(), parts[2].as<double>());
    }
  }

  /// Reads a key that must be there.
  template <class T>
  void require(std::string_view key, T& out) const {
    out = at(key).as<T>();
  }

  /// Reads a key, or leaves `out` at its default.
  template <class T>
  void read(std::string_view key, T& out) const {
    if (has(key)) require(key, out);
  }

 private:
  std::string start_of_message() const {
    return place_.empty() ? fmt::format("{}: ", file_) : fmt::format("{}: {}: ", file_, place_);
  }

  std::string child_place(std::string_view key) const {
    return place_.empty() ? std::string(key) : fmt::format("{}.{}", place_, key);
  }

  const Json* value_;
  std::string_view file_;
  std::string place_;
};

Json parse_json(const std::string& text, const std::string& file) {
  // The parser keeps the last of two equal keys and says nothing; it tells us of each key, though.
  std::vector<std::set<std::string>> open_objects;
  std::string last_key;
  const auto watch = [&](int, Json::parse_event_t event, Json& value) {
    if (event == Json::parse_event_t::object_start) open_objects.emplace_back();
    if (event == Json::parse_event_t::object_end) open_objects.pop_back();
    if (event == Json::parse_event_t::key) {
      last_key = shown(value);
      if (!open_objects.back().insert(value.get<std::string>()).second) {
        throw InputError(fmt::format("{}: expected every key once in an object (found {} twice); remove one", file, last_key));
      }
    }
    return true;
  };
  try {
    return Json::parse(text, watch);
  } catch (const Json::parse_error& error) {
    // "[json.exception.parse_error.101] parse error at line 3, column 5: ..."
    const std::string_view what = error.what();
    const std::size_t line = what.find("line ");
    throw InputError(fmt::format("{}: {} (this is not valid JSON)", file, line == what.npos ? what : what.substr(line)));
  } catch (const Json::out_of_range& error) {
    const std::string_view what = error.what();
    throw InputError(fmt::format("{}: after the key {}: expected a number that fits into double precision ({})", file, last_key,
                                 what.substr(what.find("] ") + 2)));
  }
}

/// Reads each mesh file once, however often and under whatever name a scene mentions it.
class MeshFiles {
 public:
  std::shared_ptr<const Mesh> load(const std::filesystem::path& path) {
    std::error_code error;
    const auto canonical = std::filesystem::weakly_canonical(path, error);
    auto& mesh = loaded_[error ? path : canonical];
    if (!mesh) mesh = std::make_shared<const Mesh>(load_obj(path));
    return mesh;
  }

 private:
  std::map<std::filesystem::path, std::shared_ptr<const Mesh>> loaded_;
};

SceneMesh read_mesh(const Node& node, const std::filesystem::path& folder, MeshFiles& files, const std::string& file) {
  node.object({"name", "path", "translation", "rotation_deg", "scale", "casts_shadow", "receives_shadow", "base_color"});
  std::string path;
  node.require("path", path);
  if (std::ranges::any_of(path, [](unsigned char c) { return c < 0x20; }))
    node.at("path").fail("a path without control characters");
  SceneMesh mesh;
  mesh.name = std::filesystem::path(path).stem().string();
  node.read("name", mesh.name);
  if (mesh.name.empty()) node.fail("a mesh with a name");
  node.read("translation", mesh.translation);
  node.read("rotation_deg", mesh.rotation_deg);
  node.read("scale", mesh.scale);
  node.read("casts_shadow", mesh.casts_shadow);
  node.read("receives_shadow", mesh.receives_shadow);
  node.read("base_color", mesh.base_color);
  try {
    mesh.mesh = files.load(folder / path);
  } catch (const InputError& error) {
    // The meshes of Debian's glmark2-data are too good to pass by and not ours to ship.
    const bool is_package = path.starts_with("/usr/share/glmark2/") && !std::filesystem::exists(path);
    throw InputError(fmt::format("{}: mesh {}: {}{}", file, shown(mesh.name), error.what(),
                                 is_package ? ", or install the Debian package glmark2-data" : ""));
  }
  return mesh;
}

Camera read_camera(const Node& node) {
  node.object({"position", "target", "up", "yfov_deg", "znear", "zfar", "resolution"});
  Camera camera;
  node.require("position", camera.position);
  node.require("target", camera.target);
  node.read("up", camera.up);
  node.read("yfov_deg", camera.yfov_deg);
  node.read("znear", camera.znear);
  node.read("zfar", camera.zfar);
  node.read("resolution", camera.resolution);
  return camera;
}

std::shared_ptr<const LightTexture> read_light_texture(const Node& node, const std::filesystem::path& folder,
                                                       const LightTextureReader& read_texture) {
  const auto path = node.as<std::string>();
  if (std::ranges::any_of(path, [](unsigned char c) { return c < 0x20; })) node.fail("a path without control characters");
  if (!read_texture) node.fail("no texture", "; this program reads no pictures");
  try {
    return read_texture(folder / path);
  } catch (const InputError& error) {
    node.fail(fmt::format("an EXR picture with channels R, G and B, or Y: {}", error.what()));
  }
}

Light read_light(const Node& node, std::string default_name, const std::filesystem::path& folder,
                 const LightTextureReader& read_texture) {
  const auto type = node.object().at("type").as<std::string>();
  const auto found = std::ranges::find(light_types, type);
  if (found == light_types.end())
    node.at("type").fail(fmt::format("one of the light types {}", fmt::join(light_types, ", ")), suggestion(type, light_types));
  Light light;
  light.type = static_cast<LightType>(found - light_types.begin());
  node.object(light_keys(light.type));
  const auto has = [&](std::string_view key) { return std::ranges::count(light_keys(light.type), key) > 0; };
  light.name = std::move(default_name);
  node.read("name", light.name);
  if (light.name.empty()) node.fail("a light with a name");
  if (has("position")) node.require("position", light.position);
  if (has("target")) node.require("target", light.target);
  if (has("direction")) node.require("direction", light.direction);
  if (node.has("up")) light.up = node.at("up").as<glm::dvec3>();
  node.read("radius", light.radius);
  node.read("angular_radius_deg", light.angular_radius_deg);
  node.read("cone_deg", light.cone_deg);
  node.read("color", light.color);
  node.read("intensity", light.intensity);
  if (node.has("shape")) {
    const auto shape = node.at("shape").as<std::string>();
    if (std::ranges::find(light_shapes, shape) == light_shapes.end())
      node.at("shape").fail(fmt::format("one of the shapes {}", fmt::join(light_shapes, ", ")), suggestion(shape, light_shapes));
    if (shape == "rectangle") light.shape = LightShape::rectangle;
  }
  if (light.shape == LightShape::rectangle) {
    node.require("size", light.size);
    if (node.has("radius")) node.at("radius").fail("no radius of a rectangle", "; leave it out, it has a \"size\"");
    if (node.has("texture")) light.texture = read_light_texture(node.at("texture"), folder, read_texture);
  } else {
    for (const std::string_view key : {"size", "texture"})
      if (node.has(key)) node.at(key).fail("none for a disc", "; leave it out, or give the light the shape \"rectangle\"");
  }
  return light;
}

// ---- animation --------------------------------------------------------------------------------------------------------------

template <class S, class T>
using MemberOf = std::conditional_t<std::is_const_v<S>, const T*, T*>;

/// A property that a track may set: nothing, a vector, a pair or a scalar of the scene (const if that is).
template <class S>
using Property = std::variant<std::monostate, MemberOf<S, glm::dvec3>, MemberOf<S, glm::dvec2>, MemberOf<S, double>>;

/// Calls `visit(object, member, property)` for everything in `scene` that a track may set.
template <class S, class Visit>
void for_each_property(S& scene, Visit&& visit) {
  for (auto& mesh : scene.meshes) {
    visit(mesh.name, "translation", Property<S>(&mesh.translation));
    visit(mesh.name, "rotation_deg", Property<S>(&mesh.rotation_deg));
    visit(mesh.name, "scale", Property<S>(&mesh.scale));
  }
  visit("camera", "position", Property<S>(&scene.camera.position));
  visit("camera", "target", Property<S>(&scene.camera.target));
  for (auto& light : scene.lights) {
    const auto visit_own = [&](std::string_view member, Property<S> property) {
      if (std::ranges::count(light_keys(light.type), member) > 0) visit(light.name, member, property);
    };
    visit_own("position", &light.position);
    visit_own("target", &light.target);
    if (light.shape == LightShape::disc) visit_own("radius", &light.radius);
    if (light.shape == LightShape::rectangle) visit_own("size", &light.size);
    visit_own("direction", &light.direction);
    visit_own("angular_radius_deg", &light.angular_radius_deg);
    visit(light.name, "intensity", Property<S>(&light.intensity));
  }
}

/// The property that `target` names; `where` begins the message where there is none.
template <class S>
Property<S> property_of(S& scene, std::string_view target, std::string_view where) {
  Property<S> found;
  const std::size_t dot = target.rfind('.');
  if (dot != target.npos) {
    for_each_property(scene, [&](std::string_view object, std::string_view member, Property<S> property) {
      if (object == target.substr(0, dot) && member == target.substr(dot + 1)) found = property;
    });
  }
  if (!std::holds_alternative<std::monostate>(found)) return found;

  std::vector<std::string> known;
  for_each_property(scene, [&](std::string_view object, std::string_view member, Property<S>) {
    known.push_back(fmt::format("{}.{}", object, member));
  });
  throw InputError(
      fmt::format("{}: expected <mesh>.translation|rotation_deg|scale, camera.position|target or "
                  "<light>.intensity or what it has of position|target|radius|size|direction|angular_radius_deg (found {}){}",
                  where, shown(target), suggestion(target, known)));
}

Animation read_animation(const Node& node, const Scene& scene, std::string_view file) {
  node.object({"frames", "tracks"});
  Animation animation;
  if (node.has("frames")) {
    const auto frames = node.at("frames").items(2, "an array of the first and the last frame");
    animation.first_frame = frames[0].as<int>();
    animation.last_frame = frames[1].as<int>();
  }
  if (!node.has("tracks")) return animation;
  for (const Node& track_node : node.at("tracks").items()) {
    track_node.object({"target", "keys"});
    Track& track = animation.tracks.emplace_back();
    track_node.require("target", track.target);
    const auto where = fmt::format("{}: animation.tracks[{}].target", file, animation.tracks.size() - 1);
    const auto property = property_of(scene, track.target, where);
    const bool is_scalar = std::holds_alternative<const double*>(property);
    const bool is_pair = std::holds_alternative<const glm::dvec2*>(property);
    for (const Node& key_node : track_node.at("keys").items()) {
      const auto parts = key_node.items(2, is_scalar ? "[frame, number]"
                                           : is_pair ? "[frame, [width, height]]"
                                                     : "[frame, [x, y, z]]");
      const double frame = parts[0].as<double>();
      const auto value = is_scalar ? glm::dvec3(parts[1].as<double>(), 0.0, 0.0)
                         : is_pair ? glm::dvec3(parts[1].as<glm::dvec2>(), 0.0)
                                   : parts[1].as<glm::dvec3>();
      track.keys.push_back({frame, value});
    }
  }
  return animation;
}

glm::dvec3 value_at(const Track& track, double frame) {
  const auto after = std::ranges::upper_bound(track.keys, frame, {}, &Track::Key::frame);
  if (after == track.keys.begin()) return after->value;
  const auto before = after - 1;
  if (after == track.keys.end()) return before->value;
  return glm::mix(before->value, after->value, (frame - before->frame) / (after->frame - before->frame));
}

// ---- checking ---------------------------------------------------------------------------------------------------------------

template <class T>
bool is_finite(const glm::vec<3, T>& v) {
  return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

std::string shown(double x) {
  return fmt::format("{}", x);
}
std::string shown(const glm::dvec2& v) {
  return fmt::format("[{}, {}]", v.x, v.y);
}
std::string shown(const glm::uvec2& v) {
  return fmt::format("[{}, {}]", v.x, v.y);
}

template <class T>
std::string shown(const glm::vec<3, T>& v) {
  return fmt::format("[{}, {}, {}]", v.x, v.y, v.z);
}

/// One thing of a scene under examination; the text of where it stands is made only when something is wrong with it.
struct Checker {
  std::string_view where, list;
  std::size_t index = no_index;
  static constexpr std::size_t no_index = ~std::size_t{0};

  [[noreturn]] void fail(std::string_view member, std::string_view expected, std::string_view found) const {
    const auto place = index == no_index ? std::string(list) : fmt::format("{}[{}]", list, index);
    throw InputError(fmt::format("{}: {}{}{}: expected {} (found {})", where, place, place.empty() || member.empty() ? "" : ".",
                                 member, expected, found));
  }

  template <class T>
  void expect(bool holds, std::string_view member, const T& value, std::string_view expected) const {
    if (!holds) fail(member, expected, shown(value));
  }

  template <class T>
  void finite(std::string_view member, const T& value) const {
    expect(is_finite(value), member, value, "finite numbers");
  }

  template <class T>
  void color(std::string_view member, const T& value) const {
    finite(member, value);
    expect(value.x >= 0 && value.y >= 0 && value.z >= 0, member, value, "numbers of at least 0");
  }

  void radius(std::string_view member, double value) const {
    expect(std::isfinite(value) && value >= 0.0, member, value, "a finite number of at least 0");
  }

  void size(std::string_view member, const glm::dvec2& value) const {
    expect(std::isfinite(value.x) && std::isfinite(value.y) && value.x >= 0.0 && value.y >= 0.0, member, value,
           "two finite numbers of at least 0");
  }

  void angle(std::string_view member, double value_deg) const {
    expect(value_deg > 0.0 && value_deg < max_angle_deg, member, value_deg, "an angle above 0 and below 175 degrees");
  }

  void angular_radius(std::string_view member, double value_deg) const {
    expect(value_deg >= 0.0 && value_deg < max_angular_radius_deg, member, value_deg, "an angle from 0 to below 45 degrees");
  }

  void scale(std::string_view member, const glm::dvec3& value) const {
    finite(member, value);
    expect(value.x != 0.0 && value.y != 0.0 && value.z != 0.0, member, value, "numbers other than 0");
  }

  /// That something looks from `position` to `target`, and that `up`, if given, makes a frame with that.
  void direction(const glm::dvec3& position, const glm::dvec3& target, const glm::dvec3* up) const {
    finite("position", position);
    finite("target", target);
    const glm::dvec3 axis = target - position;
    const double length = glm::length(axis);
    expect(std::isfinite(length) && length > 0.0, "target", target, "a place away from position, and not out of reach");
    if (up != nullptr) frame(axis, *up, "the line from position to target");
  }

  /// That `up` makes a frame with a direction, which is called `axis_name`.
  void frame(const glm::dvec3& axis, const glm::dvec3& up, std::string_view axis_name) const {
    const double length = glm::length(axis);
    finite("up", up);
    const double up_length = glm::length(up);
    const bool is_frame =
        std::isfinite(up_length) && up_length > 0.0 && glm::length(glm::cross(axis / length, up / up_length)) > min_up_sine;
    expect(is_frame, "up", up, fmt::format("a direction that is not along {}", axis_name));
  }
};

void check_names(const Scene& scene, std::string_view where) {
  std::set<std::string_view> names{"camera"};
  const auto check = [&](const Checker& at, const std::string& name) {
    at.expect(name.empty() || names.insert(name).second, "name", name,
              "a name that no other mesh or light has, nor the camera; give it a \"name\" of its own");
  };
  for (std::size_t i = 0; i < scene.meshes.size(); ++i) check({where, "meshes", i}, scene.meshes[i].name);
  for (std::size_t i = 0; i < scene.lights.size(); ++i) {
    const Checker at{where, "lights", i};
    const std::string& name = scene.lights[i].name;
    const bool is_plain = std::ranges::all_of(name, [](char c) {
      return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' || c == '-';
    });
    at.expect(is_plain, "name", name, "letters, digits, _ and - (it becomes part of image channel names)");
    check(at, name);
  }
}

void check_track(const Checker& at, const Track& track, const Scene& scene) {
  const auto target_place = fmt::format("{}: {}[{}].target", at.where, at.list, at.index);
  property_of(scene, track.target, target_place);
  if (track.keys.empty()) at.fail("keys", "at least one key", "none");
  const std::string_view member = std::string_view(track.target).substr(track.target.rfind('.') + 1);
  for (std::size_t k = 0; k < track.keys.size(); ++k) {
    const Track::Key& key = track.keys[k];
    const auto key_member = fmt::format("keys[{}]", k);
    at.expect(std::isfinite(key.frame) && (k == 0 || key.frame > track.keys[k - 1].frame), key_member, key.frame,
              "a frame after the one of the key before");
    at.finite(key_member, key.value);
    if (member == "scale") at.scale(key_member, key.value);
    if (member == "radius" || member == "intensity") at.radius(key_member, key.value.x);
    if (member == "angular_radius_deg") at.angular_radius(key_member, key.value.x);
    if (member == "size") at.size(key_member, glm::dvec2(key.value));
  }
}

void check_texture(const Checker& at, const Light& light) {
  const LightTexture& texture = *light.texture;
  at.expect(light.shape == LightShape::rectangle, "texture", texture.name, "none for a disc; only a rectangle can have one");
  at.expect(texture.resolution.x > 0 && texture.resolution.y > 0 && texture.resolution.x <= max_resolution_px &&
                texture.resolution.y <= max_resolution_px &&
                texture.texels.size() == std::size_t{texture.resolution.x} * texture.resolution.y,
            "texture", texture.name, "as many texels as its resolution says, from 1 to 16384 a side");
  const bool valid = std::ranges::all_of(texture.texels, [](const glm::vec3& t) {
    return std::isfinite(t.r) && std::isfinite(t.g) && std::isfinite(t.b) && t.r >= 0.0f && t.g >= 0.0f && t.b >= 0.0f;
  });
  at.expect(valid, "texture", texture.name, "a picture of finite values of at least 0");
  const bool shines = std::ranges::any_of(texture.texels, [](const glm::vec3& t) { return t.r + t.g + t.b > 0.0f; });
  at.expect(shines, "texture", texture.name, "a picture that is not black all over");
}

}  // namespace

void validate(const Scene& scene, std::string_view where) {
  check_names(scene, where);
  for (std::size_t i = 0; i < scene.meshes.size(); ++i) {
    const Checker at{where, "meshes", i};
    const SceneMesh& mesh = scene.meshes[i];
    if (!mesh.mesh) at.fail("mesh", "a mesh", "none");
    at.finite("translation", mesh.translation);
    at.finite("rotation_deg", mesh.rotation_deg);
    at.scale("scale", mesh.scale);
    at.color("base_color", mesh.base_color);
  }

  const Checker camera_at{where, "camera"};
  const Camera& camera = scene.camera;
  camera_at.direction(camera.position, camera.target, &camera.up);
  camera_at.angle("yfov_deg", camera.yfov_deg);
  camera_at.expect(std::isfinite(camera.znear) && camera.znear > 0.0, "znear", camera.znear, "a finite number above 0");
  camera_at.expect(std::isfinite(camera.zfar) && camera.zfar > camera.znear, "zfar", camera.zfar, "a finite number above znear");
  const auto is_resolution = [](unsigned side) { return side >= 1 && side <= max_resolution_px; };
  camera_at.expect(is_resolution(camera.resolution.x) && is_resolution(camera.resolution.y), "resolution", camera.resolution,
                   "a width and a height from 1 to 16384 pixels");

  for (std::size_t i = 0; i < scene.lights.size(); ++i) {
    const Checker at{where, "lights", i};
    const Light& light = scene.lights[i];
    if (light.type == LightType::spot) {
      at.direction(light.position, light.target, light.up ? &*light.up : nullptr);
      at.angle("cone_deg", light.cone_deg);
    } else if (light.type == LightType::directional) {
      at.finite("direction", light.direction);
      const double length = glm::length(light.direction);
      at.expect(std::isfinite(length) && length > 0.0, "direction", light.direction, "a direction, not 0, and not out of reach");
      if (light.up) at.frame(light.direction, *light.up, "the light's direction");
      at.angular_radius("angular_radius_deg", light.angular_radius_deg);
    } else {
      at.finite("position", light.position);
    }
    if (light.type != LightType::directional) at.radius("radius", light.radius);
    at.color("color", light.color);
    at.expect(std::isfinite(light.intensity) && light.intensity >= 0.0, "intensity", light.intensity,
              "a finite number of at least 0");
    if (light.type != LightType::spot && light.shape != LightShape::disc)
      at.fail("shape", "the shape of a spot", "a rectangle of another type");
    at.size("size", light.size);
    if (light.texture) check_texture(at, light);
  }
  Checker{where, ""}.color("ambient", scene.ambient);

  const Animation& animation = scene.animation;
  if (animation.last_frame < animation.first_frame) {
    Checker{where, "animation"}.fail("frames", "a last frame that is not before the first",
                                     fmt::format("[{}, {}]", animation.first_frame, animation.last_frame));
  }
  std::set<std::string_view> targets;
  for (std::size_t i = 0; i < animation.tracks.size(); ++i) {
    const Checker at{where, "animation.tracks", i};
    const Track& track = animation.tracks[i];
    check_track(at, track, scene);
    at.expect(targets.insert(track.target).second, "target", track.target, "one track for each target");
  }
}

Scene load_scene(const std::filesystem::path& path, const LightTextureReader& read_texture) {
  const std::string file = path.string();
  const Json json = parse_json(read_file(path, "a scene file"), file);
  const Node root(json, file, "");
  root.object({"meshes", "camera", "lights", "ambient", "animation"});

  Scene scene;
  scene.name = path.stem().string();
  scene.camera = read_camera(root.at("camera"));
  if (root.has("lights")) {
    for (const Node& node : root.at("lights").items()) {
      scene.lights.push_back(read_light(node, fmt::format("light{}", scene.lights.size()), path.parent_path(), read_texture));
    }
  }
  root.read("ambient", scene.ambient);
  MeshFiles files;
  for (const Node& node : root.at("meshes").items()) scene.meshes.push_back(read_mesh(node, path.parent_path(), files, file));
  if (root.has("animation")) scene.animation = read_animation(root.at("animation"), scene, file);
  validate(scene, file);
  return scene;
}

std::string_view name_of(LightType type) {
  return light_types[static_cast<std::size_t>(type)];
}

Scene scene_at_frame(const Scene& scene, int frame) {
  Scene result = scene;
  for (const Track& track : scene.animation.tracks) {
    if (track.keys.empty()) continue;
    const glm::dvec3 value = value_at(track, frame);
    const auto property = property_of(result, track.target, "animation track");
    if (auto* const vector = std::get_if<glm::dvec3*>(&property)) **vector = value;
    if (auto* const pair = std::get_if<glm::dvec2*>(&property)) **pair = value;
    if (auto* const scalar = std::get_if<double*>(&property)) **scalar = value.x;
  }
  return result;
}

}  // namespace halfshade
