// The order in which a bundle is needed: what finds its pictures, what shows something, the rest.
// Web, device and publisher share it. formats/shipping.md is the normative text.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "formats/bundle_view.hpp"
#include "formats/transport/recipe.hpp"

namespace modar {

/// Longer side of the finest texture level of LoadStage::kShow, texels: what a model that fills a
/// third of a phone's screen shows, for a sixteenth of the bytes of 1024.
inline constexpr std::uint32_t kShownSide = 256;

/// Types of sections from here on are payloads; before them are tables and small text.
inline constexpr std::uint32_t kFirstPayload = 256;

/// And from here on they are what GPUs draw from: vertices, indices, texture blocks.
inline constexpr std::uint32_t kFirstOfGpu = static_cast<std::uint32_t>(SectionType::kVertices);

/// Bytes of a bundle that are needed together.
struct StageRange {
  std::uint64_t offset = 0;  ///< in the bundle
  std::uint64_t size = 0;
  LoadStage stage = LoadStage::kRefine;
  std::uint32_t stride = 1;  ///< of the bytes there: vertices, triangles, blocks
};

/// All of a bundle but the zeros between sections, in the order of need. It reads tables only.
std::vector<StageRange> stage_ranges(const BundleView& bundle);

/// The earliest stage that some of a piece's bytes are of.
LoadStage earliest_stage(const PieceRecord& piece, std::span<const StageRange> stages);

/// Where a bundle's vertices, indices and texture blocks begin: all else is before.
std::uint64_t gpu_start(const BundleView& bundle);

/// Of bytes beginning at `offset`, those that are in the `size` ones from `start` on, and where
/// there; both count from the same place.
struct Overlap {
  std::uint64_t at = 0;
  std::span<const std::byte> bytes;
};
Overlap overlap(std::uint64_t start, std::uint64_t size, std::uint64_t offset,
                std::span<const std::byte> bytes);

/// Of a payload other than vertices, indices and texture blocks, which are of several.
LoadStage stage_of(SectionType type);

/// The coarsest proxy of a model as a number of a chunk group; kNone where it has none.
std::uint32_t coarsest_proxy(const BundleView& bundle, std::uint32_t model);

/// The level of a texture, counted from its finest, from which on LoadStage::kShow shows it.
std::uint32_t first_shown_level(const BundleView& bundle, const TextureRecord& texture);

/// The levels of a texture that LoadStage::kShow shows: bytes from the start of its section.
std::vector<StageRange> shown_blocks(const BundleView& bundle, std::uint32_t texture);

/// Of each model its coarsest proxy, or all of it where it has none, which LoadStage::kShow
/// shows: bytes from the start of the section of indices or vertices. Unsorted, some more than
/// once.
std::vector<StageRange> shown_geometry(const BundleView& bundle, bool indices);

/// What a program needs to have in memory when vertices, indices and texture blocks are on the GPU:
/// all that is before them, what LoadStage::kShow shows, and the indices that a draw order sorts.
/// Some bytes more than once; `stage` means nothing.
std::vector<StageRange> kept_ranges(const BundleView& bundle);

/// Gives each model that has proxies the chunks of the coarsest one in place of its own, for what
/// reads the triangles of kept_ranges(). bytes: those that `bundle` is a view of. The caller keeps
/// a copy of the section of models.
void use_proxies(std::span<std::byte> bytes, const BundleView& bundle);

/// Changes the tables of a bundle of which the last stage is missing, so that renderers made of it
/// draw nothing of that: proxies in place of all chunks, textures from kShownSide on. bytes:
/// those that `bundle` is a view of. The caller keeps a copy of the tables for when the rest is
/// there.
void show_coarsest(std::span<std::byte> bytes, const BundleView& bundle);

}  // namespace modar
