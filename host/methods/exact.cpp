// exact: depth complexity counted from the light's centre over the silhouettes that cross (docs/design.md, "Exact soft shadows").
#include <cmath>

#include "light/light_model.hpp"
#include "methods/method.hpp"
#include "passes/light_points.hpp"

namespace halfshade {
namespace {

constexpr unsigned default_samples = 256;

constexpr Option options[] = {
    light_res_option,
    choice<&Settings::samples, default_samples, 16, 64, 256, HS_MAX_SAMPLES>(
        {"samples", "samples", "16|64|256|1024", "Points of the light", "16 64 256 1024", "16 64 256"}),
    {{"sample-pattern", "sample_pattern", "fixed|rotated", "The same points for every pixel, or turned from pixel to pixel",
      "fixed rotated", ""},
     [](Settings& settings, std::string_view typed) { settings.sample_pattern = sample_pattern_from_name(typed); },
     [](const Settings& settings) { return std::string(name_of(settings.sample_pattern)); }},
    flag<&Settings::alias_free>(
        {"alias-free", "alias_free", "", "Every pixel by geometry, none by the shadow map", "no yes", ""})};

std::string refusal(const Settings& settings, const Light& light) {
  if (model_of(light.shape).is_round || settings.sample_pattern == SamplePattern::fixed) return {};
  return fmt::format("light '{}' is a rectangle: expected the sample pattern 'fixed', only discs can be turned", light.name);
}

class ExactPasses final : public MethodPasses {
 public:
  using MethodPasses::MethodPasses;

  void learn(std::size_t wanted_refs) override { edge_bins_.wanted_refs = std::max(edge_bins_.wanted_refs, wanted_refs); }

 protected:
  /// Shadow map; receivers to tiles; potential silhouettes of the whole disc to the tiles of receivers that may have them before
  /// it; then receivers near them are counted, tile by tile.
  FeatureTotal draw_face(const LightFrame& frame, const LightFace& face) override {
    const LightView& fitted = face.fitted;
    const DrawList list = draw_list(device(), frame.resident, frame.placed, fitted.view, fitted.frustum.view_from_world,
                                    fitted.casters, fitted.casters);
    const LightPointBuffer& points = points_.of(device(), face.as, chosen_samples(frame.settings));
    const Disc disc = disc_of(frame, face, points);
    const HsReceiverView receiver = frame.receiver(face);
    reserve(frame, list.view);
    shared_.shadow_map.run(shared_.triangles, frame.resident, list, Coverage::conservative);
    receive_by_map(frame, list.view, receiver);
    collect_edges(frame, list, disc);
    bin_edges(list.view, disc.in_kernels.radius_px);
    list_receivers(frame, receiver);
    count_samples(frame, list, receiver, disc.in_kernels, points);
    return {edge_bins_.offsets, tiles_of(list.view)};
  }

 private:
  struct Disc {
    HsDisc in_kernels{};
    float widest_radius = 0.0f;  ///< on the light's plane, of all receivers' discs
  };

  static Disc disc_of(const LightFrame& frame, const LightFace& face, const LightPointBuffer& points) {
    Disc result;
    HsDisc& disc = result.in_kernels;
    disc.radius = static_cast<float>(face.fitted.radius);
    disc.sphere = model_of(face.as.type).is_sphere;
    // On the plane of a sphere's face, the disc that faces a receiver is up to this much larger, at the face's corners.
    const double widest = face.fitted.radius * (disc.sphere ? std::sqrt(3.0) : 1.0);
    result.widest_radius = static_cast<float>(widest);
    disc.radius_px = static_cast<float>(widest / face.fitted.lm_from_px_scale);
    disc.reach2 = disc.radius * disc.radius * 1.001f;
    disc.near_q = static_cast<float>(HS_NEAR_PX * face.fitted.lm_from_px_scale);
    disc.table_per_turn = points.per_turn;
    disc.sample_count = chosen_samples(frame.settings);
    disc.rotated = frame.settings.sample_pattern == SamplePattern::rotated;
    disc.tinted = frame.tints.counted();
    disc.cells_across = points.cells_across;
    return result;
  }

