#include "support/failing_opencl.hpp"

#include <dlfcn.h>

#include <mutex>
#include <stdexcept>
#include <string_view>

namespace halfshade {
namespace {

/// What is to fail.
struct Plan {
  std::mutex mutex;
  unsigned left = 0;  ///< calls until the one that fails; 0: none does
  cl_int error = CL_SUCCESS;
  std::string only, failed;
};

Plan& plan() {
  static Plan the_plan;
  return the_plan;
}

/// The error of this call, or CL_SUCCESS where it is to be made.
cl_int error_of_call(std::string_view function) {
  Plan& p = plan();
  const std::lock_guard lock(p.mutex);
  if (p.left == 0 || (!p.only.empty() && p.only != function) || --p.left > 0) return CL_SUCCESS;
  p.failed = function;
  return p.error;
}

template <class Function>
Function* loaders(const char* name) {
  void* found = dlsym(RTLD_NEXT, name);
  if (found == nullptr) throw std::logic_error(std::string("no OpenCL function ") + name);
  return reinterpret_cast<Function*>(found);
}

}  // namespace

FailingCall::FailingCall(unsigned n, cl_int error, std::string only) {
  Plan& p = plan();
  const std::lock_guard lock(p.mutex);
  p.left = n;
  p.error = error;
  p.only = std::move(only);
  p.failed.clear();
}

FailingCall::~FailingCall() {
  Plan& p = plan();
  const std::lock_guard lock(p.mutex);
  p.left = 0;
}

const std::string& FailingCall::failed() const {
  return plan().failed;
}

}  // namespace halfshade

// A call that returns its error, and one that returns an object and the error through its last argument.
#define HS_CALL(name, parameters, arguments)                                            \
  extern "C" CL_API_ENTRY cl_int CL_API_CALL name parameters {                          \
    static auto* const real = halfshade::loaders<decltype(name)>(#name);                \
    if (const cl_int error = halfshade::error_of_call(#name); error != 0) return error; \
    return real arguments;                                                              \
  }
#define HS_MAKER(type, name, parameters, arguments)                             \
  extern "C" CL_API_ENTRY type CL_API_CALL name parameters {                    \
    static auto* const real = halfshade::loaders<decltype(name)>(#name);        \
    if (const cl_int failure = halfshade::error_of_call(#name); failure != 0) { \
      if (error != nullptr) *error = failure;                                   \
      return nullptr;                                                           \
    }                                                                           \
    return real arguments;                                                      \
  }

HS_CALL(clGetPlatformIDs, (cl_uint n, cl_platform_id* ids, cl_uint* count), (n, ids, count))
HS_CALL(clGetPlatformInfo, (cl_platform_id of, cl_platform_info what, size_t n, void* to, size_t* size), (of, what, n, to, size))
HS_CALL(clGetDeviceIDs, (cl_platform_id of, cl_device_type type, cl_uint n, cl_device_id* ids, cl_uint* count),
        (of, type, n, ids, count))
HS_CALL(clGetDeviceInfo, (cl_device_id of, cl_device_info what, size_t n, void* to, size_t* size), (of, what, n, to, size))
HS_CALL(clGetContextInfo, (cl_context of, cl_context_info what, size_t n, void* to, size_t* size), (of, what, n, to, size))
HS_CALL(clGetCommandQueueInfo, (cl_command_queue of, cl_command_queue_info what, size_t n, void* to, size_t* size),
        (of, what, n, to, size))
HS_CALL(clGetMemObjectInfo, (cl_mem of, cl_mem_info what, size_t n, void* to, size_t* size), (of, what, n, to, size))
HS_CALL(clGetEventProfilingInfo, (cl_event of, cl_profiling_info what, size_t n, void* to, size_t* size), (of, what, n, to, size))
HS_CALL(clGetProgramBuildInfo, (cl_program of, cl_device_id on, cl_program_build_info what, size_t n, void* to, size_t* size),
        (of, on, what, n, to, size))
HS_CALL(clRetainMemObject, (cl_mem memory), (memory))
HS_CALL(clBuildProgram,
        (cl_program program, cl_uint n, const cl_device_id* devices, const char* options,
         void(CL_CALLBACK* notify)(cl_program, void*), void* data),
        (program, n, devices, options, notify, data))
HS_CALL(clSetKernelArg, (cl_kernel kernel, cl_uint index, size_t size, const void* value), (kernel, index, size, value))
HS_CALL(clEnqueueNDRangeKernel,
        (cl_command_queue queue, cl_kernel kernel, cl_uint dimensions, const size_t* offset, const size_t* global,
         const size_t* local, cl_uint n, const cl_event* wait, cl_event* event),
        (queue, kernel, dimensions, offset, global, local, n, wait, event))
HS_CALL(clEnqueueFillBuffer,
        (cl_command_queue queue, cl_mem memory, const void* pattern, size_t pattern_size, size_t offset, size_t size, cl_uint n,
         const cl_event* wait, cl_event* event),
        (queue, memory, pattern, pattern_size, offset, size, n, wait, event))
HS_CALL(clEnqueueCopyBuffer,
        (cl_command_queue queue, cl_mem from, cl_mem to, size_t from_offset, size_t to_offset, size_t size, cl_uint n,
         const cl_event* wait, cl_event* event),
        (queue, from, to, from_offset, to_offset, size, n, wait, event))
HS_CALL(clEnqueueReadBuffer,
        (cl_command_queue queue, cl_mem from, cl_bool blocking, size_t offset, size_t size, void* to, cl_uint n,
         const cl_event* wait, cl_event* event),
        (queue, from, blocking, offset, size, to, n, wait, event))
HS_CALL(clEnqueueBarrierWithWaitList, (cl_command_queue queue, cl_uint n, const cl_event* wait, cl_event* event),
        (queue, n, wait, event))
HS_CALL(clEnqueueMarkerWithWaitList, (cl_command_queue queue, cl_uint n, const cl_event* wait, cl_event* event),
        (queue, n, wait, event))
HS_CALL(clWaitForEvents, (cl_uint n, const cl_event* events), (n, events))
HS_CALL(clFinish, (cl_command_queue queue), (queue))

HS_MAKER(cl_context, clCreateContext,
         (const cl_context_properties* properties, cl_uint n, const cl_device_id* devices,
          void(CL_CALLBACK* notify)(const char*, const void*, size_t, void*), void* data, cl_int* error),
         (properties, n, devices, notify, data, error))
HS_MAKER(cl_command_queue, clCreateCommandQueue,
         (cl_context context, cl_device_id device, cl_command_queue_properties properties, cl_int* error),
         (context, device, properties, error))
HS_MAKER(cl_mem, clCreateBuffer, (cl_context context, cl_mem_flags flags, size_t size, void* host, cl_int* error),
         (context, flags, size, host, error))
HS_MAKER(cl_program, clCreateProgramWithSource,
         (cl_context context, cl_uint n, const char** texts, const size_t* sizes, cl_int* error),
         (context, n, texts, sizes, error))
HS_MAKER(cl_kernel, clCreateKernel, (cl_program program, const char* name, cl_int* error), (program, name, error))
