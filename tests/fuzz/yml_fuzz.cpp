// libFuzzer target: any text as a feature file gives features that fit together, or a coded error.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>

#include "modar/features.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto features =
      modar::features_from_yml(std::string(reinterpret_cast<const char*>(data), size));
  if (!features) {
    if (features.error().code.empty()) std::abort();
    return 0;
  }
  if (features->descriptors.size() != features->keypoints.size() * features->descriptor_bytes) {
    std::abort();
  }
  return 0;
}
