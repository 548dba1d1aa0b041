# `cmake --install` and find_package(turbidock): the executable, the modules as libraries with their headers,
# and the data.
include(CMakePackageConfigHelpers)

get_property(modules GLOBAL PROPERTY turbidock_modules)
install(TARGETS ${modules} EXPORT turbidock ARCHIVE COMPONENT library)

# The public headers: a trial, estimators and controllers of one's own, the estimator on one's own images, a batch. What they
# include comes along, all else stays inside.
set(headers experiments/trial/trial.h experiments/trial/plugin_of.h vision/rm_ga.h vision/undistort.h
  vision/fiducial_estimator.h control/autopilot.h)
if(TURBIDOCK_PROGRAM)
  install(TARGETS turbidock EXPORT turbidock RUNTIME COMPONENT program)
  list(APPEND headers experiments/app/main.h experiments/batch/batch.h experiments/batch/plan.h)
endif()
set(installed "")
while(headers)
  list(POP_FRONT headers header)
  if(NOT header IN_LIST installed)
    list(APPEND installed ${header})
    file(STRINGS ${CMAKE_SOURCE_DIR}/${header} includes REGEX "^#include \"(sim|vision|control|experiments)/")
    list(TRANSFORM includes REPLACE "^#include \"([^\"]*)\".*" "\\1")
    list(APPEND headers ${includes})
    get_filename_component(folder ${header} DIRECTORY)
    install(FILES ${CMAKE_SOURCE_DIR}/${header} DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/turbidock/${folder}
      COMPONENT library)
  endif()
endwhile()
# The scripts that measure and draw need the source.
install(DIRECTORY ${CMAKE_SOURCE_DIR}/models ${CMAKE_SOURCE_DIR}/assets
  DESTINATION ${CMAKE_INSTALL_DATADIR}/turbidock USE_SOURCE_PERMISSIONS COMPONENT program
  PATTERN "*.py" EXCLUDE)

set(package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/turbidock)
install(EXPORT turbidock NAMESPACE turbidock:: DESTINATION ${package_dir} FILE turbidockTargets.cmake
  COMPONENT library)
configure_package_config_file(${CMAKE_CURRENT_LIST_DIR}/turbidockConfig.cmake.in
  ${CMAKE_BINARY_DIR}/turbidockConfig.cmake INSTALL_DESTINATION ${package_dir})
write_basic_package_version_file(${CMAKE_BINARY_DIR}/turbidockConfigVersion.cmake
  COMPATIBILITY SameMinorVersion)
install(FILES ${CMAKE_BINARY_DIR}/turbidockConfig.cmake
  ${CMAKE_BINARY_DIR}/turbidockConfigVersion.cmake DESTINATION ${package_dir} COMPONENT library)