  /// On CPU devices a few workers share the edges, and then the tiles; on GPU devices a work-group is a tile.
  cl_uint workers() const { return 4 * device().device_info.compute_units; }
  /// Of the tiles' counts of edges: one a worker, for cores that count in the same lines of the cache wait for each other.
  cl_uint count_copies() const { return device().lanes == 1 ? 1 : std::min(workers(), 64u); }
  /// Rows of tiles are read whole vectors at a time.
  std::size_t tile_far_count(const HsView& view) const { return tiles_of(view) + device().lanes; }

  void reserve(const LightFrame& frame, const HsView& view) {
    const ResidentScene& resident = frame.resident;
    const cl_uint tiles = tiles_of(view);
    const std::size_t pixels = frame.gbuffer.pixel_count();
    const std::size_t max_edges = resident.edge_record_count;  // in whole blocks
    planes_.reserve(device(), resident.triangle_count, "face planes");
    disc_sides_.reserve(device(), resident.triangle_count, "face sides");
    touching_.reserve(device(), std::size_t{resident.triangle_count} + 1, "faces at the light");
    edges_.reserve_bytes(device(), (max_edges + device().lanes) * HS_EDGE_NUMBERS * sizeof(cl_float), "potential silhouettes");
    tile_far_.reserve(device(), tile_far_count(view), "tile depths");
    tile_queue_.reserve(device(), 1, "tile queue");
    receiver_words_.reserve(device(), pixels, "receivers");
    receivers_.reserve(device(), pixels, "penumbra pixels");
    // Tiles list whole blocks, of as many edges as the device has lanes.
    edge_bins_.reserve(device(), 1, tiles, (4 * std::size_t{resident.edge_count} + 2048 * std::size_t{tiles}) / device().lanes,
                       count_copies());
    receiver_bins_.reserve(device(), 1, tiles, 1);
  }

  /// What the shadow map answers; and which tile each other receiver lies in.
  void receive_by_map(const LightFrame& frame, const HsView& view, const HsReceiverView& receiver) {
    const cl_uint tiles = tiles_of(view);
    launcher().zero(tile_far_, tile_far_count(view));
    launcher().zero(receiver_bins_.counts, tiles);
    launcher().zero(edge_bins_.counts, std::size_t{tiles} * count_copies());
    launcher().zero(tile_queue_, 1);
    launcher().zero(touching_, 1);
    launcher().launch_pixels(frame.gbuffer.resolution, kernels::ReceiveByMap{.light = view,
                                                                             .view = receiver,
                                                                             .gbuffer = frame.gbuffer.arguments(),
                                                                             .shadow_map = shared_.shadow_map.map(),
                                                                             .receiver_words = receiver_words_,
                                                                             .tile_far = tile_far_,
                                                                             .tile_counts = receiver_bins_.counts,
                                                                             .visibility = frame.output()});
    receiver_bins_.scan(launcher(), tiles);
  }

  /// Edges that are a silhouette for some point of the disc, and faces that touch it.
  void collect_edges(const LightFrame& frame, const DrawList& list, const Disc& disc) {
    const ResidentScene& resident = frame.resident;
    const Buffer<cl_float4>& vertices_ls = shared_.triangles.vertices_vs();
    launcher().launch_blocks(list.triangles, kernels::OrientFacesToDisc{.blocks = list.triangles.blocks,
                                                                        .triangles = resident.triangle_corners,
                                                                        .vertices_ls = vertices_ls,
                                                                        .disc = disc.in_kernels,
                                                                        .radius = disc.widest_radius,
                                                                        .planes = planes_,
                                                                        .disc_sides = disc_sides_,
                                                                        .touching = touching_});
    launcher().launch_blocks(list.caster_edges, kernels::CollectEdges{.blocks = list.caster_edges.blocks,
                                                                      .edge_ends = resident.edge_ends,
                                                                      .edge_face_offsets = resident.edge_face_offsets,
                                                                      .edge_faces = resident.edge_faces,
                                                                      .disc = disc.in_kernels,
                                                                      .disc_sides = disc_sides_,
                                                                      .planes = planes_,
                                                                      .vertices_ls = vertices_ls,
                                                                      .edges = edges_,
                                                                      .status = shared_.triangles.status()});
  }

