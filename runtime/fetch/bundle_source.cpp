#include "bundle_source.hpp"

#include <cstring>

#include "files.hpp"
#include "modar/piece.hpp"

namespace modar::fetch {

Result<RecipeView> unpack_recipe(std::span<const std::byte> stored, std::size_t raw_size,
                                 std::vector<std::uint64_t>& bytes) {
  const auto raw = unpack_zstd(stored, raw_size);
  if (!raw) return tl::unexpected(raw.error());
  bytes.assign((raw->size() + 7) / 8, 0);
  if (!raw->empty()) std::memcpy(bytes.data(), raw->data(), raw->size());
  return open_recipe(std::as_bytes(std::span(bytes)).first(raw->size()));
}

void shift_indices(std::span<std::byte> indices, std::uint16_t base) {
  for (std::size_t i = 0; i + 1 < indices.size(); i += 2) {
    std::uint16_t index = 0;
    std::memcpy(&index, indices.data() + i, 2);
    index = static_cast<std::uint16_t>(index + base);
    std::memcpy(indices.data() + i, &index, 2);
  }
}

void PieceSource::add(const InstalledRelease& installed) {
  for (const ReleaseBundle& bundle : installed.release.bundles) {
    const std::string path = installed.folder + "/" + bundle.name;
    auto file = MappedFile::open(path + ".modar");
    const auto stored = read_small_file(path + ".recipe", kMaxRecipeBytes);
    if (!file || !stored || file->bytes().size() != bundle.size) continue;
    auto old = std::make_unique<OldBundle>();
    old->bundle = std::move(*file);
    const auto recipe =
        unpack_recipe(std::as_bytes(std::span(*stored)), bundle.recipe_raw_size, old->recipe_bytes);
    if (!recipe || recipe->header.bundle_size != bundle.size) continue;
    old->recipe = *recipe;
    for (const PieceRecord& piece : old->recipe.pieces) {
      if (piece.stored_size == 0) continue;
      places_.emplace(std::to_array(piece.id), std::pair(old.get(), &piece));
    }
    bundles_.push_back(std::move(old));
  }
}

std::optional<std::vector<std::byte>> PieceSource::raw(const ObjectId& id) const {
  const auto place = places_.find(id);
  if (place == places_.end()) return std::nullopt;
  const auto& [old, piece] = place->second;
  const auto bytes = old->bundle.bytes();
  const auto first = bytes.subspan(piece->offset, piece->raw_size - piece->second_size);
  const auto second = bytes.subspan(piece->second_offset, piece->second_size);
  std::vector<std::byte> raw(first.begin(), first.end());
  raw.insert(raw.end(), second.begin(), second.end());
  const bool level = static_cast<PieceForm>(piece->form) == PieceForm::kLevel;
  shift_indices(std::span(raw).subspan(level ? 0 : first.size()),
                static_cast<std::uint16_t>(-piece->index_base));
  if (raw_hash(raw) != piece->raw_hash) return std::nullopt;
  return raw;
}

}  // namespace modar::fetch
