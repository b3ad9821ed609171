// What lights are called inside pictures. EXR keeps names of channels and of attributes up to a length; it follows how long a
// light's name may be.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <string>
#include <string_view>

#include "scene/limits.hpp"

namespace halfshade {

/// The channel of a light's visibility is its name between these.
constexpr std::string_view visibility_prefix = "shadow_", visibility_suffix = ".Y";
constexpr std::size_t max_light_name = limits::exr_name - visibility_prefix.size() - visibility_suffix.size();

inline std::string visibility_channel(std::string_view light) {
  return fmt::format("{}{}{}", visibility_prefix, light, visibility_suffix);
}

/// The light whose visibility a channel is; empty for other channels.
inline std::string_view light_of_channel(std::string_view channel) {
  if (!channel.starts_with(visibility_prefix) || !channel.ends_with(visibility_suffix)) return {};
  channel.remove_prefix(visibility_prefix.size());
  channel.remove_suffix(std::min(channel.size(), visibility_suffix.size()));
  return channel;
}

/// Attributes that say something of a picture begin with this.
constexpr std::string_view metadata_prefix = "halfshade:";

/// The attribute, without the prefix, that describes a light: its name, or as much of it as there is room for. No two lights of a
/// scene have the same.
inline std::string light_attribute(std::string_view light) {
  constexpr std::string_view prefix = "light.";
  return fmt::format("{}{}", prefix, light.substr(0, limits::exr_name - metadata_prefix.size() - prefix.size()));
}

}  // namespace halfshade
