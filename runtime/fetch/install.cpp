#include "install.hpp"

#include <algorithm>
#include <chrono>
#include <cstring>
#include <map>
#include <memory>
#include <set>
#include <utility>

#include "formats/bundle_view.hpp"
#include "formats/bundle_writer.hpp"
#include "formats/check.hpp"
#include "formats/trim.hpp"
#include "modar/mapped_file.hpp"
#include "modar/piece.hpp"

namespace modar::fetch {
namespace {

// --- Installed bundles as a source of pieces ---

/// Unpacks and validates a recipe as stored; `bytes` receives what the view points into.
/// Errors: kInvalidInput "recipe.*".
Result<RecipeView> unpack_recipe(std::span<const std::byte> stored, std::size_t raw_size,
                                 std::vector<std::uint64_t>& bytes) {
  MODAR_ASSIGN(const auto raw, unpack_zstd(stored, raw_size));
  bytes.assign((raw.size() + 7) / 8, 0);
  if (!raw.empty()) std::memcpy(bytes.data(), raw.data(), raw.size());
  return open_recipe(std::as_bytes(std::span(bytes)).first(raw.size()));
}

/// An installed bundle with its recipe.
struct OldBundle {
  MappedFile bundle;
  std::vector<std::uint64_t> recipe_bytes;  ///< aligned for RecipeView
  RecipeView recipe;
};

class PieceSource {
 public:
  /// Maps those bundles of an installed release whose recipe can be read.
  void add(const InstalledRelease& installed);
  /// Whether one of them has the piece.
  [[nodiscard]] bool has(const ObjectId& id) const { return places_.contains(id); }
  /// Its raw bytes; nothing if they do not have the hash that the recipe says (a damaged file).
  [[nodiscard]] std::optional<std::vector<std::byte>> raw(const ObjectId& id) const;

