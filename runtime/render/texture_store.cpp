// The bundle's textures in GL.
#include "runtime/render/texture_store.hpp"

#include <algorithm>

#include "formats/base/bits.hpp"
#include "formats/texture_format.hpp"
#include "formats/transport/stages.hpp"
#include "modar/mapped_file.hpp"
#include "runtime/render/plane_painter.hpp"

namespace modar {
namespace {

constexpr std::uint64_t kEtc1Block = 8;  ///< bytes of 4x4 texels

bool power_of_two(const TextureRecord& texture) {
  return is_power_of_two(texture.width) && is_power_of_two(texture.height);
}

}  // namespace

TextureStore::TextureStore(const BundleView& bundle, const GlCaps& caps)
    : bundle_(bundle),
      formats_(caps.texture_formats),
      etc1_format_(caps.etc1_format),
      etc1_in_parts_(caps.etc1_sub_texture),
      npot_mipmaps_(caps.npot_mipmaps),
      max_side_(static_cast<std::uint32_t>(caps.max_texture_size)) {
  const std::uint32_t count = bundle.textures().size();
  used_.assign(count, false);
  first_level_.assign(count, 0);
  colours_.assign(count, 0);
  alphas_.assign(count, 0);
  for (const MaterialRecord& material : bundle.materials()) {
    const std::uint32_t texture = material.texture;
    if (texture != kNone) used_[texture] = true;
  }
  for (std::uint32_t i = 0; i < bundle.nodes().size(); ++i) {
    if (is_picture(bundle, i)) used_[picture_texture(bundle, i)] = true;
  }
}

std::uint64_t TextureStore::level_bytes(const TextureRecord& texture, std::uint32_t level) const {
  const TextureLevelRecord& record = bundle_.texture_levels()[texture.first_level + level];
  const std::uint64_t one =
      reads(texture) ? std::uint64_t{record.size} : std::uint64_t{record.width} * record.height * 3;
  return record.alpha_offset == kNoOffset ? one : 2 * one;
}

std::uint64_t TextureStore::bytes_from(std::uint32_t texture, std::uint32_t first) const {
  const TextureRecord& record = bundle_.textures()[texture];
  const std::uint32_t end = mipmapped(record) ? record.level_count : first + 1;
  std::uint64_t bytes = 0;
  for (std::uint32_t level = first; level < end; ++level) bytes += level_bytes(record, level);
  return bytes;
}

bool TextureStore::mipmapped(const TextureRecord& texture) const {
  if (texture.level_count < 2) return false;
  return npot_mipmaps_ || (is_power_of_two(texture.width) && is_power_of_two(texture.height));
}

Result<void> TextureStore::choose_levels(std::uint64_t budget) {
  const Table<TextureRecord> textures = bundle_.textures();
  bytes_ = 0;
  for (std::uint32_t t = 0; t < textures.size(); ++t) {
    if (!used_[t]) continue;
    std::uint32_t level = 0;
    while (level < textures[t].level_count &&
           std::max(textures[t].width >> level, textures[t].height >> level) > max_side_) {
      ++level;
    }
    if (level == textures[t].level_count) {
      return fail(ExitCode::kUnsupported, "gl.texture-size",
                  "texture '" + std::string(bundle_.name(textures[t].name)) + "'",
                  "it is larger than this device takes, and has no smaller level",
                  "bake it with mipmaps, or with a smaller --max-texture");
    }
    first_level_[t] = level;
    bytes_ += bytes_from(t, level);
  }
  // The largest one gives way, again and again, until the rest fits.
  while (budget != 0 && bytes_ > budget) {
    std::uint32_t largest = kNone;
    std::uint64_t largest_bytes = 0;
    for (std::uint32_t t = 0; t < textures.size(); ++t) {
      if (!used_[t] || first_level_[t] + 1 >= textures[t].level_count) continue;
      const std::uint64_t size = bytes_from(t, first_level_[t]);
      if (size > largest_bytes) {
        largest = t;
        largest_bytes = size;
      }
    }
    if (largest == kNone) break;
    ++first_level_[largest];
    bytes_ = bytes_ - largest_bytes + bytes_from(largest, first_level_[largest]);
  }
  return {};
}

Result<void> TextureStore::upload(std::uint64_t budget) {
  MODAR_TRY(choose_levels(budget));
  for (std::uint32_t t = 0; t < bundle_.textures().size(); ++t) {
    if (!used_[t]) continue;
    expect_reading(bundle_.texture_data(t));
    const std::uint32_t first = first_level_[t];
    colours_[t] = make(t, false, first);
    if ((bundle_.textures()[t].flags & kTextureAlpha) != 0) alphas_[t] = make(t, true, first);
  }
  decoded_ = {};
  return {};
}

GLuint TextureStore::begin(const TextureRecord& record) {
  GLuint id = 0;
  glGenTextures(1, &id);
  glBindTexture(GL_TEXTURE_2D, id);
  // ES 2.0 repeats power-of-two textures only, and shows others black if they should repeat.
  const bool repeat =
      (record.flags & kTextureRepeat) != 0 && (npot_mipmaps_ || power_of_two(record));
  const auto set = [repeat](GLenum axis, Wrap wrap) {
    const GLint beyond = wrap == Wrap::kMirror ? GL_MIRRORED_REPEAT : GL_REPEAT;
    glTexParameteri(GL_TEXTURE_2D, axis,
                    repeat && wrap != Wrap::kClamp ? beyond : GL_CLAMP_TO_EDGE);
  };
  set(GL_TEXTURE_WRAP_S, texture_wrap(record.flags)[0]);
  set(GL_TEXTURE_WRAP_T, texture_wrap(record.flags)[1]);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER,
                  mipmapped(record) ? GL_LINEAR_MIPMAP_LINEAR : GL_LINEAR);
  return id;
}

