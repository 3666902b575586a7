// libFuzzer target: any text as the meta section of a bundle gives options that a bake can run
// with; as captions it is judged.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "bake/check/source_check.hpp"
#include "bake/mesh/lod/mesh_levels.hpp"
#include "formats/captions.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  modar::BakeRequest request;
  modar::read_bake_options({reinterpret_cast<const char*>(data), size}, request);
  const auto fault = modar::check_captions({reinterpret_cast<const char*>(data), size});
  if (fault && fault->line < 1) std::abort();
  if (request.textures.effort > modar::TextureEffort::kBest) std::abort();
  const std::uint32_t side = request.textures.max_side;
  if (side < 4 || side > modar::kMaxTextureSide) std::abort();
  if (request.levels < 1 || request.levels > modar::kMaxLevels) std::abort();
  return 0;
}
