// One mesh through a view's passes, kernel by kernel, with every buffer in reach: for properties that the renderer does not show.
#pragma once

#include "scene/topology.hpp"
#include "support/kernel_fixture.hpp"

namespace halfshade {

/// How many tile references fit: enough for small scenes, or none, which sends every tile through all primitives.
enum class RefCapacity { enough, none };

class ViewPasses {
 public:
  ViewPasses(const KernelRunner& runner, const HsView& view, const Mesh& mesh, const glm::dmat4& view_from_mesh = glm::dmat4(1.0),
             RefCapacity capacity = RefCapacity::enough, cl_uint cull = HS_CULL_NONE)
      : runner_(runner),
        launcher_(runner.launcher),
        view_(view),
        mesh_(mesh),
        topology_(build_topology(mesh)),
        capacity_(capacity == RefCapacity::enough ? 1u << 20 : 0u) {
    const Blocks vertex_blocks = blocks_of(runner, static_cast<std::uint32_t>(mesh.positions.size()));
    blocks = blocks_of(runner, static_cast<std::uint32_t>(mesh.triangles.size()), cull);
    slot_count = blocks.slots();
    triangle_corners = runner.buffer<cl_uint>(mesh.triangles);
    vertices_vs = runner.filled(mesh.positions.size(), cl_float4{});
    vertices_px = runner.filled(mesh.positions.size(), cl_int4{});
    rects = runner.filled(slot_count, cl_ushort4{});
    counts = runner.filled(tile_count(), cl_uint{0});
    offsets = runner.filled(tile_count() + 1, cl_uint{0});
    refs = runner.filled(std::max(1u, capacity_), ~cl_uint{0});
    status = runner.filled(1, HsStatus{});
    launcher_.launch_blocks(vertex_blocks, kernels::Transform{.view = view,
                                                              .blocks = vertex_blocks.blocks,
                                                              .transforms = runner.filled(1, transform_rows(view_from_mesh)),
                                                              .positions = runner.buffer<cl_float>(mesh.positions),
                                                              .vertices_vs = vertices_vs,
                                                              .vertices_px = vertices_px});
    launcher_.launch_blocks(blocks, kernels::BoundTriangles{.view = view,
                                                            .blocks = blocks.blocks,
                                                            .triangles = triangles(),
                                                            .rects = rects,
                                                            .tile_counts = counts,
                                                            .status = status});
    scan(counts, offsets);
    launcher_.launch_blocks(
        blocks,
        kernels::FillTriangles{
            .view = view, .blocks = blocks.blocks, .rects = rects, .tile_cursors = counts, .refs = refs, .capacity = capacity_});
  }

  std::size_t tile_count() const { return tiles_of(view_); }
  std::size_t texel_count() const { return pixels_of(view_); }

  std::vector<float> shadow_map() {
    shadow_map_ = runner_.filled(texel_count(), -1.0f);
    raster_shadow_map(tiles(), shadow_map_);
    return runner_.read<float>(shadow_map_, texel_count());
  }

  /// The shadow map of one triangle alone.
  std::vector<float> shadow_map_of(std::uint32_t triangle) {
    std::vector<cl_uint> one_each(tile_count() + 1);
    for (std::size_t t = 0; t < one_each.size(); ++t) one_each[t] = static_cast<cl_uint>(t);
    const auto count = static_cast<cl_uint>(tile_count());
    const Buffer<cl_float> map = runner_.filled(texel_count(), -1.0f);
    kernels::args::TriangleTiles alone = tiles();
    alone.triangle_offsets = runner_.buffer<cl_uint>(one_each);
    alone.triangle_refs = runner_.filled(count, cl_uint{triangle});
    alone.triangle_capacity = count;
    raster_shadow_map(alone, map);
    return runner_.read<float>(map, texel_count());
  }