 private:
  std::vector<std::unique_ptr<OldBundle>> bundles_;
  std::map<ObjectId, std::pair<const OldBundle*, const PieceRecord*>> places_;
};

void PieceSource::add(const InstalledRelease& installed) {
  for (const ReleaseBundle& bundle : installed.release.bundles) {
    auto file = installed.folder.map(bundle.name + ".modar");
    const auto stored = installed.folder.read(bundle.name + ".recipe", kMaxRecipeBytes);
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
  const auto first =
      bytes.subspan(static_cast<std::size_t>(piece->offset), piece->raw_size - piece->second_size);
  const auto second =
      bytes.subspan(static_cast<std::size_t>(piece->second_offset), piece->second_size);
  std::vector<std::byte> raw(first.begin(), first.end());
  raw.insert(raw.end(), second.begin(), second.end());
  subtract_index_base(*piece, raw);
  if (raw_hash(raw) != piece->raw_hash) return std::nullopt;
  return raw;
}

// --- A bundle from old pieces and new ones ---

/// A bundle under construction.
struct Assembly {
  ReleaseBundle bundle;
  std::string recipe_stored;                ///< as downloaded, kept next to the bundle
  std::vector<std::uint64_t> recipe_bytes;  ///< unpacked, aligned
  RecipeView recipe;
  bool shows = false;  ///< has a preview
};

/// The file that pieces are written into, and which.
struct Target {
  const Folder& folder;
  std::string name;
  LoadStage last = LoadStage::kRefine;  ///< later ones are left out, and their bytes zero
};

struct AssemblyCounts {
  std::uint64_t reused_bytes = 0;
  std::uint32_t reused_pieces = 0;
  std::uint32_t new_pieces = 0;
};

Result<void> write_raw(OutputFile& file, const PieceRecord& piece, std::span<std::byte> raw) {
  add_index_base(piece, raw);
  const PieceParts parts = parts_of(piece, raw);
  MODAR_TRY(file.write_at(piece.offset, parts.first.data(), parts.first.size()));
  if (parts.second.empty()) return {};
  return file.write_at(piece.second_offset, parts.second.data(), parts.second.size());
}

/// Feature texts are written last, from the mapped features that are in the file by then.
Result<void> write_texts(const Assembly& assembly, const Target& target, OutputFile& file) {
  MODAR_ASSIGN(const auto mapped, target.folder.map(target.name));
  for (const PieceRecord& piece : assembly.recipe.pieces) {
    if (static_cast<PieceForm>(piece.form) != PieceForm::kFeatureText) continue;
    MODAR_ASSIGN(auto raw, decode_piece(piece, mapped.bytes().subspan(
                                                   static_cast<std::size_t>(piece.second_offset),
                                                   piece.second_size)));
    MODAR_TRY(write_raw(file, piece, raw));
  }
  return {};
}

Result<std::vector<std::byte>> downloaded(const PieceRecord& piece, const Folder& pieces) {
  MODAR_ASSIGN(const auto file, pieces.map(to_hex(piece.id)));
  return decode_piece(piece, file.bytes());
}

/// Writes the target's file: pieces that `source` has from there, the others from
/// `pieces`/ID. Pieces in `damaged` are never taken from `source`; pieces of it that turn out to be
/// damaged are added to the set, and then the file is left unfinished. Errors: kIo; kInvalidInput.
Result<void> assemble(const Assembly& assembly, const Target& target, const PieceSource& source,
                      const Folder& pieces, AssemblyCounts& counts, std::set<ObjectId>& damaged) {
  const std::size_t known_damage = damaged.size();
  MODAR_ASSIGN(auto file, target.folder.create(target.name));
  MODAR_TRY(file.resize(assembly.bundle.size));  // bytes that no piece covers are zero
  for (const PieceRecord& piece : assembly.recipe.pieces) {
    if (piece.stored_size == 0 || piece.stage > static_cast<std::uint8_t>(target.last)) continue;
    const ObjectId id = std::to_array(piece.id);
    if (source.has(id) && !damaged.contains(id)) {
      auto raw = source.raw(id);
      if (!raw || raw->size() != piece.raw_size || raw_hash(*raw) != piece.raw_hash) {
        damaged.insert(id);
        continue;
      }
      MODAR_TRY(write_raw(file, piece, *raw));
      counts.reused_bytes += raw->size();
      ++counts.reused_pieces;
      continue;
    }
    MODAR_ASSIGN(auto raw, downloaded(piece, pieces));
    MODAR_TRY(write_raw(file, piece, raw));
    ++counts.new_pieces;
  }
  if (damaged.size() != known_damage || target.last != LoadStage::kRefine) return {};
  MODAR_TRY(write_texts(assembly, target, file));
  return file.sync();
}

// --- A release ---

/// Left free beyond the need, for folders, links and the state: 256 blocks of 4 KiB, of which
/// each takes one or two.
constexpr std::uint64_t kSpareBytes = 1u << 20;

/// Most raw bytes of a preview, which is made in memory. More are shown when they are whole.
constexpr std::uint64_t kMostFirstBytes = 32u << 20;

/// Reports progress at most ten times a second.
class ProgressReporter {
 public:
  ProgressReporter(const FetchOptions& options, std::uint64_t total)
      : options_(options), begin_(std::chrono::steady_clock::now()) {
    progress_.bytes_total = total;
  }
  void add(std::int64_t bytes) {
    progress_.bytes_done += static_cast<std::uint64_t>(bytes);
    if (first_ == 0 && bytes > 0) first_ = progress_.bytes_done;
    const auto now = std::chrono::steady_clock::now();
    if (!options_.progress || now - reported_ < std::chrono::milliseconds(100)) return;
    reported_ = now;
    const double seconds = std::chrono::duration<double>(now - begin_).count();
    const double came = double(progress_.bytes_done) - double(first_);
    if (came > 0 && seconds > 1) {
      progress_.seconds_left =
          (double(progress_.bytes_total) - double(progress_.bytes_done)) * seconds / came;
    }
    options_.progress(progress_);
  }

 private:
  const FetchOptions& options_;
  FetchProgress progress_;
  std::uint64_t first_ = 0;  // bytes of earlier runs
  std::chrono::steady_clock::time_point begin_;
  std::chrono::steady_clock::time_point reported_{};
};

/// One installation, from the verified document to the switch.
class Installation {
 public:
  explicit Installation(const InstallationJob& job)
      : options_(job.options),
        store_(job.store),
        transfers_(job.transfers),
        offered_(job.offered),
        active_(job.active),
        chosen_(job.chosen),
        slot_(job.store.spare_folder()),
        pieces_(job.store.pieces()) {}

  Result<void> run(FetchReport& report) {
    if (active_) source_.add(*active_);
    return bring_recipes()
        .and_then([&] { return find_kept(); })
        .and_then([&] { return tidy_pieces(); })
        .and_then([&] { return bring_pieces(); })
        // The release before goes only now that every piece of the new one is here.
        .and_then([&] { return store_.clear_slot(slot_, kept_); })
        .and_then([&] { return build(report); })
        .and_then([&] { return finish(); });
  }

 private:
  Result<void> bring_recipes() {
    assemblies_.reserve(chosen_.size());
    std::vector<ObjectRequest> requests;
    std::set<ObjectId> known;  // bundles of equal content share a recipe
    for (const ReleaseBundle& bundle : chosen_) {
      if (!known.insert(bundle.recipe).second || pieces_.size(to_hex(bundle.recipe))) continue;
      requests.push_back(request(bundle.recipe, bundle.recipe_size));
    }
    MODAR_TRY(transfers_.objects(requests, [](std::int64_t) {}));
    for (const ReleaseBundle& bundle : chosen_) {
      Assembly& assembly = assemblies_.emplace_back();
      assembly.bundle = bundle;
      MODAR_TRY(open_stored_recipe(assembly));
      assembly.shows = has_preview(assembly);
    }
    return {};
  }

  Result<void> open_stored_recipe(Assembly& assembly) {
    const std::string file = to_hex(assembly.bundle.recipe);
    const auto stored = pieces_.read(file, kMaxRecipeBytes);
    if (!stored || object_id(std::as_bytes(std::span(*stored))) != assembly.bundle.recipe) {
      // It was damaged on the disk after it was verified: the next run downloads it again.
      MODAR_TRY(pieces_.remove(file));
      return fail(ExitCode::kIo, "fetch.recipe", pieces_.path_of(file),
                  "it was damaged on the disk", "run modar-fetch again");
    }
    assembly.recipe_stored = *stored;
    MODAR_ASSIGN(const auto recipe,
                 unpack_recipe(std::as_bytes(std::span(assembly.recipe_stored)),
                               assembly.bundle.recipe_raw_size, assembly.recipe_bytes));
    assembly.recipe = recipe;
    if (recipe.header.bundle_size != assembly.bundle.size ||
        !std::equal(assembly.bundle.hash.begin(), assembly.bundle.hash.end(),
                    recipe.header.bundle_hash)) {
      return fail(kExitMixed, "fetch.mixed", "bundle " + assembly.bundle.name,
                  "its recipe belongs to another bundle", "publish the release again");
    }
    return {};
  }

  /// Whether somebody wants to show the bundle before all of it is there: none of that name is in
  /// use.
  [[nodiscard]] bool has_preview(const Assembly& assembly) const {
    if (!options_.first || shown_bytes(assembly) > kMostFirstBytes) return false;
    return !active_ || !active_->folder.size(assembly.bundle.name + kWhole);
  }

  /// Raw bytes of stages 1 and 2; all of a bundle whose recipe states no stages.
  static std::uint64_t shown_bytes(const Assembly& assembly) {
    std::uint64_t bytes = 0;
    for (const PieceRecord& piece : assembly.recipe.pieces) {
      if (piece.stage == static_cast<std::uint8_t>(LoadStage::kAny)) return kMaxBundleBytes;
      if (piece.stage <= static_cast<std::uint8_t>(LoadStage::kShow)) bytes += piece.raw_size;
    }
    return bytes;
  }

  struct Missing {
    std::uint64_t size = 0;  ///< of the object
    std::size_t turn = 0;    ///< number of the first assembly that shows it, or behind the last
  };

  /// Pieces that no installed bundle has.
  [[nodiscard]] std::map<ObjectId, Missing> missing_pieces() const {
    std::map<ObjectId, Missing> missing;
    for (std::size_t i = 0; i < assemblies_.size(); ++i) {
      const Assembly& assembly = assemblies_[i];
      for (const PieceRecord& piece : assembly.recipe.pieces) {
        const ObjectId id = std::to_array(piece.id);
        if (piece.stored_size == 0 || (source_.has(id) && !damaged_.contains(id))) continue;
        const bool shown = assembly.shows && LoadStage{piece.stage} != LoadStage::kRefine;
        Missing& entry =
            missing.try_emplace(id, Missing{piece.stored_size, assemblies_.size()}).first->second;
        if (shown) entry.turn = std::min(entry.turn, i);
      }
    }
    return missing;
  }

  /// Removes pieces that this release does not need.
  Result<void> tidy_pieces() {
    std::set<std::string> needed;
    for (const auto& [id, piece] : missing_pieces()) needed.insert(to_hex(id));
    for (const Assembly& assembly : assemblies_) {
      needed.insert(to_hex(assembly.bundle.recipe));
      if (assembly.shows) needed.insert(assembly.bundle.name + kFirst);
    }
    return store_.remove_pieces(needed);
  }

  /// Bundles that the spare slot has already, from the release before.
  Result<void> find_kept() {
    const auto before = read_slot(slot_);
    if (!before) return {};
    for (const Assembly& assembly : assemblies_) {
      for (const ReleaseBundle& old : before->release.bundles) {
        if (old.name != assembly.bundle.name || old.hash != assembly.bundle.hash) continue;
        // Under another name, somebody may write to it, or the other slot.
        if (slot_.has_other_names(old.name + kWhole)) continue;
        if (has_hash(slot_, assembly.bundle)) kept_.insert(old.name);
      }
    }
    return {};
  }

  /// Previews come first, one bundle after the other, then the rest.
  Result<void> bring_pieces() {
    std::vector<std::vector<ObjectRequest>> turns(assemblies_.size() + 1);
    std::uint64_t total = 0;
    std::uint64_t needed = kSpareBytes;
    for (const auto& [id, piece] : missing_pieces()) {
      if (is_whole(id, piece.size)) continue;
      turns[piece.turn].push_back(request(id, piece.size));
      total += piece.size;
      const auto part = pieces_.size(to_hex(id) + ".part").value_or(0);
      needed += piece.size - std::min(part, piece.size);
    }
    MODAR_ASSIGN(std::uint64_t room, room_beside(needed));
    ProgressReporter progress(options_, total);
    const auto count = [&](std::int64_t bytes) { progress.add(bytes); };
    for (std::size_t i = 0; i < assemblies_.size(); ++i) {
      if (!turns[i].empty()) MODAR_TRY(transfers_.objects(turns[i], count));
      if (!turns.back().empty()) show_first(assemblies_[i], room);
    }
    return transfers_.objects(turns.back(), count);
  }

  /// Bytes that are free beyond what the release takes. needed: for pieces. Errors: kExitNoSpace.
  [[nodiscard]] Result<std::uint64_t> room_beside(std::uint64_t needed) const {
    std::uint64_t reclaimed = 0;  // by clearing the spare slot once the pieces are here
    const std::uint64_t before_clearing = needed;
    for (const Assembly& assembly : assemblies_) {
      if (!kept_.contains(assembly.bundle.name)) needed += assembly.bundle.size;
    }
    for (const std::string& name : slot_.list()) {
      const bool kept = kept_.contains(name.substr(0, name.rfind('.')));
      if (!kept) reclaimed += slot_.size(name).value_or(0);
    }
    needed = std::max(before_clearing, needed - std::min(needed, reclaimed));
    MODAR_ASSIGN(const auto space, store_.folder().free_space());
    if (space >= needed) return space - needed;
    return fail(
        kExitNoSpace, "fetch.space", store_.folder().path(),
        std::to_string(needed) + " bytes are needed, " + std::to_string(space) + " are free",
        "make room and run modar-fetch again");
  }

  /// Reports the preview of a new bundle, once. Where none can be made, the bundle is seen
  /// when it is whole, or the build says why. room: bytes, less what it takes.
  void show_first(Assembly& assembly, std::uint64_t& room) {
    const std::uint64_t bytes = shown_bytes(assembly);
    if (!std::exchange(assembly.shows, false) || assembly.bundle.size + bytes > room) return;
    const std::string name = assembly.bundle.name + kFirst;
    const bool made = make_preview(assembly, name).has_value();
    static_cast<void>(pieces_.remove(name + ".part"));
    if (!made) return;
    room -= bytes;
    options_.first(pieces_.path_of(name));
  }

  Result<void> make_preview(const Assembly& assembly, const std::string& name) {
    AssemblyCounts counts;
    const std::size_t known = damaged_.size();
    const std::string part = name + ".part";
    MODAR_TRY(
        assemble(assembly, {pieces_, part, LoadStage::kShow}, source_, pieces_, counts, damaged_));
    MODAR_ASSIGN(auto mapped, pieces_.map(part));
    if (const auto start = hide_twins(mapped.bytes())) {
      MODAR_ASSIGN(auto file, pieces_.resume(part));
      MODAR_TRY(file.write_at(0, start->data(), start->size()));
    }
    MODAR_ASSIGN(mapped, pieces_.map(part));  // with the written part
    MODAR_ASSIGN(const BundleView view, BundleView::open(mapped.bytes()));
    MODAR_ASSIGN(const auto bytes, encode_bundle(preview(view)));
    const std::string error = first_error(bytes, {.release = {}, .accept_newer = true});
    if (!error.empty() || damaged_.size() != known) {
      return fail(kExitBadBundle, "store.rules", pieces_.path_of(name), error, "");
    }
    return pieces_.replace(name, {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
  }

  /// Whether the store has a piece with the right content; one with the wrong content is removed.
  bool is_whole(const ObjectId& id, std::uint64_t size) {
    const std::string file = to_hex(id);
    if (!pieces_.size(file)) return false;
    if (const auto mapped = pieces_.map(file);
        mapped && mapped->bytes().size() == size && object_id(mapped->bytes()) == id) {
      return true;
    }
    static_cast<void>(pieces_.remove(file));  // what stays is renamed over, or says so then
    return false;
  }

  Result<void> build(FetchReport& report) {
    for (const Assembly& assembly : assemblies_) {
      if (kept_.contains(assembly.bundle.name)) {
        report.reused_bytes += assembly.bundle.size;
        report.reused_pieces += static_cast<std::uint32_t>(assembly.recipe.pieces.size());
        continue;
      }
      // The recipe first: clear_slot() takes it for the sign that the bundle is ours.
      if (const std::string file = assembly.bundle.name + kWhole; slot_.has(file)) {
        return fail(ExitCode::kIo, "store.foreign", slot_.path_of(file),
                    "modar-fetch did not write it", "move it elsewhere");
      }
      MODAR_TRY(slot_.replace(assembly.bundle.name + ".recipe", assembly.recipe_stored));
      MODAR_TRY(build_bundle(assembly, report));
      MODAR_TRY(verify_bundle(slot_, assembly.bundle));
    }
    return {};
  }

  Result<void> build_bundle(const Assembly& assembly, FetchReport& report) {
    AssemblyCounts counts;
    while (true) {
      const std::size_t known = damaged_.size();
      counts = {};
      MODAR_TRY(assemble(assembly, {slot_, assembly.bundle.name + kWhole}, source_, pieces_, counts,
                         damaged_));
      if (damaged_.size() == known) break;
      // An installed bundle is damaged on the disk: download these pieces after all.
      report.corrupt_pieces += static_cast<std::uint32_t>(damaged_.size() - known);
      MODAR_TRY(bring_pieces());
    }
    report.reused_bytes += counts.reused_bytes;
    report.reused_pieces += counts.reused_pieces;
    report.downloaded_pieces += counts.new_pieces;
    return {};
  }

  /// The documents last: a slot with a release.json is complete.
  Result<void> finish() {
    if (!offered_.fresh_text.empty()) MODAR_TRY(slot_.replace("fresh.json", offered_.fresh_text));
    return slot_.replace("release.json.minisig", offered_.signature_text)
        .and_then([&] { return slot_.replace("release.json", offered_.text); })
        .and_then([&] {
          return store_.activate({slot_, offered_.text, offered_.release});
        });
  }

  [[nodiscard]] ObjectRequest request(const ObjectId& id, std::uint64_t size) const {
    return {id, size, "objects/" + object_path(id), &pieces_};
  }

  const FetchOptions& options_;
  const Store& store_;
  Transfers& transfers_;
  const SignedRelease& offered_;
  const std::optional<InstalledRelease>& active_;
  const std::vector<ReleaseBundle>& chosen_;
  const Folder& slot_;
  const Folder& pieces_;
  PieceSource source_;
  std::vector<Assembly> assemblies_;
  std::set<ObjectId> damaged_;
  std::set<std::string> kept_;  // bundles that stay in the slot unchanged
};

}  // namespace

bool has_hash(const Folder& slot, const ReleaseBundle& bundle) {
  const auto mapped = slot.map(bundle.name + kWhole);
  return mapped && mapped->bytes().size() == bundle.size &&
         bundle_hash(mapped->bytes()) == bundle.hash;
}

Result<void> verify_bundle(const Folder& slot, const ReleaseBundle& bundle) {
  MODAR_ASSIGN(const auto mapped, slot.map(bundle.name + ".modar"));
  const std::string file = slot.path_of(bundle.name + ".modar");
  if (mapped.bytes().size() != bundle.size || bundle_hash(mapped.bytes()) != bundle.hash) {
    return fail(kExitBadBundle, "store.hash", file, "it differs from the signed one",
                "run modar-fetch again");
  }
  const std::string error = first_error(mapped.bytes(), {.release = {}, .accept_newer = true});
  if (error.empty()) return {};
  return fail(kExitBadBundle, "store.rules", file, error,
              "inform the publisher: `modar check` finds this before publishing");
}

Result<void> install(const InstallationJob& job, FetchReport& report) {
  return Installation(job).run(report);
}

}  // namespace modar::fetch
