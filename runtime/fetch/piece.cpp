#include "modar/piece.hpp"

#include <cstring>

#include <zstd.h>

#include "formats/transport/feature_text.hpp"
#include "modar/mesh_transport.hpp"

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

Result<std::vector<std::byte>> mesh_bytes(std::span<const std::byte> stored) {
  auto chunk = decode_mesh_object(stored);
  if (!chunk) return tl::unexpected(chunk.error());
  const auto indices = std::as_bytes(std::span(chunk->indices));
  chunk->vertices.insert(chunk->vertices.end(), indices.begin(), indices.end());
  return std::move(chunk->vertices);
}

/// The text of a feature twin's section.
Result<std::vector<std::byte>> text_bytes(std::span<const std::byte> twin) {
  FeatureHeader header{};
  const auto bad = fail(ExitCode::kInvalidInput, "piece.twin", "feature twin",
                        "its header does not fit its size", kCure);
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
    std::memcpy(keypoints.data(), twin.data() + header.keypoints_offset, keypoint_bytes);
  }
  FeatureView view;
  view.keypoints = keypoints;
  view.descriptors = twin.subspan(header.descriptors_offset, descriptor_bytes);
  view.descriptor_bytes = header.descriptor_bytes;
  const std::string text = feature_text(view);
  const auto bytes = std::as_bytes(std::span(text));
  return std::vector<std::byte>(bytes.begin(), bytes.end());
}

Result<std::vector<std::byte>> level_bytes(const PieceRecord& piece,
                                           std::span<const std::byte> stored) {
  const auto size = ZSTD_getFrameContentSize(stored.data(), stored.size());
  const auto buffer = unpack_zstd(stored, size <= kMaxPieceBytes ? size : 0);
  if (!buffer) return tl::unexpected(buffer.error());
  const auto indices = decode_level(*buffer, piece.raw_size / 2);
  if (!indices) return tl::unexpected(indices.error());
  const auto bytes = std::as_bytes(std::span(*indices));
  return std::vector<std::byte>(bytes.begin(), bytes.end());
}

Result<std::vector<std::byte>> raw_bytes(const PieceRecord& piece,
                                         std::span<const std::byte> stored) {
  switch (static_cast<PieceForm>(piece.form)) {
    case PieceForm::kStored:
      return std::vector<std::byte>(stored.begin(), stored.end());
    case PieceForm::kZstd:
      return unpack_zstd(stored, piece.raw_size);
    case PieceForm::kZstdHalves:
      return unpack_zstd(stored, piece.raw_size).map([](const auto& b) { return join_halves(b); });
    case PieceForm::kMesh:
      return mesh_bytes(stored);
    case PieceForm::kFeatureText:
      return text_bytes(stored);
    case PieceForm::kLevel:
      return level_bytes(piece, stored);
  }
  return fail(ExitCode::kUnsupported, "piece.form", "piece", "its form is not known",
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
                "it decodes to other bytes than were published", kCure);
  }
  return raw;
}

}  // namespace modar
