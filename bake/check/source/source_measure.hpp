// What differs visibly between a bundle and the same sources baked by another version.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "bake/check/source/source_check.hpp"

namespace modar {

/// Sets the distances between the surfaces of a model and of its namesake, baked again, and the
/// mean difference of their vertex colours.
void measure_surfaces(const BundleView& ours, const ModelRecord& model, const BundleView& again,
                      const ModelRecord& other, ModelFit& fit);

/// How a texture differs from the one baked again, for a message; empty if it looks the same.
std::string texture_fault(const BundleView& ours, std::uint32_t index, const BundleView& again,
                          std::uint32_t index_again);

/// How the image or the codes of a tracker record differ from those baked again; empty if another
/// version of the baker may have made them.
std::string record_fault(std::span<const std::byte> ours, std::span<const std::byte> theirs);

}  // namespace modar
