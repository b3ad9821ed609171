// The frame: uploads what a scene needs, and enqueues the passes of DESIGN's figure, one named launch a line.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <span>
#include <tuple>
#include <utility>

#include "device_impl.hpp"
#include "light_samples.hpp"
#include "light_view.hpp"
#include "topology.hpp"

namespace halfshade {
namespace {

/// A buffer that only grows. Old memory lives on until the commands that use it are done (OpenCL retains it).
class GrowingBuffer {
 public:
  /// At least `bytes`; the contents are lost when it grows.
  const cl::Buffer& at_least(const DeviceImpl& device, std::size_t bytes, const char* what) {
    if (bytes > bytes_ || !buffer_()) {
      if (bytes > device.device_info.largest_buffer_bytes)
        throw DeviceError(
            fmt::format("{}: {} needs a buffer of {} MiB, the device allows {} MiB; lower the resolution or split the scene",
                        device.device_info.name, what, bytes >> 20, device.device_info.largest_buffer_bytes >> 20));
      bytes_ = std::max<std::size_t>(bytes, 16);
      buffer_ = cl::Buffer(device.cl_context_, CL_MEM_READ_WRITE, bytes_);
    }
    return buffer_;
  }
  const cl::Buffer& get() const { return buffer_; }
  std::size_t bytes() const { return bytes_; }

 private:
  cl::Buffer buffer_;
  std::size_t bytes_ = 0;
};

/// A read-only buffer with a copy of `values`, made without a command on any queue.
template <class T>
cl::Buffer buffer_of(const DeviceImpl& device, const std::vector<T>& values, const char* what) {
  const std::size_t bytes = std::max<std::size_t>(values.size() * sizeof(T), 16);
  if (bytes > device.device_info.largest_buffer_bytes)
    throw DeviceError(
        fmt::format("{}: {} needs a buffer of {} MiB, the device allows {} MiB; split or simplify the scene's meshes",
                    device.device_info.name, what, bytes >> 20, device.device_info.largest_buffer_bytes >> 20));
  if (values.empty()) return cl::Buffer(device.cl_context_, CL_MEM_READ_ONLY, bytes);
  return cl::Buffer(device.cl_context_, CL_MEM_READ_ONLY | CL_MEM_COPY_HOST_PTR, values.size() * sizeof(T),
                    const_cast<T*>(values.data()));
}

/// Elements first .. first + count of each mesh, cut into blocks of HS_BLOCK_SIZE.
struct Range {
  std::uint32_t first, count;
};

/// The meshes of a scene as they lie on the device, one behind the other.
struct Resident {
  std::vector<std::shared_ptr<const Mesh>> meshes;  ///< what was uploaded, to see whether it still holds
  std::vector<Range> vertices, triangles, edges;    ///< of each mesh
  std::uint32_t vertex_count = 0, triangle_count = 0, edge_count = 0;
  std::uint32_t edge_record_count = 0;  ///< the most potential silhouettes: one an edge, one more for every two faces beyond two
  std::vector<Bounds> bounds;
  std::vector<int> orientations;   ///< of each mesh: solid_orientation
  cl::Buffer positions;            // float[3 * vertex_count]
  cl::Buffer triangle_corners;     // uint[3 * triangle_count], scene-wide vertices
  cl::Buffer face_meshes;          // uint[triangle_count]
  cl::Buffer edge_ends;            // uint2[edge_count], scene-wide vertices
  cl::Buffer edge_face_offsets;    // uint[edge_count + 1]
  cl::Buffer edge_faces;           // uint[edge_face_offsets[edge_count]], (scene-wide face << 1) | against
  cl::Buffer vertex_edge_offsets;  // uint[vertex_count + 1]
  cl::Buffer vertex_edges;         // uint[2 * edge_count]
};

/// A mesh as it is uploaded.
struct Prepared {
  explicit Prepared(const Mesh& source)
      : mesh(in_spatial_order(source)), topology(build_topology(mesh)), orientation(solid_orientation(mesh, topology)) {}
  Mesh mesh;
  Topology topology;
  int orientation;
};

Resident upload(const DeviceImpl& device, const Scene& scene) {
  Resident resident;
  std::vector<glm::vec3> positions;
  std::vector<glm::uvec3> triangles;
  std::vector<std::uint32_t> face_meshes, edge_face_offsets{0}, edge_faces, vertex_edge_offsets{0}, vertex_edges;
  std::vector<glm::uvec2> edges;
  std::map<const Mesh*, Prepared> prepared;  // a mesh may stand in the scene more than once
  for (std::uint32_t m = 0; m < scene.meshes.size(); ++m) {
    resident.meshes.push_back(scene.meshes[m].mesh);
    const auto found = prepared.find(scene.meshes[m].mesh.get());
    const Prepared& part = found != prepared.end()
                               ? found->second
                               : prepared.emplace(scene.meshes[m].mesh.get(), *scene.meshes[m].mesh).first->second;
    const Mesh& mesh = part.mesh;
    const Topology& topology = part.topology;
    resident.orientations.push_back(part.orientation);
    const std::size_t limit = std::size_t{1} << 30;  // faces are stored shifted by one bit
    if (positions.size() + mesh.positions.size() > limit || triangles.size() + mesh.triangles.size() > limit ||
        edges.size() + topology.edges.size() > limit)
      throw InputError(fmt::format("scene '{}': mesh '{}' brings it past 2^30 vertices, triangles or edges; split the scene",
                                   scene.name, scene.meshes[m].name));
    const auto vertex0 = static_cast<std::uint32_t>(positions.size()), triangle0 = static_cast<std::uint32_t>(triangles.size()),
               edge0 = static_cast<std::uint32_t>(edges.size()), face_ref0 = static_cast<std::uint32_t>(edge_faces.size()),
               edge_ref0 = static_cast<std::uint32_t>(vertex_edges.size());
    resident.vertices.push_back({vertex0, static_cast<std::uint32_t>(mesh.positions.size())});
    resident.triangles.push_back({triangle0, static_cast<std::uint32_t>(mesh.triangles.size())});
    resident.edges.push_back({edge0, static_cast<std::uint32_t>(topology.edges.size())});

    Bounds bounds{glm::dvec3(1e300), glm::dvec3(-1e300)};
    for (const glm::vec3& p : mesh.positions) {
      bounds.low = glm::min(bounds.low, glm::dvec3(p));
      bounds.high = glm::max(bounds.high, glm::dvec3(p));
    }
    resident.bounds.push_back(bounds);
    positions.insert(positions.end(), mesh.positions.begin(), mesh.positions.end());
    for (const glm::uvec3& t : mesh.triangles) triangles.push_back(t + vertex0);
    face_meshes.insert(face_meshes.end(), mesh.triangles.size(), m);
    for (const glm::uvec2& e : topology.edges) edges.push_back(e + vertex0);
    for (std::size_t i = 1; i < topology.edge_face_offset.size(); ++i)
      edge_face_offsets.push_back(topology.edge_face_offset[i] + face_ref0);
    for (std::size_t i = 1; i < topology.edge_face_offset.size(); ++i)
      resident.edge_record_count += std::max(1u, (topology.edge_face_offset[i] - topology.edge_face_offset[i - 1] + 1) / 2);
    for (const std::uint32_t f : topology.edge_faces) edge_faces.push_back(f + (triangle0 << 1));
    for (std::size_t i = 1; i < topology.vertex_edge_offset.size(); ++i)
      vertex_edge_offsets.push_back(topology.vertex_edge_offset[i] + edge_ref0);
    for (const std::uint32_t e : topology.vertex_edges) vertex_edges.push_back(e + edge0);
  }
  resident.vertex_count = static_cast<std::uint32_t>(positions.size());
  resident.triangle_count = static_cast<std::uint32_t>(triangles.size());
  resident.edge_count = static_cast<std::uint32_t>(edges.size());
  resident.positions = buffer_of(device, positions, "vertex positions");
  resident.triangle_corners = buffer_of(device, triangles, "triangles");
  resident.face_meshes = buffer_of(device, face_meshes, "triangles");
  resident.edge_ends = buffer_of(device, edges, "edges");
  resident.edge_face_offsets = buffer_of(device, edge_face_offsets, "edges");
  resident.edge_faces = buffer_of(device, edge_faces, "edges");
  resident.vertex_edge_offsets = buffer_of(device, vertex_edge_offsets, "vertex edges");
  resident.vertex_edges = buffer_of(device, vertex_edges, "vertex edges");
  return resident;
}

/// Blocks of some meshes' elements, ready to launch.
struct Blocks {
  cl::Buffer blocks;
  std::uint32_t count = 0;
};

/// `cull`: HS_CULL_ a mesh of the scene, or empty.
Blocks blocks_of(const DeviceImpl& device, const std::vector<Range>& ranges, const std::vector<std::uint32_t>& meshes,
                 const std::vector<cl_uint>& cull = {}) {
  std::vector<HsBlock> blocks;
  for (const std::uint32_t m : meshes)
    for (std::uint32_t i = 0; i < ranges[m].count; i += HS_BLOCK_SIZE)
      blocks.push_back({ranges[m].first + i, std::min<std::uint32_t>(HS_BLOCK_SIZE, ranges[m].count - i), m,
                        cull.empty() ? HS_CULL_NONE : cull[m]});
  return {buffer_of(device, blocks, "block list"), static_cast<std::uint32_t>(blocks.size())};
}

/// A view with all it draws: the camera, or a light.
struct DrawList {
  HsView view{};
  cl::Buffer transforms;                  // HsTransform a mesh of the scene
  Blocks vertices, triangles;             // of all it draws
  Blocks caster_triangles, caster_edges;  // of those that get fins
};

DrawList draw_list(const DeviceImpl& device, const Resident& resident, const std::vector<PlacedMesh>& placed, const HsView& view,
                   const glm::dmat4& view_from_world, const std::vector<std::uint32_t>& drawn,
                   const std::vector<std::uint32_t>& casters = {}) {
  DrawList list;
  list.view = view;
  std::vector<HsTransform> transforms;
  std::vector<cl_uint> cull;
  for (const PlacedMesh& mesh : placed) {
    transforms.push_back(transform_rows(view_from_world * mesh.world_from_mesh));
    cull.push_back(hidden_faces(mesh, view_from_world, view.znear));
  }
  list.transforms = buffer_of(device, transforms, "transforms");
  list.vertices = blocks_of(device, resident.vertices, drawn);
  list.triangles = blocks_of(device, resident.triangles, drawn, cull);
  list.caster_triangles = blocks_of(device, resident.triangles, casters);
  list.caster_edges = blocks_of(device, resident.edges, casters);
  return list;
}

/// The tile lists of one kind of primitive. Sizes are guesses with room to spare; where they do not hold, kernels go through all
/// primitives instead, and the next frame gets the room it needs (see bins_overflow in kernels/common.h).
struct Bins {
  GrowingBuffer rects;    // ushort4 a primitive
  GrowingBuffer counts;   // uint a tile: counts, then cursors
  GrowingBuffer offsets;  // uint a tile and one: where a tile's references begin; the last is their total
  GrowingBuffer refs;     // uint a reference
  std::size_t wanted_refs = 0;
  cl_uint capacity = 0;

