// The bundle's textures in GL: compressed blocks straight from the mapped bytes, or decoded to RGB.
#pragma once

#include <cstdint>
#include <vector>

#include "formats/base/error.hpp"
#include "formats/bundle_view.hpp"
#include "modar/gl_context.hpp"
#include "runtime/render/gl.hpp"

namespace modar {

class TextureStore {
 public:
  TextureStore(const BundleView& bundle, const GlCaps& caps);

  /// Uploads every texture that a material or a picture names. Levels larger than the context's
  /// limit are left out; so are the finest ones while all together are larger than `budget` bytes
  /// (0: no limit). Errors: kUnsupported "gl.texture-size" where no level is small enough.
  Result<void> upload(std::uint64_t budget);
  /// In place of upload(), where the blocks come later: makes the textures for put(). Errors: as
  /// upload().
  Result<void> expect(std::uint64_t budget);
  /// In place of upload(), where levels that first_shown_level() leaves out come when want() asks
  /// for them. Needs ES 3. Errors: as upload().
  Result<void> expect_wanted(std::uint64_t budget);
  /// After expect_wanted(): the smallest level that is missing, as bytes of its texture's section,
  /// which put() takes until have(). Answers the texture; kNone: all are there, or one is awaited.
  std::uint32_t want(std::uint64_t& offset, std::uint64_t& size);
  /// All bytes of what want() named were put(): it is drawn from now on.
  void have();
  /// Bytes of a texture's section from `offset` on, each of which comes once. Where the context
  /// takes parts of ETC1 textures they are uploaded to their place; else a level's bytes are kept
  /// until its last one is here.
  void put(std::uint32_t texture, std::uint64_t offset, std::span<const std::byte> bytes);
  void release(GlState& gl);

  /// 0 if none.
  [[nodiscard]] GLuint colour(std::uint32_t texture) const { return colours_[texture]; }
  [[nodiscard]] GLuint alpha(std::uint32_t texture) const { return alphas_[texture]; }
  [[nodiscard]] std::uint64_t bytes() const { return bytes_; }
  [[nodiscard]] std::uint64_t uploaded_bytes() const { return uploaded_bytes_; }
  /// Of levels that have come in part: kept in memory.
  [[nodiscard]] std::uint64_t kept_bytes() const;

 private:
  /// Whether the context reads the texture's blocks; else they are decoded to RGB.
  [[nodiscard]] bool reads(const TextureRecord& texture) const {
    return (formats_ >> texture.format & 1) != 0;
  }
  [[nodiscard]] std::uint64_t level_bytes(const TextureRecord& texture, std::uint32_t level) const;
  [[nodiscard]] std::uint64_t bytes_from(std::uint32_t texture, std::uint32_t first) const;
  [[nodiscard]] bool mipmapped(const TextureRecord& texture) const;
  Result<void> choose_levels(std::uint64_t budget);
  /// A texture without levels, bound.
  GLuint begin(const TextureRecord& texture);
  GLuint make(std::uint32_t texture, bool alpha, std::uint32_t first);
  /// Of this texture, levels from shown_ on are there.
  void show(std::uint32_t texture) const;
  /// Uploads a level (counted from the bundle's finest) to the texture that is bound.
  void send(std::uint32_t texture, std::uint32_t level, std::span<const std::byte> blocks);

  /// A level of which some bytes have come.
  struct PendingUpload {
    GLuint name = 0;
    std::uint32_t level = 0;
    std::uint64_t came = 0;
    std::vector<std::byte> bytes;    ///< of the level, or of the blocks `cut`
    std::vector<std::uint64_t> cut;  ///< in place: numbers of blocks that came in two pieces
  };
  /// Some bytes of a level from `at` on, of its texture `name`.
  void take(std::uint32_t texture, GLuint name, std::uint32_t level, std::uint64_t at,
            std::span<const std::byte> bytes);

  /// The same into the bound texture, which has that level.
  void take_in_place(const TextureLevelRecord& level, GLint target_level, PendingUpload& pending,
                     std::uint64_t at, std::span<const std::byte> bytes);
  /// Whole blocks from number `first` on, in rows.
  void send_blocks(const TextureLevelRecord& level, GLint target_level, std::uint64_t first,
                   std::span<const std::byte> blocks);

  const BundleView& bundle_;
  std::uint32_t formats_ = 0;  ///< as in GlCaps
  GLenum etc1_format_ = 0;
  bool etc1_in_parts_ = false;
  bool npot_mipmaps_ = false;
  std::uint32_t max_side_ = 64;
  std::vector<bool> used_;
  std::vector<std::uint32_t> first_level_;  ///< finest one that is uploaded
  std::vector<GLuint> colours_;
  std::vector<GLuint> alphas_;
  std::vector<std::uint8_t> decoded_;
  std::vector<PendingUpload> pending_;
  std::vector<std::uint32_t> shown_;  ///< after expect_wanted(): the finest level that is there
  std::uint32_t wanted_ = kNone;      ///< texture
  std::uint64_t bytes_ = 0;
  std::uint64_t uploaded_bytes_ = 0;
};

}  // namespace modar
