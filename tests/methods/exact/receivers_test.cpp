// What the shadow map decides and which receivers are counted, kernels/methods/exact/receivers.cl, against plain loops.
#include <random>

#include "support/exact_stages.hpp"

namespace halfshade {
namespace {

using Receivers = ShapedKernelTest;
HS_IN_BOTH_SHAPES(Receivers);

constexpr float px_per_q = 32.0f;
constexpr unsigned width = 45, height = 37;  // of the G-buffer

/// A pixel of the G-buffer, which faces the light, and what the map holds where it lies.
struct Pixel {
  glm::uvec2 texel;
  float z = 0.0f;
  bool seen = true;
  enum class Map { lit, dark, unclear } map = Map::lit;
};

class World {
 public:
  explicit World(const KernelRunner& runner)
      : runner_(runner), view(straight_view(*runner.device, glm::uvec2(3, 2) * runner.device->tile_px, px_per_q)) {
    std::mt19937 random(8);
    std::uniform_real_distribution<float> depth(3, 20), one(0, 1);
    // Every pixel in a texel of its own, in any order: the map says of each what it is.
    std::vector<unsigned> texels(std::size_t{view.width_px} * view.height_px);
    for (unsigned i = 0; i < texels.size(); ++i) texels[i] = i;
    std::shuffle(texels.begin(), texels.end(), random);
    shadow_map.assign(texels.size(), HS_EMPTY_Z);
    for (std::size_t i = 0; i < width * height; ++i) {
      Pixel pixel;
      pixel.texel = {texels[i % texels.size()] % view.width_px, texels[i % texels.size()] / view.width_px};
      pixel.z = depth(random);
      pixel.seen = one(random) < 0.8f && i < texels.size();
      pixel.map = static_cast<Pixel::Map>(random() % 3);
      if (pixel.seen)
        shadow_map[texels[i]] = pixel.map == Pixel::Map::lit    ? (i % 2 ? HS_EMPTY_Z : pixel.z)  // it, or nothing
                                : pixel.map == Pixel::Map::dark ? pixel.z * 0.7f
                                                                : pixel.z * 0.996f;  // maybe it, maybe not
      pixels.push_back(pixel);
    }
  }

  struct Output {
    std::vector<float> visibility;
    std::vector<cl_uint> words, counts;
    std::vector<float> far;
  };
  Output receive() {
    std::vector<glm::vec4> positions, normals;
    for (const Pixel& pixel : pixels) {
      const glm::vec2 q((pixel.texel.x + 0.5f - view.px_from_q.s[1]) / view.px_from_q.s[0],
                        (pixel.texel.y + 0.5f - view.px_from_q.s[3]) / view.px_from_q.s[2]);
      positions.emplace_back(q * pixel.z, pixel.z, pixel.seen ? 1.0f : 0.0f);
      normals.emplace_back(0, 0, -1, 1);
    }
    words = runner_.filled(pixels.size(), ~cl_uint{0});
    counts = runner_.filled(tiles_of(view), cl_uint{0});
    const Buffer<cl_int> far = runner_.filled(tiles_of(view), cl_int{0});
    const Buffer<cl_float> visibility = runner_.filled(pixels.size(), -1.0f);
    runner_.launcher.launch_pixels({width, height},
                                   kernels::ReceiveByMap{.light = view,
                                                         .view = receiver_view(),
                                                         .gbuffer = {.depth_or_position = runner_.buffer<cl_float>(positions),
                                                                     .normal = runner_.buffer<cl_float4>(normals)},
                                                         .shadow_map = runner_.buffer<cl_float>(shadow_map),
                                                         .receiver_words = words,
                                                         .tile_far = far,
                                                         .tile_counts = counts,
                                                         .visibility = {.visibility = visibility, .plane = cl_uint{0}}});
    return {runner_.read<float>(visibility, pixels.size()), runner_.read<cl_uint>(words, pixels.size()),
            runner_.read<cl_uint>(counts, tiles_of(view)), runner_.read<float>(far, tiles_of(view))};
  }

