#include "scene/animation.hpp"

#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "scene/limits.hpp"
#include "scene/placement.hpp"
#include "scene/suggestion.hpp"

namespace halfshade {
namespace {

const Rule<glm::dvec3> is_scale_rule{[](const glm::dvec3& v) { return v.x != 0.0 && v.y != 0.0 && v.z != 0.0; },
                                     "numbers other than 0"};

/// Calls `visit(object, member, property)` for everything in `scene` that a track may set.
template <class S, class Visit>
void for_each_property(S& scene, Visit&& visit) {
  using Vector = PropertyOf<MemberOf<S, glm::dvec3>>;
  for (auto& mesh : scene.meshes) {
    const auto placed = scene.animation.placements.find(mesh.name);
    if (placed == scene.animation.placements.end()) continue;
    visit(mesh.name, "translation", Property<S>(Vector{&placed->second.translation, &is_finite_rule}));
    visit(mesh.name, "rotation_deg", Property<S>(Vector{&placed->second.rotation_deg, &is_finite_rule}));
    visit(mesh.name, "scale", Property<S>(Vector{&placed->second.scale, &is_scale_rule}));
  }
  visit("camera", "position", Property<S>(Vector{&scene.camera.position, &is_finite_rule}));
  visit("camera", "target", Property<S>(Vector{&scene.camera.target, &is_finite_rule}));
  for (auto& light : scene.lights)
    for (const LightKey& any_key : keys_of(light))
      std::visit(
          [&]<class T>(const KeyOf<T>& key) {
            if constexpr (std::is_constructible_v<Property<S>, PropertyOf<MemberOf<S, T>>>)
              if (key.is_animated)
                visit(light.name, key.name, Property<S>(PropertyOf<MemberOf<S, T>>{&(light.*key.member), key.rule}));
          },
          any_key);
}

/// What some light has that tracks may set, besides what all have.
std::vector<std::string_view> animated_light_keys() {
  std::vector<std::string_view> names;
  const auto append = [&](std::span<const LightKey> keys) {
    for (const LightKey& key : keys)
      if (is_animated(key) && std::ranges::count(names, name_of(key)) == 0) names.push_back(name_of(key));
  };
  for (const LightType type : light_types()) {
    append(model_of(type).keys);
    if (!model_of(type).has_shape_key) continue;
    for (const LightShape shape : model_of(type).shapes) append(model_of(shape).keys);
  }
  return names;
}

[[noreturn]] void fail_unknown(const Scene& scene, std::string_view target, std::string_view where) {
  std::vector<std::string> known;
  for_each_property(scene, [&](std::string_view object, std::string_view member, const Property<const Scene>&) {
    known.push_back(fmt::format("{}.{}", object, member));
  });
  const bool is_mesh = std::ranges::any_of(scene.meshes, [&](const SceneMesh& mesh) { return mesh.name == object_of(target); });
  const bool has_placement = scene.animation.placements.contains(object_of(target));
  const std::string remedy = is_mesh && !has_placement
                                 ? "; give the mesh a placement in Animation::placements"
                                 : suggestion(target, std::vector<std::string_view>(known.begin(), known.end()));
  throw InputError(
      fmt::format("{}: expected <mesh>.translation|rotation_deg|scale, camera.position|target or "
                  "<light>.intensity or what it has of {} (found {}){}",
                  where, fmt::join(animated_light_keys(), "|"), shown(nlohmann::json(target)), remedy));
}

template <class S>
Property<S> find_property(S& scene, std::string_view target, std::string_view where) {
  Property<S> found;
  const std::size_t dot = target.rfind('.');
  if (dot != target.npos) {
    for_each_property(scene, [&](std::string_view object, std::string_view member, const Property<S>& property) {
      if (object == object_of(target) && member == target.substr(dot + 1)) found = property;
    });
  }
  if (std::holds_alternative<std::monostate>(found)) fail_unknown(scene, target, where);
  return found;
}

glm::dvec3 value_at(const Track& track, double frame) {
  const auto after = std::ranges::upper_bound(track.keys, frame, {}, &Track::Key::frame);
  if (after == track.keys.begin()) return after->value;
  const auto before = after - 1;
  if (after == track.keys.end()) return before->value;
  return glm::mix(before->value, after->value, (frame - before->frame) / (after->frame - before->frame));
}

/// A key's value as the type of what it sets.
template <class T>
T value_as(const glm::dvec3& value) {
  if constexpr (std::is_same_v<T, double>)
    return value.x;
  else
    return T(value);
}

void check_track(const Checker& at, const Track& track, const Scene& scene) {
  const auto property = property_of(scene, track.target, fmt::format("{}: {}[{}].target", at.where, at.list, at.index));
  if (track.keys.empty()) at.fail("keys", "at least one key", "none");
  for (std::size_t k = 0; k < track.keys.size(); ++k) {
    const Track::Key& key = track.keys[k];
    const auto key_member = fmt::format("keys[{}]", k);
    at.expect(std::isfinite(key.frame) && (k == 0 || key.frame > track.keys[k - 1].frame), key_member, key.frame,
              "a frame after the one of the key before");
    at.finite(key_member, key.value);
    std::visit(
        [&]<class P>(const P& typed) {
          if constexpr (!std::is_same_v<P, std::monostate>) {
            using T = std::remove_cvref_t<decltype(*typed.value)>;
            if (typed.rule != nullptr) at.rule(key_member, value_as<T>(key.value), *typed.rule);
          }
        },
        property);
  }
}

}  // namespace

std::string_view object_of(std::string_view target) {
  const std::size_t dot = target.rfind('.');
  return dot == target.npos ? std::string_view() : target.substr(0, dot);
}

Property<const Scene> property_of(const Scene& scene, std::string_view target, std::string_view where) {
  return find_property(scene, target, where);
}
Property<Scene> property_of(Scene& scene, std::string_view target, std::string_view where) {
  return find_property(scene, target, where);
}

void check_animation(const Scene& scene, std::string_view where) {
  const Animation& animation = scene.animation;
  const auto frames = [&] { return fmt::format("[{}, {}]", animation.first_frame, animation.last_frame); };
  if (animation.first_frame < -limits::last_frame || animation.last_frame > limits::last_frame)
    Checker{where, "animation"}.fail("frames", fmt::format("frames from -{0} to {0}", limits::last_frame), frames());
  if (animation.last_frame < animation.first_frame)
    Checker{where, "animation"}.fail("frames", "a last frame that is not before the first", frames());
  for (const auto& [name, placement] : animation.placements) {
    const std::string list = fmt::format("animation.placements[{}]", shown(nlohmann::json(name)));
    check({where, list}, placement);
  }
  std::set<std::string_view> targets;
  for (std::size_t i = 0; i < animation.tracks.size(); ++i) {
    const Checker at{where, "animation.tracks", i};
    const Track& track = animation.tracks[i];
    check_track(at, track, scene);
    at.expect(targets.insert(track.target).second, "target", track.target, "one track for each target");
  }
}

void pose(Scene& scene, int frame) {
  for (const Track& track : scene.animation.tracks) {
    if (track.keys.empty()) continue;
    const glm::dvec3 value = value_at(track, frame);
    std::visit(
        [&]<class P>(const P& typed) {
          if constexpr (!std::is_same_v<P, std::monostate>)
            *typed.value = value_as<std::remove_cvref_t<decltype(*typed.value)>>(value);
        },
        property_of(scene, track.target, "animation track"));
  }
  for (SceneMesh& mesh : scene.meshes) {
    const auto placed = scene.animation.placements.find(mesh.name);
    if (placed != scene.animation.placements.end()) mesh.world_from_mesh = matrix_of(placed->second);
  }
}

Scene scene_at_frame(const Scene& scene, int frame) {
  Scene result = scene;
  pose(result, frame);
  return result;
}

}  // namespace halfshade
