// The one file that holds tinygltf's (and with it Draco's decoder's) implementation.
#define TINYGLTF_IMPLEMENTATION
#include "bake/import/gltf/tinygltf_library.hpp"
