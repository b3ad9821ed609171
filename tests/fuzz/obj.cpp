// A mesh file: read, and its topology built.
#include "fuzz.hpp"
#include "scene/topology.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const BytesAsFile file(data, size);
  refuse_or_do([&] { halfshade::build_topology(halfshade::load_obj(file.path())); });
  return 0;
}
