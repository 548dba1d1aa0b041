# `cpack -G DEB` in the build folder: the program with its data, its man page and its completion for bash.
set(man ${CMAKE_BINARY_DIR}/turbidock.1)
configure_file(${CMAKE_CURRENT_LIST_DIR}/turbidock.1.in ${man} @ONLY)
foreach(page ${man} ${CMAKE_CURRENT_LIST_DIR}/changelog)
  get_filename_component(name ${page} NAME)
  # without a time in it: the same package from the same files
  execute_process(COMMAND gzip -9nc ${page} OUTPUT_FILE ${CMAKE_BINARY_DIR}/${name}.gz)
endforeach()
install(FILES ${CMAKE_BINARY_DIR}/turbidock.1.gz DESTINATION ${CMAKE_INSTALL_MANDIR}/man1
  COMPONENT program)
install(FILES ${CMAKE_CURRENT_LIST_DIR}/turbidock.bash
  DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions RENAME turbidock COMPONENT program)
install(FILES ${CMAKE_BINARY_DIR}/changelog.gz DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT program)
install(FILES ${CMAKE_CURRENT_LIST_DIR}/copyright DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT program)

set(CPACK_GENERATOR DEB)
set(CPACK_COMPONENTS_ALL program)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_COMPONENTS_GROUPING ALL_COMPONENTS_IN_ONE)
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_PACKAGE_CONTACT "turbidock developers <turbidock@example.org>")
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PACKAGE_DESCRIPTION "docking trials of a stereo-vision ROV in turbid water
 Simulates, without a display or a GPU, an underwater vehicle that finds its
 dock with two cameras, from single trials with video to batches of thousands,
 controller tuning and a gate for continuous integration.")
# What draws is opened while the program runs: OSMesa, or EGL where there is none.
set(CPACK_DEBIAN_PACKAGE_DEPENDS "libosmesa6 | libegl1")
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_RECOMMENDS "ffmpeg, gnuplot-nox, fonts-dejavu-core")
include(CPack)
