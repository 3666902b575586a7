// libFuzzer target: any text as the meta section of a bundle gives options that a bake can run
// with.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "bake/check/source_check.hpp"
#include "bake/mesh/lod/mesh_levels.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  modar::BakeRequest request;
  modar::read_bake_options({reinterpret_cast<const char*>(data), size}, request);
  if (request.textures.effort > modar::TextureEffort::kBest) std::abort();
  const std::uint32_t side = request.textures.max_side;
  if (side < 4 || side > modar::kMaxTextureSide) std::abort();
  if (request.levels < 1 || request.levels > modar::kMaxLevels) std::abort();
  return 0;
}
