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
//   renderer.render({});
//   halfshade::Frame frame = renderer.read_frame();
//
// Words, spaces and units. Space suffixes: _ws world, _vs view (x right, y up, z forward from the camera), _ls light (x right,
// y up, z forward along the light's axis), _px pixels or texels; lengths are in the scene's unit, angles carry _deg. Image planes
// are row-major with the first row at the top. Visibility is the fraction of the light's area that a point sees, 0..1.
//
// Errors are exceptions: InputError for what the caller or a file got wrong, DeviceError where the work itself failed.
// Thread safety: a Device and its Renderers belong to one thread at a time.
#pragma once

#if defined(_MSVC_LANG)
#define HALFSHADE_CPLUSPLUS _MSVC_LANG
#else
#define HALFSHADE_CPLUSPLUS __cplusplus
#endif
#if HALFSHADE_CPLUSPLUS < 202002L
#error "halfshade.hpp needs C++20: compile with -std=c++20 (MSVC: /std:c++20)"
#else
#undef HALFSHADE_CPLUSPLUS

#include <cstdint>
#include <filesystem>
#include <functional>
#include <glm/glm.hpp>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

// OpenCL's handles, as CL/cl.h declares them: its headers may come before this one or after it, for any version of OpenCL.
typedef struct _cl_context* cl_context;
typedef struct _cl_command_queue* cl_command_queue;
typedef struct _cl_mem* cl_mem;
typedef struct _cl_event* cl_event;

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

/// A mesh placed in the scene.
struct SceneMesh {
  std::string name;                  ///< no two meshes or lights of a scene have the same
  std::shared_ptr<const Mesh> mesh;  ///< never null
  /// From the mesh's own space (positions + Mesh::origin) to the world, applied to columns: affine, finite and invertible.
  glm::dmat4 world_from_mesh{1.0};
  bool casts_shadow = true;     ///< it hides lights from others and from itself
  bool receives_shadow = true;  ///< else visibility is 1 on it
  glm::vec3 base_color{0.8f};   ///< linear
};

/// How scene files and animations place a mesh: scaled, then rotated about the fixed x, y and z axes, in this order, then moved.
struct Placement {
  glm::dvec3 translation{0.0};   ///< in the scene's unit
  glm::dvec3 rotation_deg{0.0};  ///< right-handed, about x, y and z
  glm::dvec3 scale{1.0};         ///< along x, y and z; not 0
};

/// world_from_mesh of a placement: T · Rz·Ry·Rx · S.
glm::dmat4 matrix_of(const Placement& placement);

/// A pinhole camera with square pixels.
struct Camera {
  glm::dvec3 position{0.0, 0.0, 5.0};  ///< world
  glm::dvec3 target{0.0};              ///< world: what is seen in the middle
  glm::dvec3 up{0.0, 1.0, 0.0};        ///< world: upwards in the picture, of any length
  double yfov_deg = 45.0;              ///< full vertical angle
  double znear = 0.1;                  ///< view-space z from which on something is seen, > 0
  double zfar = 1000.0;                ///< view-space z beyond which nothing is seen
  glm::uvec2 resolution{1024, 1024};   ///< pixels, width and height
};

/// The kinds of lights, named in scene files as here. Each is declared in a file of its own, host/light/<kind>.cpp.
///   spot         a flat disc or rectangle about `position`, facing `target`, shining into a square frustum of `cone_deg`
///   directional  a cone of directions of `angular_radius_deg` about `direction`, the same everywhere: the sun
///   point        a sphere of `radius` about `position`, shining in all directions; a receiver sees the disc that faces it
#define HALFSHADE_LIGHT_TYPES(entry) entry(spot) entry(directional) entry(point)

/// What a flat light looks like, named in scene files as here.
///   disc         of `radius`
///   rectangle    of `size`; it may show a `texture`. Of spots alone
#define HALFSHADE_LIGHT_SHAPES(entry) entry(disc) entry(rectangle)

