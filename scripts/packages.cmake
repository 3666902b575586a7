# Debian packages: modar (the workstation), modar-player (the player, the installer, the readers of videos), modar-lab (the
# benches), libmodar0 (the runtime that apps link) and libmodar-dev (what it takes to build them). `cmake --preset package && cmake --build --preset
# package` makes them; the same sources give the same bytes. scripts/release.sh makes all that a release has.
if(MODAR_PACKAGES)
  # Manual pages and completions from the words of --help; the clip of modar-demo.
  set(share ${CMAKE_BINARY_DIR}/share)
  set(player_share ${CMAKE_BINARY_DIR}/player-share)
  set(laboratory_share ${CMAKE_BINARY_DIR}/laboratory-share)
  set(page -DFOLDER=${player_share} -P ${CMAKE_CURRENT_LIST_DIR}/manual_page.cmake)
  add_custom_command(OUTPUT ${share}/man/man1/modar.1.gz ${player_share}/man/man1/modar-play.1.gz
    COMMAND ${CMAKE_COMMAND} -E rm -rf ${share} ${player_share} ${laboratory_share}  # pages of commands that are no more
    COMMAND modar document -o ${share}
    COMMAND ${CMAKE_COMMAND} -DPROGRAM=$<TARGET_FILE:modar-play> ${page}
    COMMAND ${CMAKE_COMMAND} -DPROGRAM=$<TARGET_FILE:modar-fetch> ${page}
    COMMAND ${CMAKE_COMMAND} -DPROGRAM=$<TARGET_FILE:modar-lab> -DFOLDER=${laboratory_share} -P ${CMAKE_CURRENT_LIST_DIR}/manual_page.cmake
    COMMAND ${CMAKE_COMMAND} -DPROGRAM=${CMAKE_SOURCE_DIR}/scripts/modar-demo -DFOLDER=${share} -P ${CMAKE_CURRENT_LIST_DIR}/manual_page.cmake
    COMMAND sh -c "gzip -9nf '${share}'/man/man1/*.1 '${player_share}'/man/man1/*.1 '${laboratory_share}'/man/man1/*.1"
    DEPENDS modar modar-play modar-fetch modar-lab ${CMAKE_CURRENT_LIST_DIR}/manual_page.cmake)
  set(clip ${CMAKE_BINARY_DIR}/clip)
  set(assets ${CMAKE_SOURCE_DIR}/assets)
  add_custom_command(OUTPUT ${clip}/clip.mp4
    COMMAND python3 ${assets}/make_clip.py --pattern ${assets}/patterns/cover.png --frames 60 --size 480x360 ${clip}
    COMMAND ffmpeg -v error -y -framerate 15 -pattern_type glob -i "${clip}/*.png" -pix_fmt yuv420p
      -threads 1 -fflags +bitexact -flags:v +bitexact ${clip}/clip.mp4
    VERBATIM)
  # The licences, ours and of libraries inside the binaries.
  set(notices ${CMAKE_BINARY_DIR}/notices)
  add_custom_target(modar_notices COMMAND ${CMAKE_COMMAND} -E env SOURCE_DATE_EPOCH=${MODAR_COMMIT_TIME}
      ${CMAKE_CURRENT_LIST_DIR}/package_notices.sh ${CMAKE_BINARY_DIR} ${notices} ${PROJECT_VERSION}
    COMMAND sh -c "gzip -9nc '${CMAKE_SOURCE_DIR}/CHANGELOG.md' > '${notices}/CHANGELOG.md.gz'" VERBATIM)
  add_dependencies(modar_notices modar modar-play modar-fetch modar-lab modar_media modar_video_library modar_shared modar_runtime
    modar_formats modar_fetch)
  add_custom_target(modar_package_files ALL DEPENDS ${share}/man/man1/modar.1.gz ${clip}/clip.mp4)
  add_dependencies(modar_package_files modar_notices)
  if(MODAR_PYTHON)
    set(python_package python:python3-modar)
  endif()
  foreach(package workstation:modar player:modar-player laboratory:modar-lab library:libmodar0 development:libmodar-dev ${python_package})
    string(REGEX MATCH "^(.*):(.*)$" parts ${package})
    install(FILES ${notices}/copyright ${notices}/changelog.gz
      DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/${CMAKE_MATCH_2} COMPONENT ${CMAKE_MATCH_1})
  endforeach()
  install(FILES README.md ${notices}/CHANGELOG.md.gz DESTINATION ${CMAKE_INSTALL_DOCDIR})
  foreach(component workstation player laboratory)
    set(from ${share})
    if(NOT component STREQUAL workstation)
      set(from ${${component}_share})
    endif()
    install(DIRECTORY ${from}/ DESTINATION ${CMAKE_INSTALL_DATADIR} COMPONENT ${component} PATTERN zsh EXCLUDE)
    # Debian's zsh reads its packages' completions here.
    install(DIRECTORY ${from}/zsh/site-functions/ DESTINATION ${CMAKE_INSTALL_DATADIR}/zsh/vendor-completions
      COMPONENT ${component})
  endforeach()
  install(FILES ${clip}/clip.mp4 ${assets}/models/pottery.obj ${assets}/models/pottery.mtl ${assets}/models/pottery.png
    ${assets}/patterns/cover.png DESTINATION ${CMAKE_INSTALL_DATADIR}/modar/demo)
  install(PROGRAMS scripts/modar-demo DESTINATION ${CMAKE_INSTALL_BINDIR})
  # The page and its engine, where the preset `web` has built them: scripts/release.sh does.
  install(DIRECTORY ${CMAKE_SOURCE_DIR}/build/web/web/ DESTINATION ${CMAKE_INSTALL_DATADIR}/modar/web OPTIONAL)
