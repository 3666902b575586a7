# The player's parts, and the player from the outside.
find_package(OpenCV REQUIRED COMPONENTS calib3d core imgproc imgcodecs videoio)
set(play_tests
  play_camera_file_test.cpp
  play_controls_test.cpp
  play_display_test.cpp
  play_faststart_test.cpp
  play_json_test.cpp
  play_options_test.cpp
  play_overlay_test.cpp
  play_qos_test.cpp
  play_raw_source_test.cpp
  play_recording_test.cpp
  play_report_test.cpp
  play_sinks_test.cpp
  play_source_test.cpp
  play_v4l2_test.cpp
  play_vision_test.cpp
  play_window_test.cpp)
find_package(SDL2 REQUIRED)
modar_test(play_test SOURCES ${play_tests} ${CMAKE_SOURCE_DIR}/runtime/play/screen.cpp
  LIBRARIES test_pictures modar_play_desk modar_pattern SDL2::SDL2 opencv_calib3d opencv_core opencv_imgproc opencv_imgcodecs opencv_videoio)
target_include_directories(play_test PRIVATE ${CMAKE_SOURCE_DIR}/runtime/play)

# Apart, so that ThreadSanitizer sees our threads and nobody else's.
set(play_threads_tests play_mailbox_test.cpp play_pipeline_test.cpp)
modar_test(play_threads_test SOURCES ${play_threads_tests} LIBRARIES modar_play)
target_include_directories(play_threads_test PRIVATE ${CMAKE_SOURCE_DIR}/runtime/play)

add_test(NAME cli_play COMMAND Python3::Interpreter ${CMAKE_CURRENT_SOURCE_DIR}/play_test.py)
set_tests_properties(cli_play PROPERTIES TIMEOUT 600 ENVIRONMENT
  "MODAR_SOURCE_DIR=${CMAKE_SOURCE_DIR};MODAR_BIN_DIR=${CMAKE_BINARY_DIR}/bin;LSAN_OPTIONS=suppressions=${CMAKE_SOURCE_DIR}/tests/lsan.supp:print_suppressions=0")

add_test(NAME cli_gl_calls COMMAND Python3::Interpreter ${CMAKE_CURRENT_SOURCE_DIR}/gl_calls_test.py)
set_tests_properties(cli_gl_calls PROPERTIES TIMEOUT 600 ENVIRONMENT
  "MODAR_SOURCE_DIR=${CMAKE_SOURCE_DIR};MODAR_BIN_DIR=${CMAKE_BINARY_DIR}/bin")
add_test(NAME cli_app COMMAND Python3::Interpreter ${CMAKE_CURRENT_SOURCE_DIR}/app_test.py)
set_tests_properties(cli_app PROPERTIES TIMEOUT 600 ENVIRONMENT
  "MODAR_SOURCE_DIR=${CMAKE_SOURCE_DIR};MODAR_BIN_DIR=${CMAKE_BINARY_DIR}/bin;MODAR_SANITIZE=${MODAR_SANITIZE};LSAN_OPTIONS=suppressions=${CMAKE_SOURCE_DIR}/tests/lsan.supp:print_suppressions=0")