GLuint TextureStore::make(std::uint32_t texture, bool alpha, std::uint32_t first) {
  const TextureRecord& record = bundle_.textures()[texture];
  const std::span<const std::byte> data = bundle_.texture_data(texture);
  const GLuint id = begin(record);
  const std::uint32_t end = mipmapped(record) ? record.level_count : first + 1;
  for (std::uint32_t i = first; i < end; ++i) {
    const TextureLevelRecord& level = bundle_.texture_levels()[record.first_level + i];
    const std::uint64_t offset = alpha ? level.alpha_offset : level.offset;
    send(texture, i,
         data.subspan(static_cast<std::size_t>(offset), static_cast<std::size_t>(level.size)));
  }
  return id;
}

void TextureStore::send(std::uint32_t texture, std::uint32_t number,
                        std::span<const std::byte> blocks) {
  const TextureRecord& record = bundle_.textures()[texture];
  const TextureFormatInfo& format = *find_texture_format(record.format);  // the view checked it
  const TextureLevelRecord& level = bundle_.texture_levels()[record.first_level + number];
  const GLint target_level = static_cast<GLint>(number - first_level_[texture]);
  const GLsizei width = static_cast<GLsizei>(level.width);
  const GLsizei height = static_cast<GLsizei>(level.height);
  if (reads(record)) {
    const GLenum gl_format =
        format.format == TextureFormat::kEtc1Rgb ? etc1_format_ : format.gl_format;
    glCompressedTexImage2D(GL_TEXTURE_2D, target_level, gl_format, width, height, 0,
                           static_cast<GLsizei>(level.size), blocks.data());
    uploaded_bytes_ += level.size;
  } else {
    const std::size_t bytes = std::size_t{level.width} * level.height * 3;
    decoded_.resize(std::max(decoded_.size(), bytes));
    format.decode(blocks, level.width, level.height, 3, decoded_);
    glTexImage2D(GL_TEXTURE_2D, target_level, GL_RGB, width, height, 0, GL_RGB, GL_UNSIGNED_BYTE,
                 decoded_.data());
    uploaded_bytes_ += bytes;
  }
}