#define HALFSHADE_ENUMERATOR(name) name,
/// What kind a light is of: see HALFSHADE_LIGHT_TYPES.
enum class LightType { HALFSHADE_LIGHT_TYPES(HALFSHADE_ENUMERATOR) };
/// What shape a light has: see HALFSHADE_LIGHT_SHAPES.
enum class LightShape { HALFSHADE_LIGHT_SHAPES(HALFSHADE_ENUMERATOR) };
#undef HALFSHADE_ENUMERATOR

/// A picture that a light shows: how bright, and of which colour, its points are. Finite, not negative, not all black; linear.
struct LightTexture {
  std::string name;               ///< where it came from, for messages
  glm::uvec2 resolution{0, 0};    ///< texels, width and height
  std::vector<glm::vec3> texels;  ///< row-major, first row at the top (the frustum's up)
};

/// An area light. No falloff with distance: intensity is what a surface facing the light receives.
/// Which methods know a rectangle is said at MethodInfo::any_shape; the others throw InputError.
struct Light {
  std::string name = {};                 ///< letters, digits, _ and -, at most 246: it becomes part of image channel names
  LightType type = LightType::spot;      ///< which of the members below count
  glm::dvec3 position{0.0, 5.0, 0.0};    ///< spot, point
  glm::dvec3 target{0.0};                ///< spot
  glm::dvec3 direction{0.0, -1.0, 0.0};  ///< directional: in which the light travels, of any length
  std::optional<glm::dvec3> up = {};     ///< of a spot's frustum, a directional light's map; by default world +Y, or +Z where
                                         ///< the axis is within 8° of Y
  double radius = 0.1;                   ///< spot, point; 0: hard shadows
  double angular_radius_deg = 0.2665;    ///< directional; 0 <= angle < 45; by default the sun's
  double cone_deg = 60.0;                ///< spot: full angle of the square frustum, 0 < cone_deg < 175
  glm::vec3 color{1.0f};                 ///< linear
  double intensity = 1.0;                ///< times color, both at most 1e9: what a surface that faces the light receives
  LightShape shape = LightShape::disc;   ///< of spots; others are discs
  glm::dvec2 size{0.0};  ///< of a rectangle: width and height, along the frustum's right and up; (0, 0) is a point
  /// On a rectangle: its points are as bright as this, times color and intensity. The light's visibility is then the fraction of
  /// its luminance that is seen, and `render` shades with the mean colour of what is seen. Null: all points alike.
  std::shared_ptr<const LightTexture> texture = nullptr;
};

/// As in scene files. Throw InputError for what is none of the enumerators.
std::string_view name_of(LightType type);
std::string_view name_of(LightShape shape);  ///< as in scene files

/// One animated property, linear between keys, held before the first and after the last.
struct Track {
  /// "<mesh>.translation|rotation_deg|scale" of a mesh that has a placement (see Animation), "camera.position|target",
  /// "<light>.intensity", and of a light what it has of position, target, radius, size, direction and angular_radius_deg.
  std::string target;
  /// A value at a frame.
  struct Key {
    double frame;      ///< need not be whole
    glm::dvec3 value;  ///< scalars use x, sizes x and y
  };
  std::vector<Key> keys;  ///< ascending frames
};

/// What moves, and over which frames.
struct Animation {
  int first_frame = 1;        ///< of the range that is rendered by default, from -1,000,000 to 1,000,000
  int last_frame = 1;         ///< the last of the range
  std::vector<Track> tracks;  ///< at most one a target
  /// Of the meshes that tracks move, by name: what scene_at_frame makes their world_from_mesh of. load_scene fills it.
  std::map<std::string, Placement, std::less<> > placements;
};