  /// After receive: the pixels to be counted, tile by tile.
  std::vector<std::vector<cl_uint>> list(const std::vector<cl_uint>& edge_offsets, bool all) {
    const cl_uint tiles = tiles_of(view);
    const Buffer<cl_uint> offsets = runner_.filled(tiles + 1, cl_uint{0}), listed = runner_.filled(pixels.size(), ~cl_uint{0});
    scan_tiles(runner_, tiles, 1, counts, offsets);
    runner_.launcher.launch_pixels({width, height}, kernels::ListReceivers{.view = receiver_view(),
                                                                           .receiver_words = words,
                                                                           .edge_offsets = runner_.buffer<cl_uint>(edge_offsets),
                                                                           .all = cl_uint{all},
                                                                           .touching = runner_.filled(1, cl_uint{0}),
                                                                           .tile_cursors = counts,
                                                                           .listed = listed});
    const auto begins = runner_.read<cl_uint>(offsets, tiles + 1), ends = runner_.read<cl_uint>(counts, tiles),
               numbers = runner_.read<cl_uint>(listed, pixels.size());
    std::vector<std::vector<cl_uint>> out;
    for (cl_uint tile = 0; tile < tiles; ++tile) {
      out.emplace_back(numbers.begin() + begins[tile], numbers.begin() + ends[tile]);
      std::sort(out.back().begin(), out.back().end());
    }
    return out;
  }

  std::size_t tile_of(const Pixel& pixel) const {
    return pixel.texel.y / runner_.device->tile_px * view.tiles_x + pixel.texel.x / runner_.device->tile_px;
  }

 private:
  static HsReceiverView receiver_view() {
    HsReceiverView view{};
    const HsTransform rows = identity_transform();
    view.from_world_x = rows.row_x;
    view.from_world_y = rows.row_y;
    view.from_world_z = rows.row_z;
    view.from_world_w = rows.row_w;
    view.axis_ws = {{0, 0, 1, 1}};
    view.width_px = width;
    view.height_px = height;
    view.tan_half_cone = 8.0f;
    view.unit = 1.0f;
    return view;
  }

  const KernelRunner& runner_;
  Buffer<cl_uint> words, counts;

 public:
  HsView view;
  std::vector<float> shadow_map;
  std::vector<Pixel> pixels;
};

TEST_P(Receivers, TheMapDecidesAndEveryTileKnowsItsReceivers) {
  World world(runner_);
  const World::Output out = world.receive();
  std::vector<cl_uint> counts(tiles_of(world.view), 0);
  std::vector<float> far(counts.size(), 0.0f);
  for (std::size_t i = 0; i < world.pixels.size(); ++i) {
    const Pixel& pixel = world.pixels[i];
    if (!pixel.seen) {
      ASSERT_EQ(out.visibility[i], 1.0f) << i;
      ASSERT_EQ(out.words[i], 0u) << i;
      continue;
    }
    const std::size_t tile = world.tile_of(pixel);
    ++counts[tile];
    far[tile] = std::max(far[tile], pixel.z);
    const cl_uint unclear = cl_uint{1} << 30;
    ASSERT_EQ(out.words[i], (tile + 1) | (pixel.map == Pixel::Map::unclear ? unclear : 0u)) << i;
    if (pixel.map != Pixel::Map::unclear) {
      ASSERT_EQ(out.visibility[i], pixel.map == Pixel::Map::lit ? 1.0f : 0.0f) << i;
    }
  }
  EXPECT_EQ(out.counts, counts);
  for (std::size_t tile = 0; tile < far.size(); ++tile) EXPECT_NEAR(out.far[tile], far[tile], 1e-5f * far[tile]) << tile;
  EXPECT_GT(*std::min_element(counts.begin(), counts.end()), 5u);
}

TEST_P(Receivers, CountedAreThoseOfTilesWithEdgesThoseThatTheMapLeavesOpenOrAll) {
  // Tiles 1 and 4 have edges.
  const std::vector<cl_uint> edge_offsets = {0, 0, 3, 3, 3, 5, 5};
  for (const bool all : {false, true}) {
    World world(runner_);
    world.receive();
    std::vector<std::vector<cl_uint>> expected(tiles_of(world.view));
    for (cl_uint i = 0; i < world.pixels.size(); ++i) {
      const Pixel& pixel = world.pixels[i];
      const std::size_t tile = world.tile_of(pixel);
      if (pixel.seen && (all || edge_offsets[tile] != edge_offsets[tile + 1] || pixel.map == Pixel::Map::unclear))
        expected[tile].push_back(i);
    }
    EXPECT_EQ(world.list(edge_offsets, all), expected) << all;
    EXPECT_FALSE(expected[0].empty());
  }
}

}  // namespace
}  // namespace halfshade
