// libFuzzer target: any text as an MTL file gives materials whose numbers are finite, and
// diagnostics that tell where.
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "bake/import/read_model.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  std::vector<modar::Diagnostic> diagnostics;
  const auto materials = modar::parse_mtl({reinterpret_cast<const char*>(data), size}, "/nowhere",
                                          "fuzz", diagnostics);
  for (const modar::SourceMaterial& m : materials) {
    for (const glm::vec3& colour : {m.ambient, m.diffuse, m.specular, m.emission}) {
      for (int i = 0; i < 3; ++i) {
        if (!std::isfinite(colour[i])) std::abort();
      }
    }
    if (!std::isfinite(m.shininess) || !std::isfinite(m.opacity)) std::abort();
    if (!m.diffuse_map.empty() || !m.alpha_map.empty()) std::abort();  // nothing is there
  }
  for (const modar::Diagnostic& diagnostic : diagnostics) {
    if (diagnostic.id.empty() || diagnostic.message.empty()) std::abort();
  }
  return 0;
}