/// What is drawn.
struct Scene {
  std::string name;               ///< the file's stem
  std::vector<SceneMesh> meshes;  ///< what casts and receives
  Camera camera;                  ///< what the G-buffer is drawn from
  std::vector<Light> lights;      ///< each has a visibility plane of its own
  glm::vec3 ambient{0.0f};        ///< linear; added to what lights give, times base colour
  Animation animation;            ///< see scene_at_frame
};

/// Reads a light's texture. The library itself reads no pictures.
using LightTextureReader = std::function<std::shared_ptr<const LightTexture>(const std::filesystem::path& path)>;

/// Which files a scene file may name. Those of its own folder and below, or, where some folder above holds a file
/// `.halfshade-root`, those of the nearest such folder and below; and what packages have installed in /usr/share. Links are
/// followed first. Or any: for scene files whose origin is trusted.
enum class ScenePaths { inside, anywhere };

/// Reads a scene file (JSON, see README) and the meshes it names, each once. Throws InputError, also for a light with a texture
/// where no reader is given, and for a path that leads to where it may not.
Scene load_scene(const std::filesystem::path& path, const LightTextureReader& read_texture = {},
                 ScenePaths allowed = ScenePaths::inside);

/// The scene with its animation tracks applied at `frame`. Throws InputError for a track whose target the scene does not have.
Scene scene_at_frame(const Scene& scene, int frame);

/// Throws InputError for what no picture can be made of: a camera or light with no direction, angles, radii or resolutions out of
/// range, a matrix that is singular or not affine, numbers that are not finite. `where` begins the message, which names the
/// place.
void validate(const Scene& scene, std::string_view where);

// --------------------------------------------------------------------------------------------------------------- device

/// One OpenCL device as `list_devices` sees it.
struct DeviceInfo {
  std::size_t index;                   ///< counts through all platforms; Device::open takes it
  std::size_t platform;                ///< its number
  std::size_t device;                  ///< "P:D" for Device::open
  std::string platform_name;           ///< CL_PLATFORM_NAME
  std::string name;                    ///< CL_DEVICE_NAME
  std::string version;                 ///< CL_DEVICE_VERSION
  std::string driver;                  ///< CL_DRIVER_VERSION
  unsigned compute_units;              ///< CL_DEVICE_MAX_COMPUTE_UNITS
  std::uint64_t memory_bytes;          ///< CL_DEVICE_GLOBAL_MEM_SIZE
  std::uint64_t largest_buffer_bytes;  ///< CL_DEVICE_MAX_MEM_ALLOC_SIZE
  bool is_cpu;                         ///< its type says CPU
  /// The shape of its kernels: wide (vectors, a work-item a tile) where a CPU device says that it computes in vectors of floats,
  /// else narrow (a work-item a texel). The environment variable HALFSHADE_KERNEL_SHAPE, `wide` or `narrow`, overrules.
  bool has_wide_kernels;
};

/// All OpenCL devices. Empty where there are none.
std::vector<DeviceInfo> list_devices();

/// An OpenCL device with its compiled kernels.
class Device {
 public:
  /// Opens a device of this machine with a context and queue of its own. `selector` is an index, "P:D", or part of a name;
  /// empty: the environment variable HALFSHADE_DEVICE, or else the first GPU, or else the first device with wide kernels, or
  /// else the first device.
  /// Throws InputError where nothing matches, with what is there, or what to install.
  static std::shared_ptr<Device> open(std::string_view selector);

  /// Works in the caller's context, on the caller's in-order queue, which is retained, and never finished or flushed by
  /// enqueue_visibility.
  static std::shared_ptr<Device> adopt(cl_context context, cl_command_queue queue);

  virtual ~Device() = default;
  virtual const DeviceInfo& info() const = 0;  ///< as list_devices tells it
  virtual cl_context context() const = 0;      ///< the device's, not retained
  virtual cl_command_queue queue() const = 0;  ///< where all commands go, in order; not retained
};

