# Toolchain of scripts/foreign.sh: Debian's cross compilers, the host's headers that are the same for every
# processor, and EGL and GLES unpacked below MODAR_FOREIGN_ROOT.
set(CMAKE_SYSTEM_NAME Linux)
set(CMAKE_TRY_COMPILE_PLATFORM_VARIABLES MODAR_FOREIGN MODAR_FOREIGN_ROOT)
if(MODAR_FOREIGN STREQUAL "armhf")
  set(CMAKE_SYSTEM_PROCESSOR arm)
  set(triple arm-linux-gnueabihf)
  # NEON with fused multiply-add: Cortex-A7, A15, A53 and later. Highway knows no NEON without it,
  # and no half floats of ARM's own format.
  set(CMAKE_CXX_FLAGS_INIT "-march=armv7-a -mfpu=neon-vfpv4 -mfp16-format=ieee -mfloat-abi=hard")
elseif(MODAR_FOREIGN STREQUAL "arm64")
  set(CMAKE_SYSTEM_PROCESSOR aarch64)
  set(triple aarch64-linux-gnu)
else()
  message(FATAL_ERROR "MODAR_FOREIGN is armhf or arm64, not '${MODAR_FOREIGN}'")
endif()
set(CMAKE_CXX_COMPILER ${triple}-g++)
set(CMAKE_STRIP ${triple}-strip)
string(APPEND CMAKE_CXX_FLAGS_INIT " -idirafter /usr/include")
set(libraries ${MODAR_FOREIGN_ROOT}/usr/lib/${triple})
set(CMAKE_EXE_LINKER_FLAGS_INIT "-L${libraries} -Wl,-rpath-link,${libraries}")
set(ENV{PKG_CONFIG_LIBDIR} ${MODAR_FOREIGN_ROOT}/pkgconfig)
