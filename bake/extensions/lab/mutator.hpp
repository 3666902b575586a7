// Mutations of a bundle: the places of every field of the specification, and one mutation after the
// other on a copy, each undone before the next.
#pragma once

#include <cstddef>
#include <cstdint>
#include <random>
#include <span>
#include <string>
#include <vector>

#include "formats/bundle_view.hpp"
#include "formats/field_table.hpp"

namespace modar {

/// `count` elements, each `step` bytes behind the one before.
struct PlaceRange {
  std::uint64_t first = 0;  ///< byte in the file
  std::uint64_t step = 0;
  std::uint64_t count = 0;
};

/// One field of the specification with all its places in the file.
struct MutationField {
  std::string name;  ///< "ModelRecord.center", "vertex uv", "index", "names"
  FieldType type = FieldType::kU8;
  bool hash = false;  ///< made true again where hashes are
  std::vector<PlaceRange> places;

  [[nodiscard]] std::uint64_t elements() const;
  /// Byte of element i < elements().
  [[nodiscard]] std::uint64_t place(std::uint64_t i) const;
};

/// Every field that has a place in the bundle, in a fixed order.
std::vector<MutationField> mutation_fields(const BundleView& bundle);

/// Items of one size, back to back, whose order a mutation changes.
struct ItemArray {
  const char* name = "";    ///< "vertices", "triangles", "blocks", "descriptors"
  std::uint64_t first = 0;  ///< byte in the file
  std::uint64_t size = 0;   ///< of an item, bytes
  std::uint64_t count = 0;  ///< at least 2
};

/// The vertices and triangles of each level, the ETC1 blocks of each texture, the descriptors of
/// each pattern, the codes of each tracker record.
std::vector<ItemArray> item_arrays(const BundleView& bundle);

/// The change of the bytes.
struct Mutation {
  std::string kind;
  std::string field;
  std::uint64_t offset = 0;
  std::vector<std::byte> before;
  std::vector<std::byte> after;
  bool rehashed = false;
};

class Mutator {
 public:
  /// bytes: a good bundle.
  Mutator(std::span<const std::byte> bytes, std::uint64_t seed);

  /// Damages the copy in some way and tells how; the mutated file is file().
  Mutation next(bool rehashed);
  [[nodiscard]] std::span<const std::byte> file() const { return std::span(bytes_).first(size_); }
  /// Takes the last mutation back.
  void undo();

 private:
  Mutation edit_field(bool rehashed);
  Mutation permute(bool rehashed);
  Mutation flip_bit();
  Mutation truncate(bool rehashed);
  Mutation extend();
  Mutation swap_sections(bool rehashed);

  std::uint64_t draw(std::uint64_t below) { return random_() % below; }
  const char* change(const MutationField& field, std::uint64_t place);
  void rehash(std::uint64_t from, std::uint64_t to);
  [[nodiscard]] SectionEntry& entry(std::size_t i);

  std::vector<std::byte> bytes_;  // as long as the file and what extend() may add
  std::size_t size_ = 0;
  std::size_t whole_ = 0;
  std::size_t section_count_ = 0;
  std::vector<std::byte> head_;  // header and section table unchanged
  std::vector<std::byte> saved_;
  std::uint64_t saved_at_ = 0;
  std::vector<MutationField> fields_;
  std::vector<std::vector<ItemArray>> arrays_;  ///< a list a kind
  std::mt19937_64 random_;
};

}  // namespace modar
