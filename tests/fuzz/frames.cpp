// What --frames is given.
#include "cli/frame_files.hpp"
#include "fuzz.hpp"
#include "scene/limits.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text(reinterpret_cast<const char*>(data), size);
  if (text.find('\n') != text.npos) return 0;  // an argument is shown as it was given
  refuse_or_do([&] {
    const halfshade::FrameRange range = halfshade::frame_range(text, {});
    if (range.first < 0 || range.last < range.first || range.last > halfshade::limits::last_frame) std::abort();
  });
  return 0;
}
