// The table of device profiles and its look-up.
#include "modar/device_profile.hpp"

#include "runtime/platform/gl/extension_list.hpp"

namespace modar {
namespace {

#include "device_profiles.inc"

}  // namespace

bool DeviceProfile::has_extension(std::string_view extension) const {
  return lists_extension(extensions, extension);
}

std::span<const DeviceProfile> device_profiles() {
  return kProfiles;
}

const DeviceProfile* find_device_profile(std::string_view name) {
  for (const DeviceProfile& profile : kProfiles) {
    if (profile.name == name) return &profile;
  }
  return nullptr;
}

std::string device_profile_names() {
  std::string names;
  for (const DeviceProfile& profile : kProfiles) {
    if (!names.empty()) names += ", ";
    names += profile.name;
  }
  return names;
}

}  // namespace modar
