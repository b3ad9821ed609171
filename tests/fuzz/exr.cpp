// An EXR file: as a light's texture, and as a picture to compare, with what it says of its lights.
#include "cli/light_metadata.hpp"
#include "fuzz.hpp"
#include "image/image_io.hpp"
#include "scene/picture_names.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const BytesAsFile file(data, size);
  refuse_or_do([&] { halfshade::read_light_texture(file.path()); });
  refuse_or_do([&] {
    const halfshade::ExrImage image = halfshade::read_exr(file.path());
    for (const std::string& channel : image.channel_names)
      if (const auto light = halfshade::light_of_channel(channel); !light.empty())
        halfshade::light_from_metadata(image, std::string(light), "picture");
  });
  return 0;
}
