// Moves the index of an MP4 to its front (ISO 14496-12: boxes of a 32-bit size and a four-letter
// type; stco and co64 hold absolute offsets of the media data).
#include "faststart.hpp"

#include <array>
#include <cstdint>
#include <cstring>
#include <optional>
#include <string_view>

#include "formats/atomic_file.hpp"
#include "modar/mapped_file.hpp"

namespace modar {
namespace {

constexpr std::size_t kBoxHead = 8;

std::uint64_t read_big(std::span<const std::byte> bytes, std::size_t offset, std::size_t count) {
  std::uint64_t value = 0;
  for (std::size_t i = 0; i < count; ++i) {
    value = (value << 8) | std::to_integer<std::uint64_t>(bytes[offset + i]);
  }
  return value;
}

void write_big(std::span<std::byte> bytes, std::size_t offset, std::size_t count,
               std::uint64_t value) {
  for (std::size_t i = count; i-- > 0; value >>= 8) {
    bytes[offset + i] = static_cast<std::byte>(value & 0xFF);
  }
}

struct Box {
  std::uint32_t type = 0;
  std::size_t head = 0;  ///< bytes before the content
  std::size_t size = 0;  ///< with its head
};

constexpr std::uint32_t type_of(std::string_view letters) {
  std::uint32_t type = 0;
  for (const char letter : letters) type = (type << 8) | static_cast<std::uint8_t>(letter);
  return type;
}

std::optional<Box> box_at(std::span<const std::byte> bytes, std::size_t offset) {
  const std::size_t left = bytes.size() - offset;
  if (left < kBoxHead) return std::nullopt;
  Box box;
  box.head = kBoxHead;
  box.type = static_cast<std::uint32_t>(read_big(bytes, offset + 4, 4));
  std::uint64_t size = read_big(bytes, offset, 4);
  if (size == 0) size = left;  // up to the end of the file
  if (size == 1) {             // a 64-bit size follows
    if (left < 16) return std::nullopt;
    size = read_big(bytes, offset + 8, 8);
    box.head = 16;
  }
  if (size < box.head || size > left) return std::nullopt;
  box.size = static_cast<std::size_t>(size);
  return box;
}

/// Raises the entries of one stco (4 bytes each) or co64 (8). False where they do not fit.
bool raise_offsets(std::span<std::byte> content, std::size_t width, std::uint64_t shift) {
  if (content.size() < 8) return false;
  const std::uint64_t count = read_big(content, 4, 4);
  if (count > (content.size() - 8) / width) return false;
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint64_t raised = read_big(content, 8 + i * width, width) + shift;
    if (width == 4 && raised > 0xFFFFFFFFu) return false;
    write_big(content, 8 + i * width, width, raised);
  }
  return true;
}

/// Walks the boxes on the way to the offset tables. depth bounds the recursion on a hostile file.
bool raise_tables(std::span<std::byte> bytes, std::uint64_t shift, int depth) {
  for (std::size_t offset = 0; offset < bytes.size();) {
    const std::optional<Box> box = box_at(bytes, offset);
    if (!box) return false;
    const std::span<std::byte> content = bytes.subspan(offset + box->head, box->size - box->head);
    bool good = true;
    switch (box->type) {
      case type_of("moov"):
      case type_of("trak"):
      case type_of("mdia"):
      case type_of("minf"):
      case type_of("stbl"):
        good = depth > 0 && raise_tables(content, shift, depth - 1);
        break;
      case type_of("stco"):
        good = raise_offsets(content, 4, shift);
        break;
      case type_of("co64"):
        good = raise_offsets(content, 8, shift);
        break;
      default:
        break;
    }
    if (!good) return false;
    offset += box->size;
  }
  return true;
}

struct TopLevel {
  std::size_t lead = 0;  ///< bytes of ftyp
  std::span<const std::byte> index;
};

/// ftyp, then anything with an mdat before the moov, and moov last.
std::optional<TopLevel> find_index(std::span<const std::byte> movie) {
  TopLevel top;
  for (std::size_t offset = 0; offset < movie.size();) {
    const std::optional<Box> box = box_at(movie, offset);
    if (!box) return std::nullopt;
    if (offset == 0) {
      if (box->type != type_of("ftyp")) return std::nullopt;
      top.lead = box->size;
    }
    if (box->type == type_of("moov")) {
      if (offset == top.lead || offset + box->size != movie.size()) return std::nullopt;
      top.index = movie.subspan(offset, box->size);
      return top;
    }
    offset += box->size;
  }
  return std::nullopt;
}

}  // namespace

std::vector<std::byte> leading_index(std::span<const std::byte> movie) {
  constexpr int kDepth = 8;
  const std::optional<TopLevel> top = find_index(movie);
  if (!top) return {};
  std::vector<std::byte> index(top->index.begin(), top->index.end());
  if (!raise_tables(index, index.size(), kDepth)) return {};
  return index;
}

Result<void> write_faststart(const std::string& from, const std::string& to) {
  const Result<MappedFile> file = MappedFile::open(from);
  if (!file) return tl::unexpected(file.error());
  const std::span<const std::byte> movie = file->bytes();
  const std::vector<std::byte> index = leading_index(movie);
  Result<AtomicFile> out = AtomicFile::create(to);
  if (!out) return tl::unexpected(out.error());
  std::array<std::span<const std::byte>, 3> parts = {movie, {}, {}};
  if (!index.empty()) {
    const std::size_t lead = find_index(movie)->lead;
    parts = {movie.first(lead), index, movie.subspan(lead, movie.size() - lead - index.size())};
  }
  for (const std::span<const std::byte> part : parts) {
    if (auto written = out->write(part); !written) return written;
  }
  return out->commit();
}

}  // namespace modar
