// How far a visibility plane is from the truth: which pixels count, and the figures over them, in double precision.
#pragma once

#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "halfshade/halfshade.hpp"

namespace halfshade {

/// What a pixel is to one light.
enum class PixelKind : std::uint8_t {
  ignored,  ///< sees nothing, receives no shadow, or lies outside the light's cone: visibility 1 by definition
  away,     ///< its geometric normal turns away from the light's centre: visibility 0 by definition
  counted,  ///< shadow is computed here
};

/// The kind of each pixel. `normal_ws`: world-space geometric normals on the side that is seen, w = 0 where nothing is seen or
/// shadows are not received.
std::vector<PixelKind> pixel_kinds(std::span<const glm::dvec3> position_ws, std::span<const glm::vec4> normal_ws,
                                   const Light& light);

/// Error of a visibility plane over counted pixels. A visibility that is not finite counts as an absolute error of 1, and is left
/// out of `bias`, which has no sign for it.
struct ErrorFigures {
  std::size_t counted_pixels = 0;
  std::size_t penumbra_pixels = 0;  ///< counted, with 0.002 < truth < 0.998
  double rmse = 0.0;                ///< over counted pixels
  double penumbra_rmse = 0.0;       ///< over penumbra pixels; 0 where there are none
  double bias = 0.0;                ///< mean signed error (visibility - truth) over penumbra pixels; positive is too light
  double max_error = 0.0;
  double p999_error = 0.0;      ///< 99.9th percentile of absolute error, nearest rank
  double bad_fraction = 0.0;    ///< fraction of counted pixels with absolute error > 0.1
  std::size_t false_lit = 0;    ///< truth 0 shown > 0.5
  std::size_t false_umbra = 0;  ///< truth 1 shown < 0.5
  std::size_t nonfinite = 0;    ///< values that are not finite, over all pixels of the plane
};

/// All spans are one plane. Throws InputError where their sizes differ, or the truth is not finite at a counted pixel.
ErrorFigures compare_visibility(std::span<const float> visibility, std::span<const float> truth,
                                std::span<const PixelKind> kinds);

/// A figure by its name, as reports print it.
struct NamedFigure {
  std::string_view name;
  double value;
  bool is_count;
};
std::vector<NamedFigure> named_figures(const ErrorFigures& figures);

}  // namespace halfshade