  void size_for(const DeviceImpl& device, std::size_t primitives, std::size_t tiles, std::size_t refs_guess) {
    rects.at_least(device, primitives * sizeof(cl_ushort4), "tile rectangles");
    counts.at_least(device, tiles * sizeof(cl_uint), "tile counts");
    offsets.at_least(device, (tiles + 1) * sizeof(cl_uint), "tile offsets");
    const std::size_t most = device.device_info.largest_buffer_bytes / sizeof(cl_uint);
    const std::size_t wanted = std::min(std::max(refs_guess, wanted_refs), most);
    refs.at_least(device, wanted * sizeof(cl_uint), "tile references");
    capacity = static_cast<cl_uint>(std::min<std::size_t>(refs.bytes() / sizeof(cl_uint), 0xffffffffu));
  }
};

cl_uint tiles_of(const HsView& view) {
  return view.tiles_x * view.tiles_y;
}
std::size_t pixels_of(const HsView& view) {
  return std::size_t{view.width_px} * view.height_px;
}

/// A light, or one face of a point light, with the map it was last drawn with.
struct LightFace {
  std::size_t light;  ///< of the scene
  Light as;
  LightView fitted;
};

/// Copied back after a frame; a row a light's face.
struct LightCounters {
  HsStatus status;
  cl_uint triangle_refs, feature_refs;
  cl_uint padding[2];
};

/// A light's sample points on the device (SampleTable).
struct LightSamples {
  cl::Buffer samples, below, weights, cell_xy, cells, window_xy, windows;
  float per_turn = 0.0f;
  cl_uint cells_across = 0;
};

/// What a light's sample points depend on.
using LightSamplesKey = std::tuple<unsigned, LightShape, double, double, std::shared_ptr<const LightTexture>>;

/// Where the colour of a textured light is counted.
struct Tints {
  cl::Buffer buffer = {};
  cl_int plane = -1;  ///< -1: not
};

}  // namespace

struct Renderer::State {
  std::shared_ptr<DeviceImpl> device;
  std::map<std::string, cl::Kernel, std::less<>> kernels;

  Scene scene;
  Resident resident;
  std::vector<PlacedMesh> placed;
  cl::Buffer materials;  // float4 a mesh: base colour, w = receives
  std::optional<DrawList> camera_list;

  // Filled by a view's passes; reused by the next view's.
  GrowingBuffer vertices_vs, vertices_px, face_normals, sides, multiplicities, silhouettes, features, status;
  Bins triangle_bins, feature_bins;
  GrowingBuffer planes, disc_sides, disc_edges, tile_far, receivers, tile_queue;
  Bins receiver_bins;
  std::map<LightSamplesKey, LightSamples> light_samples;
  GrowingBuffer shadow_map, fin_depth, fin_alpha, penumbra_map, tile_near_fins;
  GrowingBuffer receiver_words;                // to which tile each pixel belongs; of shadow fins and exact
  GrowingBuffer horizon_limits, illuminances;  // of shadow fins
  GrowingBuffer sublayer_counts, sublayer_layers, caster_range, other_casters;  // of layers of them
  GrowingBuffer depth, normal, face, visibility, rgb, tints;
  GrowingBuffer counters;  // LightCounters a face

  std::string label;                                     ///< whose stages are being timed
  std::vector<std::pair<std::string, cl::Event>> timed;  ///< stages of the last `render`
  bool timing = false;                                   ///< in `render`, on a queue that profiles
  std::optional<Settings> rendered;                      ///< what `render` last drew with
  std::vector<LightFace> faces;                          ///< of all lights, one light's behind the other's

  // ---------------------------------------------------------------------------------------------------------- launching

  template <class... Args>
  void launch(std::string_view name, cl::NDRange global, cl::NDRange local, const Args&... args) {
    auto found = kernels.find(name);
    if (found == kernels.end())
      found = kernels.emplace(std::string(name), cl::Kernel(device->program, std::string(name).c_str())).first;
    cl::Kernel& kernel = found->second;
    try {
      cl_uint index = 0;
      (kernel.setArg(index++, args), ...);
      cl::Event event;
      device->cl_queue.enqueueNDRangeKernel(kernel, cl::NullRange, global, local, nullptr, timing ? &event : nullptr);
      if (timing) timed.emplace_back(fmt::format("{}/{}", label, name), std::move(event));
    } catch (const cl::Error& error) {
      throw DeviceError(fmt::format("kernel {}: {}: {}; global size {}x{}, local size {}x{}", name, error.what(),
                                    error_name(error.err()), global.get()[0], global.dimensions() > 1 ? global.get()[1] : 1,
                                    local.get()[0], local.dimensions() > 1 ? local.get()[1] : 1));
    }
  }

  /// One work-group a block, one work-item an element.
  template <class... Args>
  void launch_blocks(std::string_view name, const Blocks& blocks, const Args&... args) {
    if (blocks.count > 0)
      launch(name, cl::NDRange(std::size_t{blocks.count} * HS_BLOCK_SIZE), cl::NDRange(HS_BLOCK_SIZE), args...);
  }

  /// One work-group a tile.
  template <class... Args>
  void launch_tiles(std::string_view name, const HsView& view, const Args&... args) {
    launch(name, cl::NDRange(tiles_of(view) * tile_items()), cl::NDRange(tile_items()), args...);
  }

  std::size_t tile_items() const { return device->lanes == 1 ? std::size_t{device->tile_px} * device->tile_px : 1; }

  /// Enough work-items to fill the device, each taking every n-th element.
  template <class... Args>
  void launch_strided(std::string_view name, const Args&... args) {
    launch(name, cl::NDRange(64 * 256), cl::NDRange(64), args...);
  }

  /// Counts of the bins to where each tile's references begin.
  void scan(const Bins& bins, cl_uint tiles, cl_uint copies = 1) {
    launch("scan_tiles", cl::NDRange(64), cl::NDRange(64), tiles, copies, bins.counts.get(), bins.offsets.get());
  }

