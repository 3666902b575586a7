// Bytes and gray pictures as ContextCoder's decisions: bytes that first visits download
// (PieceForm::kCoded, kTrackerRecord). formats/shipping.md is the normative text.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

namespace modar {

/// Bytes from one record to the next, at most: those of a vertex.
inline constexpr std::uint32_t kMostCodedStride = 256;

/// stride: bytes of a record, 1 to kMostCodedStride: what stands a record before predicts.
std::vector<std::byte> encode_bytes(std::span<const std::byte> raw, std::uint32_t stride);
/// Nothing where the coded bytes end too early. Other damage makes other bytes: see
/// PieceRecord::raw_hash.
std::optional<std::vector<std::byte>> decode_bytes(std::span<const std::byte> coded,
                                                   std::size_t raw_size, std::uint32_t stride);

/// Of a gray picture without padding, of width x height pixels.
std::vector<std::byte> encode_picture(std::span<const std::uint8_t> pixels, std::uint32_t width);

/// Decodes while the coded bytes come: on a slow line nothing is left to do when the last one is
/// there.
class PictureDecoder {
 public:
  /// coded: memory for all of the bytes, which outlives this.
  PictureDecoder(std::span<const std::byte> coded, std::uint32_t width, std::uint32_t height);
  PictureDecoder(PictureDecoder&&) noexcept;
  PictureDecoder& operator=(PictureDecoder&&) noexcept;
  ~PictureDecoder();
  /// Decodes the rows for which the first `there` bytes suffice.
  void go_on(std::size_t there);
  /// All bytes are there. Nothing where they end too early.
  std::optional<std::vector<std::uint8_t>> finish();

 private:
  struct State;
  std::span<const std::byte> coded_;
  std::uint32_t width_ = 0;
  std::unique_ptr<State> state_;
  std::vector<std::uint8_t> pixels_;
  std::size_t done_ = 0;  ///< pixels
};

}  // namespace modar
