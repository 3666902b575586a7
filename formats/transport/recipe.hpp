// How a bundle is put together from the pieces that travel: shipping.md is the normative text.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "formats/base/error.hpp"

namespace modar {

inline constexpr std::array<std::uint8_t, 8> kRecipeMagic = {0x89, 'M',  'O',  'R',
                                                             0x0D, 0x0A, 0x1A, 0x0A};
inline constexpr std::uint32_t kRecipeVersion = 2;
inline constexpr std::uint32_t kMaxPieces = 1u << 20;
inline constexpr std::uint32_t kMaxPieceBytes = 16u << 20;  ///< raw or stored
inline constexpr std::uint64_t kMaxBundleBytes = 1ull << 40;

/// BLAKE2b of an object's bytes, 16 bytes: its name on the server.
using ObjectId = std::array<std::uint8_t, 16>;
/// BLAKE2b of a whole bundle, 32 bytes.
using BundleHash = std::array<std::uint8_t, 32>;

/// How the stored bytes of a piece encode its raw bytes.
enum class PieceForm : std::uint8_t {
  kStored = 1,      ///< the raw bytes
  kZstd = 2,        ///< a zstd frame of them
  kZstdHalves = 3,  ///< ETC1: a zstd frame of the blocks' first four bytes, then of their last four
  kMesh = 4,        ///< a mesh object (mesh_coder.hpp)
  kFeatureText = 5,    ///< nothing stored: the text of the mapped features at second_offset
  kLevel = 6,          ///< a coarser level's indices (mesh_coder.hpp)
  kTrackerRecord = 7,  ///< since version 2: a packed tracker record (modar/packed_record.hpp)
  kCoded = 8,          ///< since version 2: bytes by encode_bytes(), index_base as their stride
};

/// What a part of a bundle is needed for, in the order of need.
enum class LoadStage : std::uint8_t {
  kAny = 0,   ///< not said: recipes of version 1
  kFind = 1,  ///< tables and patterns: pictures are recognised
  kShow = 2,  ///< each model as coarse as the bundle has it, textures up to kShownSide
  kRefine = 3,
};

struct RecipeHeader {
  std::uint8_t magic[8];
  std::uint32_t version;
  std::uint32_t piece_count;
  std::uint64_t bundle_size;
  std::uint8_t bundle_hash[32];
  std::uint64_t table_hash;  ///< XXH64 of the recipe with 0 here; 0 in version 1
};
static_assert(sizeof(RecipeHeader) == 64);

/// One piece. The raw bytes of a mesh are its vertices, which go to `offset`, and its indices,
/// which go to `second_offset` with `index_base` added to each.
struct PieceRecord {
  std::uint8_t id[16];          ///< ObjectId of the stored bytes; zero for kFeatureText
  std::uint64_t raw_hash;       ///< XXH64, seed 0, of the raw bytes
  std::uint64_t offset;         ///< bytes into the bundle
  std::uint64_t second_offset;  ///< kMesh: of the indices; kFeatureText: of the features; else 0
  std::uint32_t raw_size;       ///< bytes
  std::uint32_t stored_size;    ///< bytes; 0 for kFeatureText
  std::uint32_t
      second_size;  ///< bytes: kMesh: of the indices; kFeatureText: of the features; else 0
  std::uint16_t index_base;  ///< kMesh, kLevel: added to each index; kCoded: the stride; else 0
  std::uint8_t form;         ///< PieceForm
  std::uint8_t stage;        /// LoadStage, since version 2
  std::uint8_t reserved[8];
};
static_assert(sizeof(PieceRecord) == 64);

/// A validated recipe: every range is in the bundle, every size is in its limit. Bytes of the
/// bundle that no piece covers are zero. Points into the caller's bytes.
struct RecipeView {
  RecipeHeader header{};
  std::span<const PieceRecord> pieces;
};

/// A recipe of kRecipeVersion. header: its magic, version, count and hash are filled in.
std::vector<std::byte> recipe_bytes(RecipeHeader header, std::span<const PieceRecord> pieces);

/// bytes: 8-byte aligned. Errors: kInvalidInput "recipe.*".
Result<RecipeView> open_recipe(std::span<const std::byte> bytes);

/// The raw bytes of a piece by where they go.
struct PieceParts {
  std::span<std::byte> first;   ///< to `offset`
  std::span<std::byte> second;  ///< to `second_offset`; empty but for kMesh
};
PieceParts parts_of(const PieceRecord& piece, std::span<std::byte> raw);
/// Adds index_base to the indices of kMesh and kLevel, or takes it off.
void add_index_base(const PieceRecord& piece, std::span<std::byte> raw);
void subtract_index_base(const PieceRecord& piece, std::span<std::byte> raw);

/// XXH64, seed 0.
std::uint64_t raw_hash(std::span<const std::byte> bytes);

}  // namespace modar
