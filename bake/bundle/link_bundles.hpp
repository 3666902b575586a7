// Bundles of single assets to one bundle, without baking them again.
#pragma once

#include <array>
#include <functional>
#include <span>
#include <string>

#include "bake/bundle/bundle_builder.hpp"
#include "formats/bundle_view.hpp"

namespace modar {

/// A bundle of one model or of one pattern, as build_bundle() makes it of a request that names
/// nothing else.
struct LinkPart {
  BundleView bundle;                    ///< its bytes outlive the link
  std::string name;                     ///< of the model or the pattern in the new bundle
  std::array<double, 3> model_sides{};  ///< BakeTrace::model_sides of a model
  bool keypoints = true;                ///< with a pattern's, of the ModAR paper's method
};

/// A video or sound made fit, as a bundle of its one MediaRecord and, of a video, its poster's
/// texture. Errors: those of encode_video(), write_poster(), flashes() and bake_texture().
Result<BundleContent> bake_media(const NodeRequest& node, const BakeRequest& request,
                                 Report& report);
/// What bake_media() gave before, from a bundle of it.
BundleContent media_content(const BundleView& part);
/// Where the media of nodes come from.
using MediaSource = std::function<Result<BundleContent>(const NodeRequest&)>;

/// Joins models and patterns, in this order. Textures with equal bytes are stored once. described:
/// its options are what the meta text states; its scenes find the parts by their names.
/// The bytes of one model and one pattern are those of a bake of both together. Errors: kUsage
/// "bake.scene-unknown"; kInvalidInput "link.part" for a bundle that is no such part; those of
/// `media`, which is bake_media() where it is empty.
Result<BundleContent> link_bundles(std::span<const LinkPart> models,
                                   std::span<const LinkPart> patterns, const BakeRequest& described,
                                   const MediaSource& media = {});

}  // namespace modar
