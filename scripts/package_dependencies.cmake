# Read by cpack, before it makes packages: what the programs in the build folder depend on, by dpkg-shlibdeps. What
# they load when a video is opened is recommended and not required: OpenCV's codecs alone bring 380 MB.
set(binary ${CPACK_PACKAGE_DIRECTORY}/../bin)
set(loaded ${CPACK_PACKAGE_DIRECTORY}/../libexec/modar)
set(work ${CPACK_PACKAGE_DIRECTORY}/shlibdeps)
file(WRITE ${work}/debian/control "Source: modar\n\nPackage: modar\nArchitecture: any\n")
# Sets PREFIX_Depends and PREFIX_Recommends.
function(read_dependencies prefix)
  execute_process(COMMAND dpkg-shlibdeps -O --warnings=0 ${ARGN}
    WORKING_DIRECTORY ${work} OUTPUT_VARIABLE lines COMMAND_ERROR_IS_FATAL ANY)
  foreach(field Depends Recommends)
    string(REGEX MATCH "shlibs:${field}=([^\n]*)" found "${lines}")
    set(${prefix}_${field} "${CMAKE_MATCH_1}" PARENT_SCOPE)
  endforeach()
endfunction()

read_dependencies(workstation -e${binary}/modar)
set(CPACK_DEBIAN_WORKSTATION_PACKAGE_DEPENDS "${workstation_Depends}")
set(CPACK_DEBIAN_WORKSTATION_PACKAGE_RECOMMENDS "modar-player, libgl1-mesa-dri")
set(CPACK_DEBIAN_WORKSTATION_PACKAGE_SUGGESTS "ninja-build")

read_dependencies(player -e${binary}/modar-play -e${binary}/modar-fetch
  -dRecommends -e${loaded}/libmodar_media.so -e${loaded}/libmodar_video.so)
set(CPACK_DEBIAN_PLAYER_PACKAGE_DEPENDS "${player_Depends}")
set(CPACK_DEBIAN_PLAYER_PACKAGE_RECOMMENDS "libgl1-mesa-dri, ${player_Recommends}")
