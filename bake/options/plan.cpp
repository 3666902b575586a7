// What devices and tiers allow.
#include <algorithm>
#include <string_view>

#include "bake/options/request.hpp"
#include "modar/device_profile.hpp"

namespace modar {
namespace {

/// Sizes that collections publish their scans in.
struct Tier {
  std::string_view name;
  std::size_t triangles;
  std::uint32_t texture_side;
};
constexpr Tier kTiers[] = {
    {"thumb", 20000, 512}, {"phone", 100000, 2048}, {"desktop", 150000, 4096}};

void lower_budget(std::uint64_t bytes, BakeRequest& request) {
  if (request.texture_budget == 0 || bytes < request.texture_budget) request.texture_budget = bytes;
}

}  // namespace

Result<void> plan_for_device(const std::string& device, BakeRequest& request) {
  const DeviceProfile* profile = find_device_profile(device);
  if (profile == nullptr) {
    return fail(ExitCode::kUsage, "device.unknown", "--device " + device,
                "there is no such device profile", "name one of: " + device_profile_names());
  }
  const auto side = static_cast<std::uint32_t>(profile->max_texture_size);
  request.textures.max_side = std::min(request.textures.max_side, side);
  lower_budget(std::uint64_t{profile->gpu_memory_mib} * 1024 * 1024 / 2, request);
  const bool reads_half =
      profile->es_version >= 30 || profile->has_extension("GL_OES_vertex_half_float");
  if (!reads_half && !request.positions) request.positions = PositionKind::kInt16;
  request.device = device;
  return {};
}

Result<void> plan_for_tier(const std::string& tier, BakeRequest& request) {
  std::string names;
  for (const Tier& known : kTiers) {
    names += (names.empty() ? "" : ", ") + std::string(known.name);
    if (tier != known.name) continue;
    request.most_triangles = known.triangles;
    request.textures.max_side = std::min(request.textures.max_side, known.texture_side);
    // Four such textures in ETC1, with their mip levels.
    lower_budget(std::uint64_t{4} * known.texture_side * known.texture_side / 2 * 4 / 3, request);
    request.tier = tier;
    return {};
  }
  return fail(ExitCode::kUsage, "bake.tier", "--tier " + tier, "there is no such tier",
              "name one of: " + names);
}

std::vector<std::string> tier_names() {
  std::vector<std::string> names;
  for (const Tier& tier : kTiers) names.emplace_back(tier.name);
  return names;
}

}  // namespace modar
