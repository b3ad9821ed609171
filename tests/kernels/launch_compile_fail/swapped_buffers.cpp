// expect: Buffer<(unsigned int|cl_uint)>.* to .*Global<cl_ushort4>
#include "given.hpp"

void launch(const Given& given) {
  given.launcher.launch_blocks(given.blocks, halfshade::kernels::FillTriangles{.view = given.view,
                                                                               .blocks = given.blocks.blocks,
                                                                               .rects = given.cursors,
                                                                               .tile_cursors = given.rects,
                                                                               .refs = given.refs,
                                                                               .capacity = given.capacity});
}
