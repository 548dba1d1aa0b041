# `cmake --install` and find_package(turbidock): the executable, the modules as libraries with their headers,
# and the data.
include(CMakePackageConfigHelpers)

get_property(modules GLOBAL PROPERTY turbidock_modules)
install(TARGETS turbidock EXPORT turbidock RUNTIME COMPONENT program)
install(TARGETS ${modules} EXPORT turbidock ARCHIVE COMPONENT library)
foreach(folder sim vision control experiments)
  install(DIRECTORY ${CMAKE_SOURCE_DIR}/${folder} DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/turbidock
    COMPONENT library FILES_MATCHING PATTERN "*.h")
endforeach()
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
