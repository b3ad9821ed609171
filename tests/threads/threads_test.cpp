// Several threads at once: devices and renderers of their own, or a device that they take turns with. A program of its own, so
// that scripts/threads.sh builds little of it with ThreadSanitizer.
#include <gtest/gtest.h>

#include <mutex>
#include <thread>
#include <vector>

#include "support/scenes.hpp"

namespace halfshade {
namespace {

Frame drawn(const std::shared_ptr<Device>& device, const Settings& settings) {
  Renderer renderer(device);
  renderer.set_scene(box_over_floor({64, 48}));
  renderer.render(settings);
  return renderer.read_frame();
}

TEST(Threads, FourWithTwoDevicesDrawWhatOneDraws) {
  const std::vector<Settings> all = {{.method = Method::exact, .light_resolution_px = 64, .samples = 16},
                                     {.method = Method::smoothies, .light_resolution_px = 64}};
  std::vector<Frame> expected, seen(4);
  for (const Settings& settings : all) expected.push_back(drawn(Device::open(""), settings));

  // Devices are opened at the same time, too. Each serves two threads, one at a time, with its own queue.
  struct Shared {
    std::mutex mutex;
    std::shared_ptr<Device> device;
  } shared[2];
  std::vector<std::thread> threads;
  for (unsigned i = 0; i < 4; ++i)
    threads.emplace_back([&, i] {
      Shared& mine = shared[i % 2];
      for (int round = 0; round < 5; ++round) {
        const std::lock_guard lock(mine.mutex);
        if (!mine.device) mine.device = Device::open("");
        seen[i] = drawn(mine.device, all[i / 2]);
      }
    });
  for (std::thread& thread : threads) thread.join();
  for (unsigned i = 0; i < 4; ++i) {
    EXPECT_EQ(seen[i].visibility, expected[i / 2].visibility) << i;
    EXPECT_EQ(seen[i].rgb, expected[i / 2].rgb) << i;
  }
}

}  // namespace
}  // namespace halfshade