  struct GBufferPlanes {
    std::vector<float> depth;
    std::vector<glm::vec4> normal;
    std::vector<cl_uint> face;
  };
  GBufferPlanes gbuffer(float receives = 1.0f) {
    const Buffer<cl_float4> normals = runner_.filled(mesh_.triangles.size(), cl_float4{{-1, -1, -1, -1}});
    const Buffer<cl_float> depth = runner_.filled(texel_count(), -1.0f);
    const Buffer<cl_float4> normal = runner_.filled(texel_count(), cl_float4{{-1, -1, -1, -1}});
    const Buffer<cl_uint> face = runner_.filled(texel_count(), cl_uint{77});
    launcher_.launch_blocks(blocks,
                            kernels::FaceNormals{.view = view_,
                                                 .blocks = blocks.blocks,
                                                 .rects = rects,
                                                 .triangles = triangle_corners,
                                                 .vertices_vs = vertices_vs,
                                                 .materials = runner_.filled(1, cl_float4{{0.25f, 0.5f, 0.75f, receives}}),
                                                 .normals = normals});
    launcher_.launch_tiles(tiles_of(view_), kernels::RasterGbuffer{.view = view_,
                                                                   .triangle_tiles = tiles(),
                                                                   .triangles = triangles(),
                                                                   .face_normals = normals,
                                                                   .unit = 1.0f,
                                                                   .depth = depth,
                                                                   .normal = normal,
                                                                   .face = face});
    return {runner_.read<float>(depth, texel_count()), runner_.read<glm::vec4>(normal, texel_count()),
            runner_.read<cl_uint>(face, texel_count())};
  }

  /// Sides of all faces, then the edges with m != 0.
  void classify() {
    const Blocks edge_blocks = blocks_of(runner_, static_cast<std::uint32_t>(topology_.edges.size()));
    sides = runner_.filled(mesh_.triangles.size(), cl_uchar{9});
    multiplicities = runner_.filled(topology_.edges.size(), cl_char{9});
    silhouettes = runner_.filled(topology_.edges.size(), cl_uint{0});
    edge_face_offsets_ = runner_.buffer<cl_uint>(topology_.edge_face_offset);
    edge_faces_ = runner_.buffer<cl_uint>(topology_.edge_faces);
    launcher_.launch_blocks(
        blocks,
        kernels::OrientFaces{.blocks = blocks.blocks, .triangles = triangle_corners, .vertices_ls = vertices_vs, .sides = sides});
    launcher_.launch_blocks(edge_blocks, kernels::ClassifyEdges{.blocks = edge_blocks.blocks,
                                                                .edge_face_offsets = edge_face_offsets_,
                                                                .edge_faces = edge_faces_,
                                                                .sides = sides,
                                                                .multiplicities = multiplicities,
                                                                .silhouettes = silhouettes,
                                                                .status = status});
  }

  struct FeatureList {
    std::vector<HsFeature> features;
    std::vector<cl_ushort4> rects;
  };
  /// After classify.
  FeatureList build_features(HsFinShape shape) {
    in_tiles_of_map(shape);
    const std::size_t max_features = 3 * topology_.edges.size();
    features_ = runner_.filled(max_features, HsFeature{});
    feature_rects_ = runner_.filled(max_features, cl_ushort4{});
    feature_counts_ = runner_.filled(tile_count(), cl_uint{0});
    launcher_.launch_strided(
        kernels::BuildFeatures{.view = view_,
                               .shape = shape,
                               .layer_count = cl_uint{1},
                               .sublayer_layers = Buffer<cl_uint>(),
                               .silhouettes = silhouettes,
                               .topology = {.edges = runner_.buffer<cl_uint2>(topology_.edges),
                                            .edge_face_offsets = edge_face_offsets_,
                                            .edge_faces = edge_faces_,
                                            .vertex_edge_offsets = runner_.buffer<cl_uint>(topology_.vertex_edge_offset),
                                            .vertex_edges = runner_.buffer<cl_uint>(topology_.vertex_edges)},
                               .triangles = triangles(),
                               .multiplicities = multiplicities,
                               .shadow_map = shadow_map_,
                               .features = features_,
                               .rects = feature_rects_,
                               .tile_counts = feature_counts_,
                               .status = status});
    const std::size_t count = read_status().feature_count;
    return {runner_.read<HsFeature>(features_, count), runner_.read<cl_ushort4>(feature_rects_, count)};
  }

