// Limits of the supported devices: one table, compiled in from assets/devices/*.json.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace modar {

/// One device or class of devices. Strings live as long as the program.
struct DeviceProfile {
  std::string_view name;  ///< for `--device`
  std::string_view title;
  std::string_view extensions;  ///< names, each with a space before and after
  int es_version;               ///< 20: OpenGL ES 2.0; 30 and up has instancing in its core
  int max_texture_size;         ///< pixels
  int max_vertex_uniform_vectors;
  int max_fragment_uniform_vectors;
  int max_vertex_attributes;
  int max_varying_vectors;
  std::uint32_t gpu_memory_mib;  ///< budget of one app
  std::uint32_t ram_mib;
  std::uint32_t storage_mib;
  int cores;
  int screen_width;  ///< pixels
  int screen_height;
  int frame_width;  ///< pixels of the camera's frames
  int frame_height;

  [[nodiscard]] bool has_extension(std::string_view extension) const;
};

/// All profiles, sorted by name.
std::span<const DeviceProfile> device_profiles();

/// The profile of that name, or nullptr.
const DeviceProfile* find_device_profile(std::string_view name);

/// "ace2, adreno200, ...": for messages.
std::string device_profile_names();

}  // namespace modar
