# cmake -D INCLUDE_DIR=... -D WORK_DIR=... -D CXX=... -P run.cmake
#
# Compiles users of the public header that include OpenCL's before it, after it, in any version, or not at all; and sees that an
# older C++ is told what the header needs, in one error of its own.
file(REMOVE_RECURSE ${WORK_DIR})
file(MAKE_DIRECTORY ${WORK_DIR})
set(ours "#include <halfshade/halfshade.hpp>\n")
set(use "std::size_t use(cl_mem plane, cl_event* done) { halfshade::GBuffer g; g.depth = plane; return g.depth ? sizeof *done : 0; }\n")

# Compiles `text` as `name`.cpp; `result` and `errors` are the compiler's.
function(compile name standard text)
  file(WRITE ${WORK_DIR}/${name}.cpp "${text}")
  execute_process(COMMAND ${CXX} -std=${standard} -Wall -Wextra -Werror -Wno-deprecated-declarations -fsyntax-only
                          -I${INCLUDE_DIR} ${WORK_DIR}/${name}.cpp
                  RESULT_VARIABLE result ERROR_VARIABLE errors)
  set(result ${result} PARENT_SCOPE)
  set(errors "${errors}" PARENT_SCOPE)
endfunction()

function(expect_compiles name text)
  compile(${name} c++20 "${text}")
  if(NOT result EQUAL 0)
    message(FATAL_ERROR "${name}.cpp: expected to compile:\n${errors}")
  endif()
  message(STATUS "${name}: compiles")
endfunction()

expect_compiles(alone "${ours}${use}")
foreach(version 120 300)
  set(hpp "#define CL_HPP_MINIMUM_OPENCL_VERSION ${version}\n#define CL_HPP_TARGET_OPENCL_VERSION ${version}\n#include <CL/opencl.hpp>\n")
  set(c "#define CL_TARGET_OPENCL_VERSION ${version}\n#include <CL/cl.h>\n")
  # What OpenCL's header declares for this version is there, whichever comes first.
  set(check "static_assert(CL_TARGET_OPENCL_VERSION == ${version});\n")
  expect_compiles(opencl_hpp_${version}_before "${hpp}${ours}${use}${check}")
  expect_compiles(opencl_hpp_${version}_after "${ours}${hpp}${use}${check}")
  expect_compiles(cl_h_${version}_before "${c}${ours}${use}${check}")
  expect_compiles(cl_h_${version}_after "${ours}${c}${use}${check}")
endforeach()

compile(older c++17 "${ours}")
string(REGEX MATCHALL "error: [^\n]*" lines "${errors}")
list(LENGTH lines count)
if(result EQUAL 0 OR NOT count EQUAL 1 OR NOT errors MATCHES "halfshade.hpp needs C\\+\\+20")
  message(FATAL_ERROR "older.cpp: expected one error, 'halfshade.hpp needs C++20' (found ${count}):\n${errors}")
endif()
message(STATUS "older: one error")
