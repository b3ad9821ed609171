// One mesh through a view's passes, kernel by kernel, with every buffer in reach: for properties that the renderer does not show.
#pragma once

#include "kernel_fixture.hpp"
#include "topology.hpp"

namespace halfshade {

/// Room for tile references: enough for small scenes, or none, which sends every tile through all primitives.
enum class Room { enough, none };

class ViewPasses {
 public:
  ViewPasses(const KernelRunner& runner, const HsView& view, const Mesh& mesh, const glm::dmat4& view_from_mesh = glm::dmat4(1.0),
             Room room = Room::enough, cl_uint cull = HS_CULL_NONE)
      : runner_(runner),
        view_(view),
        mesh_(mesh),
        topology_(build_topology(mesh)),
        capacity_(room == Room::enough ? 1u << 20 : 0u) {
    std::vector<float> positions;
    for (const glm::vec3& p : mesh.positions) positions.insert(positions.end(), {p.x, p.y, p.z});
    std::vector<cl_uint> triangles;
    for (const glm::uvec3& t : mesh.triangles) triangles.insert(triangles.end(), {t.x, t.y, t.z});
    const auto vertex_blocks = blocks_of(static_cast<std::uint32_t>(mesh.positions.size()));
    auto triangle_blocks = blocks_of(static_cast<std::uint32_t>(mesh.triangles.size()));
    for (HsBlock& block : triangle_blocks) block.cull = cull;
    slot_count = static_cast<cl_uint>(triangle_blocks.size() * HS_BLOCK_SIZE);
    triangle_corners = runner.buffer(triangles);
    blocks = runner.buffer(triangle_blocks);
    vertices_vs = runner.filled(mesh.positions.size(), cl_float4{});
    vertices_px = runner.filled(mesh.positions.size(), cl_int4{});
    rects = runner.filled(slot_count, cl_ushort4{});
    counts = runner.filled(tile_count(), cl_uint{0});
    offsets = runner.filled(tile_count() + 1, cl_uint{0});
    refs = runner.filled(std::max(1u, capacity_), ~cl_uint{0});
    status = runner.filled(1, HsStatus{});
    runner.run_blocks("transform", vertex_blocks.size(), view, runner.buffer(vertex_blocks),
                      runner.buffer(std::vector{transform_rows(view_from_mesh)}), runner.buffer(positions), vertices_vs,
                      vertices_px);
    runner.run_blocks("bound_triangles", triangle_blocks.size(), view, blocks, triangle_corners, vertices_vs, vertices_px, rects,
                      counts, status);
    scan(counts, offsets);
    runner.run_blocks("fill_triangles", triangle_blocks.size(), view, blocks, rects, counts, refs, capacity_);
  }

  std::size_t tile_count() const { return std::size_t{view_.tiles_x} * view_.tiles_y; }
  std::size_t texel_count() const { return std::size_t{view_.width_px} * view_.height_px; }

  std::vector<float> shadow_map() {
    shadow_map_ = runner_.filled(texel_count(), -1.0f);
    raster_shadow_map(offsets, refs, capacity_, shadow_map_);
    return runner_.read<float>(shadow_map_, texel_count());
  }

  /// The shadow map of one triangle alone.
  std::vector<float> shadow_map_of(std::uint32_t triangle) {
    std::vector<cl_uint> one_each(tile_count() + 1);
    for (std::size_t t = 0; t < one_each.size(); ++t) one_each[t] = static_cast<cl_uint>(t);
    const cl_uint count = static_cast<cl_uint>(tile_count());
    const cl::Buffer map = runner_.filled(texel_count(), -1.0f);
    raster_shadow_map(runner_.buffer(one_each), runner_.filled(count, cl_uint{triangle}), count, map);
    return runner_.read<float>(map, texel_count());
  }

  struct GBufferPlanes {
    std::vector<float> depth;
    std::vector<glm::vec4> normal;
    std::vector<cl_uint> face;
  };
  GBufferPlanes gbuffer(float receives = 1.0f) {
    const cl::Buffer materials = runner_.buffer(std::vector{glm::vec4(0.25f, 0.5f, 0.75f, receives)});
    const cl::Buffer normals = runner_.filled(mesh_.triangles.size(), glm::vec4(-1.0f));
    const cl::Buffer depth = runner_.filled(texel_count(), -1.0f), normal = runner_.filled(texel_count(), glm::vec4(-1.0f)),
                     face = runner_.filled(texel_count(), cl_uint{77});
    runner_.run_blocks("face_normals", slot_count / HS_BLOCK_SIZE, view_, blocks, rects, triangle_corners, vertices_vs, materials,
                       normals);
    runner_.run_tiles("raster_gbuffer", view_, view_, blocks, slot_count, rects, offsets, refs, capacity_, triangle_corners,
                      vertices_vs, vertices_px, normals, depth, normal, face);
    return {runner_.read<float>(depth, texel_count()), runner_.read<glm::vec4>(normal, texel_count()),
            runner_.read<cl_uint>(face, texel_count())};
  }