  /// The pixels of a G-buffer: 16 x 16 a work-item on CPU devices, one on GPU devices (HS_FOR_PIXELS in kernels/common.h).
  template <class... Args>
  void launch_pixels(std::string_view name, glm::uvec2 size_px, const Args&... args) {
    const auto cover = [](std::size_t n, std::size_t by) { return (n + by - 1) / by; };
    if (device->lanes == 1)
      launch(name, cl::NDRange(cover(size_px.x, 16) * 16, cover(size_px.y, 16) * 16), cl::NDRange(16, 16), args...);
    else
      launch(name, cl::NDRange(cover(size_px.x, 16), cover(size_px.y, 16)), cl::NDRange(1, 1), args...);
  }

  void zero(const cl::Buffer& buffer, std::size_t bytes) { device->cl_queue.enqueueFillBuffer(buffer, cl_uint{0}, 0, bytes); }

  // ------------------------------------------------------------------------------------------------------------- passes

  /// Vertices into the view, triangles into its tiles.
  void transform_and_bin(const DrawList& list, std::string_view bound_kernel = "bound_triangles") {
    const cl_uint tiles = tiles_of(list.view);
    vertices_vs.at_least(*device, resident.vertex_count * sizeof(cl_float4), "vertices");
    vertices_px.at_least(*device, resident.vertex_count * sizeof(cl_int4), "vertices");
    status.at_least(*device, sizeof(HsStatus), "counters");
    triangle_bins.size_for(*device, std::size_t{list.triangles.count} * HS_BLOCK_SIZE, tiles,
                           std::size_t{list.triangles.count} * HS_BLOCK_SIZE * 4 + std::size_t{tiles} * 256);
    zero(status.get(), sizeof(HsStatus));
    zero(triangle_bins.counts.get(), tiles * sizeof(cl_uint));
    launch_blocks("transform", list.vertices, list.view, list.vertices.blocks, list.transforms, resident.positions,
                  vertices_vs.get(), vertices_px.get());
    launch_blocks(bound_kernel, list.triangles, list.view, list.triangles.blocks, resident.triangle_corners, vertices_vs.get(),
                  vertices_px.get(), triangle_bins.rects.get(), triangle_bins.counts.get(), status.get());
    scan(triangle_bins, tiles);
    launch_blocks("fill_triangles", list.triangles, list.view, list.triangles.blocks, triangle_bins.rects.get(),
                  triangle_bins.counts.get(), triangle_bins.refs.get(), triangle_bins.capacity);
  }

  GBuffer draw_gbuffer() {
    label = "camera";
    const DrawList& list = *camera_list;
    const std::size_t pixels = pixels_of(list.view);
    depth.at_least(*device, pixels * sizeof(cl_float), "G-buffer depth");
    normal.at_least(*device, pixels * sizeof(cl_float4), "G-buffer normals");
    face.at_least(*device, pixels * sizeof(cl_uint), "G-buffer faces");
    face_normals.at_least(*device, resident.triangle_count * sizeof(cl_float4), "face normals");

    transform_and_bin(list);
    launch_blocks("face_normals", list.triangles, list.view, list.triangles.blocks, triangle_bins.rects.get(),
                  resident.triangle_corners, vertices_vs.get(), materials, face_normals.get());
    launch_tiles("raster_gbuffer", list.view, list.view, list.triangles.blocks, list.triangles.count * HS_BLOCK_SIZE,
                 triangle_bins.rects.get(), triangle_bins.offsets.get(), triangle_bins.refs.get(), triangle_bins.capacity,
                 resident.triangle_corners, vertices_vs.get(), vertices_px.get(), face_normals.get(), depth.get(), normal.get(),
                 face.get());
    return {scene.camera.resolution, depth.get()(), nullptr, normal.get()(), nullptr, face.get()()};
  }

  void draw_shadow_map(const DrawList& list, std::string_view bound_kernel = "bound_triangles") {
    shadow_map.at_least(*device, pixels_of(list.view) * sizeof(cl_float), "shadow map");
    transform_and_bin(list, bound_kernel);
    launch_tiles("raster_shadow_map", list.view, list.view, list.triangles.blocks, list.triangles.count * HS_BLOCK_SIZE,
                 triangle_bins.rects.get(), triangle_bins.offsets.get(), triangle_bins.refs.get(), triangle_bins.capacity,
                 resident.triangle_corners, vertices_vs.get(), vertices_px.get(), shadow_map.get());
  }

  /// Faces to the light, silhouette edges, their quads and corners, into tiles.
  void draw_features(const DrawList& list, const HsFinShape& shape, const HsLayers& layering) {
    const cl_uint layers = layering.count;
    const cl_uint tiles = shape.tiles_x * shape.tiles_y;
    sides.at_least(*device, (resident.triangle_count + 3) / 4 * 4, "face sides");
    multiplicities.at_least(*device, resident.edge_count, "edge multiplicities");
    silhouettes.at_least(*device, resident.edge_count * sizeof(cl_uint), "silhouette edges");
    // Each edge can be a silhouette, with its quad and a corner at either end: room for all, so that none is ever lost.
    const std::size_t max_features = 3 * std::size_t{resident.edge_count};
    features.at_least(*device, max_features * sizeof(HsFeature), "fins");
    feature_bins.size_for(*device, max_features, std::size_t{tiles} * layers,
                          4 * std::size_t{resident.edge_count} + 2048 * std::size_t{tiles});
    tile_near_fins.at_least(*device, (tiles + 3) / 4 * 4, "tile flags");  // filled four at a time

    zero(feature_bins.counts.get(), std::size_t{tiles} * layers * sizeof(cl_uint));
    zero(tile_near_fins.get(), (tiles + 3) / 4 * 4);
    if (layers > 1)  // as of faces turned away: of meshes that cast nothing
      device->cl_queue.enqueueFillBuffer(sides.get(), cl_uint{0x01010101}, 0, (resident.triangle_count + 3) / 4 * 4);
    launch_blocks("orient_faces", list.caster_triangles, list.caster_triangles.blocks, resident.triangle_corners,
                  vertices_vs.get(), sides.get());
    launch_blocks("classify_edges", list.caster_edges, list.caster_edges.blocks, resident.edge_face_offsets, resident.edge_faces,
                  sides.get(), multiplicities.get(), silhouettes.get(), status.get());
    sublayer_counts.at_least(*device, HS_SUBLAYERS * sizeof(cl_uint), "sub-layers");
    sublayer_layers.at_least(*device, (HS_SUBLAYERS + 1) * sizeof(cl_uint), "sub-layers");
    caster_range.at_least(*device, 3 * sizeof(cl_float), "depths");
    if (layers > 1) {
      zero(sublayer_counts.get(), HS_SUBLAYERS * sizeof(cl_uint));
      launch_strided("count_sublayers", list.view, silhouettes.get(), resident.edge_ends, vertices_vs.get(), status.get(),
                     sublayer_counts.get());
      launch("merge_sublayers", cl::NDRange(1), cl::NDRange(1), list.view, shape, layering, status.get(), sublayer_counts.get(),
             sublayer_layers.get(), caster_range.get());
    }
    launch_strided("build_features", list.view, shape, layers, sublayer_layers.get(), silhouettes.get(), resident.edge_ends,
                   resident.edge_face_offsets, resident.edge_faces, resident.triangle_corners, resident.vertex_edge_offsets,
                   resident.vertex_edges, multiplicities.get(), vertices_vs.get(), vertices_px.get(), shadow_map.get(),
                   features.get(), feature_bins.rects.get(), feature_bins.counts.get(), status.get());
    scan(feature_bins, tiles * layers);
    launch_strided("fill_features", shape, status.get(), features.get(), feature_bins.rects.get(), feature_bins.counts.get(),
                   feature_bins.refs.get(), feature_bins.capacity);
  }