/// Worker threads of CPU devices (PoCL). Only before the first OpenCL call of the process; 0 = all cores.
void set_cpu_threads(unsigned count);

// -------------------------------------------------------------------------------------------------------------- methods

/// Every method, in the order of the report. One line a method: the enumerator, and what host/methods/registry.cpp looks for.
#define HALFSHADE_METHODS(entry)                                                                     \
  entry(hard)              /* shadow map, nearest texel */                                           \
      entry(pcf)           /* shadow map, filtered comparisons */                                    \
      entry(pcss)          /* shadow map, filtered as widely as the blockers' mean depth asks for */ \
      entry(smoothies)     /* outer penumbra, minimum alpha */                                       \
      entry(penumbra_maps) /* outer penumbra, cones and sheets */                                    \
      entry(fins)          /* inner and outer penumbra */                                            \
      entry(layered_fins)  /* the same, layer by layer of depth */                                   \
      entry(light_samples) /* the mean of hard shadows from points of the light */                   \
      entry(exact)         /* the light's sample points counted as rays would, by crossed silhouettes */

#define HALFSHADE_ENUMERATOR(name) name,
/// How shadows are computed: see HALFSHADE_METHODS and methods().
enum class Method { HALFSHADE_METHODS(HALFSHADE_ENUMERATOR) };
#undef HALFSHADE_ENUMERATOR

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

/// A method as `halfshade methods` lists it.
struct MethodInfo {
  Method method;                ///< itself
  std::string_view name;        ///< as on the command line
  std::string_view summary;     ///< one line
  std::string_view source;      ///< citation
  std::string_view exact_when;  ///< where its penumbra is right, as in Table 1 of Hasenfratz et al. 2003
  std::string_view receivers;   ///< what it can cast shadows on
  std::string_view time;        ///< what its time grows with
  Falloff falloff;              ///< by default, for methods that use one: the one with the least error
  Falloff faithful_falloff;     ///< the one of its paper
  bool any_shape = false;  ///< draws lights of every LightShape; methods without penumbra take their centre. Else discs alone
  std::string_view options = {};  ///< names of the options that it uses, separated by spaces
};

/// Every method, in the order of the report.
std::span<const MethodInfo> methods();
/// Throws InputError with the known names.
Method method_from_name(std::string_view name);
/// Throws InputError with the known names.
Falloff falloff_from_name(std::string_view name);
/// Throws InputError with the known names.
SamplePattern sample_pattern_from_name(std::string_view name);
std::string_view name_of(Method method);          ///< as on the command line
std::string_view name_of(Falloff falloff);        ///< as on the command line
std::string_view name_of(SamplePattern pattern);  ///< as on the command line
/// Throws InputError for what is none of the enumerators.
const MethodInfo& info_of(Method method);

