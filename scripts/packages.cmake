# Debian packages: `cpack` in a build folder makes modar (the workstation), modar-player (the player, the installer and
# the reader of videos) and libmodar-dev (the runtime for apps). Dependencies are those of the files within.
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_VENDOR "ModAR")
set(CPACK_PACKAGE_CONTACT "The ModAR maintainers <maintainers@modar.invalid>")
set(CPACK_PACKAGE_VERSION ${PROJECT_VERSION})
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_COMPONENTS_ALL workstation player development)
set(CPACK_COMPONENTS_GROUPING IGNORE)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_SECTION graphics)

set(CPACK_DEBIAN_WORKSTATION_PACKAGE_NAME modar)
set(CPACK_COMPONENT_WORKSTATION_DESCRIPTION "Bakes models and pictures for augmented reality on old phones
 The command modar: bakes models (OBJ, glTF) and pictures of flat things into one bundle, checks it,
 reports on it and publishes it to devices.")
set(CPACK_DEBIAN_WORKSTATION_PACKAGE_RECOMMENDS "libegl1, libgl1-mesa-dri")
set(CPACK_DEBIAN_WORKSTATION_PACKAGE_SUGGESTS "modar-player, ninja-build")

set(CPACK_DEBIAN_PLAYER_PACKAGE_NAME modar-player)
set(CPACK_COMPONENT_PLAYER_DESCRIPTION "Plays ModAR bundles on videos and cameras
 The commands modar-play and modar-fetch, and the library with which modar reads videos.")
set(CPACK_DEBIAN_PLAYER_PACKAGE_RECOMMENDS "libgl1-mesa-dri")

set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_NAME libmodar-dev)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SECTION libdevel)
set(CPACK_COMPONENT_DEVELOPMENT_DESCRIPTION "The runtime of ModAR for apps: tracker, renderer, installer
 Static and shared libraries, headers, files for CMake and pkg-config, and an example in C.")
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_DEPENDS "libegl-dev, libgles-dev, libglm-dev, libexpected-dev")
include(CPack)
