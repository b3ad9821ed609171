// expect: (missing initializer|in implicit initialization) .*tile_cursors
#include "given.hpp"

void launch(const Given& given) {
  given.launcher.launch_blocks(given.blocks, halfshade::kernels::FillTriangles{.view = given.view,
                                                                               .blocks = given.blocks.blocks,
                                                                               .rects = given.rects,
                                                                               .refs = given.refs,
                                                                               .capacity = given.capacity});
}
