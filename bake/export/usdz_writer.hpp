// Models out of a bundle as a USDZ file, which iPhones show in the visitor's room (Quick Look).
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "bake/export/glb_writer.hpp"
#include "formats/base/error.hpp"
#include "formats/bundle_view.hpp"

namespace modar {

/// A stored ZIP of a scene description as text (Model.usda, y up, metres) and its textures (JPEG,
/// or PNG where one has alpha), each at a multiple of 64 bytes, as the USDZ specification asks.
/// Meshes are the finest level, materials UsdPreviewSurface. images: may lack textures; their
/// materials then have their colour alone. Errors: those of decode_level(); kUnsupported
/// "usdz.too-large" beyond 4 GB.
Result<std::vector<std::byte>> encode_usdz(const BundleView& bundle,
                                           std::span<const RoomModel> models,
                                           std::span<const GlbImage> images);

}  // namespace modar
