// What the values of a scene mean, whether it comes from a file or from a program.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "halfshade/halfshade.hpp"
#include "light/light_model.hpp"
#include "scene/animation.hpp"
#include "scene/checker.hpp"
#include "scene/limits.hpp"
#include "scene/picture_names.hpp"
#include "scene/placement.hpp"

namespace halfshade {
namespace {

void check_names(const Scene& scene, std::string_view where) {
  std::set<std::string_view> names{"camera"};
  std::set<std::string> attributes;
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
    if (name.size() > max_light_name)
      at.fail("name", fmt::format("at most {} letters (it becomes part of image channel names)", max_light_name),
              fmt::format("{} letters", name.size()));
    at.expect(is_plain, "name", name, "letters, digits, _ and - (it becomes part of image channel names)");
    check(at, name);
    if (!name.empty() && !attributes.insert(light_attribute(name)).second)
      at.fail("name",
              fmt::format("a name that differs from those of other lights in its first {} letters",
                          light_attribute(name).size() - light_attribute("").size()),
              shown(name));
  }
}

void check_texture(const Checker& at, const Light& light) {
  const LightTexture& texture = *light.texture;
  at.expect(model_of(light.shape).has_texture, "texture", texture.name, "none for a disc; only a rectangle can have one");
  const glm::uvec2 size = texture.resolution;
  at.expect(size.x > 0 && size.y > 0 && size.x <= limits::side_px && size.y <= limits::side_px &&
                texture.texels.size() == std::size_t{size.x} * size.y && texture.texels.size() <= limits::texels,
            "texture", texture.name,
            fmt::format("as many texels as its resolution says, from 1 to {} a side and at most {} in all", limits::side_px,
                        limits::texels));
  const auto is_valid = [](float value) { return value >= 0.0f && value <= limits::texel; };
  const bool valid =
      std::ranges::all_of(texture.texels, [&](const glm::vec3& t) { return is_valid(t.r) && is_valid(t.g) && is_valid(t.b); });
  at.expect(valid, "texture", texture.name,
            fmt::format("a picture of finite values of at least 0 and at most {:g}", limits::texel));
  const bool shines = std::ranges::any_of(texture.texels, [](const glm::vec3& t) { return t.r + t.g + t.b > 0.0f; });
  at.expect(shines, "texture", texture.name, "a picture that is not black all over");
}

/// The value of a light's member as a message can show it.
std::string shown_member(const Light& light, std::string_view member) {
  std::string text;
  for (const LightKey& any_key : keys_of(light))
    std::visit(
        [&]<class T>(const KeyOf<T>& key) {
          if (key.name == member) text = shown(light.*key.member);
        },
        any_key);
  return text;
}

void check_keys(const Checker& at, const Light& light, std::span<const LightKey> keys) {
  for (const LightKey& any_key : keys)
    std::visit(
        [&]<class T>(const KeyOf<T>& key) {
          if (key.rule != nullptr) at.rule(key.name, light.*key.member, *key.rule);
        },
        any_key);
}

void check_light(const Checker& at, const Light& light) {
  if (std::ranges::count(light_types(), light.type) == 0)
    at.fail("type", "a declared light type", fmt::format("number {}", static_cast<int>(light.type)));
  const LightModel& model = model_of(light.type);
  check_keys(at, light, model.keys);
  if (const std::optional<Misfit> misfit = model.misfit(light))
    at.fail(misfit->member, misfit->expected, shown_member(light, misfit->member));
  check_keys(at, light, common_light_keys());
  if (std::ranges::count(model.shapes, light.shape) == 0) {
    std::vector<std::string_view> known;
    for (const LightShape shape : model.shapes) known.push_back(name_of(shape));
    at.fail("shape", fmt::format("a shape of a {} light: {}", name_of(light.type), fmt::join(known, ", ")), name_of(light.shape));
  }
  // Of all shapes, so that a program may choose another one later.
  if (model.has_shape_key)
    for (const LightShape shape : model.shapes) check_keys(at, light, model_of(shape).keys);
  if (light.texture) check_texture(at, light);
}

void check_camera(const Checker& at, const Camera& camera) {
  if (const std::optional<Misfit> misfit = misfit_of_look(camera.position, camera.target, camera.up))
    at.fail(misfit->member, misfit->expected,
            shown(misfit->member == "up"       ? camera.up
                  : misfit->member == "target" ? camera.target
                                               : camera.position));
  at.rule("yfov_deg", camera.yfov_deg, is_full_angle_rule);
  at.expect(std::isfinite(camera.znear) && camera.znear > 0.0, "znear", camera.znear, "a finite number above 0");
  at.expect(std::isfinite(camera.zfar) && camera.zfar > camera.znear, "zfar", camera.zfar, "a finite number above znear");
  const auto is_resolution = [](unsigned side) { return side >= 1 && side <= limits::side_px; };
  at.expect(is_resolution(camera.resolution.x) && is_resolution(camera.resolution.y), "resolution", camera.resolution,
            fmt::format("a width and a height from 1 to {} pixels", limits::side_px));
}

/// Checks what the tracks of an object move, by its name, at the frame that `posed` shows.
void check_object(const Scene& posed, std::string_view name, std::string_view where) {
  if (name == "camera") check_camera({where, "camera"}, posed.camera);
  for (std::size_t i = 0; i < posed.lights.size(); ++i)
    if (posed.lights[i].name == name) check_light({where, "lights", i}, posed.lights[i]);
  for (std::size_t i = 0; i < posed.meshes.size(); ++i) {
    if (posed.meshes[i].name != name) continue;
    const auto placed = posed.animation.placements.find(name);
    if (placed != posed.animation.placements.end()) check({where, "meshes", i}, placed->second);
    check_matrix({where, "meshes", i}, "world_from_mesh", posed.meshes[i].world_from_mesh);
  }
}

}  // namespace

void check_frames(const Scene& scene, int first, int last, std::string_view where) {
  std::map<std::string_view, std::string> tracks_of;  // by the name of what they move
  for (std::size_t i = 0; i < scene.animation.tracks.size(); ++i) {
    std::string& tracks = tracks_of[object_of(scene.animation.tracks[i].target)];
    tracks += fmt::format("{}animation.tracks[{}]", tracks.empty() ? "" : ", ", i);
  }
  if (tracks_of.empty()) return;
  Scene posed = scene;
  for (Light& light : posed.lights) light.texture = nullptr;  // textures do not move, and are long to check
  for (int frame = first; frame <= last; ++frame) {
    pose(posed, frame);
    for (const auto& [name, tracks] : tracks_of)
      check_object(posed, name, fmt::format("{}: frame {}, moved by {}", where, frame, tracks));
  }
}

void validate(const Scene& scene, std::string_view where) {
  check_names(scene, where);
  for (std::size_t i = 0; i < scene.meshes.size(); ++i) {
    const Checker at{where, "meshes", i};
    const SceneMesh& mesh = scene.meshes[i];
    if (!mesh.mesh) at.fail("mesh", "a mesh", "none");
    check_matrix(at, "world_from_mesh", mesh.world_from_mesh);
    at.color("base_color", mesh.base_color, limits::base_color);
  }
  check_camera({where, "camera"}, scene.camera);
  for (std::size_t i = 0; i < scene.lights.size(); ++i) check_light({where, "lights", i}, scene.lights[i]);
  Checker{where, ""}.color("ambient", scene.ambient, limits::light_color);
  check_animation(scene, where);
}

}  // namespace halfshade