  /// Blocks of edges to tiles: counted, scanned, filled.
  void bin_edges(const HsView& view, float radius_px) {
    const cl_uint tiles = tiles_of(view), copies = count_copies();
    const auto launch_for_edges = [&](const auto& kernel) {
      if (launcher().one_lane())
        launcher().launch_strided(kernel);
      else
        launcher().launch(kernel, cl::NDRange(copies), cl::NDRange(1));
    };
    launch_for_edges(kernels::CountEdges{.view = view,
                                         .radius_px = radius_px,
                                         .status = shared_.triangles.status(),
                                         .edges = edges_,
                                         .tile_far = tile_far_.as<cl_float>(),
                                         .tile_counts = edge_bins_.counts,
                                         .copies = copies});
    edge_bins_.scan(launcher(), tiles, copies);
    launch_for_edges(kernels::FillEdges{.view = view,
                                        .radius_px = radius_px,
                                        .status = shared_.triangles.status(),
                                        .edges = edges_,
                                        .tile_far = tile_far_.as<cl_float>(),
                                        .tile_cursors = edge_bins_.counts,
                                        .copies = copies,
                                        .refs = edge_bins_.refs,
                                        .capacity = edge_bins_.capacity});
  }

  void list_receivers(const LightFrame& frame, const HsReceiverView& receiver) {
    launcher().launch_pixels(frame.gbuffer.resolution, kernels::ListReceivers{.view = receiver,
                                                                              .receiver_words = receiver_words_,
                                                                              .edge_offsets = edge_bins_.offsets,
                                                                              .all = cl_uint{frame.settings.alias_free},
                                                                              .touching = touching_,
                                                                              .tile_cursors = receiver_bins_.counts,
                                                                              .listed = receivers_});
  }

  void count_samples(const LightFrame& frame, const DrawList& list, const HsReceiverView& receiver, const HsDisc& disc,
                     const LightPointBuffer& points) {
    const bool one_lane = launcher().one_lane();
    launcher().launch(kernels::CountSamples{.light = list.view,
                                            .view = receiver,
                                            .disc = disc,
                                            .gbuffer = frame.gbuffer.arguments(),
                                            .shadow_map = shared_.shadow_map.map(),
                                            .edge_tiles = {.edges = edges_,
                                                           .edge_offsets = edge_bins_.offsets,
                                                           .edge_refs = edge_bins_.refs,
                                                           .edge_capacity = edge_bins_.capacity},
                                            .samples = points.arguments(),
                                            .tints = frame.tints.arguments(),
                                            .triangle_tiles = shared_.triangles.tiles(list),
                                            .triangles = shared_.triangles.triangles(frame.resident),
                                            .disc_faces = {.planes = planes_, .disc_sides = disc_sides_, .touching = touching_},
                                            .listed_receivers = {.receiver_offsets = receiver_bins_.offsets,
                                                                 .receiver_ends = receiver_bins_.counts,
                                                                 .listed = receivers_},
                                            .queue = tile_queue_,
                                            .visibility = frame.output(),
                                            .status = shared_.triangles.status()},
                      cl::NDRange(one_lane ? std::size_t{tiles_of(list.view)} * 64 : workers()), cl::NDRange(one_lane ? 64 : 1));
  }

  LightPointBuffers points_;
  Buffer<cl_float4> planes_;          // a triangle: its plane in light space
  Buffer<cl_uchar> disc_sides_;       // a triangle: see orient_faces_to_disc
  Buffer<cl_uint> touching_;          // the number of triangles that touch the light, and which
  Buffer<kernels::EdgeBlock> edges_;  // potential silhouettes
  Bins edge_bins_;                    // of blocks of them
  Buffer<cl_int> tile_far_;           // a tile: bits of the depth of its farthest receiver
  Buffer<cl_uint> receiver_words_;    // a pixel: its tile
  Bins receiver_bins_;
  Buffer<cl_uint> receivers_;  // pixels to be counted, tile by tile
  Buffer<cl_int> tile_queue_;  // one
};

}  // namespace

extern const MethodDeclaration exact_method;
constinit const MethodDeclaration exact_method{
    .info = {.method = Method::exact,
             .name = "exact",
             .summary = "the light's sample points counted as rays would, by crossings of silhouettes; no artefacts but noise",
             .source = "halfshade",
             .exact_when = "always, but for the noise of its samples",
             .receivers = "any",
             .time = "triangles + pixels + silhouettes x penumbra pixels",
             .falloff = Falloff::linear,
             .faithful_falloff = Falloff::linear,
             .any_shape = true},
    .options = options,
    .create = create<ExactPasses>,
    .refusal = refusal,
    .features_name = "edge records",
    .counts_depth_complexity = true};

}  // namespace halfshade
