#include "assembly.hpp"

#include <cstring>

#include "formats/check.hpp"
#include "modar/digest.hpp"
#include "modar/piece.hpp"

namespace modar::fetch {
namespace {

Result<void> write_raw(OutputFile& file, const PieceRecord& piece, std::span<std::byte> raw) {
  const auto form = static_cast<PieceForm>(piece.form);
  const std::size_t second_size = form == PieceForm::kMesh ? piece.second_size : 0;
  const auto second = raw.last(second_size);
  shift_indices(form == PieceForm::kLevel ? raw : second, piece.index_base);
  if (auto done = file.write_at(piece.offset, raw.data(), raw.size() - second_size); !done) {
    return done;
  }
  if (second.empty()) return {};
  return file.write_at(piece.second_offset, second.data(), second.size());
}

/// Texts are written last, from the twins that stand in the file by then.
Result<void> write_texts(const Assembly& assembly, OutputFile& file) {
  const auto mapped = MappedFile::open(assembly.file);
  if (!mapped) return tl::unexpected(mapped.error());
  for (const PieceRecord& piece : assembly.recipe.pieces) {
    if (static_cast<PieceForm>(piece.form) != PieceForm::kFeatureText) continue;
    auto raw = decode_piece(piece, mapped->bytes().subspan(piece.second_offset, piece.second_size));
    if (!raw) return tl::unexpected(raw.error());
    if (auto done = write_raw(file, piece, *raw); !done) return done;
  }
  return {};
}

Result<std::vector<std::byte>> downloaded(const PieceRecord& piece, const std::string& pieces) {
  const auto file = MappedFile::open(pieces + "/" + to_hex(piece.id));
  if (!file) return tl::unexpected(file.error());
  return decode_piece(piece, file->bytes());
}

}  // namespace

Result<void> assemble(const Assembly& assembly, const PieceSource& source,
                      const std::string& pieces, AssemblyCounts& counts,
                      std::set<ObjectId>& damaged) {
  const std::size_t known_damage = damaged.size();
  auto file = OutputFile::open(assembly.file);
  if (!file) return tl::unexpected(file.error());
  if (auto sized = file->resize(assembly.bundle.size); !sized) return sized;
  for (const PieceRecord& piece : assembly.recipe.pieces) {
    if (piece.stored_size == 0) continue;
    const ObjectId id = std::to_array(piece.id);
    if (source.has(id) && !damaged.contains(id)) {
      auto raw = source.raw(id);
      if (!raw || raw->size() != piece.raw_size || raw_hash(*raw) != piece.raw_hash) {
        damaged.insert(id);
        continue;
      }
      if (auto done = write_raw(*file, piece, *raw); !done) return done;
      counts.reused_bytes += raw->size();
      ++counts.reused_pieces;
      continue;
    }
    auto raw = downloaded(piece, pieces);
    if (!raw) return tl::unexpected(raw.error());
    if (auto done = write_raw(*file, piece, *raw); !done) return done;
    ++counts.new_pieces;
  }
  if (damaged.size() != known_damage) return {};
  if (auto done = write_texts(assembly, *file); !done) return done;
  return file->sync();
}

Result<void> verify_bundle(const std::string& file, const ReleaseBundle& bundle) {
  const auto mapped = MappedFile::open(file);
  if (!mapped) return tl::unexpected(mapped.error());
  if (mapped->bytes().size() != bundle.size || bundle_hash(mapped->bytes()) != bundle.hash) {
    return fail(kExitBadBundle, "store.hash", file, "it is not what was signed",
                "run modar-fetch again");
  }
  const std::string error = first_error(mapped->bytes());
  if (error.empty()) return {};
  return fail(kExitBadBundle, "store.rules", file, error,
              "tell the publisher: `modar check` finds it before publishing");
}

}  // namespace modar::fetch
