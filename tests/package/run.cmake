# cmake -D BUILD_DIR=... -D WORK_DIR=... -D CXX=... -D CXX_FLAGS=... -D VERSION=... -P run.cmake
#
# Installs the build into an empty folder, builds a user of it by find_package and by pkg-config, and runs both.
set(prefix ${WORK_DIR}/prefix)
set(scene ${CMAKE_CURRENT_LIST_DIR}/../../data/scenes/boxes.json)
file(REMOVE_RECURSE ${WORK_DIR})

function(run)
  execute_process(COMMAND ${ARGV} COMMAND_ECHO STDOUT COMMAND_ERROR_IS_FATAL ANY)
endfunction()

run(${CMAKE_COMMAND} --install ${BUILD_DIR} --prefix ${prefix})
run(${CMAKE_COMMAND} -S ${CMAKE_CURRENT_LIST_DIR} -B ${WORK_DIR}/build -G Ninja -D CMAKE_PREFIX_PATH=${prefix}
    -D CMAKE_CXX_COMPILER=${CXX} -D CMAKE_CXX_FLAGS=${CXX_FLAGS} -D HALFSHADE_VERSION=${VERSION})
run(${CMAKE_COMMAND} --build ${WORK_DIR}/build)
run(${WORK_DIR}/build/user ${scene})

file(GLOB_RECURSE pc ${prefix}/*/halfshade.pc)
get_filename_component(pc_folder ${pc} DIRECTORY)
execute_process(COMMAND ${CMAKE_COMMAND} -E env PKG_CONFIG_PATH=${pc_folder} pkg-config --cflags --libs "halfshade = ${VERSION}"
                OUTPUT_VARIABLE flags OUTPUT_STRIP_TRAILING_WHITESPACE COMMAND_ERROR_IS_FATAL ANY)
separate_arguments(flags UNIX_COMMAND "${CXX_FLAGS} -std=c++20 ${CMAKE_CURRENT_LIST_DIR}/main.cpp ${flags}")
run(${CXX} -o ${WORK_DIR}/pc_user ${flags})
run(${CMAKE_COMMAND} -E env LD_LIBRARY_PATH=${pc_folder}/.. ${WORK_DIR}/pc_user ${scene})
run(${prefix}/bin/halfshade --version)
