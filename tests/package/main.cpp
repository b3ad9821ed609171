// Uses something of each dependency of the library, so that a forgotten one fails to link. Needs no device.
#include <halfshade/halfshade.hpp>
#include <iostream>

int main(int argument_count, char** arguments) {
  if (argument_count != 2) return 2;
  const halfshade::Scene scene = halfshade::load_scene(arguments[1]);
  std::cout << halfshade::version() << ": " << scene.meshes.size() << " meshes, " << halfshade::list_devices().size()
            << " devices, " << halfshade::methods().size() << " methods\n";
  return scene.meshes.empty() ? 1 : 0;
}
