// What tracks animate.
#pragma once

#include <string_view>
#include <type_traits>
#include <variant>

#include "halfshade/halfshade.hpp"
#include "light/light_model.hpp"
#include "scene/checker.hpp"

namespace halfshade {

/// A property that a track sets: where it is, and what its values must be.
template <class T>
struct PropertyOf {
  T* value;
  const Rule<std::remove_const_t<T>>* rule;
};

/// A property of a scene, const if that is: a vector, a pair or a number; or none.
template <class S, class T>
using MemberOf = std::conditional_t<std::is_const_v<S>, const T, T>;
template <class S>
using Property = std::variant<std::monostate, PropertyOf<MemberOf<S, glm::dvec3>>, PropertyOf<MemberOf<S, glm::dvec2>>,
                              PropertyOf<MemberOf<S, double>>>;

/// The property that a track's target names. Throws InputError, whose message begins with `where`, if the scene has none.
Property<const Scene> property_of(const Scene& scene, std::string_view target, std::string_view where);
Property<Scene> property_of(Scene& scene, std::string_view target, std::string_view where);

/// The part before the last dot of "<object>.<member>".
std::string_view object_of(std::string_view target);

/// Applies a scene's tracks to itself.
void pose(Scene& scene, int frame);

/// Throws InputError for the first frame of a range that cannot be drawn, as where a scale passes through 0 or a camera through
/// its target. The message begins with `where` and names frame and tracks.
void check_frames(const Scene& scene, int first, int last, std::string_view where);

/// Throws InputError for tracks that cannot be played.
void check_animation(const Scene& scene, std::string_view where);

}  // namespace halfshade