  /// Features into the buffers of a method.
  void draw_fins(const DrawList& list, const HsFinShape& shape, const Settings& settings) {
    const std::size_t pixels = pixels_of(list.view);
    const auto raster = [&](std::string_view kernel, const auto&... args) {
      launch_tiles(kernel, list.view, list.view, shape, status.get(), feature_bins.rects.get(), feature_bins.offsets.get(),
                   feature_bins.refs.get(), feature_bins.capacity, features.get(), shadow_map.get(), tile_near_fins.get(),
                   args...);
    };
    const cl_uint layers = layers_of(settings);
    draw_features(list, shape, layering_of(settings));
    if (settings.method == Method::smoothies) {
      fin_depth.at_least(*device, pixels * sizeof(cl_float), "fin depth");
      fin_alpha.at_least(*device, pixels * sizeof(cl_float), "fin alpha");
      raster("raster_fins", fin_depth.get(), fin_alpha.get());
    } else if (settings.method == Method::penumbra_maps) {
      penumbra_map.at_least(*device, pixels * sizeof(cl_float), "penumbra map");
      raster("raster_penumbra_map", penumbra_map.get(), static_cast<cl_uint>(chosen_falloff(settings)));
    } else {
      launch_strided("flag_feature_tiles", shape, status.get(), feature_bins.rects.get(), tile_near_fins.get());
      other_casters.at_least(*device, (layers > 1 ? pixels : 1) * sizeof(cl_uint), "casters");
      if (layers > 1)
        launch_tiles("raster_casters", list.view, list.view, shape, list.triangles.blocks, list.triangles.count * HS_BLOCK_SIZE,
                     triangle_bins.rects.get(), triangle_bins.offsets.get(), triangle_bins.refs.get(), triangle_bins.capacity,
                     resident.triangle_corners, vertices_vs.get(), vertices_px.get(), sides.get(), shadow_map.get(),
                     caster_range.get(), tile_near_fins.get(), other_casters.get());
    }
  }

  /// Shadow map, potential silhouettes of the whole disc, into tiles; receivers near them, into tiles; counting
  /// (visibility_exact.cl).
  void draw_exact(const LightView& fitted, const Light& light, const Settings& settings, const HsReceiverView& receiver,
                  const GBuffer& gbuffer, const cl::Buffer& depth_or_position, const cl::Buffer& normals, const cl::Buffer& out,
                  cl_uint plane, const Tints& tinting) {
    const DrawList list =
        draw_list(*device, resident, placed, fitted.view, fitted.frustum.view_from_world, fitted.casters, fitted.casters);
    const HsView& view = list.view;
    const cl_uint tiles = tiles_of(view);
    const std::size_t pixels = std::size_t{gbuffer.resolution.x} * gbuffer.resolution.y;
    const LightSamples& samples = samples_of(light, chosen_samples(settings));
    HsDisc disc{};
    disc.radius = static_cast<float>(disc_radius(light));
    disc.sphere = light.type == LightType::point;
    // On the plane of a ball's face, the disc that faces a receiver is up to this much larger, at the face's corners.
    const double widest = disc_radius(light) * (disc.sphere ? std::sqrt(3.0) : 1.0);
    const auto widest_radius = static_cast<float>(widest);
    disc.radius_px = static_cast<float>(widest / fitted.lm_from_px_scale);
    disc.reach2 = disc.radius * disc.radius * 1.001f;
    disc.near_q = static_cast<float>(HS_NEAR_PX * fitted.lm_from_px_scale);
    disc.table_per_turn = samples.per_turn;
    disc.sample_count = chosen_samples(settings);
    disc.rotated = settings.sample_pattern == SamplePattern::rotated;
    disc.tinted = tinting.plane >= 0;
    disc.cells_across = samples.cells_across;

    // A cut for every triangle that passes through the light's plane, at worst.
    const std::size_t max_edges = std::size_t{resident.edge_record_count} + resident.triangle_count;
    planes.at_least(*device, resident.triangle_count * sizeof(cl_float4), "face planes");
    disc_sides.at_least(*device, resident.triangle_count, "face sides");
    disc_edges.at_least(*device, (max_edges + device->lanes) * HS_EDGE_NUMBERS * sizeof(cl_float),  // in whole blocks
                        "potential silhouettes");
    const std::size_t tile_far_bytes = (tiles + device->lanes) * sizeof(cl_float);  // rows are read whole vectors at a time
    tile_far.at_least(*device, tile_far_bytes, "tile depths");
    tile_queue.at_least(*device, sizeof(cl_int), "tile queue");
    receiver_words.at_least(*device, pixels * sizeof(cl_uint), "receivers");
    receivers.at_least(*device, pixels * sizeof(cl_uint), "penumbra pixels");
    // On CPU devices a few workers share the edges, and then the tiles; on GPU devices a work-group is a tile.
    const cl_uint workers = 4 * device->device_info.compute_units, copies = device->lanes == 1 ? 1 : std::min(workers, 64u);
    // Tiles list whole blocks, of as many edges as the device has lanes.
    feature_bins.size_for(*device, 1, tiles, (4 * std::size_t{resident.edge_count} + 2048 * std::size_t{tiles}) / device->lanes);
    feature_bins.counts.at_least(*device, std::size_t{tiles} * copies * sizeof(cl_uint), "tile counts");
    receiver_bins.size_for(*device, 1, tiles, 1);

    draw_shadow_map(list, "bound_triangles_wide");
    zero(tile_far.get(), tile_far_bytes);
    zero(receiver_bins.counts.get(), tiles * sizeof(cl_uint));
    zero(feature_bins.counts.get(), std::size_t{tiles} * copies * sizeof(cl_uint));
    zero(tile_queue.get(), sizeof(cl_int));
    launch_pixels("receive_by_map", gbuffer.resolution, view, receiver, depth_or_position, normals, shadow_map.get(),
                  receiver_words.get(), tile_far.get(), receiver_bins.counts.get(), out, plane);
    scan(receiver_bins, tiles);
    launch_blocks("orient_faces_to_disc", list.triangles, list.triangles.blocks, resident.triangle_corners, vertices_vs.get(),
                  widest_radius, planes.get(), disc_sides.get());
    launch_blocks("collect_edges", list.caster_edges, list.caster_edges.blocks, resident.edge_ends, resident.edge_face_offsets,
                  resident.edge_faces, disc_sides.get(), planes.get(), vertices_vs.get(), disc_edges.get(), status.get());
    launch_blocks("collect_cuts", list.triangles, list.triangles.blocks, resident.triangle_corners, disc_sides.get(),
                  planes.get(), vertices_vs.get(), widest_radius, disc_edges.get(), status.get());
    const auto for_edges = [&](std::string_view kernel, const auto&... args) {
      if (device->lanes == 1)
        launch_strided(kernel, args...);
      else
        launch(kernel, cl::NDRange(copies), cl::NDRange(1), args...);
    };
    for_edges("count_edges", view, disc.radius_px, status.get(), disc_edges.get(), tile_far.get(), feature_bins.counts.get(),
              copies);
    scan(feature_bins, tiles, copies);
    for_edges("fill_edges", view, disc.radius_px, status.get(), disc_edges.get(), tile_far.get(), feature_bins.counts.get(),
              copies, feature_bins.refs.get(), feature_bins.capacity);
    launch_pixels("list_receivers", gbuffer.resolution, receiver, receiver_words.get(), feature_bins.offsets.get(),
                  static_cast<cl_uint>(settings.alias_free), receiver_bins.counts.get(), receivers.get());
    launch("count_samples", cl::NDRange(device->lanes == 1 ? std::size_t{tiles} * 64 : workers),
           cl::NDRange(device->lanes == 1 ? 64 : 1), view, receiver, disc, depth_or_position, normals, shadow_map.get(),
           disc_edges.get(), feature_bins.offsets.get(), feature_bins.refs.get(), feature_bins.capacity, samples.samples,
           samples.below, samples.weights, samples.cell_xy, samples.cells, samples.window_xy, samples.windows, tinting.buffer,
           static_cast<cl_uint>(std::max(0, tinting.plane)), list.triangles.blocks, list.triangles.count * HS_BLOCK_SIZE,
           triangle_bins.rects.get(), triangle_bins.offsets.get(), triangle_bins.refs.get(), triangle_bins.capacity,
           resident.triangle_corners, vertices_vs.get(), vertices_px.get(), planes.get(), disc_sides.get(),
           receiver_bins.offsets.get(), receiver_bins.counts.get(), receivers.get(), tile_queue.get(), out, plane, status.get());
  }

  const LightSamples& samples_of(const Light& light, unsigned count) {
    const bool is_disc = light.shape == LightShape::disc;
    const LightSamplesKey key{count, light.shape, is_disc ? 0.0 : light.size.x, is_disc ? 0.0 : light.size.y, light.texture};
    auto found = light_samples.find(key);
    if (found == light_samples.end()) {
      if (light_samples.size() > 64) light_samples.clear();  // sizes that are animated
      const SampleTable table = sample_table(light_points(light, count));
      found =
          light_samples
              .emplace(key,
                       LightSamples{buffer_of(*device, table.samples, "samples"), buffer_of(*device, table.below, "samples"),
                                    buffer_of(*device, table.weights, "samples"), buffer_of(*device, table.cell_xy, "samples"),
                                    buffer_of(*device, table.cells, "samples"), buffer_of(*device, table.window_xy, "samples"),
                                    buffer_of(*device, table.windows, "samples"), table.per_turn, table.cells_across})
              .first;
    }
    return found->second;
  }

