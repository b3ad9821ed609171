// What each launch of this folder is given: a kernel with two buffers of different types and one scalar, and its arguments.
#pragma once

#include "halfshade/halfshade.hpp"

#include "device/launcher.hpp"
#include "kernels.hpp"

struct Given {
  halfshade::Launcher& launcher;
  halfshade::Blocks blocks;
  HsView view{};
  halfshade::Buffer<cl_ushort4> rects;
  halfshade::Buffer<cl_uint> cursors, refs;
  cl_uint capacity = 0;
};
