# turbidock_embed(OUTPUT ARRAY FILES...): OUTPUT, a C++ source, defines ARRAY, whose elements are the files' names
# and texts, as experiments/page/web_files.h declares it. Made anew when a file changes.
function(turbidock_embed output array)
  add_custom_command(OUTPUT ${output}
    COMMAND ${CMAKE_COMMAND} -DOUTPUT=${output} -DARRAY=${array} "-DFILES=${ARGN}"
            -P ${CMAKE_SOURCE_DIR}/cmake/embed.cmake
    DEPENDS ${ARGN} ${CMAKE_SOURCE_DIR}/cmake/embed.cmake VERBATIM)
endfunction()

if(NOT CMAKE_SCRIPT_MODE_FILE STREQUAL CMAKE_CURRENT_LIST_FILE)
  return()
endif()
list(LENGTH FILES count)
set(text "#include \"experiments/page/web_files.h\"\n\nnamespace turbidock::page {\n\nusing namespace std::string_view_literals;\n\n")
string(APPEND text "constexpr std::array<WebFile, ${count}> kFiles = {{\n")
foreach(file ${FILES})
  get_filename_component(name ${file} NAME)
  file(READ ${file} content)
  string(APPEND text "{\"${name}\", R\"turbidock_(${content})turbidock_\"sv},\n")
endforeach()
string(APPEND text "}};\n\nstd::span<const WebFile> ${ARRAY}() { return kFiles; }\n\n}  // namespace turbidock::page\n")
file(WRITE ${OUTPUT} "${text}")