  static bool has_fins(const Settings& settings, const Light& light) {
    const double radius = disc_radius(light);
    if (settings.method == Method::smoothies) return settings.smoothie_width > 0.0 || radius > 0.0;
    return radius > 0.0 && (settings.method == Method::penumbra_maps || settings.method == Method::fins ||
                            settings.method == Method::layered_fins);
  }

  /// The layers there is room for.
  static cl_uint layers_of(const Settings& settings) {
    return settings.method == Method::layered_fins ? chosen_layers(settings).value_or(HS_AUTO_LAYERS) : 1;
  }

  static HsLayers layering_of(const Settings& settings) {
    return {layers_of(settings), static_cast<cl_uint>(chosen_falloff(settings)), settings.faithful,
            settings.method == Method::layered_fins && !chosen_layers(settings)};
  }

  /// Hard shadows; the pixels near fins into the tiles of these; then tile by tile the fins, layer by layer.
  void draw_shadow_fins(const LightView& fitted, const HsReceiverView& receiver, const HsFinShape& shape,
                        const Settings& settings, const GBuffer& gbuffer, const cl::Buffer& depth_or_position,
                        const cl::Buffer& normals, const cl::Buffer& out, cl_uint plane) {
    const HsView& view = fitted.view;
    const cl_uint tiles = shape.tiles_x * shape.tiles_y, layer_count = layers_of(settings);
    const HsLayers layers = layering_of(settings);
    const std::size_t pixels = std::size_t{gbuffer.resolution.x} * gbuffer.resolution.y;
    horizon_limits.at_least(*device, pixels * sizeof(cl_float), "receivers");
    receiver_words.at_least(*device, pixels * sizeof(cl_uint), "receivers");
    receivers.at_least(*device, pixels * sizeof(cl_uint), "penumbra pixels");
    illuminances.at_least(*device, (layer_count > 1 ? HS_STATE_PLANES * pixels : 1) * sizeof(cl_float), "illuminance");
    receiver_bins.size_for(*device, 1, tiles, 1);
    tile_far.at_least(*device, tiles * sizeof(cl_float), "tile depths");

    zero(receiver_bins.counts.get(), tiles * sizeof(cl_uint));
    zero(tile_far.get(), tiles * sizeof(cl_float));
    launch_pixels("begin_fins", gbuffer.resolution, view, receiver, depth_or_position, normals, shadow_map.get(),
                  tile_near_fins.get(), shape, layers, caster_range.get(), receiver_words.get(), horizon_limits.get(),
                  receiver_bins.counts.get(), tile_far.get(), out, plane);
    scan(receiver_bins, tiles);
    launch_pixels("list_fin_receivers", gbuffer.resolution, receiver, receiver_words.get(), receiver_bins.counts.get(),
                  receivers.get());
    launch("receive_fins", cl::NDRange(tiles * tile_items()), cl::NDRange(tile_items()), view, shape, layers, status.get(),
           feature_bins.rects.get(), feature_bins.offsets.get(), feature_bins.refs.get(), feature_bins.capacity, features.get(),
           shadow_map.get(), other_casters.get(), caster_range.get(), receiver_bins.offsets.get(), receivers.get(), receiver,
           tile_far.get(), depth_or_position, receiver_words.get(), horizon_limits.get(), illuminances.get(), out, plane);
  }

  HsFinShape fin_shape(const Light& light, const LightView& fitted, const Settings& settings) const {
    HsFinShape shape{};
    if (settings.method == Method::smoothies && settings.smoothie_width > 0.0)
      shape.width_px = static_cast<float>(settings.smoothie_width * fitted.frustum.tan_half_x / fitted.lm_from_px_scale);
    else
      shape.radius_px = static_cast<float>(disc_radius(light) / fitted.lm_from_px_scale);
    if (light.type == LightType::point) shape.sphere_q_per_px = static_cast<float>(fitted.lm_from_px_scale);
    shape.two_sided = settings.method == Method::fins || settings.method == Method::layered_fins;
    shape.drop_hidden = !shape.two_sided || settings.faithful ? 0 : layers_of(settings) > 1 ? 1 : 2;
    shape.tile_step = device->tile_px;
    shape.tiles_x = fitted.view.tiles_x;
    shape.tiles_y = fitted.view.tiles_y;
    if (shape.two_sided) {
      // Footprints begin anywhere but in the last column and row.
      shape.tile_step -= 1;
      shape.tiles_x = (fitted.view.width_px - 2) / shape.tile_step + 1;
      shape.tiles_y = (fitted.view.height_px - 2) / shape.tile_step + 1;
    }
    return shape;
  }

  /// The light's side of the frame: shadow map and fin buffers. False if nothing casts in its reach.
  bool draw_light_buffers(const Light& light, const LightView& fitted, const Settings& settings) {
    label = light.name;
    if (fitted.casters.empty()) return false;
    const DrawList list =
        draw_list(*device, resident, placed, fitted.view, fitted.frustum.view_from_world, fitted.drawn, fitted.casters);
    draw_shadow_map(list);
    if (has_fins(settings, light)) {
      draw_fins(list, fin_shape(light, fitted, settings), settings);
    }
    return true;
  }

  /// Shadow map after shadow map, each from another point of the light; `out` counts those that see a pixel, then holds the mean.
  void draw_samples(const GBuffer& gbuffer, std::size_t light, const Settings& settings, const cl::Buffer& depth_or_position,
                    const cl::Buffer& normals, const cl::Buffer& out, cl_uint plane, const Tints& tinting) {
    const bool has_depth = gbuffer.depth != nullptr, tinted = tinting.plane >= 0;
    const cl_uint count = chosen_samples(settings), tint_plane = static_cast<cl_uint>(std::max(0, tinting.plane));
    const auto& [index, as, centre] = faces_of_light(light).front();
    const LightPoints points = as.shape == LightShape::disc ? LightPoints{} : light_points(as, count);
    fill_plane(out, plane, 0.0f);
    for (cl_uint i = 0; i < count; ++i) {
      const std::vector<Light> samples =
          faces_of(points.points.empty() ? light_sample(as, centre, i, count) : light_at_point(as, centre, points.points[i]));
      const glm::vec3 channels = points.weights.empty() ? glm::vec3(1.0f) : points.weights[i];
      const cl_float4 weight{{channels.r, channels.g, channels.b, tinted ? 1.0f : 0.0f}};
      for (std::size_t face = 0; face < samples.size(); ++face) {
        const Light& sample = samples[face];
        const LightView from = fit_light_view(sample, placed, settings.light_resolution_px, device->tile_px);
        const cl_uint casts = !from.casters.empty();
        if (casts) draw_shadow_map(draw_list(*device, resident, placed, from.view, from.frustum.view_from_world, from.drawn));
        HsReceiverView view = receiver_view(scene.camera, sample, from, has_depth);
        if (!view.is_face) view.tan_half_cone = HS_EMPTY_Z;  // the cone is the centre's, see the end
        launch_pixels("receive_sample", gbuffer.resolution, from.view, view, depth_or_position, normals, shadow_map.get(), casts,
                      weight, tinting.buffer, tint_plane, out, plane);
        if (i + 1 == count) keep_counters(faces_of_light(light)[face], from, settings);
      }
    }
    for (const LightFace& face : faces_of_light(light))
      launch_pixels("receive_samples_end", gbuffer.resolution, whole_cone_view(face.fitted),
                    receiver_view(scene.camera, face.as, face.fitted, has_depth), depth_or_position, normals, count,
                    static_cast<cl_uint>(tinted), tinting.buffer, tint_plane, out, plane);
  }

  void fill_plane(const cl::Buffer& out, cl_uint plane, float value) {
    const std::size_t bytes = pixels_of(camera_list->view) * sizeof(cl_float);
    device->cl_queue.enqueueFillBuffer(out, value, plane * bytes, bytes);
  }

  std::span<LightFace> faces_of_light(std::size_t light) {
    const auto [first, last] = std::ranges::equal_range(faces, light, {}, &LightFace::light);
    return {first, last};
  }

  /// Of each light the number of its plane of tints, -1 for those without a texture.
  std::vector<cl_int> tint_planes() const {
    std::vector<cl_int> planes;
    cl_int count = 0;
    for (const Light& light : scene.lights) planes.push_back(light.texture ? count++ : -1);
    return planes;
  }

