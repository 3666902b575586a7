// libFuzzer target: any text as a device profile gives one with sane limits, or a coded error.
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "bake/check/device/device_file.hpp"
#include "tests/fuzz/need.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using modar::test::need;
  modar::DeviceFile file;
  const auto parsed =
      modar::parse_device_profile({reinterpret_cast<const char*>(data), size}, "fuzz", file);
  if (!parsed) {
    modar::test::need_told(parsed.error());
    return 0;
  }
  const modar::DeviceProfile& device = file.profile;
  need(!device.name.empty() && device.name.data() == file.name.data());
  need(device.max_texture_size > 0 && device.max_vertex_attributes > 0 && device.cores > 0);
  need(device.gpu_memory_mib > 0 && device.ram_mib > 0 && device.storage_mib > 0);
  need(!device.has_extension("GL_NO_SUCH_EXTENSION") || size >= 20);
  return 0;
}
