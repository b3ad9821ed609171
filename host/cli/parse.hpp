// Values of options that are no method's own, from text.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace halfshade {

/// Parts of a text between separators.
std::vector<std::string> split(std::string_view text, char separator);

/// An integer in [min, max]. Throws InputError with the option's name.
long parse_integer(std::string_view option, const std::string& text, long min, long max);

}  // namespace halfshade
