# turbidock_room(NAME FOLDER SOURCES... LINKS...): one static library a room.
#
# A room's headers are reached as "folder/file.h", through an include folder of its own that holds nothing
# but a link to that room. A target therefore sees only the rooms that it links: a wrong include does not
# build.
function(turbidock_room name folder)
  cmake_parse_arguments(arg "" "" "SOURCES;PUBLIC;PRIVATE" ${ARGN})
  add_library(turbidock_${name} STATIC ${arg_SOURCES})
  add_library(turbidock::${name} ALIAS turbidock_${name})
  set_target_properties(turbidock_${name} PROPERTIES EXPORT_NAME ${name})

  set(view ${CMAKE_BINARY_DIR}/rooms/${name})
  get_filename_component(parent ${view}/${folder} DIRECTORY)
  file(MAKE_DIRECTORY ${parent})
  file(CREATE_LINK ${CMAKE_SOURCE_DIR}/${folder} ${view}/${folder} SYMBOLIC)
  target_include_directories(turbidock_${name} PUBLIC
    $<BUILD_INTERFACE:${view}> $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}/turbidock>)

  target_link_libraries(turbidock_${name} PUBLIC ${arg_PUBLIC} PRIVATE ${arg_PRIVATE})
  turbidock_compile_options(turbidock_${name})
endfunction()

function(turbidock_compile_options target)
  # No contraction into fused multiply-adds: the digest of a run must not depend on where the compiler
  # happens to see one.
  target_compile_options(${target} PRIVATE
    -Wall -Wextra -Wpedantic -Wshadow -Wnon-virtual-dtor -ffp-contract=off
    -Wno-restrict  # GCC 12 sees overlaps in std::string's operator+ that are not there (bug 105651)
    $<$<BOOL:${TURBIDOCK_WERROR}>:-Werror>)
  if(TURBIDOCK_SANITIZE)
    # GCC's own advice: instrumented code makes -Wmaybe-uninitialized see paths that are not there.
    target_compile_options(${target} PRIVATE -Wno-maybe-uninitialized
      -fsanitize=${TURBIDOCK_SANITIZE} -fno-sanitize-recover=all -fno-omit-frame-pointer)
    # Eigen would allocate differently from libraries that were built without sanitizers, whose
    # matrices we free. Their malloc is aligned too.
    target_compile_definitions(${target} PRIVATE EIGEN_MALLOC_ALREADY_ALIGNED=1)
    target_link_options(${target} PUBLIC -fsanitize=${TURBIDOCK_SANITIZE})
  endif()
endfunction()
