# cmake -D CXX=... -D FLAGS=... -D INCLUDES=a|b|... -D FILE=x.cpp -P run.cmake
#
# Compiles FILE and compares with its first line: "// expect: compiles", or "// expect: REGEX" for what the compiler must say as
# it refuses it, in its own words, not in excerpts of the source.
file(STRINGS ${FILE} expected LIMIT_COUNT 1)
string(REGEX REPLACE "^// expect: " "" expected "${expected}")
separate_arguments(flags UNIX_COMMAND "${FLAGS}")
string(REPLACE "|" ";" includes "${INCLUDES}")
list(TRANSFORM includes PREPEND "-I")
execute_process(
  COMMAND ${CXX} ${flags} -std=c++20 -Wall -Wextra -fsyntax-only ${includes} ${FILE}
  RESULT_VARIABLE result
  OUTPUT_VARIABLE said
  ERROR_VARIABLE said)
if(expected STREQUAL "compiles")
  if(NOT result EQUAL 0)
    message(FATAL_ERROR "${FILE}: expected it to compile; the compiler says:\n${said}")
  endif()
elseif(result EQUAL 0)
  message(FATAL_ERROR "${FILE}: expected it not to compile, but it does")
else()
  string(REGEX MATCHALL "(error|warning|note): [^\n]*" messages "${said}")
  if(NOT messages MATCHES "${expected}")
    message(FATAL_ERROR "${FILE}: expected the compiler to say '${expected}'; it says:\n${said}")
  endif()
endif()
