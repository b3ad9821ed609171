# cmake -D OUTPUT=file.cpp -D FOLDER=kernels -P embed_kernels.cmake
#
# Writes FOLDER's *.h and *.cl into OUTPUT as byte arrays behind embedded_kernels() of host/embedded_kernels.hpp. Bytes rather
# than string literals: any content survives, and no compiler limit on a literal's length applies.
file(GLOB paths ${FOLDER}/*.h ${FOLDER}/*.cl)
list(SORT paths) # all in one folder, so this orders by name
set(arrays "")
set(entries "")
set(index 0)
foreach(path IN LISTS paths)
  get_filename_component(name ${path} NAME)
  file(READ ${path} hex HEX)
  string(REGEX REPLACE "(................................................................)" "\\1\n" hex "${hex}")
  string(REGEX REPLACE "([0-9a-f][0-9a-f])" "0x\\1," bytes "${hex}")
  # The closing 0 keeps an empty file's array legal; it is not part of the text.
  string(APPEND arrays "const unsigned char bytes_${index}[] = {\n${bytes}0};\n")
  string(APPEND entries "      {\"${name}\", text_of(bytes_${index}, sizeof(bytes_${index}) - 1)},\n")
  math(EXPR index "${index} + 1")
endforeach()
file(WRITE ${OUTPUT} "// Made by scripts/embed_kernels.cmake; changes are lost.
#include \"embedded_kernels.hpp\"

#include <array>
#include <cstddef>

namespace halfshade {
namespace {

${arrays}
std::string_view text_of(const unsigned char* bytes, std::size_t size) {
  return {reinterpret_cast<const char*>(bytes), size};
}

}  // namespace

std::span<const EmbeddedKernel> embedded_kernels() {
  static const std::array<EmbeddedKernel, ${index}> kernels{{
${entries}  }};
  return kernels;
}

}  // namespace halfshade
")
