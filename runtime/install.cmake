# What an app of somebody else's needs: libraries, headers, find_package(modar), pkg-config.
include(CMakePackageConfigHelpers)
set(package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/modar)
set(include_dir ${CMAKE_INSTALL_INCLUDEDIR}/modar)
set_target_properties(modar_runtime PROPERTIES EXPORT_NAME runtime)
set_target_properties(modar_formats PROPERTIES EXPORT_NAME formats)
install(TARGETS modar_runtime modar_formats EXPORT modar-targets
  ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT development
  INCLUDES DESTINATION ${include_dir})
install(EXPORT modar-targets NAMESPACE modar:: DESTINATION ${package_dir} COMPONENT development)
install(DIRECTORY include/ DESTINATION ${include_dir} COMPONENT development)
install(DIRECTORY ${CMAKE_SOURCE_DIR}/formats/ DESTINATION ${include_dir}/formats
  COMPONENT development FILES_MATCHING PATTERN "*.hpp")
install(FILES example/overlay.c example/CMakeLists.txt
  DESTINATION ${CMAKE_INSTALL_DOCDIR}/example COMPONENT development)

configure_package_config_file(modar-config.cmake.in ${CMAKE_CURRENT_BINARY_DIR}/modar-config.cmake
  INSTALL_DESTINATION ${package_dir})
write_basic_package_version_file(${CMAKE_CURRENT_BINARY_DIR}/modar-config-version.cmake
  COMPATIBILITY SameMinorVersion)
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/modar-config.cmake
  ${CMAKE_CURRENT_BINARY_DIR}/modar-config-version.cmake
  DESTINATION ${package_dir} COMPONENT development)
# Wherever the whole is moved to, it finds itself.
file(RELATIVE_PATH prefix_from_pkgconfig
  /${CMAKE_INSTALL_LIBDIR}/pkgconfig /)
configure_file(modar.pc.in ${CMAKE_CURRENT_BINARY_DIR}/modar.pc @ONLY)
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/modar.pc
  DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig COMPONENT development)
