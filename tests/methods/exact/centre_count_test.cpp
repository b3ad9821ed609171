// How many surfaces hide the light's centre, kernels/methods/exact/crossed_edges.h: lit_by_map against the nine texels around,
// and count_triangles against one triangle after the other.
#include <random>

#include "support/exact_stages.hpp"
#include "support/view_passes.hpp"

namespace halfshade {
namespace {

using CentreCount = ShapedKernelTest;
HS_IN_BOTH_SHAPES(CentreCount);

constexpr double radius = 0.5;

/// Counts for receivers of tile 0, all of which are asked for, in groups of as many as the shape has.
constexpr const char* count_source = R"(
__kernel void count_all(const HsView view, __global const float4* receivers, const int count, HS_ARGS_TRIANGLES, HS_ARGS_DISC_FACES,
                        __global const HsBlock* blocks, const uint slot_count, __global const ushort4* rects,
                        __global const uint* offsets, __global const uint* refs, const uint capacity, __global int* crossings_out) {
  const CasterFaces casters = {blocks,    slot_count,  rects,       offsets, refs,      capacity,
                               triangles, vertices_vs, vertices_px, planes,  disc_sides, touching};
  Batch batch;
  FacesBefore faces;
  int asking[HS_GROUP], crossings[HS_GROUP];
  for (int from = 0; from < count; from += HS_GROUP) {
    const int n = min(count - from, HS_GROUP);
    for (int i = 0; i < n; ++i) {
      const float4 p = receivers[from + i];
      batch.x[i] = p.x;
      batch.y[i] = p.y;
      batch.z[i] = p.z;
      batch.u[i] = p.x / p.z * view.px_from_q.x + view.px_from_q.y;
      batch.v[i] = p.y / p.z * view.px_from_q.z + view.px_from_q.w;
      asking[i] = n - 1 - i;
    }
    Region region;
    bound_region(&batch, 0, n, &region);
    faces.from = faces.to = 0;
    count_triangles(view, &casters, &batch, &region, 0, asking, n, 0, &faces, crossings);
    for (int i = 0; i < n; ++i) crossings_out[from + asking[i]] = crossings[i];
  }
})";

/// `capacity`: RefCapacity::none has every triangle's rectangle looked at instead of a list.
std::vector<cl_int> count_all(const KernelRunner& runner, const twins::Triangles& mesh, const std::vector<glm::dvec3>& receivers,
                              RefCapacity capacity = RefCapacity::enough) {
  // All of it in one tile.
  const unsigned tile_px = runner.device->tile_px;
  const HsView view = straight_view(*runner.device, {tile_px, tile_px}, 0.5f * tile_px, 0.125f, 50.0f);
  ViewPasses passes(runner, view, mesh_of(mesh));
  const auto count = static_cast<cl_uint>(mesh.corners.size());
  std::vector<cl_uint> all(count);
  for (cl_uint i = 0; i < count; ++i) all[i] = i;
  std::vector<cl_ushort4> rects(passes.slot_count);
  std::fill_n(rects.begin(), count, cl_ushort4{{0, 0, 1, 1}});
  std::vector<cl_float4> points;
  for (const glm::dvec3& p : receivers) points.push_back({{float(p.x), float(p.y), float(p.z), 0}});
  const kernels::args::DiscFaces faces = orient_to_disc(runner, mesh, radius);
  const Buffer<cl_int> crossings = runner.filled(receivers.size(), cl_int{-99});
  runner.run(runner.kernel_with("methods/exact/crossed_edges.h", count_source, "count_all"), cl::NDRange(1), cl::NDRange(1), view,
             runner.buffer<cl_float4>(points), static_cast<cl_int>(points.size()), passes.triangle_corners, passes.vertices_vs,
             passes.vertices_px, faces.planes.argument(), faces.disc_sides.argument(), faces.touching.argument(),
             passes.blocks.blocks, passes.slot_count, runner.buffer<cl_ushort4>(rects),
             runner.buffer<cl_uint>(std::vector<cl_uint>{0, count}), runner.buffer<cl_uint>(all),
             capacity == RefCapacity::enough ? count : cl_uint{0}, crossings);
  return runner.read<cl_int>(crossings, receivers.size());
}

/// Triangles of any size and winding; `behind`: some reach behind the light's plane.
twins::Triangles soup(std::mt19937& random, unsigned count, bool behind) {
  std::uniform_real_distribution<double> unit(-1, 1);
  twins::Triangles mesh;
  for (unsigned i = 0; i < count; ++i) {
    const double z = behind ? 1 + unit(random) : 4 + 2 * unit(random), size = i % 2 ? 0.3 : 1.5;
    const glm::dvec3 middle{0.2 * z * unit(random), 0.2 * z * unit(random), z};
    for (int k = 0; k < 3; ++k) {
      glm::dvec3 p = middle + size * glm::dvec3{unit(random), unit(random), unit(random)};
      if (!behind) p.z = std::max(p.z, 0.5);
      mesh.positions.push_back(p);
    }
    // Every order of the corners.
    glm::uvec3 corners(3 * i + i % 3, 3 * i + (i + 1) % 3, 3 * i + (i + 2) % 3);
    if (i % 2 == 1) std::swap(corners.x, corners.y);
    mesh.corners.push_back(corners);
  }
  return rounded(mesh);
}

std::vector<glm::dvec3> random_receivers(std::mt19937& random, std::size_t count) {
  std::uniform_real_distribution<double> unit(-1, 1);
  std::vector<glm::dvec3> receivers;
  for (std::size_t i = 0; i < count; ++i)
    receivers.push_back(glm::dvec3(glm::vec3{2 * unit(random), 2 * unit(random), 5 + 4 * unit(random)}));
  return receivers;
}

/// The same without the faces that touch the light, which are counted sample by sample.
twins::Triangles beside_the_light(const twins::Triangles& mesh) {
  twins::Triangles others = mesh;
  others.corners.clear();
  for (std::size_t t = 0; t < mesh.corners.size(); ++t)
    if (!twins::touches_disc(mesh, t, radius)) others.corners.push_back(mesh.corners[t]);
  return others;
}

TEST_P(CentreCount, CountsTheTrianglesBetweenTheReceiverAndTheCentre) {
  std::mt19937 random(41);
  for (const bool behind : {false, true}) {
    SCOPED_TRACE(behind);
    const twins::Triangles mesh = soup(random, 60, behind), counted = beside_the_light(mesh);
    EXPECT_EQ(counted.corners.size() < mesh.corners.size(), behind);
    const std::vector<glm::dvec3> receivers = random_receivers(random, 300);
    for (const RefCapacity capacity : {RefCapacity::enough, RefCapacity::none}) {
      const std::vector<cl_int> counts = count_all(runner_, mesh, receivers, capacity);
      std::size_t tested = 0, hidden = 0;
      for (std::size_t i = 0; i < receivers.size(); ++i) {
        const twins::Count expected = twins::surfaces_between(counted, receivers[i], glm::dvec3(0));
        if (expected.margin < 1e-5) continue;
        EXPECT_EQ(counts[i], expected.value) << i;
        ++tested;
        hidden += expected.value > 0;
      }
      EXPECT_GT(tested, 280u);
      EXPECT_GT(hidden, 30u);
    }
  }
}

TEST_P(CentreCount, NeighboursAgreeAboutTheEdgeTheyShare) {
  // A closed fan whose middle lies exactly before the centre: whichever triangles it is given to, it is one surface.
  twins::Triangles mesh;
  mesh.positions = {{0.5, 0.25, 2}, {1, 0, 2}, {0.5, 1, 2}, {0, 0.5, 2}, {-0.5, 0.25, 2}, {0, -0.5, 2}, {0.5, -0.5, 2}};
  for (unsigned i = 1; i < 7; ++i) mesh.corners.emplace_back(0, i, i % 6 + 1);
  std::vector<glm::dvec3> receivers;
  for (unsigned i = 1; i < 7; ++i)
    for (const double t : {0.0, 0.25, 0.5, 0.75})
      receivers.push_back(2.0 * (mesh.positions[0] + t * (mesh.positions[i] - mesh.positions[0])));
  EXPECT_EQ(count_all(runner_, mesh, receivers), std::vector<cl_int>(receivers.size(), 1));
}

// --------------------------------------------------------------------------------------------------------------- by the map

constexpr const char* map_source = R"(
__kernel void look_up(const HsView view, __global const float* shadow_map, __global const float* places, const int count,
                      __global int* results) {
  Batch batch;
  for (int i = 0; i < count; ++i) {
    batch.u[0] = places[5 * i];
    batch.v[0] = places[5 * i + 1];
    batch.plane_d[0] = places[5 * i + 2];
    batch.plane_dx[0] = places[5 * i + 3];
    batch.plane_dy[0] = places[5 * i + 4];
    results[i] = lit_by_map(view, shadow_map, &batch, 0);
  }
})";