/// How shadows are computed. A method ignores what it does not use (MethodInfo::options).
struct Settings {
  Method method = Method::exact;        ///< the one whose error is noise alone, by default
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

/// A G-buffer on the device, row-major, first row at the top, one element a pixel. Its size is its own: it need not be the scene
/// camera's resolution.
struct GBuffer {
  glm::uvec2 resolution{0, 0};  ///< pixels, width and height
  /// float: view-space z (distance along the view axis) of the scene's camera, whose vertical field of view spans the rows and
  /// whose pixels are square; not finite or <= 0 where nothing is seen. Or null, with `position`.
  cl_mem depth = nullptr;
  /// float4: world position xyz, from any camera or none; w <= 0 where nothing is seen. Read where `depth` is null.
  cl_mem position = nullptr;
  /// float4: world-space unit geometric normal on the side that is seen; w = 0 where shadows are not received, else 1.
  cl_mem normal = nullptr;
  /// float4: linear base colour. Only for shading; null where `face` tells it.
  cl_mem base_color = nullptr;
  /// uint: the scene's triangle that is seen, counted through all meshes as the renderer holds them; 0xffffffff for none or
  /// unknown. Filled by enqueue_gbuffer; a caller's own G-buffer can do without.
  cl_mem face = nullptr;
  /// How far a receiver may lie off its own surface, in the scene's unit, beside the rounding of its coordinates: receivers are
  /// lifted by it along their normals, or surfaces as near as that are taken for their own. 0: for depths what rasterizers cost,
  /// 1/256 of a pixel; for positions, wherever the scene's camera is, 1e-5 of the distance from the light (of the scene's extent
  /// along a directional light), or 1/128 of that distance over the rows of the G-buffer if that is more.
  double tolerance = 0.0;
};

/// A finished frame on the host. Planes are resolution.x · resolution.y elements.
struct Frame {
  glm::uvec2 resolution{0, 0};                  ///< pixels, width and height
  std::vector<glm::vec4> rgb;                   ///< shaded, linear; w = 1 where something is seen
  std::vector<std::vector<float> > visibility;  ///< one plane a light
  std::vector<glm::vec4> position_ws;           ///< w = 1 where something is seen
  std::vector<glm::vec4> normal_ws;             ///< unit geometric normals on the side that is seen, w = 0
  std::vector<float> depth;                     ///< view-space z, 0 where nothing is seen
};

/// A light's buffers on the host, in its light map: row-major, first row at the top (+y of light space). A face of a point light
/// looks along an axis of the world with +y up, or +z up along y.
struct LightBuffers {
  /// One of them.
  struct Plane {
    std::string name;           ///< "shadow_map.Z", "fin.Z", "fin.A"
    std::vector<float> values;  ///< one a texel
  };
  glm::uvec2 resolution{0, 0};  ///< texels, width and height; 0 where nothing casts
  /// Light map coordinates of the corner of texel (0,0). Of a directional light these are lengths, from the world's origin.
  glm::dvec2 lm_from_px_origin{0.0};
  double lm_from_px_scale = 0.0;  ///< light map units a texel; x grows right, y grows up
  double znear = 0.0;             ///< light-space z; of a directional light, along its direction from the world's origin
  double zfar = 0.0;              ///< the same
  std::vector<Plane> planes;      ///< the shadow map, and what the method keeps beside it
};

/// Time of one stage, from OpenCL events.
struct StageTime {
  std::string stage;  ///< "<light or camera>/<kernel>"
  double time_ms;     ///< from its start to its end on the device
};

/// Counts of the last frame.
struct FrameStats {
  /// Of a point light, the sums over its six faces, and the largest of their maps. Features are fins, or potential silhouettes of
  /// `exact`, which tiles refer to by blocks of as many as the device's vectors have lanes.
  struct PerLight {
    std::string name;                            ///< the light's
    std::uint32_t silhouette_edges = 0;          ///< for methods that classify edges
    std::uint32_t features = 0;                  ///< what FrameStats::features_name says
    std::uint32_t feature_tile_references = 0;   ///< of features in tiles
    std::uint32_t triangle_tile_references = 0;  ///< of triangles in tiles
    glm::uvec2 light_map_px{0, 0};               ///< size of its map
    bool skipped = false;                        ///< nothing casts in this light's reach
    /// Of methods that count depth complexity: pixels where rounding made some of it negative. Expected 0.
    std::optional<std::uint32_t> negative_pixels = {};
  };
  std::string_view features_name;  ///< what `features` counts: "fins", "edge records"; empty for methods without
  std::uint32_t triangles = 0;     ///< of all meshes
  std::uint32_t vertices = 0;      ///< of all meshes
  std::uint32_t edges = 0;         ///< of all meshes
  std::vector<PerLight> lights;    ///< in the scene's order; empty before a frame is rendered
};

/// What enqueue_visibility is asked for.
struct VisibilityRequest {
  const GBuffer& gbuffer;  ///< read during the call alone; its buffers until the commands are done
  std::size_t light = 0;   ///< of the scene
  Settings settings = {};  ///< checked as `render` does
  /// float a pixel, one plane behind the other; plane number `plane` is written whole.
  cl_mem visibility = nullptr;
  std::size_t plane = 0;  ///< which plane of `visibility`
  /// Null, or where the colours of textured lights go: float4 a pixel, one plane a light that has a texture, in the scene's
  /// order. This light's is written whole if it has one: where w = 1, xyz is how much of each channel of the whole light is seen
  /// (methods exact and light_samples, in penumbrae); where w = 0 it is as much of each, the visibility.
  cl_mem tints = nullptr;
  std::span<const cl_event> wait = {};  ///< the commands go to the device's queue after these
  cl_event* done = nullptr;             ///< if not null, receives an event that the caller releases
};

/// What enqueue_shade is asked for.
struct ShadeRequest {
  const GBuffer& gbuffer;       ///< with base_color or face
  cl_mem visibility = nullptr;  ///< float a pixel, one plane a light, in the scene's order
  cl_mem rgb = nullptr;         ///< receives float4 a pixel, linear; w = 1 where something is seen
  cl_mem tints = nullptr;       ///< of all textured lights, as enqueue_visibility wrote them; null: each has its mean colour
};

/// Scene in, visibility out. All work runs on the device; buffers are kept and reused between frames.
///
/// While enqueued work is pending it is safe to call set_scene, with other transforms, lights, cameras or meshes, and to enqueue
/// more: commands keep what they were enqueued with, and the queue's order keeps buffers apart. A caller's own buffers must stay
/// as they are until the commands that read them are done.
///
/// Where OpenCL fails, a call throws DeviceError and leaves scene, buffers and kernels so that the same call, made again, does
/// what it would have done. A `render` that began to draw has no frame to read until one has been drawn; what enqueue_visibility
/// and enqueue_shade were to write is undefined then.
class Renderer {
 public:
  /// Kernels are compiled, or taken from the cache, when they are first needed.
  explicit Renderer(std::shared_ptr<Device> device);
  ~Renderer();
  Renderer(const Renderer&) = delete;
  Renderer& operator=(const Renderer&) = delete;

