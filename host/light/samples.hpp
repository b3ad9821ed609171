// Points of a light that stand for all of it.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

#include "halfshade/halfshade.hpp"

namespace halfshade {

struct LightView;

/// O'Neill's PCG output permutation as a hash of one word. kernels/methods/exact has the same.
std::uint32_t hash_of(std::uint32_t x);
/// A hash as a number in (0, 1).
double unit_of(std::uint32_t hash);

/// n stratified points of the unit square, one jittered point in each of n strata of equal area; disc_samples says more.
std::vector<glm::dvec2> square_samples(unsigned n, std::uint32_t seed);

/// n stratified points of the unit disc: strata of equal area on a square, one jittered point in each, mapped to the disc by
/// Shirley & Chiu's concentric map, which keeps areas and neighbourhoods. The same points for the same n and seed. 16 consecutive
/// ones lie together where n is a multiple of 16 and a square, for packets of rays. n = 1 is the centre. Another `seed`, other
/// jitter.
std::vector<glm::dvec2> disc_samples(unsigned n, std::uint32_t seed = 0);

/// Points of a light.
struct LightPoints {
  std::vector<glm::dvec2> points;  ///< along the light's right and up, in units of its disc_radius
  /// Of a textured light: what each point adds to each channel of the colour, 1 on average; else empty.
  std::vector<glm::vec3> weights;
};

/// n stratified points that stand for as much luminance each: disc_samples of a disc; the same strata on a rectangle, of a
/// textured one pulled to where it is bright (by rows, then along them). n = 1 of what has no texture is the centre.
LightPoints light_points(const Light& light, unsigned n, std::uint32_t seed = 0);

/// The mean of a light's texture; 1 without.
glm::dvec3 mean_color(const Light& light);

/// Samples as kernels/methods/exact reads them.
struct SampleTable {
  std::vector<float> samples;        ///< x of all, y of all, turns of all (ascending)
  std::vector<std::uint16_t> below;  ///< below[i]: how many have a turn below i / per_turn, from 0 to one step past a whole turn
  float per_turn = 0.0f;             ///< steps a quarter turn
  std::vector<float> weights;        ///< red of all, green of all, blue of all; empty where the points have none
  /// The samples again, by the cell that they lie in of a grid of cells_across^2 on -1..1: x of all, padding, y of all, padding.
  std::vector<float> cell_xy;
  unsigned cells_across = 0;
  std::vector<std::uint16_t> cells;  ///< where each cell, row by row, begins there; one more; their numbers in `samples`; padding
  /// The samples once more, for each cell of a grid twice as fine those of it and of the next two columns and rows: x of 16, y of
  /// 16, beyond the light where there are fewer.
  std::vector<float> window_xy;
  std::vector<std::uint16_t> windows;  ///< 16 a window: their numbers in `samples`; the first is 65535 if there are more than 16
};

/// Sorts points by angle, and into grids.
SampleTable sample_table(const LightPoints& points);

/// Point number `index` of `count` of the light, as a light without extent that faces the same direction: of a flat light
/// disc_sample; of a sphere so that they fill its disc evenly from wherever it is seen. A spot's cone holds all that can lie in
/// the light's own behind the nearest caster.
Light light_sample(const Light& light, const LightView& fitted, unsigned index, unsigned count);

/// The same of a disc: in rings of equal area, rotated from one to the next by the golden angle.
Light disc_sample(const Light& light, const LightView& fitted, unsigned index, unsigned count);

/// The same for a given point, in units of disc_radius along the light's right and up.
Light light_at_point(const Light& light, const LightView& fitted, const glm::dvec2& point);

}  // namespace halfshade
