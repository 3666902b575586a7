// A level of detail against the same one, baked again: what of it a visitor would see changed.
#pragma once

#include <cstddef>
#include <span>
#include <string>

#include "formats/layout.hpp"

namespace modar {

/// A level with all that its bytes are decoded by. Nothing is owned.
struct LevelPart {
  const LayoutRecord* layout = nullptr;
  const ChunkRecord* chunk = nullptr;
  const LevelRecord* level = nullptr;
  std::span<const std::byte> vertices;  ///< of the whole bundle, as are the indices
  std::span<const std::byte> indices;
};

/// How `ours` differs from `theirs`, for a message; empty where nothing is to be seen, and where
/// the two are in another order, as those of two versions of the baker are: then nothing is
/// compared. slack: model space, how far a position may be off.
std::string level_difference(const LevelPart& ours, const LevelPart& theirs, double slack);

}  // namespace modar