  std::size_t tints_bytes() const {
    return static_cast<std::size_t>(
               std::ranges::count_if(scene.lights, [](const Light& light) { return light.texture != nullptr; })) *
           pixels_of(camera_list->view) * sizeof(cl_float4);
  }

  /// Every pass of one light over a G-buffer. `tints`: as enqueue_visibility has them, or none.
  void draw_visibility(const GBuffer& gbuffer, std::size_t light, const Settings& settings, const cl::Buffer& out, cl_uint plane,
                       const cl::Buffer& tints) {
    const Tints tinting{tints, tints() ? tint_planes()[light] : -1};
    if (tinting.plane >= 0) {
      const std::size_t bytes = pixels_of(camera_list->view) * sizeof(cl_float4);
      device->cl_queue.enqueueFillBuffer(tints, 0.0f, static_cast<std::size_t>(tinting.plane) * bytes, bytes);
    }
    const std::span<LightFace> own = faces_of_light(light);
    for (LightFace& face : own)
      face.fitted =
          fit_light_view(face.as, placed, settings.light_resolution_px, device->tile_px, settings.method == Method::pcss);
    label = scene.lights[light].name;
    if (own.size() > 1) fill_plane(out, plane, 1.0f);  // where no face reaches: the light's very centre
    const bool casts = std::ranges::any_of(own, [](const LightFace& face) { return !face.fitted.casters.empty(); });
    if (casts && settings.method == Method::light_samples && chosen_samples(settings) > 1 &&
        disc_radius(scene.lights[light]) > 0.0) {
      const bool has_depth = gbuffer.depth != nullptr;
      draw_samples(gbuffer, light, settings, cl::Buffer(has_depth ? gbuffer.depth : gbuffer.position, true),
                   cl::Buffer(gbuffer.normal, true), out, plane, tinting);
    } else {
      for (const LightFace& face : own) draw_face(gbuffer, face, settings, out, plane, tinting);
    }
  }

  void draw_face(const GBuffer& gbuffer, const LightFace& face, const Settings& settings, const cl::Buffer& out, cl_uint plane,
                 const Tints& tinting) {
    const Light& light = face.as;
    const LightView& fitted = face.fitted;
    const bool exact = settings.method == Method::exact && !fitted.casters.empty();
    const bool casts = !exact && draw_light_buffers(light, fitted, settings);

    const bool has_depth = gbuffer.depth != nullptr;
    const HsReceiverView view = receiver_view(scene.camera, light, fitted, has_depth);
    const cl::Buffer depth_or_position(has_depth ? gbuffer.depth : gbuffer.position, true), normals(gbuffer.normal, true);
    const auto receive = [&](std::string_view kernel, const auto&... args) {
      launch_pixels(kernel, gbuffer.resolution, fitted.view, view, depth_or_position, normals, args..., out, plane);
    };
    if (exact)
      draw_exact(fitted, light, settings, view, gbuffer, depth_or_position, normals, out, plane, tinting);
    else if (!casts)
      receive("receive_all");
    else if (settings.method == Method::pcf)
      settings.pcf_filter == 4 ? receive("receive_pcf4", shadow_map.get()) : receive("receive_pcf2", shadow_map.get());
    else if (settings.method == Method::pcss && disc_radius(light) > 0.0)
      receive("receive_pcss", shadow_map.get(), fin_shape(light, fitted, settings),
              static_cast<cl_float>(1.0 / fitted.casters_znear), cl_uint{settings.pcss_taps},
              samples_of(light, settings.pcss_taps).samples);
    else if (!has_fins(settings, light))
      receive("receive_hard", shadow_map.get());
    else if (settings.method == Method::smoothies)
      receive("receive_smoothies", shadow_map.get(), fin_depth.get(), fin_alpha.get(), tile_near_fins.get(),
              static_cast<cl_uint>(chosen_falloff(settings)));
    else if (settings.method == Method::penumbra_maps)
      receive("receive_penumbra_map", shadow_map.get(), penumbra_map.get(), tile_near_fins.get());
    else
      draw_shadow_fins(fitted, view, fin_shape(light, fitted, settings), settings, gbuffer, depth_or_position, normals, out,
                       plane);
    keep_counters(face, fitted, settings);
  }

  /// Copies a face's counters aside, on the device. `fitted` is what was drawn last.
  void keep_counters(const LightFace& face, const LightView& fitted, const Settings& settings) {
    const std::size_t row = static_cast<std::size_t>(&face - faces.data()) * sizeof(LightCounters);
    device->cl_queue.enqueueFillBuffer(counters.get(), cl_uint{0}, row, sizeof(LightCounters));
    if (fitted.casters.empty()) return;
    const std::size_t total = tiles_of(fitted.view) * sizeof(cl_uint);
    const HsFinShape shape = fin_shape(face.as, fitted, settings);
    const std::size_t feature_total = std::size_t{shape.tiles_x} * shape.tiles_y * layers_of(settings) * sizeof(cl_uint);
    device->cl_queue.enqueueCopyBuffer(status.get(), counters.get(), 0, row, sizeof(HsStatus));
    device->cl_queue.enqueueCopyBuffer(triangle_bins.offsets.get(), counters.get(), total,
                                       row + offsetof(LightCounters, triangle_refs), sizeof(cl_uint));
    if (has_fins(settings, face.as) || settings.method == Method::exact)
      device->cl_queue.enqueueCopyBuffer(feature_bins.offsets.get(), counters.get(), feature_total,
                                         row + offsetof(LightCounters, feature_refs), sizeof(cl_uint));
  }

  /// `tints`: as enqueue_visibility has them, or none.
  void draw_shade(const GBuffer& gbuffer, const cl::Buffer& planes, const cl::Buffer& out, const cl::Buffer& tints) {
    label = "camera";
    std::vector<HsShadeLight> lights;
    for (const Light& light : scene.lights) lights.push_back(shade_light(scene.camera, light));
    if (tints()) {
      const std::vector<cl_int> own = tint_planes();
      for (std::size_t i = 0; i < own.size(); ++i) lights[i].tint_plane = own[i];
    }
    const cl_float4 ambient{{scene.ambient.x, scene.ambient.y, scene.ambient.z, 0.0f}};
    const bool has_depth = gbuffer.depth != nullptr, has_colors = gbuffer.base_color != nullptr;
    launch_pixels("shade", gbuffer.resolution, static_cast<cl_uint>(lights.size()), buffer_of(*device, lights, "lights"), ambient,
                  shade_view(scene.camera, has_depth), cl::Buffer(has_depth ? gbuffer.depth : gbuffer.position, true),
                  cl::Buffer(gbuffer.normal, true), has_colors ? cl::Buffer(gbuffer.base_color, true) : cl::Buffer(),
                  has_colors ? cl::Buffer() : cl::Buffer(gbuffer.face, true), resident.face_meshes, materials, planes, tints,
                  out);
  }

  // ------------------------------------------------------------------------------------------------------------- checks

  void require_scene(std::string_view caller) const {
    if (!camera_list) throw InputError(fmt::format("{}: no scene; call set_scene first", caller));
  }

  void check(const Settings& settings, std::string_view caller) const {
    if (settings.light_resolution_px < 1 || settings.light_resolution_px > HS_MAX_RESOLUTION)
      throw InputError(
          fmt::format("{}: light map resolution {}: expected 1 to {}", caller, settings.light_resolution_px, HS_MAX_RESOLUTION));
    if (settings.pcf_filter != 2 && settings.pcf_filter != 4)
      throw InputError(fmt::format("{}: PCF filter {}: expected 2 or 4", caller, settings.pcf_filter));
    if (settings.pcss_taps != 16 && settings.pcss_taps != 32)
      throw InputError(fmt::format("{}: {} PCSS taps: expected 16 or 32", caller, settings.pcss_taps));
    if (settings.layers && (*settings.layers < 1 || *settings.layers > HS_MAX_LAYERS))
      throw InputError(fmt::format("{}: {} layers: expected 1 to {}", caller, *settings.layers, HS_MAX_LAYERS));
    const unsigned samples = chosen_samples(settings);
    if (samples < 1) throw InputError(fmt::format("{}: 0 light samples: expected at least 1", caller));
    if (settings.method == Method::exact && samples != 16 && samples != 64 && samples != 256 && samples != HS_MAX_SAMPLES)
      throw InputError(fmt::format("{}: {} samples: expected 16, 64, 256 or 1024", caller, samples));
    if (!(settings.smoothie_width >= 0.0 && settings.smoothie_width <= 2.0))
      throw InputError(fmt::format("{}: smoothie width {}: expected 0 (from the light's radius) to 2, the whole map", caller,
                                   settings.smoothie_width));
  }

