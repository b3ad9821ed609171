// Lights in a scene file's terms: as scene files and picture metadata have them.
#pragma once

#include <string>

#include "halfshade/halfshade.hpp"
#include "scene/json_node.hpp"

namespace halfshade {

/// The type that a light's "type" names. Throws InputError with the known ones.
LightType read_light_type(const Node& type);

/// Reads "shape", where lights of this type have it, and all keys that the light then has, into `light`, whose type is set. Other
/// keys are left alone. Throws InputError for a key that is missing or of a wrong form.
void read_light_keys(const Node& node, Light& light);

/// All keys that an object of a light of this type may have.
std::vector<std::string_view> known_light_keys(LightType type);

/// Where a light is and how large, as one line of JSON: its type, its shape if that is not the first of its type, and the keys of
/// both. Name, color, intensity and texture are left out.
std::string json_of(const Light& light);

/// The light that json_of wrote; what is left out has its default. Without a type, as pictures had before there were others than
/// spots, it is a spot. Throws InputError, whose message begins with `where`.
Light light_from_json(const std::string& text, const std::string& where);

}  // namespace halfshade
