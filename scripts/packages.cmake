# Debian packages: modar (the workstation), modar-player (the player, the installer, the readers of videos) and
# libmodar-dev (the runtime for apps). `cmake --preset package && cmake --build --preset package` makes them.
if(MODAR_PACKAGES)
  # Manual pages and completions from the words of --help; the clip of modar-demo.
  set(share ${CMAKE_BINARY_DIR}/share)
  set(player_share ${CMAKE_BINARY_DIR}/player-share)
  set(page -DFOLDER=${player_share} -P ${CMAKE_CURRENT_LIST_DIR}/manual_page.cmake)
  add_custom_command(OUTPUT ${share}/man/man1/modar.1 ${player_share}/man/man1/modar-play.1
    COMMAND modar document -o ${share}
    COMMAND ${CMAKE_COMMAND} -DPROGRAM=$<TARGET_FILE:modar-play> ${page}
    COMMAND ${CMAKE_COMMAND} -DPROGRAM=$<TARGET_FILE:modar-fetch> ${page}
    DEPENDS modar modar-play modar-fetch ${CMAKE_CURRENT_LIST_DIR}/manual_page.cmake)
  set(clip ${CMAKE_BINARY_DIR}/clip)
  set(assets ${CMAKE_SOURCE_DIR}/assets)
  add_custom_command(OUTPUT ${clip}/clip.mp4
    COMMAND python3 ${assets}/make_clip.py --pattern ${assets}/patterns/cover.png --frames 60 --size 480x360 ${clip}
    COMMAND ffmpeg -v error -y -framerate 15 -pattern_type glob -i "${clip}/*.png" -pix_fmt yuv420p ${clip}/clip.mp4
    VERBATIM)
  add_custom_target(modar_package_files ALL DEPENDS ${share}/man/man1/modar.1 ${clip}/clip.mp4)
  foreach(component workstation player)
    set(from ${share})
    if(component STREQUAL player)
      set(from ${player_share})
    endif()
    install(DIRECTORY ${from}/ DESTINATION ${CMAKE_INSTALL_DATADIR} COMPONENT ${component} PATTERN zsh EXCLUDE)
    # Debian's zsh reads its packages' completions here.
    install(DIRECTORY ${from}/zsh/site-functions/ DESTINATION ${CMAKE_INSTALL_DATADIR}/zsh/vendor-completions
      COMPONENT ${component})
  endforeach()
  install(FILES ${clip}/clip.mp4 ${assets}/models/pottery.obj ${assets}/models/pottery.mtl ${assets}/models/pottery.png
    ${assets}/patterns/cover.png DESTINATION ${CMAKE_INSTALL_DATADIR}/modar/demo)
  install(PROGRAMS scripts/modar-demo DESTINATION ${CMAKE_INSTALL_BINDIR})
  # The page's engine, where the preset `web` has built it.
  install(DIRECTORY ${CMAKE_SOURCE_DIR}/build/web/web/ DESTINATION ${CMAKE_INSTALL_DATADIR}/modar/web OPTIONAL)
endif()

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_VENDOR "ModAR")
set(CPACK_PACKAGE_CONTACT "The ModAR maintainers <maintainers@modar.invalid>")
set(CPACK_PACKAGE_VERSION ${PROJECT_VERSION})
set(CPACK_PACKAGE_DIRECTORY ${CMAKE_BINARY_DIR}/packages)
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_COMPONENTS_ALL workstation player development)
set(CPACK_COMPONENTS_GROUPING IGNORE)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION graphics)
# Reads what the programs depend on, when the packages are made.
set(CPACK_PROJECT_CONFIG_FILE ${CMAKE_CURRENT_LIST_DIR}/package_dependencies.cmake)

set(CPACK_DEBIAN_WORKSTATION_PACKAGE_NAME modar)
set(CPACK_COMPONENT_WORKSTATION_DESCRIPTION "Bakes models and pictures for augmented reality on old phones
 The command modar: bakes models (OBJ, glTF) and pictures of flat things into one bundle, checks it,
 reports on it and publishes it to devices. modar-demo shows it.")

set(CPACK_DEBIAN_PLAYER_PACKAGE_NAME modar-player)
set(CPACK_COMPONENT_PLAYER_DESCRIPTION "Plays ModAR bundles on videos and cameras
 The commands modar-play and modar-fetch, and the libraries with which modar reads videos.")

set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_NAME libmodar-dev)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SECTION libdevel)
set(CPACK_COMPONENT_DEVELOPMENT_DESCRIPTION "The runtime of ModAR for apps: tracker, renderer, installer
 Static and shared libraries, headers, files for CMake and pkg-config, and an example in C.")
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_DEPENDS
  "libegl-dev, libgles-dev, libglm-dev, libexpected-dev, libsodium-dev, libzstd-dev, libmeshoptimizer-dev")
include(CPack)
