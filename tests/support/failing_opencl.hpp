// OpenCL calls that fail on demand: the test program has functions of their names, which call the loader's.
#pragma once

#include <CL/cl.h>

#include <string>

namespace halfshade {

/// Makes one OpenCL call of this program fail while it lives. Calls of the ICD loader's own, and those that release something,
/// are not counted.
class FailingCall {
 public:
  /// The n-th call from now on, the first being 1, returns `error`; only calls of the function `only` count, if one is given.
  explicit FailingCall(unsigned n, cl_int error = CL_OUT_OF_RESOURCES, std::string only = {});
  ~FailingCall();
  FailingCall(const FailingCall&) = delete;
  FailingCall& operator=(const FailingCall&) = delete;

  /// The function that failed; empty while none has.
  const std::string& failed() const;
};

}  // namespace halfshade
