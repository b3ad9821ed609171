#include "device/memory.hpp"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include "device/buffer.hpp"
#include "support/temp_folder.hpp"

namespace halfshade {
namespace {

TEST(Memory, LimitsOfTheProcessCount) {
  const MemoryAvailable all = memory_available();
  EXPECT_GT(all.bytes, std::uint64_t{1} << 20);
  EXPECT_LT(all.bytes, std::uint64_t{1} << 50);
  EXPECT_FALSE(all.limit.empty());

  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_DATA, &before), 0);
  rlimit low = before;
  low.rlim_cur = 4096;
  ASSERT_EQ(setrlimit(RLIMIT_DATA, &low), 0);
  const MemoryAvailable none = memory_available();
  ASSERT_EQ(setrlimit(RLIMIT_DATA, &before), 0);
  EXPECT_EQ(none.bytes, 0u);
  EXPECT_EQ(none.limit, "ulimit -d");
}

TEST(Memory, BuffersAreCountedAsLongAsTheyAreHeldAndRefusedBeyondWhatThereIs) {
  const auto device = std::dynamic_pointer_cast<DeviceImpl>(Device::open(""));
  ASSERT_TRUE(device);
  EXPECT_GT(device->memory_bytes, 0u);
  const std::uint64_t before = buffer_bytes_held();
  constexpr std::size_t mib = 1 << 20;
  {
    Buffer<cl_uchar> buffer;
    buffer.reserve(*device, 3 * mib, "bytes");
    EXPECT_EQ(buffer_bytes_held(), before + 3 * mib);
    device->memory_bytes = before + 5 * mib;
    device->memory_limit = "a test";
    Buffer<cl_uchar> other;
    expect_error<DeviceError>([&] { other.reserve(*device, 4 * mib, "more bytes"); },
                              {"more bytes", "needs 4 MiB", "there are", "a test", "lower the resolution"});
    EXPECT_FALSE(other);
    other.reserve(*device, 2 * mib, "fewer bytes");
    EXPECT_EQ(buffer_bytes_held(), before + 5 * mib);
  }
  EXPECT_EQ(buffer_bytes_held(), before);
}

}  // namespace
}  // namespace halfshade
