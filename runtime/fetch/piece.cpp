#include "modar/piece.hpp"

#include <algorithm>
#include <cstring>
#include <string>

#include <zstd.h>

#include "formats/transport/feature_text.hpp"
#include "modar/arriving_bundle.hpp"

namespace modar {
namespace {

constexpr const char* kCure = "publish the release again";

std::vector<std::byte> join_halves(const std::vector<std::byte>& halves) {
  std::vector<std::byte> blocks(halves.size());
  const std::size_t count = halves.size() / 8;
  for (std::size_t i = 0; i < count; ++i) {
    std::memcpy(blocks.data() + 8 * i, halves.data() + 4 * i, 4);
    std::memcpy(blocks.data() + 8 * i + 4, halves.data() + 4 * (count + i), 4);
  }
  return blocks;
}

/// The OpenCV text of a section of mapped features.
Result<std::vector<std::byte>> text_bytes(std::span<const std::byte> twin) {
  FeatureHeader header{};
  const auto bad = fail(ExitCode::kInvalidInput, "piece.twin", "mapped features",
                        "the header does not match the size", kCure);
  if (twin.size() < sizeof header) return bad;
  std::memcpy(&header, twin.data(), sizeof header);
  const std::uint64_t keypoint_bytes = std::uint64_t{header.count} * sizeof(KeypointRecord);
  const std::uint64_t descriptor_bytes = std::uint64_t{header.count} * header.descriptor_bytes;
  const auto fits = [&](std::uint64_t offset, std::uint64_t size) {
    return offset <= twin.size() && size <= twin.size() - offset;
  };
  if (!fits(header.keypoints_offset, keypoint_bytes) ||
      !fits(header.descriptors_offset, descriptor_bytes)) {
    return bad;
  }
  std::vector<KeypointRecord> keypoints(header.count);
  if (keypoint_bytes != 0) {
    std::memcpy(keypoints.data(), twin.data() + header.keypoints_offset,
                static_cast<std::size_t>(keypoint_bytes));
  }
  FeatureView view;
  view.keypoints = keypoints;
  view.descriptors = twin.subspan(static_cast<std::size_t>(header.descriptors_offset),
                                  static_cast<std::size_t>(descriptor_bytes));
  view.descriptor_bytes = header.descriptor_bytes;
  const std::string text = feature_text(view);
  const auto bytes = std::as_bytes(std::span(text));
  return std::vector<std::byte>(bytes.begin(), bytes.end());
}

Result<std::vector<std::byte>> raw_bytes(const PieceRecord& piece,
                                         std::span<const std::byte> stored) {
  switch (static_cast<PieceForm>(piece.form)) {
    case PieceForm::kStored:
    case PieceForm::kMesh:
    case PieceForm::kLevel:
    case PieceForm::kTrackerRecord:
    case PieceForm::kCoded:
      return decode_own_piece(piece, stored);
    case PieceForm::kZstd:
      return unpack_zstd(stored, piece.raw_size);
    case PieceForm::kZstdHalves:
      return unpack_zstd(stored, piece.raw_size).map([](const auto& b) { return join_halves(b); });
    case PieceForm::kFeatureText:
      return text_bytes(stored);
  }
  return fail(ExitCode::kUnsupported, "piece.form", "piece", "its form is unknown",
              "use a newer modar-fetch");
}

}  // namespace

Result<std::vector<std::byte>> unpack_zstd(std::span<const std::byte> frame, std::size_t size) {
  std::vector<std::byte> out(size);
  const std::size_t got = ZSTD_decompress(out.data(), out.size(), frame.data(), frame.size());
  if (ZSTD_isError(got) != 0 || got != size) {
    return fail(ExitCode::kInvalidInput, "piece.zstd", "piece",
                ZSTD_isError(got) != 0 ? ZSTD_getErrorName(got) : "it unpacks to another size",
                kCure);
  }
  return out;
}

Result<std::vector<std::byte>> decode_piece(const PieceRecord& piece,
                                            std::span<const std::byte> stored) {
  auto raw = raw_bytes(piece, stored);
  if (!raw) return raw;
  if (raw->size() != piece.raw_size || raw_hash(*raw) != piece.raw_hash) {
    return fail(ExitCode::kInvalidInput, "piece.hash", "piece",
                "it decodes to different bytes than were published", kCure);
  }
  return raw;
}

}  // namespace modar
