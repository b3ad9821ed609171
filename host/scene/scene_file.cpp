// Scene files: JSON to a scene. Reading complains about the file's form (keys, types), `validate` about what the values mean, for
// scenes made by a program too.
#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "halfshade/halfshade.hpp"
#include "light/light_model.hpp"
#include "scene/animation.hpp"
#include "scene/json_node.hpp"
#include "scene/light_json.hpp"
#include "scene/limits.hpp"
#include "scene/placement.hpp"
#include "scene/read_file.hpp"
#include "scene/scene_folder.hpp"

namespace halfshade {
namespace {

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

SceneMesh read_mesh(const Node& node, const SceneFolder& folder, MeshFiles& files, const std::string& file,
                    Placement& placement) {
  node.object({"name", "path", "translation", "rotation_deg", "scale", "casts_shadow", "receives_shadow", "base_color"});
  std::string path;
  node.require("path", path);
  const std::filesystem::path mesh_file = folder.file_at(node.at("path"));
  SceneMesh mesh;
  mesh.name = std::filesystem::path(path).stem().string();
  node.read("name", mesh.name);
  if (mesh.name.empty()) node.fail("a mesh with a name");
  node.read("translation", placement.translation);
  node.read("rotation_deg", placement.rotation_deg);
  node.read("scale", placement.scale);
  mesh.world_from_mesh = matrix_of(placement);
  node.read("casts_shadow", mesh.casts_shadow);
  node.read("receives_shadow", mesh.receives_shadow);
  node.read("base_color", mesh.base_color);
  try {
    mesh.mesh = files.load(mesh_file);
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

std::shared_ptr<const LightTexture> read_light_texture(const Node& node, const SceneFolder& folder,
                                                       const LightTextureReader& read_texture) {
  const std::filesystem::path path = folder.file_at(node);
  if (!read_texture) node.fail("no texture", "; this program reads no pictures");
  try {
    return read_texture(path);
  } catch (const InputError& error) {
    node.fail(fmt::format("an EXR picture with channels R, G and B, or Y: {}", error.what()));
  }
}

Light read_light(const Node& node, std::string default_name, const SceneFolder& folder, const LightTextureReader& read_texture) {
  Light light;
  light.type = read_light_type(node.object().at("type"));
  const std::vector<std::string_view> known = known_light_keys(light.type);
  node.object(known);
  light.name = std::move(default_name);
  node.read("name", light.name);
  if (light.name.empty()) node.fail("a light with a name");
  read_light_keys(node, light);
  const LightModel& model = model_of(light.type);
  if (!model.has_shape_key) return light;

  // Keys of a shape that the light does not have.
  const ShapeModel& shape = model_of(light.shape);
  const auto refuse = [&](std::string_view key) {
    if (node.has(key)) node.at(key).fail(shape.other_keys_expected, shape.other_keys_remedy);
  };
  for (const LightShape other : model.shapes)
    if (other != light.shape)
      for (const LightKey& key : model_of(other).keys) refuse(name_of(key));
  if (!shape.has_texture)
    refuse("texture");
  else if (node.has("texture"))
    light.texture = read_light_texture(node.at("texture"), folder, read_texture);
  return light;
}

/// Reads what moves `scene`, whose placements are those of all its meshes.
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
    const bool is_scalar = std::holds_alternative<PropertyOf<const double>>(property);
    const bool is_pair = std::holds_alternative<PropertyOf<const glm::dvec2>>(property);
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
  for (const auto& placed : scene.animation.placements)
    if (std::ranges::any_of(animation.tracks, [&](const Track& track) { return object_of(track.target) == placed.first; }))
      animation.placements.insert(placed);
  return animation;
}

/// The items of the array at a key.
std::vector<Node> items_at(const Node& root, std::string_view key, std::size_t max_count) {
  std::vector<Node> items = root.at(key).items();
  if (items.size() > max_count)
    root.at(key).fail(fmt::format("at most {} items", max_count), fmt::format("; there are {}", items.size()));
  return items;
}

}  // namespace

Scene load_scene(const std::filesystem::path& path, const LightTextureReader& read_texture, ScenePaths allowed) {
  const std::string file = path.string();
  const nlohmann::json json = parse_json(read_file(path, "a scene file", limits::scene_bytes), file);
  const Node root(json, file, "");
  root.object({"meshes", "camera", "lights", "ambient", "animation"});
  const SceneFolder folder(path, allowed);

  Scene scene;
  scene.name = path.stem().string();
  scene.camera = read_camera(root.at("camera"));
  if (root.has("lights")) {
    for (const Node& node : items_at(root, "lights", limits::scene_lights))
      scene.lights.push_back(read_light(node, fmt::format("light{}", scene.lights.size()), folder, read_texture));
  }
  root.read("ambient", scene.ambient);
  MeshFiles files;
  std::vector<Placement> placements;
  for (const Node& node : items_at(root, "meshes", limits::scene_meshes))
    scene.meshes.push_back(read_mesh(node, folder, files, file, placements.emplace_back()));
  if (root.has("animation")) {
    for (std::size_t i = 0; i < placements.size(); ++i)
      scene.animation.placements.insert_or_assign(scene.meshes[i].name, placements[i]);
    scene.animation = read_animation(root.at("animation"), scene, file);
  }
  for (std::size_t i = 0; i < placements.size(); ++i) check({file, "meshes", i}, placements[i]);
  validate(scene, file);
  return scene;
}

}  // namespace halfshade
