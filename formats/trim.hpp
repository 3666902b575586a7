// Smaller bundles from a bundle: without what only the ModAR paper's method reads, as pages get it,
// and the preview of one that is yet to arrive.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "formats/bundle_view.hpp"
#include "formats/bundle_writer.hpp"

namespace modar {

/// A copy of all that players read: feature twins and feature texts (OpenCV YML), with the
/// parameter sets that they name, are left out where a pattern has a tracker record, and the
/// content summary is made anew. bundle: opened, so that its records are known to be in range.
BundleContent trim(const BundleView& bundle);

/// Takes the feature twins and texts that trim() leaves out from a section table, so that a bundle
/// without their bytes opens. start: header and section table, whose length stays; nothing if it is
/// not one.
std::optional<std::vector<std::byte>> hide_twins(std::span<const std::byte> start);

/// What LoadStage::kShow shows of a bundle whose last stage is yet to come, as a good bundle of its
/// own: of each model the coarsest proxy, or all where it has none; textures from kShownSide on;
/// patterns as trim() keeps them. What plays media, and all actions, are left out. bundle: reads
/// the bytes of stages 1 and 2, and nothing else.
BundleContent preview(const BundleView& bundle);

}  // namespace modar
