# Sets MODAR_COMMIT_TIME, seconds since 1970: SOURCE_DATE_EPOCH where that is set, else the time of the last commit, which
# `git archive` writes into this file.
set(MODAR_COMMIT_TIME "$ENV{SOURCE_DATE_EPOCH}")
get_filename_component(modar_root ${CMAKE_CURRENT_LIST_DIR} DIRECTORY)
if(MODAR_COMMIT_TIME STREQUAL "" AND EXISTS ${modar_root}/.git)  # not the repository of a folder above
  execute_process(COMMAND git -c safe.directory=* -C ${modar_root} log -1 --format=%ct
    OUTPUT_VARIABLE MODAR_COMMIT_TIME OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
endif()
if(MODAR_COMMIT_TIME STREQUAL "")
  set(MODAR_COMMIT_TIME "$Format:%ct$")
endif()
if(NOT MODAR_COMMIT_TIME MATCHES "^[0-9]+$")
  message(WARNING "No commit and no SOURCE_DATE_EPOCH tell the age of these sources: modar-fetch will believe a clock of 1970")
  set(MODAR_COMMIT_TIME 0)
endif()
