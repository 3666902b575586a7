# Read by cpack, before it makes packages: what the programs in the build folder depend on, by dpkg-shlibdeps. What
# they load when a video is opened is recommended and not required: OpenCV's codecs alone need 380 MB.
# The same sources give the same bytes: files are as old as the last commit.
include(${CMAKE_CURRENT_LIST_DIR}/commit_time.cmake)
set(ENV{SOURCE_DATE_EPOCH} ${MODAR_COMMIT_TIME})
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
set(CPACK_DEBIAN_WORKSTATION_PACKAGE_RECOMMENDS "modar-player, libgl1-mesa-dri, xdg-utils")
set(CPACK_DEBIAN_WORKSTATION_PACKAGE_SUGGESTS "ninja-build")

read_dependencies(player -e${binary}/modar-play -e${binary}/modar-fetch
  -dRecommends -e${loaded}/libmodar_media.so -e${loaded}/libmodar_video.so)
set(CPACK_DEBIAN_PLAYER_PACKAGE_DEPENDS "${player_Depends}")
set(CPACK_DEBIAN_PLAYER_PACKAGE_RECOMMENDS "libgl1-mesa-dri, ${player_Recommends}")

read_dependencies(laboratory -e${binary}/modar-lab)
set(CPACK_DEBIAN_LABORATORY_PACKAGE_DEPENDS "${laboratory_Depends}")
set(CPACK_DEBIAN_LABORATORY_PACKAGE_RECOMMENDS "modar-player, libgl1-mesa-dri")

# Of the shared library: its dependencies, and by which version others depend on it, as a whole and function by function.
set(library ${CPACK_PACKAGE_DIRECTORY}/../runtime/capi/libmodar.so.0)
read_dependencies(library -e${library})
set(CPACK_DEBIAN_LIBRARY_PACKAGE_DEPENDS "${library_Depends}")
set(version ${CPACK_PACKAGE_VERSION})
file(WRITE ${work}/shlibs "libmodar 0 libmodar0 (>= ${version})\n")
file(WRITE ${work}/triggers "activate-noawait ldconfig\n")
execute_process(COMMAND dpkg-gensymbols -q -plibmodar0 -v${version} -e${library} -O${work}/symbols
  WORKING_DIRECTORY ${work} COMMAND_ERROR_IS_FATAL ANY)
set(CPACK_DEBIAN_LIBRARY_PACKAGE_CONTROL_EXTRA ${work}/shlibs ${work}/triggers ${work}/symbols)
set(CPACK_DEBIAN_LIBRARY_PACKAGE_CONTROL_STRICT_PERMISSION ON)
