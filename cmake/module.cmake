# turbidock_module(NAME FOLDER [SOURCES...] [PUBLIC...] [PRIVATE...] [OPTIONS...]): one static library and
# one namespace, turbidock::NAME, a module. SOURCES are all of the folder's unless they are listed.
#
# A module's headers are reached as "folder/file.h", through an include folder of its own that holds nothing
# but a link to that module. A target therefore sees only the modules that it links: a wrong include does not
# build.
function(turbidock_module name folder)
  cmake_parse_arguments(arg "" "" "SOURCES;PUBLIC;PRIVATE;OPTIONS" ${ARGN})
  if(NOT arg_SOURCES)
    file(GLOB arg_SOURCES CONFIGURE_DEPENDS ${CMAKE_SOURCE_DIR}/${folder}/*.cc)
  endif()
  add_library(turbidock_${name} STATIC ${arg_SOURCES})
  add_library(turbidock::${name} ALIAS turbidock_${name})
  set_target_properties(turbidock_${name} PROPERTIES EXPORT_NAME ${name} UNITY_BUILD ${TURBIDOCK_UNITY})

  set(view ${CMAKE_BINARY_DIR}/modules/${name})
  get_filename_component(parent ${view}/${folder} DIRECTORY)
  file(MAKE_DIRECTORY ${parent})
  file(CREATE_LINK ${CMAKE_SOURCE_DIR}/${folder} ${view}/${folder} SYMBOLIC)
  target_include_directories(turbidock_${name} PUBLIC
    $<BUILD_INTERFACE:${view}> $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}/turbidock>)

  list(TRANSFORM arg_PUBLIC REPLACE "^module:" "turbidock_")
  list(TRANSFORM arg_PRIVATE REPLACE "^module:" "turbidock_")
  target_link_libraries(turbidock_${name} PUBLIC ${arg_PUBLIC} PRIVATE ${arg_PRIVATE})
  # Fuzzers steer by the branches they reach. Readers are in experiments/; the numerical core would only be slower.
  if(TURBIDOCK_FUZZ AND folder MATCHES "^experiments/")
    list(APPEND arg_OPTIONS -fsanitize=fuzzer-no-link)
  endif()
  # All around the trial runs once a command, not once a frame: compiling it costs more than optimising it gains.
  # (Boost's long doubles in statistics, unless folded when compiled, end the program under valgrind.)
  if(folder MATCHES "^experiments/" AND NOT folder MATCHES "/(trial|media|search|statistics)$")
    list(APPEND arg_OPTIONS $<$<CONFIG:Release>:-O1>)
  endif()
  turbidock_compile_options(turbidock_${name})
  target_compile_options(turbidock_${name} PRIVATE ${arg_OPTIONS})
  turbidock_precompile(turbidock_${name} "${arg_OPTIONS}")
  set_property(GLOBAL APPEND PROPERTY turbidock_modules turbidock_${name})
endfunction()

# Precompiles what nearly every file includes. Targets with equal options share the work: it belongs to a target of its own,
# since what was compiled with definitions serves nobody without them. The clang build goes without
# (CMAKE_DISABLE_PRECOMPILE_HEADERS), and so does clang-tidy, so that a missing include is noticed.
function(turbidock_precompile target options)
  string(MAKE_C_IDENTIFIER "turbidock_precompiled${options}" owner)
  if(NOT TARGET ${owner})
    set(source ${CMAKE_BINARY_DIR}/generated/${owner}.cc)
    file(GENERATE OUTPUT ${source} CONTENT "")
    add_library(${owner} OBJECT ${source})
    target_link_libraries(${owner} PRIVATE Eigen3::Eigen nlohmann_json::nlohmann_json)
    turbidock_compile_options(${owner})
    target_compile_options(${owner} PRIVATE ${options})
    target_precompile_headers(${owner} PRIVATE
      <algorithm> <array> <cmath> <filesystem> <fstream> <functional> <map> <memory> <optional> <set> <sstream>
      <string> <vector> <Eigen/Core> <Eigen/Geometry> <nlohmann/json.hpp>)
  endif()
  target_precompile_headers(${target} REUSE_FROM ${owner})
endfunction()

function(turbidock_compile_options target)
  # No contraction into fused multiply-adds: the digest of a run must not depend on where the compiler
  # happens to see one.
  target_compile_options(${target} PRIVATE
    -Wall -Wextra -Wpedantic -Wshadow -Wnon-virtual-dtor -ffp-contract=off
    # GCC 12 sees overlaps, overflows and reads past the end inside std::string that are not there (bug 105651).
    "$<$<CXX_COMPILER_ID:GNU>:-Wno-restrict;-Wno-stringop-overflow;-Wno-stringop-overread;-Wno-array-bounds>"
    # The page's files are strings longer than the standard asks a compiler to take.
    $<$<CXX_COMPILER_ID:Clang>:-Wno-overlength-strings>
    $<$<BOOL:${TURBIDOCK_WERROR}>:-Werror>
    # Programs share the libraries' precompiled headers, so they are compiled alike.
    $<$<STREQUAL:$<TARGET_PROPERTY:TYPE>,EXECUTABLE>:-fPIC>)
  if(TURBIDOCK_SANITIZE)
    # GCC's own advice: instrumented code makes -Wmaybe-uninitialized see paths that are not there.
    target_compile_options(${target} PRIVATE $<$<CXX_COMPILER_ID:GNU>:-Wno-maybe-uninitialized>
      -fsanitize=${TURBIDOCK_SANITIZE} -fno-sanitize-recover=all -fno-omit-frame-pointer)
    # Eigen would allocate differently from libraries that were built without sanitizers, whose
    # matrices we free. Their malloc is aligned too.
    target_compile_definitions(${target} PRIVATE EIGEN_MALLOC_ALREADY_ALIGNED=1)
    # An index beyond a vector that it holds memory for, an optional without a value.
    target_compile_definitions(${target} PRIVATE _GLIBCXX_ASSERTIONS)
    if(TURBIDOCK_SANITIZE STREQUAL "thread")
      # ThreadSanitizer knows no fences; Asio's queues have mutexes as well.
      target_compile_definitions(${target} PRIVATE BOOST_ASIO_DISABLE_FENCED_BLOCK)
    endif()
    target_link_options(${target} PUBLIC -fsanitize=${TURBIDOCK_SANITIZE})
  endif()
endfunction()