endif()

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_VENDOR "ModAR")
set(CPACK_PACKAGE_CONTACT "The ModAR maintainers <maintainers@modar.invalid>")
set(CPACK_PACKAGE_VERSION ${PROJECT_VERSION})
set(CPACK_PACKAGE_DIRECTORY ${CMAKE_BINARY_DIR}/packages)
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_COMPONENTS_ALL workstation player laboratory library development)
set(CPACK_COMPONENTS_GROUPING IGNORE)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION graphics)
# Reads what the programs depend on, when the packages are made.
set(CPACK_PROJECT_CONFIG_FILE ${CMAKE_CURRENT_LIST_DIR}/package_dependencies.cmake)

set(CPACK_DEBIAN_WORKSTATION_PACKAGE_NAME modar)
set(CPACK_COMPONENT_WORKSTATION_DESCRIPTION "baker of models and pictures for augmented reality on old phones
The command modar bakes models (OBJ, glTF) and pictures of flat things into
one bundle, checks it, reports on it, makes web pages of it and publishes it
to devices. modar-demo shows it.")

set(CPACK_DEBIAN_PLAYER_PACKAGE_NAME modar-player)
set(CPACK_COMPONENT_PLAYER_DESCRIPTION "player of ModAR bundles on videos and cameras
The commands modar-play and modar-fetch, which installs releases of bundles,
and the libraries with which they and modar read and write videos.")

set(CPACK_DEBIAN_LABORATORY_PACKAGE_NAME modar-lab)
set(CPACK_COMPONENT_LABORATORY_DESCRIPTION "measures ModAR next to references
The command modar-lab runs the benches of tracker, baker and renderer, and
tests the bundle checker with damaged bundles.")

set(CPACK_DEBIAN_LIBRARY_PACKAGE_NAME libmodar0)
set(CPACK_DEBIAN_LIBRARY_PACKAGE_SECTION libs)
set(CPACK_COMPONENT_LIBRARY_DESCRIPTION "runtime of ModAR: tracker and renderer
The shared library with the C interface of modar.h. It finds pictures in the
frames of a camera and draws models on them with OpenGL ES 2.0.")

set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_NAME libmodar-dev)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SECTION libdevel)
set(CPACK_COMPONENT_DEVELOPMENT_DESCRIPTION "runtime of ModAR: files to develop apps
Static libraries of tracker, renderer and installer, headers in C and C++,
files for CMake and pkg-config, and an example in C.")
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_DEPENDS
  "libmodar0 (= ${PROJECT_VERSION}), libegl-dev, libgles-dev, libglm-dev, libexpected-dev, libsodium-dev, libzstd-dev")
if(MODAR_PYTHON)
  list(APPEND CPACK_COMPONENTS_ALL python)
  set(CPACK_DEBIAN_PYTHON_PACKAGE_NAME python3-modar)
  set(CPACK_DEBIAN_PYTHON_PACKAGE_SECTION python)
  set(CPACK_DEBIAN_PYTHON_PACKAGE_ARCHITECTURE all)
  set(CPACK_DEBIAN_PYTHON_PACKAGE_DEPENDS "python3, python3-numpy, libmodar0 (>= ${PROJECT_VERSION})")
  set(CPACK_DEBIAN_PYTHON_PACKAGE_RECOMMENDS modar)
  set(CPACK_COMPONENT_PYTHON_DESCRIPTION "ModAR for Python 3
Bundles as numpy arrays, the tracker, the renderer, and the commands that bake
and check.")
endif()
include(CPack)
