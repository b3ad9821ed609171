#include "cli/light_metadata.hpp"

#include <fmt/format.h>

#include "scene/light_json.hpp"
#include "scene/picture_names.hpp"
#include "scene/printable.hpp"

namespace halfshade {

std::pair<std::string, std::string> light_metadata(const Light& light) {
  return {light_attribute(light.name), json_of(light)};
}

std::optional<Light> light_from_metadata(const ExrImage& image, const std::string& name, const std::string& where) {
  const auto found = image.metadata.find(light_attribute(name));
  if (found == image.metadata.end()) return {};
  try {
    Light light = light_from_json(found->second, where);
    light.name = name;
    return light;
  } catch (const InputError& error) {
    throw InputError(fmt::format("{}: metadata {}{}: expected what halfshade render writes (found '{}'): {}", where,
                                 metadata_prefix, printable(found->first), printable(found->second, 200), error.what()));
  }
}

}  // namespace halfshade
