# The libraries of modar::fetch out of Debian's source packages (scripts/sources.sh --libraries), for WebAssembly and
# Android: of each what verifies, unpacks and decodes, and no more. Named as the packages' own targets are.
set(source_root ${MODAR_SOURCES})
function(modar_source_library name alias)
  add_library(${name} STATIC ${ARGN})
  add_library(${alias} ALIAS ${name})
  # Others' code, small before fast: an update is no loop over pixels.
  target_compile_options(${name} PRIVATE -w -Os -ffunction-sections -fdata-sections)
  set_target_properties(${name} PROPERTIES CXX_STANDARD 17 C_STANDARD 99 C_EXTENSIONS ON)
endfunction()

set(sodium ${source_root}/libsodium/src/libsodium)
set(VERSION 1.0.18)
set(SODIUM_LIBRARY_VERSION_MAJOR 10)
set(SODIUM_LIBRARY_VERSION_MINOR 3)
configure_file(${sodium}/include/sodium/version.h.in ${CMAKE_CURRENT_BINARY_DIR}/sodium/sodium/version.h @ONLY)
modar_source_library(source_sodium PkgConfig::SODIUM
  ${sodium}/crypto_core/ed25519/ref10/ed25519_ref10.c
  ${sodium}/crypto_generichash/blake2b/generichash_blake2.c
  ${sodium}/crypto_generichash/blake2b/ref/blake2b-compress-ref.c
  ${sodium}/crypto_generichash/blake2b/ref/blake2b-ref.c
  ${sodium}/crypto_generichash/blake2b/ref/generichash_blake2b.c
  ${sodium}/crypto_generichash/crypto_generichash.c
  ${sodium}/crypto_hash/sha512/cp/hash_sha512_cp.c
  ${sodium}/crypto_sign/crypto_sign.c
  ${sodium}/crypto_sign/ed25519/ref10/open.c
  ${sodium}/crypto_sign/ed25519/ref10/sign.c
  ${sodium}/crypto_verify/sodium/verify.c
  ${sodium}/sodium/codecs.c
  ${sodium}/sodium/core.c
  ${sodium}/sodium/utils.c)
target_include_directories(source_sodium SYSTEM
  PUBLIC ${sodium}/include ${CMAKE_CURRENT_BINARY_DIR}/sodium ${sodium}/include/sodium
  PRIVATE ${CMAKE_CURRENT_BINARY_DIR}/sodium/sodium)
set_target_properties(source_sodium PROPERTIES UNITY_BUILD OFF)
target_compile_definitions(source_sodium PRIVATE CONFIGURED=1 NATIVE_LITTLE_ENDIAN=1 SODIUM_STATIC=1)
# release.cpp chooses no faster code of libsodium's: it is left out.
target_compile_definitions(source_sodium PUBLIC MODAR_PLAIN_SODIUM)

set(zstd ${source_root}/libzstd/lib)
file(GLOB zstd_files ${zstd}/common/*.c ${zstd}/decompress/*.c)
modar_source_library(source_zstd PkgConfig::ZSTD ${zstd_files})
target_include_directories(source_zstd SYSTEM PUBLIC ${zstd})
target_compile_definitions(source_zstd PRIVATE ZSTD_DISABLE_ASM=1 ZSTD_LEGACY_SUPPORT=0)
