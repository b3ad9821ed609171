// halfshade: soft shadows from area lights as a compute-only OpenCL pipeline.
//
// This header is the whole public interface and its manual. In the order of use:
//
//   Scene     what is drawn: meshes, a camera, lights        load_scene, scene_at_frame, load_obj, make_mesh
//   Device    where it is drawn: an OpenCL device            list_devices, Device::open, Device::adopt
//   Settings  how shadows are computed                       methods()
//   Renderer  scene in, visibility out                       set_scene, render, read_frame
//             plugging into a compute renderer               enqueue_visibility
//
// A complete program:
//
//   auto device = halfshade::Device::open("");
//   halfshade::Renderer renderer(device);
//   renderer.set_scene(halfshade::load_scene("scene.json"));
//   renderer.render({.method = halfshade::Method::smoothies});
//   halfshade::Frame frame = renderer.read_frame();
//
// Words, spaces and units. Space suffixes: _ws world, _vs view (x right, y up, z forward from the camera), _ls light (x right,
// y up, z forward along the light's axis), _px pixels or texels; lengths are in the scene's unit, angles carry _deg. Image planes
// are row-major with the first row at the top. Visibility is the fraction of the light's area that a point sees, 0..1.
//
// Errors are exceptions: InputError for what the caller or a file got wrong, DeviceError where the work itself failed.
// Thread safety: a Device and its Renderers belong to one thread at a time.
#pragma once

#ifndef CL_TARGET_OPENCL_VERSION
#define CL_TARGET_OPENCL_VERSION 120
#endif
#include <CL/cl.h>

#include <cstdint>
#include <filesystem>
#include <functional>
#include <glm/glm.hpp>
#include <memory>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace halfshade {

/// What a user or a file got wrong. The message is one line: which file or option, where in it, what was expected, what to do.
struct InputError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// The work failed: an OpenCL call (with kernel, sizes and build log), memory, a disk. Not the input's fault.
struct DeviceError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// The library's version, "MAJOR.MINOR.PATCH".
std::string_view version();

// ---------------------------------------------------------------------------------------------------------------- scene

/// Triangle geometry as the pipeline needs it: every position once (OBJ files split vertices at normals and texture seams; for
/// silhouettes they are one), relative to a local origin so that single precision holds far from the world's origin.
/// Immutable once made; scenes share it.
struct Mesh {
  std::string name;                     ///< where it came from, for messages
  glm::dvec3 origin{0.0};               ///< what the positions are relative to, in the mesh's own space
  std::vector<glm::vec3> positions;     ///< distinct, finite
  std::vector<glm::uvec3> triangles;    ///< three different indices each, any winding
  std::size_t source_vertex_count = 0;  ///< before welding
  std::size_t collapsed_count = 0;      ///< triangles dropped because welding made two of their corners one
};

/// Welds positions that are equal in single precision about the local origin (the centre of what the triangles span), in order of
/// first appearance; drops triangles that collapse and vertices that no triangle uses.
/// Throws InputError, naming `name`, for an index out of range, a position that is not finite, or no triangle at all.
Mesh make_mesh(std::string name, std::span<const glm::dvec3> positions, std::span<const glm::uvec3> triangles);

/// Reads a Wavefront OBJ file (positions and faces; polygons are triangulated) in double precision and makes a mesh of it.
/// Throws InputError with file, line where known, and what was expected.
Mesh load_obj(const std::filesystem::path& path);

/// A mesh placed in the scene. world_from_mesh = T · Rz·Ry·Rx · S.
struct SceneMesh {
  std::string name;
  std::shared_ptr<const Mesh> mesh;
  glm::dvec3 translation{0.0};
  glm::dvec3 rotation_deg{0.0};  ///< about fixed x, then y, then z
  glm::dvec3 scale{1.0};
  bool casts_shadow = true;
  bool receives_shadow = true;
  glm::vec3 base_color{0.8f};  ///< linear
};

struct Camera {
  glm::dvec3 position{0.0, 0.0, 5.0};
  glm::dvec3 target{0.0};
  glm::dvec3 up{0.0, 1.0, 0.0};
  double yfov_deg = 45.0;  ///< full vertical angle
  double znear = 0.1, zfar = 1000.0;
  glm::uvec2 resolution{1024, 1024};
};

enum class LightType {
  spot,         ///< a flat disc of `radius` about `position`, facing `target`, shining into a square frustum
  directional,  ///< the sun: a cone of directions of `angular_radius_deg` about `direction`, everywhere
  point,        ///< a ball of `radius` about `position`, shining all around; a receiver sees the disc that faces it
};

enum class LightShape { disc, rectangle };

