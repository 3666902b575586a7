// Reads the options of a bake back from the meta text that bundle_meta() wrote.
#include <limits>
#include <map>
#include <nlohmann/json.hpp>

#include "bake/check/source_check.hpp"
#include "bake/mesh/lod/mesh_levels.hpp"

namespace modar {
namespace {

using Json = nlohmann::json;

constexpr std::uint32_t kLeastTextureSide = 4;  // as the command line has it

/// Takes a key over where it is there and of that type: the text may be anyone's.
template <class T>
void take(const Json& options, const char* key, T& value) {
  const auto found = options.find(key);
  if (found == options.end()) return;
  if constexpr (std::is_same_v<T, bool>) {
    if (found->is_boolean()) value = found->get<bool>();
  } else if constexpr (std::is_same_v<T, std::string>) {
    if (found->is_string()) value = found->get<std::string>();
  } else if constexpr (std::is_integral_v<T>) {
    // Numbers beyond the type would be cast to anything.
    if (found->is_number_integer() && *found >= 0 && *found <= std::numeric_limits<T>::max()) {
      value = found->get<T>();
    }
  } else {
    if (found->is_number()) value = found->get<T>();
  }
}

}  // namespace

void read_bake_options(std::string_view meta, BakeRequest& request) {
  const Json document = Json::parse(meta, nullptr, false);
  if (!document.is_object() || !document.contains("options")) return;
  const Json& options = document["options"];
  if (!options.is_object()) return;
  take(options, "device", request.device);
  if (!request.device.empty() && !plan_for_device(request.device, request)) request.device.clear();
  int effort = static_cast<int>(request.textures.effort);
  take(options, "effort", effort);
  if (effort >= 0 && effort <= static_cast<int>(TextureEffort::kBest)) {
    request.textures.effort = static_cast<TextureEffort>(effort);
  }
  take(options, "perceptual", request.textures.perceptual);
  std::uint32_t side = request.textures.max_side;
  take(options, "max_texture", side);
  if (side >= kLeastTextureSide && side <= kMaxTextureSide) request.textures.max_side = side;
  std::uint32_t levels = request.levels;
  take(options, "lods", levels);
  if (levels >= 1 && levels <= kMaxLevels) request.levels = levels;
  take(options, "mipmaps", request.textures.mipmaps);
  take(options, "topology", request.topology);
  take(options, "unit_metres", request.unit_metres);
  take(options, "max_error", request.max_error.value);
  const std::map<std::string, MaxError::Unit> units = {{"any", MaxError::Unit::kAny},
                                                       {"source", MaxError::Unit::kSource},
                                                       {"percent", MaxError::Unit::kPercent},
                                                       {"metres", MaxError::Unit::kMetres}};
  std::string word;
  take(options, "max_error_unit", word);
  if (const auto unit = units.find(word); unit != units.end())
    request.max_error.unit = unit->second;
  word.clear();
  take(options, "positions", word);
  if (word == "half") request.positions = PositionKind::kHalf;
  if (word == "int16") request.positions = PositionKind::kInt16;
}

}  // namespace modar
