// expect: (missing initializer|in implicit initialization) .*capacity
#include "given.hpp"

void launch(const Given& given) {
  given.launcher.launch_blocks(given.blocks, halfshade::kernels::FillTriangles{.view = given.view,
                                                                               .blocks = given.blocks.blocks,
                                                                               .rects = given.rects,
                                                                               .tile_cursors = given.cursors,
                                                                               .refs = given.refs});
}