  /// Sides of all faces, then the edges with m != 0.
  void classify() {
    const auto edge_blocks = blocks_of(static_cast<std::uint32_t>(topology_.edges.size()));
    sides = runner_.filled(mesh_.triangles.size(), cl_uchar{9});
    multiplicities = runner_.filled(topology_.edges.size(), cl_char{9});
    silhouettes = runner_.filled(topology_.edges.size(), cl_uint{0});
    edge_face_offsets_ = runner_.buffer(topology_.edge_face_offset);
    edge_faces_ = runner_.buffer(topology_.edge_faces);
    runner_.run_blocks("orient_faces", slot_count / HS_BLOCK_SIZE, blocks, triangle_corners, vertices_vs, sides);
    runner_.run_blocks("classify_edges", edge_blocks.size(), runner_.buffer(edge_blocks), edge_face_offsets_, edge_faces_, sides,
                       multiplicities, silhouettes, status);
  }

  struct FeatureList {
    std::vector<HsFeature> features;
    std::vector<cl_ushort4> rects;
  };
  /// After classify.
  FeatureList build_features(HsFinShape shape) {
    in_tiles_of_map(shape);
    const std::size_t most = 3 * topology_.edges.size();
    features_ = runner_.filled(most, HsFeature{});
    feature_rects_ = runner_.filled(most, cl_ushort4{});
    feature_counts_ = runner_.filled(tile_count(), cl_uint{0});
    const auto strided = cl::NDRange(64 * 256);
    const cl::Buffer nothing = runner_.filled(1, cl_uint{0});
    runner_.run("build_features", strided, cl::NDRange(64), view_, shape, cl_uint{1}, nothing, silhouettes,
                runner_.buffer(topology_.edges), edge_face_offsets_, edge_faces_, triangle_corners,
                runner_.buffer(topology_.vertex_edge_offset), runner_.buffer(topology_.vertex_edges), multiplicities, vertices_vs,
                vertices_px, shadow_map_() ? shadow_map_ : nothing, features_, feature_rects_, feature_counts_, status);
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
    const cl::Buffer fin_offsets = runner_.filled(tile_count() + 1, cl_uint{0});
    const cl::Buffer fin_refs = runner_.filled(std::max(1u, capacity_), ~cl_uint{0});
    scan(feature_counts_, fin_offsets);
    runner_.run("fill_features", cl::NDRange(64 * 256), cl::NDRange(64), shape, status, features_, feature_rects_,
                feature_counts_, fin_refs, capacity_);
    const cl::Buffer depth = runner_.filled(texel_count(), -1.0f), alpha = runner_.filled(texel_count(), -1.0f),
                     near = runner_.filled(tile_count(), cl_uchar{0});
    runner_.run_tiles("raster_fins", view_, view_, shape, status, feature_rects_, fin_offsets, fin_refs, capacity_, features_,
                      shadow_map_, near, depth, alpha);
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
  cl::Buffer blocks, triangle_corners, vertices_vs, vertices_px, rects, counts, offsets, refs, status;
  cl::Buffer sides, multiplicities, silhouettes;

 private:
  void in_tiles_of_map(HsFinShape& shape) const {
    shape.tile_step = runner_.device->tile_px;
    shape.tiles_x = view_.tiles_x;
    shape.tiles_y = view_.tiles_y;
  }
  void scan(const cl::Buffer& tile_counts, const cl::Buffer& tile_offsets) {
    runner_.run("scan_tiles", cl::NDRange(64), cl::NDRange(64), static_cast<cl_uint>(tile_count()), cl_uint{1}, tile_counts,
                tile_offsets);
  }
  void raster_shadow_map(const cl::Buffer& tile_offsets, const cl::Buffer& tile_refs, cl_uint capacity, const cl::Buffer& map) {
    runner_.run_tiles("raster_shadow_map", view_, view_, blocks, slot_count, rects, tile_offsets, tile_refs, capacity,
                      triangle_corners, vertices_vs, vertices_px, map);
  }

  const KernelRunner& runner_;
  HsView view_;
  Mesh mesh_;
  Topology topology_;
  cl_uint capacity_;
  cl::Buffer shadow_map_, edge_face_offsets_, edge_faces_, features_, feature_rects_, feature_counts_;
};

}  // namespace halfshade
