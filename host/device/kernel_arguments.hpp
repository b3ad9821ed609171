// What the members of the generated kernel structs are made of. None can be left out and none converts: an argument that is
// missing, of another type or in another's place does not compile.
#pragma once

#include <concepts>
#include <string_view>

#include "base/shared.h"
#include "device/buffer.hpp"

namespace halfshade::kernels {

/// Which kernel, and the file of kernels/ that has it.
struct KernelName {
  std::string_view name, file;
};

/// An argument that is passed by value.
template <class T>
class Value {
 public:
  template <std::same_as<T> U>
  Value(const U& value) : value_(value) {}
  const T& argument() const { return value_; }

 private:
  T value_;
};

/// An argument that points to memory on the device. A buffer that is none is a null pointer.
template <class T>
class Global {
 public:
  template <class U>
  requires std::same_as<U, T> Global(const Buffer<U>& buffer) : memory_(buffer.memory()) {}
  const cl::Buffer& argument() const { return memory_; }

 private:
  cl::Buffer memory_;
};

}  // namespace halfshade::kernels
