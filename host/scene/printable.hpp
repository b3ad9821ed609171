// Text of others' files in messages.
#pragma once

#include <algorithm>
#include <string>
#include <string_view>

namespace halfshade {

/// Text as a message can show it: on one line, without control characters, and not too long.
inline std::string printable(std::string_view text, std::size_t max_size = 40) {
  std::string shown(text.substr(0, max_size));
  std::ranges::replace_if(
      shown, [](unsigned char c) { return c < 0x20 || c > 0x7e; }, '?');
  return text.size() > max_size ? shown + "..." : shown;
}

}  // namespace halfshade