/// A picture that a light shows: how bright, and of which colour, its points are. Finite, not negative, not all black; linear.
struct LightTexture {
  std::string name;  ///< where it came from, for messages
  glm::uvec2 resolution{0, 0};
  std::vector<glm::vec3> texels;  ///< row-major, first row at the top (the frustum's up)
};

/// An area light. No falloff with distance: intensity is what a surface facing the light receives.
/// Which methods know a rectangle is said at MethodInfo::any_shape; the others throw InputError.
struct Light {
  std::string name;
  LightType type = LightType::spot;
  glm::dvec3 position{0.0, 5.0, 0.0};    ///< spot, point
  glm::dvec3 target{0.0};                ///< spot
  glm::dvec3 direction{0.0, -1.0, 0.0};  ///< directional: the way light travels, of any length
  std::optional<glm::dvec3> up = {};     ///< of a spot's frustum, a directional light's map; by default world +Y, or +Z where
                                         ///< the axis is within 8° of Y
  double radius = 0.1;                   ///< spot, point; 0: hard shadows
  double angular_radius_deg = 0.2665;    ///< directional; 0 <= angle < 45; by default the sun's
  double cone_deg = 60.0;                ///< spot: full angle of the square frustum, 0 < cone_deg < 175
  glm::vec3 color{1.0f};
  double intensity = 1.0;
  LightShape shape = LightShape::disc;
  glm::dvec2 size{0.0};  ///< of a rectangle: width and height, along the frustum's right and up; (0, 0) is a point
  /// On a rectangle: its points are as bright as this, times color and intensity. The light's visibility is then the fraction of
  /// its luminance that is seen, and `render` shades with the mean colour of what is seen. Null: all points alike.
  std::shared_ptr<const LightTexture> texture = nullptr;
};

std::string_view name_of(LightType type);  ///< as in scene files

/// One animated property, linear between keys, held before the first and after the last.
struct Track {
  /// "<mesh>.translation|rotation_deg|scale", "camera.position|target", "<light>.intensity", and of a light what it has of
  /// position, target, radius, size, direction and angular_radius_deg.
  std::string target;
  struct Key {
    double frame;
    glm::dvec3 value;  ///< scalars use x, sizes x and y
  };
  std::vector<Key> keys;  ///< ascending frames
};

struct Animation {
  int first_frame = 1, last_frame = 1;
  std::vector<Track> tracks;
};

struct Scene {
  std::string name;  ///< the file's stem
  std::vector<SceneMesh> meshes;
  Camera camera;
  std::vector<Light> lights;
  glm::vec3 ambient{0.0f};
  Animation animation;
};

/// Reads a light's texture. The library itself reads no pictures.
using LightTextureReader = std::function<std::shared_ptr<const LightTexture>(const std::filesystem::path& path)>;

/// Reads a scene file (JSON, see README) and the meshes it names, each once. Throws InputError, also for a light with a texture
/// where no reader is given.
Scene load_scene(const std::filesystem::path& path, const LightTextureReader& read_texture = {});

/// The scene with its animation tracks applied at `frame`.
Scene scene_at_frame(const Scene& scene, int frame);

/// Throws InputError for what no picture can be made of: a camera or light with no direction, angles, radii or resolutions out of
/// range, numbers that are not finite. `where` begins the message.
void validate(const Scene& scene, std::string_view where);

// --------------------------------------------------------------------------------------------------------------- device

/// One OpenCL device as `list_devices` sees it.
struct DeviceInfo {
  std::size_t index;             ///< counts through all platforms; Device::open takes it
  std::size_t platform, device;  ///< "P:D" for Device::open
  std::string platform_name, name, version, driver;
  unsigned compute_units;
  std::uint64_t memory_bytes, largest_buffer_bytes;
  bool is_cpu;
};

/// All OpenCL devices. Empty where there are none.
std::vector<DeviceInfo> list_devices();

/// An OpenCL device with its compiled kernels.
class Device {
 public:
  /// Opens a device of this machine with a context and queue of its own. `selector` is an index, "P:D", or part of a name;
  /// empty: the environment variable HALFSHADE_DEVICE, or else the first GPU, or else the first device.
  /// Throws InputError where nothing matches, with what is there, or what to install.
  static std::shared_ptr<Device> open(std::string_view selector);

  /// Works in the caller's context, on the caller's in-order queue, which is retained, and never finished or flushed by
  /// enqueue_visibility.
  static std::shared_ptr<Device> adopt(cl_context context, cl_command_queue queue);

  virtual ~Device() = default;
  virtual const DeviceInfo& info() const = 0;
  virtual cl_context context() const = 0;
  virtual cl_command_queue queue() const = 0;
};

/// Worker threads of CPU devices (PoCL). Only before the first OpenCL call of the process; 0 = all cores.
void set_cpu_threads(unsigned count);

// -------------------------------------------------------------------------------------------------------------- methods