  static void check(const Settings& settings, const Light& light, std::string_view caller) {
    if (can_draw(settings, light)) return;
    if (light.type == LightType::directional)
      throw InputError(
          fmt::format("{}: smoothie width {}: it is of a light's cone, and light '{}' is directional; use 0 (from its radius)",
                      caller, settings.smoothie_width, light.name));
    if (!info_of(settings.method).any_shape)
      throw InputError(fmt::format("{}: light '{}' is a rectangle: method {} knows discs alone; choose {}", caller, light.name,
                                   name_of(settings.method), methods_of_any_shape()));
    throw InputError(fmt::format("{}: light '{}' is a rectangle: expected the sample pattern 'fixed', only discs can be turned",
                                 caller, light.name));
  }

  static std::string methods_of_any_shape() {
    std::string names;
    for (const MethodInfo& info : methods())
      if (info.any_shape) names += fmt::format("{}{}", names.empty() ? "" : ", ", info.name);
    return names;
  }

  void check(const GBuffer& gbuffer, std::string_view caller) const {
    if (gbuffer.resolution != scene.camera.resolution)
      throw InputError(fmt::format("{}: the G-buffer is {}x{}, the scene's camera {}x{}; they must agree", caller,
                                   gbuffer.resolution.x, gbuffer.resolution.y, scene.camera.resolution.x,
                                   scene.camera.resolution.y));
    const std::size_t pixels = std::size_t{gbuffer.resolution.x} * gbuffer.resolution.y;
    check_plane(gbuffer.depth ? gbuffer.depth : gbuffer.position, pixels * (gbuffer.depth ? 4 : 16),
                gbuffer.depth ? "depth" : "depth or position", caller);
    check_plane(gbuffer.normal, pixels * 16, "normal", caller);
  }

