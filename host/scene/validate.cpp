// What the values of a scene mean, whether it comes from a file or from a program.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "halfshade/halfshade.hpp"
#include "light/light_model.hpp"
#include "scene/animation.hpp"
#include "scene/checker.hpp"
#include "scene/placement.hpp"

namespace halfshade {
namespace {

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

void check_texture(const Checker& at, const Light& light) {
  const LightTexture& texture = *light.texture;
  at.expect(model_of(light.shape).has_texture, "texture", texture.name, "none for a disc; only a rectangle can have one");
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
  const auto is_resolution = [](unsigned side) { return side >= 1 && side <= max_resolution_px; };
  at.expect(is_resolution(camera.resolution.x) && is_resolution(camera.resolution.y), "resolution", camera.resolution,
            "a width and a height from 1 to 16384 pixels");
}

}  // namespace

void validate(const Scene& scene, std::string_view where) {
  check_names(scene, where);
  for (std::size_t i = 0; i < scene.meshes.size(); ++i) {
    const Checker at{where, "meshes", i};
    const SceneMesh& mesh = scene.meshes[i];
    if (!mesh.mesh) at.fail("mesh", "a mesh", "none");
    check_matrix(at, "world_from_mesh", mesh.world_from_mesh);
    at.color("base_color", mesh.base_color);
  }
  check_camera({where, "camera"}, scene.camera);
  for (std::size_t i = 0; i < scene.lights.size(); ++i) check_light({where, "lights", i}, scene.lights[i]);
  Checker{where, ""}.color("ambient", scene.ambient);
  check_animation(scene, where);
}

}  // namespace halfshade