  /// Makes `scene` what is drawn next. Meshes seen before (same shared_ptr, same order) stay on the device; transforms, camera
  /// and lights cost next to nothing. Throws InputError as `validate`, DeviceError where the device has too little memory; the
  /// scene of before then stays.
  void set_scene(const Scene& scene);

  /// Draws the G-buffer, every light's visibility and the shaded picture, and waits. Where there is too little memory it throws
  /// DeviceError; for what the settings get wrong, InputError.
  void render(const Settings& settings);

  /// Enqueues the G-buffer from the scene's camera and returns it; it stays the renderer's and is valid until the next call
  /// or set_scene.
  GBuffer enqueue_gbuffer();

  /// Enqueues the visibility of one light over a G-buffer, ours or the caller's: every pass from meshes to the finished plane.
  /// Nothing is read back, finished or flushed. Throws InputError for what the request gets wrong (no scene, no such light,
  /// settings out of range, a buffer that is too small, an image or of another context), before anything is enqueued.
  void enqueue_visibility(const VisibilityRequest& request);

  /// Enqueues shading of a G-buffer. Throws as enqueue_visibility.
  void enqueue_shade(const ShadeRequest& request);

  /// Copies of the last frame that `render` drew; waits.
  Frame read_frame();
  /// Of a point light, `face` is one of its six: +x, -x, +y, -y, +z, -z.
  LightBuffers read_light_buffers(std::size_t light, std::size_t face = 0);

  /// Stages of the last frame that `render` drew, in order; empty where the queue was made without profiling, or none was drawn.
  std::vector<StageTime> stage_times();
  /// Counts of the last frame that `render` drew; waits for nothing else.
  FrameStats stats();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace halfshade

#endif  // C++20
