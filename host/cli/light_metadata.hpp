// What `render` writes about a light for `compare` to read.
#pragma once

#include <optional>
#include <string>
#include <utility>

#include "halfshade/halfshade.hpp"
#include "image/image_io.hpp"

namespace halfshade {

/// A light as picture metadata, "light.<name>": what decides which pixels count (docs/design.md, "Error"), as JSON in the scene
/// file's terms.
std::pair<std::string, std::string> light_metadata(const Light& light);

/// The light of that name in a picture. Nothing where the picture does not tell. Throws InputError, beginning with `where`, for
/// what cannot be read.
std::optional<Light> light_from_metadata(const ExrImage& image, const std::string& name, const std::string& where);

}  // namespace halfshade
