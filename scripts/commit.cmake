# cmake -D OUTPUT=commit.hpp -D FOLDER=source -P commit.cmake
#
# Writes which commit is being built; "+" where files differ from it, empty outside a repository. Touches OUTPUT only on change.
execute_process(COMMAND git -C ${FOLDER} describe --always --abbrev=10 --dirty=+ --exclude=* OUTPUT_VARIABLE commit
                OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
set(text "#define HALFSHADE_COMMIT \"${commit}\"\n")
set(before "")
if(EXISTS ${OUTPUT})
  file(READ ${OUTPUT} before)
endif()
if(NOT text STREQUAL before)
  file(WRITE ${OUTPUT} "${text}")
endif()
