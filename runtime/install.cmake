# What an app of somebody else's needs: libraries, headers, find_package(modar), pkg-config.
include(CMakePackageConfigHelpers)
set(package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/modar)
set(include_dir ${CMAKE_INSTALL_INCLUDEDIR}/modar)
set_target_properties(modar_runtime PROPERTIES EXPORT_NAME runtime)
set_target_properties(modar_formats PROPERTIES EXPORT_NAME formats)
set(packages modar)
set(libraries modar_runtime modar_formats)
set(include_folders include/)
if(TARGET modar_fetch)
  set_target_properties(modar_fetch PROPERTIES EXPORT_NAME fetch)
  list(APPEND packages modar-fetch)
  list(APPEND libraries modar_fetch)
  list(APPEND include_folders fetch/include/)
endif()
install(TARGETS ${libraries} EXPORT modar-targets
  ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT development
  INCLUDES DESTINATION ${include_dir})
set_target_properties(modar_shared PROPERTIES EXPORT_NAME shared)
install(TARGETS modar_shared EXPORT modar-targets
  LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT library NAMELINK_COMPONENT development
  INCLUDES DESTINATION ${include_dir})
install(EXPORT modar-targets NAMESPACE modar:: DESTINATION ${package_dir} COMPONENT development)
install(DIRECTORY ${include_folders} DESTINATION ${include_dir} COMPONENT development)
# Of formats/ only what the headers above include; tests/cli/app_test.py links every function of theirs.
foreach(header base/error base/turn base/utf8 action_machine layout clip_tracks clips pattern_shape scene_nodes sections bundle_view transport/recipe transport/stages)
  get_filename_component(folder formats/${header} DIRECTORY)
  install(FILES ${CMAKE_SOURCE_DIR}/formats/${header}.hpp DESTINATION ${include_dir}/${folder} COMPONENT development)
endforeach()
install(FILES example/overlay.c example/CMakeLists.txt
  DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/libmodar-dev/examples COMPONENT development)

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
foreach(package ${packages})
  configure_file(${package}.pc.in ${CMAKE_CURRENT_BINARY_DIR}/${package}.pc @ONLY)
  install(FILES ${CMAKE_CURRENT_BINARY_DIR}/${package}.pc
    DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig COMPONENT development)
endforeach()
