# cmake -D OUTPUT=file.cpp -D FOLDER=host/report/page -D D3=d3.min.js -P embed_report_page.cmake
#
# Puts style, script and the D3 library into the report's page, and the page into OUTPUT as bytes behind report_page_template() of
# host/report/report_page.hpp. What remains open in the page are the places of the report's own data.
file(READ ${FOLDER}/page.html page)
foreach(part IN ITEMS "page.css;${FOLDER}/page.css" "page.js;${FOLDER}/page.js" "d3.js;${D3}")
  list(GET part 0 name)
  list(GET part 1 path)
  file(READ ${path} text)
  string(FIND "${page}" "{{${name}}}" at)
  if(at EQUAL -1)
    message(FATAL_ERROR "${FOLDER}/page.html: expected a place for {{${name}}}")
  endif()
  string(REPLACE "{{${name}}}" "${text}" page "${page}")
endforeach()
file(WRITE ${OUTPUT}.html "${page}")
file(READ ${OUTPUT}.html hex HEX)
string(REGEX REPLACE "(................................................................)" "\\1\n" hex "${hex}")
string(REGEX REPLACE "([0-9a-f][0-9a-f])" "0x\\1," bytes "${hex}")
file(WRITE ${OUTPUT} "// Made by scripts/embed_report_page.cmake; changes are lost.
#include \"report/report_page.hpp\"

namespace halfshade {
namespace {

const unsigned char bytes[] = {
${bytes}0};

}  // namespace

std::string_view report_page_template() {
  return {reinterpret_cast<const char*>(bytes), sizeof(bytes) - 1};
}

}  // namespace halfshade
")
