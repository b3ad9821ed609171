// "Did you mean ...?" for words that a user mistyped.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace halfshade {

/// `; did you mean "x"?` where one of `known` resembles `word`, else nothing.
std::string suggestion(std::string_view word, const std::vector<std::string_view>& known);

}  // namespace halfshade
