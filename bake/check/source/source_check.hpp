// A bundle against the files that it was baked from.
#pragma once

#include <string>
#include <vector>

#include "bake/bundle/bundle_builder.hpp"
#include "formats/bundle_view.hpp"
#include "formats/check.hpp"

namespace modar {

/// How a model differs from its source, baked again. Lengths in source units; 0 for the same bytes.
struct ModelFit {
  std::string name;
  bool same_bytes = false;      ///< baked again, it has the same bytes
  double stated_error = 0;      ///< position_error_max of the bundle
  double source_to_bundle = 0;  ///< greatest distance of samples of the one surface to the other
  double bundle_to_source = 0;
  double colour_error = 0;  ///< mean, of vertex colours, 0 to 1; 0 without
};

struct SourceFit {
  std::vector<ModelFit> models;
  std::vector<std::string> same;       ///< textures and patterns that have the same bytes
  std::vector<std::string> different;  ///< and those that do not
};

/// Bakes `request` in memory, once, and compares each part of each asset with its counterpart by a
/// hash. If the same version of this program baked the bundle, and not its assets apart, every
/// difference is reported, by the asset, the part and the rule of its kind. Else hashes may
/// differ, and what counts is measured: the distances of surfaces both ways (as far as both bakes
/// state), the mean difference of vertex colours, the PSNR of textures, the images and codes of
/// patterns, and the places of scenes; materials, shapes, widths, parameter sets and counts of the
/// source must be the same. bundle: one that check_bundle() found good. Errors: those of the bake.
Result<SourceFit> check_source(const BundleView& bundle, const BakeRequest& request,
                               const IssueSink& sink, Report& report);

/// Options of the bake that made a bundle, from its meta text, which may be anyone's; what it does
/// not state stays. Scenes of models and patterns that the request lacks are left out.
void read_bake_options(std::string_view meta, BakeRequest& request);

}  // namespace modar