  struct FinPlanes {
    std::vector<float> depth, alpha;  // as written; meaningless in tiles that were not
    std::vector<cl_uchar> tile_near_fins;
    std::vector<bool> written;  // a texel
  };
  /// After shadow_map and build_features.
  FinPlanes fins(HsFinShape shape) {
    in_tiles_of_map(shape);
    const Buffer<cl_uint> fin_offsets = runner_.filled(tile_count() + 1, cl_uint{0});
    const Buffer<cl_uint> fin_refs = runner_.filled(std::max(1u, capacity_), ~cl_uint{0});
    scan(feature_counts_, fin_offsets);
    launcher_.launch_strided(kernels::FillFeatures{.shape = shape,
                                                   .status = status,
                                                   .features = features_,
                                                   .rects = feature_rects_,
                                                   .tile_cursors = feature_counts_,
                                                   .refs = fin_refs,
                                                   .capacity = capacity_});
    const Buffer<cl_float> depth = runner_.filled(texel_count(), -1.0f), alpha = runner_.filled(texel_count(), -1.0f);
    const Buffer<cl_uchar> near = runner_.filled(tile_count(), cl_uchar{0});
    launcher_.launch_tiles(tiles_of(view_), kernels::RasterSmoothies{.light = view_,
                                                                     .shape = shape,
                                                                     .feature_tiles = {.status = status,
                                                                                       .features = features_,
                                                                                       .feature_rects = feature_rects_,
                                                                                       .feature_offsets = fin_offsets,
                                                                                       .feature_refs = fin_refs,
                                                                                       .feature_capacity = capacity_},
                                                                     .shadow_map = shadow_map_,
                                                                     .tile_near_fins = near,
                                                                     .fin_depth = depth,
                                                                     .fin_alpha = alpha});
    FinPlanes planes{runner_.read<float>(depth, texel_count()),
                     runner_.read<float>(alpha, texel_count()),
                     runner_.read<cl_uchar>(near, tile_count()),
                     {}};
    for (const float z : planes.depth) planes.written.push_back(z != -1.0f);
    return planes;
  }

  HsStatus read_status() const { return runner_.read<HsStatus>(status, 1)[0]; }
  const Topology& topology() const { return topology_; }

  cl_uint slot_count = 0;
  Blocks blocks;
  Buffer<cl_uint> triangle_corners, counts, offsets, refs, silhouettes;
  Buffer<cl_float4> vertices_vs;
  Buffer<cl_int4> vertices_px;
  Buffer<cl_ushort4> rects;
  Buffer<HsStatus> status;
  Buffer<cl_uchar> sides;
  Buffer<cl_char> multiplicities;

 private:
  void in_tiles_of_map(HsFinShape& shape) const {
    shape.tile_step = runner_.device->tile_px;
    shape.tiles_x = view_.tiles_x;
    shape.tiles_y = view_.tiles_y;
  }
  kernels::args::Triangles triangles() const {
    return {.triangles = triangle_corners, .vertices_vs = vertices_vs, .vertices_px = vertices_px};
  }
  kernels::args::TriangleTiles tiles() const {
    return {.triangle_blocks = blocks.blocks,
            .triangle_slot_count = slot_count,
            .triangle_rects = rects,
            .triangle_offsets = offsets,
            .triangle_refs = refs,
            .triangle_capacity = capacity_};
  }
  void scan(const Buffer<cl_uint>& tile_counts, const Buffer<cl_uint>& tile_offsets) {
    scan_tiles(runner_, tiles_of(view_), 1, tile_counts, tile_offsets);
  }
  void raster_shadow_map(const kernels::args::TriangleTiles& listed, const Buffer<cl_float>& map) {
    launcher_.launch_tiles(
        tiles_of(view_),
        kernels::RasterShadowMap{.view = view_, .triangle_tiles = listed, .triangles = triangles(), .shadow_map = map});
  }

  const KernelRunner& runner_;
  Launcher& launcher_;
  HsView view_;
  Mesh mesh_;
  Topology topology_;
  cl_uint capacity_;
  Buffer<cl_float> shadow_map_;
  Buffer<cl_uint> edge_face_offsets_, edge_faces_, feature_counts_;
  Buffer<HsFeature> features_;
  Buffer<cl_ushort4> feature_rects_;
};

}  // namespace halfshade
