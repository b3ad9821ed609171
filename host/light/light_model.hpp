// What a light is, by its kind and its shape. A kind is declared once, in host/light/<kind>.cpp, and named once, in
// HALFSHADE_LIGHT_TYPES of the public header; everything else that a light's kind decides is asked here. Likewise a shape.
#pragma once

#include <optional>
#include <span>
#include <string_view>
#include <variant>
#include <vector>

#include "halfshade/halfshade.hpp"
#include "light/samples.hpp"
#include "light/view.hpp"

namespace halfshade {

struct LightView;

// ---- keys -------------------------------------------------------------------------------------------------------------------

/// What a value must be, and in words.
template <class T>
struct Rule {
  bool (*holds)(const T& value);
  std::string_view expected;
};

/// A key that lights have in scene files, picture metadata and animations, and the member of Light that it sets.
template <class T>
struct KeyOf {
  std::string_view name;
  T Light::*member;
  const Rule<T>* rule;  ///< null: checked with others, by LightModel::misfit
  bool is_required, is_animated;
};
using LightKey =
    std::variant<KeyOf<double>, KeyOf<glm::dvec2>, KeyOf<glm::dvec3>, KeyOf<glm::vec3>, KeyOf<std::optional<glm::dvec3>>>;

enum class Presence { optional, required };
enum class Motion { fixed, animated };

template <class T>
constexpr LightKey light_key(std::string_view name, T Light::*member, const Rule<T>* rule, Presence presence, Motion motion) {
  return KeyOf<T>{name, member, rule, presence == Presence::required, motion == Motion::animated};
}
constexpr std::string_view name_of(const LightKey& key) {
  return std::visit([](const auto& typed) { return typed.name; }, key);
}
constexpr bool is_animated(const LightKey& key) {
  return std::visit([](const auto& typed) { return typed.is_animated; }, key);
}

extern const Rule<glm::dvec3> is_finite_rule;
extern const Rule<double> is_not_negative_rule;
extern const Rule<double> is_full_angle_rule;      ///< of a frustum, in degrees
extern const Rule<double> is_angular_radius_rule;  ///< of a cone of directions, in degrees
extern const Rule<glm::dvec2> is_size_rule;

/// What every light has besides its name and type: color and intensity.
std::span<const LightKey> common_light_keys();

// ---- shapes -----------------------------------------------------------------------------------------------------------------

/// What the shape of a flat light decides.
struct ShapeModel {
  std::span<const LightKey> keys;  ///< in the order in which errors and documents list them
  bool has_texture;                ///< scene files may give it the key "texture"
  bool is_round;                   ///< it stays the same however it is turned
  /// What a scene file's error expects in place of another shape's key, and what to do.
  std::string_view other_keys_expected, other_keys_remedy;
  /// The radius of the disc about the centre that holds it.
  double (*radius)(const Light& light);
  /// See light_points.
  LightPoints (*points)(const Light& light, unsigned n, std::uint32_t seed);
};

/// Throws InputError for what is none of the enumerators.
const ShapeModel& model_of(LightShape shape);
std::span<const LightShape> light_shapes();

// ---- kinds ------------------------------------------------------------------------------------------------------------------

/// What the kind of a light decides. A member function without a body here must be said for each kind.
class LightModel {
 public:
  virtual ~LightModel() = default;

  std::span<const LightKey> keys;           ///< its own, besides those of every light and of its shape
  std::span<const LightShape> shapes;       ///< what it may look like, the first by default
  bool has_shape_key = false;               ///< the scene file's "shape" tells which, and the shape's keys are the light's too
  std::span<const std::string_view> faces;  ///< names of the views that it is drawn in; one, without a name, if one is enough
  bool is_sphere = false;                   ///< each receiver sees the disc that faces it; else all see the same flat shape
  bool is_projective = false;               ///< it shines in parallel: its light space is a projective image of the world
  bool has_cone = false;                    ///< it shines into a square frustum; else in all directions, or everywhere

  bool has_faces() const { return faces.size() > 1; }

  /// What keeps a light whose values follow the keys' rules one by one from being drawn.
  virtual std::optional<Misfit> misfit(const Light& light) const = 0;

  /// The lights that it is drawn as, one for each name of `faces`, each looking along an axis of its own.
  virtual std::vector<Light> drawn_as(const Light& light) const = 0;

  /// Right, up and axis as rows, from the light's place; of a light without one, from the world's origin. Of one of `drawn_as`.
  virtual glm::dmat4 axes(const Light& light) const = 0;

  /// See disc_radius.
  virtual double radius(const Light& light) const = 0;

  /// The light's centre relative to `origin_ws`, and 1; or where the light comes from, a direction, and 0.
  virtual glm::dvec4 centre(const Light& light, const glm::dvec3& origin_ws) const = 0;

  /// The direction, of any length, in which light from the centre travels at a point of the world.
  virtual glm::dvec3 travel(const Light& light, const glm::dvec3& point_ws) const = 0;

  /// Half the width of the square that is lit at unit distance, for shading; 0 where there is no cone.
  virtual double tan_half_cone(const Light& light) const = 0;

  /// See light_sample.
  virtual Light sample(const Light& light, const LightView& fitted, unsigned index, unsigned count) const = 0;
};

/// Throws InputError for what is none of the enumerators.
const LightModel& model_of(LightType type);
std::span<const LightType> light_types();

/// The keys that this light has, in files and animations: of every light, of its kind, and of its shape.
std::vector<LightKey> keys_of(const Light& light);

// ---- of a light -------------------------------------------------------------------------------------------------------------

/// The lights that a light is drawn as: itself, or the six faces of a point light, each looking along an axis of the world: +x,
/// -x, +y, -y, +z, -z.
std::vector<Light> faces_of(const Light& light);

/// A light's right, up and axis as rows, from its position; a directional light's from the world's origin.
glm::dmat4 light_axes(const Light& light);

/// The square frustum of a light with a cone, or of a face.
Frustum light_frustum(const Light& light);

/// The radius of the disc about the light's centre that holds all of it, in the light's own space: R of the penumbra's
/// half-width. 0 for hard shadows.
double disc_radius(const Light& light);

/// Right, up and axis, as columns, of the face of a sphere light that a direction from its centre, not 0, lies in.
glm::dmat3 world_from_sphere_face(const glm::dvec3& from_light);

}  // namespace halfshade
