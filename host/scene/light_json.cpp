#include "scene/light_json.hpp"

#include <fmt/ranges.h>

#include <algorithm>

#include "light/light_model.hpp"
#include "scene/suggestion.hpp"

namespace halfshade {
namespace {

using OrderedJson = nlohmann::ordered_json;

/// The enumerator that a word names. Throws InputError with the known ones.
template <class Enum>
Enum enumerator_of(const Node& node, std::span<const Enum> all, std::string_view what) {
  const auto word = node.as<std::string>();
  std::vector<std::string_view> known;
  for (const Enum one : all) {
    if (name_of(one) == word) return one;
    known.push_back(name_of(one));
  }
  node.fail(fmt::format("one of the {} {}", what, fmt::join(known, ", ")), suggestion(word, known));
}

OrderedJson json_of(double value) {
  return value;
}
OrderedJson json_of(const glm::dvec2& v) {
  return OrderedJson::array({v.x, v.y});
}
template <class T>
OrderedJson json_of(const glm::vec<3, T>& v) {
  return OrderedJson::array({v.x, v.y, v.z});
}

void write_keys(OrderedJson& json, const Light& light, std::span<const LightKey> keys) {
  for (const LightKey& any_key : keys)
    std::visit(
        [&]<class T>(const KeyOf<T>& key) {
          const T& value = light.*key.member;
          if constexpr (std::is_same_v<T, std::optional<glm::dvec3>>) {
            if (value) json[std::string(key.name)] = json_of(*value);
          } else {
            json[std::string(key.name)] = json_of(value);
          }
        },
        any_key);
}

}  // namespace

LightType read_light_type(const Node& type) {
  return enumerator_of(type, light_types(), "light types");
}

void read_light_keys(const Node& node, Light& light) {
  const LightModel& model = model_of(light.type);
  light.shape = model.shapes.front();
  if (model.has_shape_key && node.has("shape")) light.shape = enumerator_of(node.at("shape"), model.shapes, "shapes");
  for (const LightKey& any_key : keys_of(light))
    std::visit(
        [&]<class T>(const KeyOf<T>& key) {
          T& value = light.*key.member;
          if (key.is_required)
            node.require(key.name, value);
          else
            node.read(key.name, value);
        },
        any_key);
}

std::vector<std::string_view> known_light_keys(LightType type) {
  const LightModel& model = model_of(type);
  std::vector<std::string_view> names{"name", "type"};
  const auto append = [&](std::span<const LightKey> keys) {
    for (const LightKey& key : keys) names.push_back(name_of(key));
  };
  append(common_light_keys());
  append(model.keys);
  if (!model.has_shape_key) return names;
  names.push_back("shape");
  bool has_texture = false;
  for (const LightShape shape : model.shapes) {
    append(model_of(shape).keys);
    has_texture |= model_of(shape).has_texture;
  }
  if (has_texture) names.push_back("texture");
  return names;
}

std::string json_of(const Light& light) {
  const LightModel& model = model_of(light.type);
  OrderedJson json = {{"type", name_of(light.type)}};
  if (light.shape != model.shapes.front()) json["shape"] = name_of(light.shape);
  write_keys(json, light, model.keys);
  if (model.has_shape_key) write_keys(json, light, model_of(light.shape).keys);
  return json.dump();
}

Light light_from_json(const std::string& text, const std::string& where) {
  const nlohmann::json json = parse_json(text, where);
  const Node node = Node(json, where, "").object();
  Light light;
  if (node.has("type")) light.type = read_light_type(node.at("type"));
  read_light_keys(node, light);
  return light;
}

}  // namespace halfshade