Result<void> TextureStore::expect(std::uint64_t budget) {
  MODAR_TRY(choose_levels(budget));
  for (std::uint32_t t = 0; t < bundle_.textures().size(); ++t) {
    if (!used_[t]) continue;
    const TextureRecord& record = bundle_.textures()[t];
    colours_[t] = begin(record);
    if ((record.flags & kTextureAlpha) != 0) alphas_[t] = begin(record);
  }
  return {};
}

Result<void> TextureStore::expect_wanted(std::uint64_t budget) {
  MODAR_TRY(choose_levels(budget));
  shown_ = first_level_;
  for (std::uint32_t t = 0; t < bundle_.textures().size(); ++t) {
    if (!used_[t]) continue;
    const TextureRecord& record = bundle_.textures()[t];
    if (mipmapped(record)) shown_[t] = std::max(shown_[t], first_shown_level(bundle_, record));
    colours_[t] = make(t, false, shown_[t]);
    if ((record.flags & kTextureAlpha) != 0) alphas_[t] = make(t, true, shown_[t]);
    show(t);
  }
  decoded_ = {};
  return {};
}

void TextureStore::show(std::uint32_t texture) const {
  constexpr GLenum kBaseLevel = 0x813C;  // of ES 3
  for (const GLuint name : {colours_[texture], alphas_[texture]}) {
    if (name == 0) continue;
    glBindTexture(GL_TEXTURE_2D, name);
    glTexParameteri(GL_TEXTURE_2D, kBaseLevel,
                    static_cast<GLint>(shown_[texture] - first_level_[texture]));
  }
}

void TextureStore::have() {
  --shown_[wanted_];
  show(wanted_);
  wanted_ = kNone;
}

std::uint32_t TextureStore::want(std::uint64_t& offset, std::uint64_t& size) {
  if (wanted_ != kNone) return kNone;
  for (std::uint32_t t = 0; t < shown_.size(); ++t) {
    if (!used_[t] || shown_[t] == first_level_[t]) continue;
    const TextureLevelRecord& level =
        bundle_.texture_levels()[bundle_.textures()[t].first_level + shown_[t] - 1];
    const bool twin = level.alpha_offset != kNoOffset;
    const std::uint64_t from = twin ? std::min(level.offset, level.alpha_offset) : level.offset;
    const std::uint64_t to = twin ? std::max(level.offset, level.alpha_offset) : level.offset;
    if (wanted_ != kNone && to + level.size - from >= size) continue;
    wanted_ = t;
    offset = from;
    size = to + level.size - from;
  }
  return wanted_;
}

void TextureStore::put(std::uint32_t texture, std::uint64_t offset,
                       std::span<const std::byte> bytes) {
  if (!used_[texture]) return;
  const TextureRecord& record = bundle_.textures()[texture];
  const std::uint32_t first = first_level_[texture];
  const std::uint32_t end = mipmapped(record) ? record.level_count : first + 1;
  for (std::uint32_t i = first; i < end; ++i) {
    const TextureLevelRecord& level = bundle_.texture_levels()[record.first_level + i];
    for (const bool alpha : {false, true}) {
      const std::uint64_t start = alpha ? level.alpha_offset : level.offset;
      const GLuint name = alpha ? alphas_[texture] : colours_[texture];
      if (name == 0 || start == kNoOffset) continue;
      if (!shown_.empty() && (texture != wanted_ || i + 1 != shown_[texture])) continue;
      const Overlap part = overlap(start, level.size, offset, bytes);
      if (!part.bytes.empty()) take(texture, name, i, part.at, part.bytes);
    }
  }
}

