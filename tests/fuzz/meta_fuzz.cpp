// libFuzzer target: any text as the meta section of a bundle gives options that a bake can run
// with; as captions it is judged.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <string_view>

#include "bake/check/source/source_check.hpp"
#include "bake/mesh/lod/mesh_levels.hpp"
#include "formats/captions.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  modar::BakeRequest request;
  modar::read_bake_options({reinterpret_cast<const char*>(data), size}, request);
  const std::string_view captions(reinterpret_cast<const char*>(data), size);
  const auto fault = modar::check_captions(captions);
  const std::string all = modar::transcript(captions);
  if (all.size() > size || modar::words_at(captions, 1.0).size() > size) std::abort();
  if (fault && fault->line < 1) std::abort();
  if (request.textures.effort > modar::TextureEffort::kBest) std::abort();
  const std::uint32_t side = request.textures.max_side;
  if (side < 4 || side > modar::kMaxTextureSide) std::abort();
  if (request.levels < 1 || request.levels > modar::kMaxLevels) std::abort();
  return 0;
}
