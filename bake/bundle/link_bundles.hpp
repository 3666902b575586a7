// Bundles of single assets to one bundle, without baking them again.
#pragma once

#include <array>
#include <span>
#include <string>
#include <vector>

#include "bake/bundle/bundle_builder.hpp"
#include "formats/bundle_view.hpp"

namespace modar {

/// A bundle of one model or of one pattern, as build_bundle() makes it of a request that names
/// nothing else.
struct LinkPart {
  BundleView bundle;                    ///< its bytes outlive the link
  std::string name;                     ///< of the model or the pattern in the new bundle
  std::array<double, 3> model_sides{};  ///< BakeTrace::model_sides of a model
};

/// Joins models and patterns, in this order. Textures with equal bytes are stored once. described:
/// its options are what the meta text states; its scenes find the parts by their names.
/// The bytes of one model and one pattern are those of a bake of both together. Errors: kUsage
/// "bake.scene-unknown"; kInvalidInput "link.part" for a bundle that is no such part.
Result<BundleContent> link_bundles(std::span<const LinkPart> models,
                                   std::span<const LinkPart> patterns,
                                   const BakeRequest& described);

}  // namespace modar
