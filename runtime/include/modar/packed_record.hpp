// A tracker record as it travels: its picture, coded, and where in the baked views each feature was
// found. The device renders those places again. formats/shipping.md is the normative text.
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "formats/base/error.hpp"

namespace modar {

class PictureDecoder;

/// A record of make_tracker_record(), packed: about a quarter of its bytes. Nothing where unpacking
/// would not give back these very bytes: a record that another program made, or other options did.
/// record: 8-byte aligned. Takes half a second.
std::optional<std::vector<std::byte>> pack_tracker_record(std::span<const std::byte> record);

/// The record's bytes, the same on every processor. Takes 0.25 s for a picture of 348 x 717 pixels
/// on a workstation of 2020. Errors: kInvalidInput "record.packed".
Result<std::vector<std::byte>> unpack_tracker_record(std::span<const std::byte> packed);

/// unpack_tracker_record() while the bytes come.
class RecordUnpacker {
 public:
  /// packed: memory for all of the bytes, which outlives this.
  explicit RecordUnpacker(std::span<const std::byte> packed);
  RecordUnpacker(RecordUnpacker&&) noexcept;
  RecordUnpacker& operator=(RecordUnpacker&&) noexcept;
  ~RecordUnpacker();
  /// Decodes what the first `there` bytes hold of the picture.
  void go_on(std::size_t there);
  /// All bytes are there. Errors: as of unpack_tracker_record().
  Result<std::vector<std::byte>> finish();

 private:
  std::span<const std::byte> packed_;
  std::unique_ptr<PictureDecoder> picture_;
};

}  // namespace modar