enum class Method { hard, pcf, pcss, smoothies, penumbra_maps, fins, layered_fins, light_samples, exact };

/// From where in the penumbra to visibility. Each is 0 at 0 and 1 at 1.
enum class Falloff {
  linear,
  bernstein,  ///< 3x² − 2x³, Parker et al. as used by Wyman & Hansen §3
  sine,       ///< ½ − ½cos(πx), Chan & Durand §3.1
  disc,       ///< a straight edge across a disc, ½ + (asin u + u√(1−u²))/π with u = 2x − 1
};

/// Where on the light the sample points lie.
enum class SamplePattern {
  fixed,    ///< the same for every pixel: no noise, steps of 1/samples
  rotated,  ///< turned by an angle of each pixel's own
};

struct MethodInfo {
  Method method;
  std::string_view name;     ///< as on the command line
  std::string_view summary;  ///< one line
  std::string_view source;   ///< citation
  std::string_view options;  ///< names of the settings it uses, separated by spaces
  Falloff falloff;           ///< by default, for methods that heed it: the one with the least error
  Falloff faithful_falloff;  ///< the one of its paper
  bool any_shape = false;    ///< draws lights of every LightShape; methods without penumbra take their centre. Else discs alone
};

/// Every method, in the order of the report.
std::span<const MethodInfo> methods();
/// Throws InputError with the known names.
Method method_from_name(std::string_view name);
Falloff falloff_from_name(std::string_view name);
std::string_view name_of(Method method);
SamplePattern sample_pattern_from_name(std::string_view name);
std::string_view name_of(Falloff falloff);
std::string_view name_of(SamplePattern pattern);
const MethodInfo& info_of(Method method);

struct Settings {
  Method method = Method::smoothies;
  unsigned light_resolution_px = 1024;  ///< upper bound of the light map's sides; it is fitted to what casts and receives
  unsigned pcf_filter = 2;              ///< 2: 2×2 bilinear, 4: 4×4 bicubic B-spline (method pcf)
  unsigned pcss_taps = 32;              ///< look-ups of each of the two steps, 16 or 32 (method pcss)
  double smoothie_width = 0.0;  ///< Chan & Durand's t, in normalised device coordinates of the light's cone; 0: from the radius
  std::optional<Falloff> falloff = {};  ///< methods with a penumbra; by default the method's own, see chosen_falloff
  /// Of method layered_fins, 1 to 1024; by default as many as the depths of the scene's silhouettes call for, see chosen_layers.
  std::optional<unsigned> layers = {};
  /// Points of the light's disc: method light_samples, at least 1 (64 by default); method exact, 16, 64, 256 or 1024 (256).
  std::optional<unsigned> samples = {};
  bool faithful = false;  ///< as published, where this implementation knows better (see MethodInfo::options)
  SamplePattern sample_pattern = SamplePattern::fixed;  ///< method exact
  bool alias_free = false;  ///< decide every pixel by geometry, those far from any penumbra too (method exact)
};

/// The falloff that a method is drawn with: the one asked for, its paper's if faithful, else its best.
Falloff chosen_falloff(const Settings& settings);
/// The number of layers that layered_fins is drawn with: the one asked for, its paper's 16 if faithful, else none: chosen on the
/// device, 1 to 16, so that no layer is thicker than the depth within which silhouettes are taken for one caster's.
std::optional<unsigned> chosen_layers(const Settings& settings);
/// The number of samples that a method is drawn with.
unsigned chosen_samples(const Settings& settings);
/// Whether a light of this shape is drawn with these settings; where not, rendering throws InputError.
bool can_draw(const Settings& settings, const Light& light);

// ------------------------------------------------------------------------------------------------------------- renderer

/// A G-buffer on the device, row-major, first row at the top, one element a pixel.
struct GBuffer {
  glm::uvec2 resolution{0, 0};
  /// float: view-space z (distance along the view axis); not finite or <= 0 where nothing is seen. Or null, with `position`.
  cl_mem depth = nullptr;
  /// float4: world position xyz; w <= 0 where nothing is seen. Read where `depth` is null.
  cl_mem position = nullptr;
  /// float4: world-space unit geometric normal on the side that is seen; w = 0 where shadows are not received, else 1.
  cl_mem normal = nullptr;
  /// float4: linear base colour. Only for shading; null where `face` tells it.
  cl_mem base_color = nullptr;
  /// uint: the scene's triangle that is seen, counted through all meshes as the renderer holds them; 0xffffffff for none or
  /// unknown. Filled by enqueue_gbuffer; a caller's own G-buffer can do without.
  cl_mem face = nullptr;
};

