// expect: tile_cursor[^s]
#include "given.hpp"

void launch(const Given& given) {
  given.launcher.launch_blocks(given.blocks, halfshade::kernels::FillTriangles{.view = given.view,
                                                                               .blocks = given.blocks.blocks,
                                                                               .rects = given.rects,
                                                                               .tile_cursor = given.cursors,
                                                                               .refs = given.refs,
                                                                               .capacity = given.capacity});
}