void TextureStore::take(std::uint32_t texture, GLuint name, std::uint32_t level, std::uint64_t at,
                        std::span<const std::byte> bytes) {
  const TextureRecord& record = bundle_.textures()[texture];
  const TextureLevelRecord& target = bundle_.texture_levels()[record.first_level + level];
  glBindTexture(GL_TEXTURE_2D, name);
  if (bytes.size() == target.size) return send(texture, level, bytes);
  const bool in_place = etc1_in_parts_ && reads(record) &&
                        record.format == static_cast<std::uint32_t>(TextureFormat::kEtc1Rgb);
  auto pending = std::find_if(pending_.begin(), pending_.end(), [&](const PendingUpload& each) {
    return each.name == name && each.level == level;
  });
  if (pending == pending_.end()) {
    pending = pending_.insert(pending_.end(), PendingUpload{name, level, 0, {}, {}});
    if (in_place) {
      // ES 2.0 names no way to make the level without its bytes.
      decoded_.resize(static_cast<std::size_t>(target.size));
      send(texture, level, std::as_bytes(std::span(decoded_)));
    } else {
      pending->bytes.resize(static_cast<std::size_t>(target.size));
    }
  }
  pending->came += bytes.size();
  if (in_place) {
    take_in_place(target, static_cast<GLint>(level - first_level_[texture]), *pending, at, bytes);
  } else {
    std::copy(bytes.begin(), bytes.end(), pending->bytes.begin() + static_cast<std::ptrdiff_t>(at));
    if (pending->came == target.size) send(texture, level, pending->bytes);
  }
  if (pending->came == target.size) pending_.erase(pending);
  decoded_ = {};
}

void TextureStore::take_in_place(const TextureLevelRecord& level, GLint target_level,
                                 PendingUpload& pending, std::uint64_t at,
                                 std::span<const std::byte> bytes) {
  while (!bytes.empty()) {
    const std::uint64_t block = at / kEtc1Block;
    const std::uint64_t start = at % kEtc1Block;
    std::size_t count = bytes.size() / kEtc1Block * kEtc1Block;
    if (start == 0 && count > 0) {
      send_blocks(level, target_level, block, bytes.first(count));
    } else {
      count = std::min(static_cast<std::size_t>(kEtc1Block - start), bytes.size());
      const auto found = std::find(pending.cut.begin(), pending.cut.end(), block);
      const auto place = static_cast<std::size_t>(found - pending.cut.begin()) * kEtc1Block;
      if (found == pending.cut.end()) {
        pending.cut.push_back(block);
        pending.bytes.resize(place + kEtc1Block);
      }
      const std::span<std::byte> whole = std::span(pending.bytes).subspan(place, kEtc1Block);
      std::copy_n(bytes.begin(), count, whole.begin() + static_cast<std::ptrdiff_t>(start));
      send_blocks(level, target_level, block, whole);
    }
    at += count;
    bytes = bytes.subspan(count);
  }
}

void TextureStore::send_blocks(const TextureLevelRecord& level, GLint target_level,
                               std::uint64_t first, std::span<const std::byte> blocks) {
  const std::uint64_t a_row = (level.width + 3) / 4;
  uploaded_bytes_ += blocks.size();
  while (!blocks.empty()) {
    const std::uint64_t count = blocks.size() / kEtc1Block;
    const std::uint64_t column = first % a_row;
    const std::uint64_t across = std::min(count, a_row - column);
    const std::uint64_t down = across == a_row ? count / a_row : 1;
    const auto x = static_cast<GLint>(4 * column);
    const auto y = static_cast<GLint>(4 * (first / a_row));
    const auto size = static_cast<std::size_t>(across * down * kEtc1Block);
    glCompressedTexSubImage2D(
        GL_TEXTURE_2D, target_level, x, y,
        std::min(static_cast<GLsizei>(4 * across), static_cast<GLsizei>(level.width) - x),
        std::min(static_cast<GLsizei>(4 * down), static_cast<GLsizei>(level.height) - y),
        etc1_format_, static_cast<GLsizei>(size), blocks.data());
    first += across * down;
    blocks = blocks.subspan(size);
  }
}

std::uint64_t TextureStore::kept_bytes() const {
  std::uint64_t bytes = 0;
  for (const PendingUpload& each : pending_) {
    bytes += each.bytes.size();
  }
  return bytes;
}

void TextureStore::release(GlState& gl) {
  for (std::vector<GLuint>* names : {&colours_, &alphas_}) {
    for (const GLuint name : *names) {
      if (name == 0) continue;
      gl.forget_texture(name);
      glDeleteTextures(1, &name);
    }
  }
}

}  // namespace modar