/// A finished frame on the host. Planes are resolution.x · resolution.y elements.
struct Frame {
  glm::uvec2 resolution{0, 0};
  std::vector<glm::vec4> rgb;                  ///< shaded, linear; w = 1 where something is seen
  std::vector<std::vector<float>> visibility;  ///< one plane a light
  std::vector<glm::vec4> position_ws;          ///< w = 1 where something is seen
  std::vector<glm::vec4> normal_ws;
  std::vector<float> depth;  ///< view-space z, 0 where nothing is seen
};

/// A light's buffers on the host, in its light map: row-major, first row at the top (+y of light space). A face of a point light
/// looks along an axis of the world with +y up, or +z up along y.
struct LightBuffers {
  struct Plane {
    std::string name;  ///< "shadow_map.Z", "fin.Z", "fin.A"
    std::vector<float> values;
  };
  glm::uvec2 resolution{0, 0};
  /// Light map coordinates of the corner of texel (0,0). Of a directional light these are lengths, from the world's origin.
  glm::dvec2 lm_from_px_origin{0.0};
  double lm_from_px_scale = 0.0;   ///< light map units a texel; x grows right, y grows up
  double znear = 0.0, zfar = 0.0;  ///< light-space z; of a directional light, along its direction from the world's origin
  std::vector<Plane> planes;
};

/// Time of one stage, from OpenCL events.
struct StageTime {
  std::string stage;  ///< "<light or camera>/<kernel>"
  double time_ms;
};

/// Counts of the last frame.
struct FrameStats {
  /// Of a point light, the sums over its six faces, and the largest of their maps. Features are fins, or potential silhouettes of
  /// `exact`, which tiles refer to by blocks of as many as the device's vectors have lanes.
  struct PerLight {
    std::string name;
    std::uint32_t silhouette_edges = 0, features = 0, feature_tile_references = 0, triangle_tile_references = 0;
    glm::uvec2 light_map_px{0, 0};
    bool skipped = false;  ///< nothing casts in this light's reach
    /// Method exact: pixels where rounding made some depth complexity negative. A measure of numerical health: expected 0.
    std::uint32_t negative_pixels = 0;
  };
  std::uint32_t triangles = 0, vertices = 0, edges = 0;
  std::vector<PerLight> lights;
};

/// Scene in, visibility out. All work runs on the device; buffers are kept and reused between frames.
class Renderer {
 public:
  /// Compiles the kernels, or takes them from the cache.
  explicit Renderer(std::shared_ptr<Device> device);
  ~Renderer();
  Renderer(const Renderer&) = delete;
  Renderer& operator=(const Renderer&) = delete;

  /// Makes `scene` what is drawn next. Meshes seen before (same shared_ptr, same order) stay on the device; transforms, camera
  /// and lights cost next to nothing. Throws InputError as `validate`, DeviceError where the device has too little memory.
  void set_scene(const Scene& scene);

  /// Draws the G-buffer, every light's visibility and the shaded picture, and waits.
  void render(const Settings& settings);

  /// Enqueues the G-buffer from the scene's camera and returns it; it stays the renderer's and is valid until the next call
  /// or set_scene.
  GBuffer enqueue_gbuffer();

  /// Enqueues the visibility of one light over a G-buffer, ours or the caller's: every pass from meshes to the finished plane.
  /// `visibility`: float a pixel, one plane behind the other; plane number `plane` is written whole. `tints`, if not null, is for
  /// the colours of textured lights: float4 a pixel, one plane a light that has a texture, in the scene's order. This light's is
  /// written whole if it has one: where w = 1, xyz is how much of each channel of the whole light is seen (methods exact and
  /// light_samples, in penumbrae); where w = 0 it is as much of each, the visibility. The commands go to the device's queue
  /// after `wait`; nothing is read back, finished or flushed. `done`, if not null, receives an event that the caller releases.
  void enqueue_visibility(const GBuffer& gbuffer, std::size_t light, const Settings& settings, cl_mem visibility,
                          std::size_t plane = 0, cl_mem tints = nullptr, std::span<const cl_event> wait = {},
                          cl_event* done = nullptr);

  /// Enqueues shading of a G-buffer with one visibility plane a light, in the scene's order, into `rgb` (float4 a pixel, w = 1
  /// where something is seen). `tints`: of all textured lights as enqueue_visibility wrote them; null: each has its mean colour.
  void enqueue_shade(const GBuffer& gbuffer, cl_mem visibility, cl_mem rgb, cl_mem tints = nullptr);

  /// Copies of the last frame that `render` drew; waits.
  Frame read_frame();
  /// Of a point light, `face` is one of its six: +x, -x, +y, -y, +z, -z.
  LightBuffers read_light_buffers(std::size_t light, std::size_t face = 0);

  /// Stages of the last `render`, in order; empty where the queue was made without profiling.
  std::vector<StageTime> stage_times();
  FrameStats stats();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace halfshade