TEST_P(CentreCount, TheMapDecidesWhereNothingIsNearOrSomethingIsClearlyBefore) {
  constexpr int size = 24;
  const HsView view = straight_view(*runner_.device, {size, size}, 32.0f);
  std::mt19937 random(42);
  std::uniform_real_distribution<float> place(0.01f, size - 0.01f), slope(-0.002f, 0.002f), one(0, 1);
  std::vector<float> map(size * size), places;
  for (std::size_t i = 0; i < map.size(); ++i) {
    const float kind = one(random);
    map[i] = kind < 0.8f    ? HS_EMPTY_Z
             : kind < 0.85f ? 9.0f
             : kind < 0.95f ? 2.0f
                            : 3.8f;  // nothing, behind, clearly before, near
  }
  const int count = 2000;
  for (int i = 0; i < count; ++i) {
    const float lean = i % 2 ? 1.0f : 0.0f;
    places.insert(places.end(), {place(random), place(random), 0.25f, lean * slope(random), lean * slope(random)});
  }
  const Buffer<cl_int> results = runner_.filled(count, cl_int{-1});
  runner_.run(runner_.kernel_with("methods/exact/crossed_edges.h", map_source, "look_up"), cl::NDRange(1), cl::NDRange(1), view,
              runner_.buffer<cl_float>(map), runner_.buffer<cl_float>(places), cl_int{count}, results);
  const auto got = runner_.read<cl_int>(results, count);
  std::size_t seen[3] = {0, 0, 0};
  for (int i = 0; i < count; ++i) {
    const float* at = &places[5 * static_cast<std::size_t>(i)];
    const int x = static_cast<int>(std::floor(at[0])), y = static_cast<int>(std::floor(at[1]));
    // 1: nothing stands before the receiver's plane in its texel or those around; 0: its own texel is clearly before, whatever
    // the surface does; 2: neither.
    int expected = 1;
    const double steep = std::abs(at[3]) + std::abs(at[4]);
    for (int v = std::max(y - 1, 0); v <= std::min(y + 1, size - 1); ++v)
      for (int u = std::max(x - 1, 0); u <= std::min(x + 1, size - 1); ++u) {
        const double plane = at[2] + at[3] * (u + 0.5 - at[0]) + at[4] * (v + 0.5 - at[1]);
        if (1.0 / map[v * size + u] > plane + steep / 64 + 4e-6 * at[2]) expected = 2;
      }
    if (expected == 2 && 1.0 / map[y * size + x] > 1.01 * at[2] + 2 * steep) expected = 0;
    ASSERT_EQ(got[i], expected) << i;
    ++seen[expected];
  }
  for (const std::size_t times : seen) EXPECT_GT(times, 50u);
}

}  // namespace
}  // namespace halfshade
