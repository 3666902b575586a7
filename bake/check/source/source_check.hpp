// A bundle against the files that it was baked from.
#pragma once

#include <string>
#include <vector>

#include "bake/bundle/bundle_builder.hpp"
#include "formats/bundle_view.hpp"
#include "formats/check.hpp"

namespace modar {

/// How a model lies to its source. Lengths in source units.
struct ModelFit {
  std::string name;
  bool same_bytes = false;      ///< baked again, it has the same bytes
  double stated_error = 0;      ///< position_error_max of the bundle
  double source_to_bundle = 0;  ///< greatest distance of samples of the one surface to the other
  double bundle_to_source = 0;
  double colour_error = 0;  ///< greatest, of vertex colours, 0 to 1; 0 without
};

struct SourceFit {
  std::vector<ModelFit> models;
  std::vector<std::string> same;       ///< textures and patterns that have the same bytes
  std::vector<std::string> different;  ///< and those that do not
};

/// Bakes `request` in memory and compares each asset of the bundle with its namesake: byte for
/// byte, then the surfaces of models both ways in double precision, at their vertices and the
/// centres of their triangles (a surface may be off by no more than the bundle states), materials
/// and their textures, occlusion, the order of drawing, patterns' images, codes, widths and shapes,
/// and scenes with their lights and shadows where the request has any. bundle: one that
/// check_bundle() found good. Errors: those of the bake.
Result<SourceFit> check_source(const BundleView& bundle, const BakeRequest& request,
                               const IssueSink& sink, Report& report);

/// Options of the bake that made a bundle, from its meta text, which may be anyone's; what it does
/// not state stays. Scenes of models and patterns that the request lacks are left out.
void read_bake_options(std::string_view meta, BakeRequest& request);

}  // namespace modar