  static void check_plane(cl_mem plane, std::size_t bytes, std::string_view what, std::string_view caller) {
    if (!plane) throw InputError(fmt::format("{}: no {} buffer", caller, what));
    std::size_t have = 0;
    if (clGetMemObjectInfo(plane, CL_MEM_SIZE, sizeof have, &have, nullptr) != CL_SUCCESS)
      throw InputError(fmt::format("{}: {} is not an OpenCL buffer", caller, what));
    if (have < bytes) throw InputError(fmt::format("{}: the {} buffer holds {} bytes, expected {}", caller, what, have, bytes));
  }
};

namespace {

/// OpenCL's errors as ours.
template <class F>
auto guarded(std::string_view caller, F&& f) {
  try {
    return f();
  } catch (const cl::Error& error) {
    throw DeviceError(fmt::format("{}: {}: {}", caller, error.what(), error_name(error.err())));
  }
}

/// A caller's buffer, or none.
cl::Buffer retained(cl_mem buffer) {
  return buffer ? cl::Buffer(buffer, true) : cl::Buffer();
}

template <class T>
std::vector<T> read(const cl::CommandQueue& queue, const cl::Buffer& buffer, std::size_t count, std::size_t offset_bytes = 0) {
  std::vector<T> values(count);
  if (count > 0) queue.enqueueReadBuffer(buffer, CL_TRUE, offset_bytes, count * sizeof(T), values.data());
  return values;
}

}  // namespace

Renderer::Renderer(std::shared_ptr<Device> device) : state_(std::make_unique<State>()) {
  state_->device = std::dynamic_pointer_cast<DeviceImpl>(std::move(device));
  if (!state_->device) throw InputError("Renderer: expected a device from Device::open or Device::adopt");
}

Renderer::~Renderer() {
  // Where a frame was cut short by an error, PoCL may still be compiling its kernels: the process must not exit under it. A
  // caller's queue is the caller's to wait for.
  if (state_->device->owns_queue) clFinish(state_->device->cl_queue());
}

void Renderer::set_scene(const Scene& scene) {
  validate(scene, scene.name.empty() ? "scene" : scene.name);
  guarded("set_scene", [&] {
    State& s = *state_;
    const bool resident =
        s.camera_list && std::equal(scene.meshes.begin(), scene.meshes.end(), s.resident.meshes.begin(), s.resident.meshes.end(),
                                    [](const SceneMesh& a, const auto& b) { return a.mesh == b; });
    if (!resident) s.resident = upload(*s.device, scene);
    s.scene = scene;
    s.placed.clear();
    std::vector<cl_float4> materials;
    for (std::size_t i = 0; i < scene.meshes.size(); ++i) {
      const SceneMesh& mesh = scene.meshes[i];
      s.placed.push_back(
          {world_from_mesh(mesh), s.resident.bounds[i], s.resident.orientations[i], mesh.casts_shadow, mesh.receives_shadow});
      materials.push_back({{mesh.base_color.x, mesh.base_color.y, mesh.base_color.z, mesh.receives_shadow ? 1.0f : 0.0f}});
    }
    s.materials = buffer_of(*s.device, materials, "materials");
    const Frustum frustum = camera_frustum(scene.camera);
    s.camera_list = draw_list(*s.device, s.resident, s.placed, camera_view(scene.camera, s.device->tile_px),
                              frustum.view_from_world, meshes_in_view(frustum, s.placed, scene.camera.znear, scene.camera.zfar));
    s.faces.clear();
    for (std::size_t light = 0; light < scene.lights.size(); ++light)
      for (const Light& face : faces_of(scene.lights[light])) s.faces.push_back({light, face, {}});
    s.counters.at_least(*s.device, std::max<std::size_t>(1, s.faces.size()) * sizeof(LightCounters), "counters");
    s.rendered.reset();
  });
}

GBuffer Renderer::enqueue_gbuffer() {
  state_->require_scene("enqueue_gbuffer");
  return guarded("enqueue_gbuffer", [&] { return state_->draw_gbuffer(); });
}

void Renderer::enqueue_visibility(const GBuffer& gbuffer, std::size_t light, const Settings& settings, cl_mem visibility,
                                  std::size_t plane, cl_mem tints, std::span<const cl_event> wait, cl_event* done) {
  State& s = *state_;
  s.require_scene("enqueue_visibility");
  s.check(settings, "enqueue_visibility");
  s.check(gbuffer, "enqueue_visibility");
  if (light >= s.scene.lights.size())
    throw InputError(fmt::format("enqueue_visibility: light {}: the scene has {}", light, s.scene.lights.size()));
  State::check(settings, s.scene.lights[light], "enqueue_visibility");
  State::check_plane(visibility, (plane + 1) * pixels_of(s.camera_list->view) * sizeof(cl_float), "visibility",
                     "enqueue_visibility");
  if (tints) State::check_plane(tints, s.tints_bytes(), "tints", "enqueue_visibility");
  guarded("enqueue_visibility", [&] {
    if (!wait.empty()) {
      if (const cl_int code =
              clEnqueueBarrierWithWaitList(s.device->cl_queue(), static_cast<cl_uint>(wait.size()), wait.data(), nullptr))
        throw cl::Error(code, "clEnqueueBarrierWithWaitList");
    }
    s.draw_visibility(gbuffer, light, settings, cl::Buffer(visibility, true), static_cast<cl_uint>(plane), retained(tints));
    if (done) {
      if (const cl_int code = clEnqueueMarkerWithWaitList(s.device->cl_queue(), 0, nullptr, done))
        throw cl::Error(code, "clEnqueueMarkerWithWaitList");
    }
  });
}

void Renderer::enqueue_shade(const GBuffer& gbuffer, cl_mem visibility, cl_mem rgb, cl_mem tints) {
  State& s = *state_;
  s.require_scene("enqueue_shade");
  s.check(gbuffer, "enqueue_shade");
  const std::size_t pixels = pixels_of(s.camera_list->view);
  State::check_plane(gbuffer.base_color ? gbuffer.base_color : gbuffer.face, pixels * (gbuffer.base_color ? 16 : 4),
                     "base colour or face", "enqueue_shade");
  State::check_plane(visibility, std::max<std::size_t>(1, s.scene.lights.size()) * pixels * 4, "visibility", "enqueue_shade");
  State::check_plane(rgb, pixels * 16, "rgb", "enqueue_shade");
  if (tints) State::check_plane(tints, s.tints_bytes(), "tints", "enqueue_shade");
  guarded("enqueue_shade", [&] { s.draw_shade(gbuffer, cl::Buffer(visibility, true), cl::Buffer(rgb, true), retained(tints)); });
}

void Renderer::render(const Settings& settings) {
  State& s = *state_;
  s.require_scene("render");
  s.check(settings, "render");
  for (const Light& light : s.scene.lights) State::check(settings, light, "render");
  guarded("render", [&] {
    s.timed.clear();
    s.timing = s.device->profiles;
    const struct StopTiming {
      bool& timing;
      ~StopTiming() { timing = false; }
    } stop_timing{s.timing};
    const std::size_t pixels = pixels_of(s.camera_list->view);
    s.visibility.at_least(*s.device, std::max<std::size_t>(1, s.scene.lights.size()) * pixels * sizeof(cl_float), "visibility");
    s.rgb.at_least(*s.device, pixels * sizeof(cl_float4), "shaded picture");

    const GBuffer gbuffer = s.draw_gbuffer();
    const std::size_t tints_bytes = s.tints_bytes();
    const cl::Buffer tints =
        tints_bytes > 0 ? s.tints.at_least(*s.device, tints_bytes, "tints of textured lights") : cl::Buffer();
    for (std::size_t light = 0; light < s.scene.lights.size(); ++light)
      s.draw_visibility(gbuffer, light, settings, s.visibility.get(), static_cast<cl_uint>(light), tints);
    s.draw_shade(gbuffer, s.visibility.get(), s.rgb.get(), tints);
    s.device->cl_queue.finish();
    s.rendered = settings;

    // Room for the next frame where this one had to go without tile lists.
    for (const LightCounters& light : read<LightCounters>(s.device->cl_queue, s.counters.get(), s.faces.size())) {
      s.triangle_bins.wanted_refs = std::max<std::size_t>(s.triangle_bins.wanted_refs, light.triangle_refs);
      s.feature_bins.wanted_refs = std::max<std::size_t>(s.feature_bins.wanted_refs, light.feature_refs);
    }
  });
}

Frame Renderer::read_frame() {
  State& s = *state_;
  if (!s.rendered) throw InputError("read_frame: nothing rendered; call render first");
  return guarded("read_frame", [&] {
    const cl::CommandQueue& queue = s.device->cl_queue;
    const std::size_t pixels = pixels_of(s.camera_list->view);
    const auto vec4s = [&](const cl::Buffer& buffer) { return read<glm::vec4>(queue, buffer, pixels); };
    Frame frame;
    frame.resolution = s.scene.camera.resolution;
    frame.depth = read<float>(queue, s.depth.get(), pixels);
    frame.normal_ws = vec4s(s.normal.get());
    frame.rgb = vec4s(s.rgb.get());
    for (std::size_t light = 0; light < s.scene.lights.size(); ++light)
      frame.visibility.push_back(read<float>(queue, s.visibility.get(), pixels, light * pixels * sizeof(float)));

    const Frustum frustum = camera_frustum(s.scene.camera);
    const glm::dmat3 world_from_view = glm::transpose(glm::dmat3(frustum.view_from_world));
    const glm::dvec2 px_to_q = 2.0 * glm::dvec2(frustum.tan_half_x, -frustum.tan_half_y) / glm::dvec2(frame.resolution);
    frame.position_ws.resize(pixels);
    for (std::size_t i = 0; i < pixels; ++i) {
      const double z = frame.depth[i];
      const glm::dvec2 px(i % frame.resolution.x + 0.5, i / frame.resolution.x + 0.5);
      const glm::dvec2 q = glm::dvec2(-frustum.tan_half_x, frustum.tan_half_y) + px * px_to_q;
      if (z > 0.0) frame.position_ws[i] = glm::vec4(s.scene.camera.position + world_from_view * glm::dvec3(q * z, z), 1.0f);
      frame.normal_ws[i].w = 0.0f;
    }
    return frame;
  });
}

LightBuffers Renderer::read_light_buffers(std::size_t light, std::size_t face) {
  State& s = *state_;
  if (!s.rendered) throw InputError("read_light_buffers: nothing rendered; call render first");
  if (light >= s.scene.lights.size())
    throw InputError(fmt::format("read_light_buffers: light {}: the scene has {}", light, s.scene.lights.size()));
  const std::span<LightFace> own = s.faces_of_light(light);
  if (face >= own.size())
    throw InputError(fmt::format("read_light_buffers: face {} of light {}: it has {}", face, light, own.size()));
  return guarded("read_light_buffers", [&] {
    // Lights take turns with the buffers, so this one's are drawn again.
    const LightView& fitted = own[face].fitted;
    LightBuffers buffers;
    const bool casts = s.draw_light_buffers(own[face].as, fitted, *s.rendered);
    if (!casts) return buffers;
    const cl::CommandQueue& queue = s.device->cl_queue;
    const HsView& view = fitted.view;
    const std::size_t texels = pixels_of(view);
    buffers.resolution = {view.width_px, view.height_px};
    const bool is_directional = s.scene.lights[light].type == LightType::directional;
    const auto depth_of = [&](double z) { return is_directional ? fitted.horizon - fitted.unit / z : z; };
    buffers.lm_from_px_origin = fitted.lm_from_px_origin * fitted.unit;
    buffers.lm_from_px_scale = fitted.lm_from_px_scale * fitted.unit;
    buffers.znear = depth_of(fitted.znear);
    buffers.zfar = depth_of(fitted.zfar);
    const auto far_where_empty = [&](std::vector<float> plane) {
      for (float& z : plane) z = static_cast<float>(depth_of(z >= HS_EMPTY_Z ? fitted.zfar : z));
      return plane;
    };
    buffers.planes.push_back({"shadow_map.Z", far_where_empty(read<float>(queue, s.shadow_map.get(), texels))});
    if (State::has_fins(*s.rendered, s.scene.lights[light])) {
      // Tiles without fins are not written by the kernels.
      const std::vector<cl_uint> offsets = read<cl_uint>(queue, s.feature_bins.offsets.get(), tiles_of(view) + 1);
      const auto plane = [&](const GrowingBuffer& buffer, float where_none) {
        std::vector<float> values = read<float>(queue, buffer.get(), texels);
        for (std::size_t i = 0; i < texels; ++i) {
          const std::size_t tile = i / view.width_px / s.device->tile_px * view.tiles_x + i % view.width_px / s.device->tile_px;
          if (offsets[tile] == offsets[tile + 1]) values[i] = where_none;
        }
        return values;
      };
      if (s.rendered->method == Method::smoothies) {
        buffers.planes.push_back({"fin.Z", far_where_empty(plane(s.fin_depth, HS_EMPTY_Z))});
        buffers.planes.push_back({"fin.A", plane(s.fin_alpha, 1.0f)});
      } else if (s.rendered->method == Method::penumbra_maps) {
        buffers.planes.push_back({"penumbra_map.Y", plane(s.penumbra_map, 1.0f)});
      }
    }
    return buffers;
  });
}

std::vector<StageTime> Renderer::stage_times() {
  return guarded("stage_times", [&] {
    std::vector<StageTime> times;
    for (const auto& [stage, event] : state_->timed) {
      event.wait();
      const double ns = static_cast<double>(event.getProfilingInfo<CL_PROFILING_COMMAND_END>() -
                                            event.getProfilingInfo<CL_PROFILING_COMMAND_START>());
      times.push_back({stage, ns * 1e-6});
    }
    return times;
  });
}

FrameStats Renderer::stats() {
  State& s = *state_;
  return guarded("stats", [&] {
    FrameStats stats;
    stats.triangles = s.resident.triangle_count;
    stats.vertices = s.resident.vertex_count;
    stats.edges = s.resident.edge_count;
    if (!s.rendered) return stats;
    const auto counters = read<LightCounters>(s.device->cl_queue, s.counters.get(), s.faces.size());
    for (const Light& light : s.scene.lights) stats.lights.push_back({.name = light.name, .skipped = true});
    for (std::size_t i = 0; i < counters.size(); ++i) {
      const LightView& fitted = s.faces[i].fitted;
      FrameStats::PerLight& light = stats.lights[s.faces[i].light];
      light.silhouette_edges += counters[i].status.silhouette_count;
      light.features += counters[i].status.feature_count;
      light.feature_tile_references += counters[i].feature_refs;
      light.triangle_tile_references += counters[i].triangle_refs;
      light.light_map_px = glm::max(light.light_map_px, glm::uvec2(fitted.view.width_px, fitted.view.height_px));
      light.skipped &= fitted.casters.empty();
      light.negative_pixels += counters[i].status.negative_count;
    }
    return stats;
  });
}

}  // namespace halfshade
