#include "installation.hpp"

#include <algorithm>
#include <chrono>
#include <map>
#include <set>

#include <unistd.h>

#include "assembly.hpp"
#include "formats/atomic_file.hpp"
#include "modar/digest.hpp"

namespace modar::fetch {
namespace {

/// Left free beyond what is needed: folders, links, the state.
constexpr std::uint64_t kSpareBytes = 1u << 20;

/// Calls the caller's progress at most ten times a second.
class ProgressTeller {
 public:
  ProgressTeller(const FetchOptions& options, std::uint64_t total)
      : options_(options), begin_(std::chrono::steady_clock::now()) {
    progress_.bytes_total = total;
  }
  void add(std::int64_t bytes) {
    progress_.bytes_done += static_cast<std::uint64_t>(bytes);
    if (first_ == 0 && bytes > 0) first_ = progress_.bytes_done;
    const auto now = std::chrono::steady_clock::now();
    if (!options_.progress || now - told_ < std::chrono::milliseconds(100)) return;
    told_ = now;
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
  std::uint64_t first_ = 0;  // what lay there before
  std::chrono::steady_clock::time_point begin_;
  std::chrono::steady_clock::time_point told_{};
};

/// One installation, from the signed document on.
class Installation {
 public:
  explicit Installation(const InstallationJob& job)
      : options_(job.options),
        store_(job.store),
        transfers_(job.transfers),
        news_(job.news),
        active_(job.active),
        chosen_(job.chosen),
        slot_(job.store.spare_folder()) {}

  Result<void> run(FetchReport& report) {
    if (active_) source_.add(*active_);
    return bring_recipes()
        .and_then([&] { return empty_folder(slot_); })
        .and_then([&] { return tidy_pieces(); })
        .and_then([&] { return bring_pieces(); })
        .and_then([&] { return build(report); })
        .and_then([&] { return finish(); });
  }

 private:
  Result<void> bring_recipes() {
    assemblies_.reserve(chosen_.size());
    std::vector<Wanted> wanted;
    for (const ReleaseBundle& bundle : chosen_) {
      const std::string file = piece_file(bundle.recipe);
      if (!file_size(file)) wanted.push_back(want(bundle.recipe, bundle.recipe_size));
    }
    if (auto done = transfers_.objects(wanted, [](std::int64_t) {}); !done) return done;
    for (const ReleaseBundle& bundle : chosen_) {
      Assembly& assembly = assemblies_.emplace_back();
      assembly.bundle = bundle;
      assembly.file = slot_ + "/" + bundle.name + ".modar";
      if (auto opened = open_stored_recipe(assembly); !opened) return opened;
    }
    return {};
  }

  Result<void> open_stored_recipe(Assembly& assembly) {
    const std::string file = piece_file(assembly.bundle.recipe);
    const auto stored = read_small_file(file, kMaxRecipeBytes);
    if (!stored || object_id(std::as_bytes(std::span(*stored))) != assembly.bundle.recipe) {
      // It came whole and was damaged on the disk since: it comes again next time.
      if (auto gone = remove_file(file); !gone) return gone;
      return fail(ExitCode::kIo, "fetch.recipe", file, "it was damaged on the disk",
                  "run modar-fetch again");
    }
    assembly.recipe_stored = *stored;
    const auto recipe = unpack_recipe(std::as_bytes(std::span(assembly.recipe_stored)),
                                      assembly.bundle.recipe_raw_size, assembly.recipe_bytes);
    if (!recipe) return tl::unexpected(recipe.error());
    assembly.recipe = *recipe;
    if (recipe->header.bundle_size != assembly.bundle.size ||
        !std::equal(assembly.bundle.hash.begin(), assembly.bundle.hash.end(),
                    recipe->header.bundle_hash)) {
      return fail(kExitMixed, "fetch.mixed", "bundle " + assembly.bundle.name,
                  "its recipe is of another bundle", "publish the release again");
    }
    return {};
  }

  /// Pieces that neither an old bundle nor the store has.
  [[nodiscard]] std::map<ObjectId, std::uint64_t> lacking() const {
    std::map<ObjectId, std::uint64_t> sizes;
    for (const Assembly& assembly : assemblies_) {
      for (const PieceRecord& piece : assembly.recipe.pieces) {
        const ObjectId id = std::to_array(piece.id);
        if (piece.stored_size == 0 || (source_.has(id) && !damaged_.contains(id))) continue;
        sizes.emplace(id, piece.stored_size);
      }
    }
    return sizes;
  }

  /// Removes pieces that this release does not need.
  Result<void> tidy_pieces() {
    std::set<std::string> needed;
    for (const auto& [id, size] : lacking()) needed.insert(to_hex(id));
    for (const Assembly& assembly : assemblies_) needed.insert(to_hex(assembly.bundle.recipe));
    for (const std::string& name : list_folder(store_.pieces())) {
      if (needed.contains(name.substr(0, name.find('.')))) continue;
      if (auto gone = remove_file(store_.pieces() + "/" + name); !gone) return gone;
    }
    return {};
  }

  Result<void> bring_pieces() {
    std::vector<Wanted> wanted;
    std::uint64_t total = 0;
    std::uint64_t needed = kSpareBytes;
    for (const auto& [id, size] : lacking()) {
      if (is_whole(id, size)) continue;
      wanted.push_back(want(id, size));
      total += size;
      const auto part = file_size(wanted.back().file + ".part").value_or(0);
      needed += size - std::min(part, size);
    }
    for (const Assembly& assembly : assemblies_) {
      needed += assembly.bundle.size - file_size(assembly.file).value_or(0);
    }
    const auto space = free_space(store_.path());
    if (!space) return tl::unexpected(space.error());
    if (*space < needed) {
      return fail(
          kExitNoSpace, "fetch.space", store_.path(),
          std::to_string(needed) + " bytes are needed, " + std::to_string(*space) + " are free",
          "make room and run modar-fetch again");
    }
    ProgressTeller teller(options_, total);
    return transfers_.objects(wanted, [&](std::int64_t bytes) { teller.add(bytes); });
  }

  /// Whether a piece lies in the store and is what it should be; one that is not is removed.
  bool is_whole(const ObjectId& id, std::uint64_t size) {
    const std::string file = piece_file(id);
    const auto found = file_size(file);
    if (!found) return false;
    if (const auto mapped = MappedFile::open(file);
        *found == size && mapped && object_id(mapped->bytes()) == id) {
      return true;
    }
    ::unlink(file.c_str());
    return false;
  }

  Result<void> build(FetchReport& report) {
    for (const Assembly& assembly : assemblies_) {
      if (!link_old_bundle(assembly, report)) {
        if (auto built = build_bundle(assembly, report); !built) return built;
        if (auto good = verify_bundle(assembly.file, assembly.bundle); !good) return good;
      }
      if (auto kept = write_file(slot_ + "/" + assembly.bundle.name + ".recipe",
                                 std::string_view(assembly.recipe_stored));
          !kept) {
        return kept;
      }
    }
    return {};
  }

  /// A bundle that did not change is the same file in both slots.
  bool link_old_bundle(const Assembly& assembly, FetchReport& report) const {
    if (!active_) return false;
    const std::string old = active_->folder + "/" + assembly.bundle.name + ".modar";
    if (!verify_bundle(old, assembly.bundle) || !share_file(old, assembly.file)) return false;
    report.reused_bytes += assembly.bundle.size;
    report.reused_pieces += static_cast<std::uint32_t>(assembly.recipe.pieces.size());
    return true;
  }

  Result<void> build_bundle(const Assembly& assembly, FetchReport& report) {
    AssemblyCounts counts;
    while (true) {
      const std::size_t known = damaged_.size();
      counts = {};
      if (auto done = assemble(assembly, source_, store_.pieces(), counts, damaged_); !done) {
        return done;
      }
      if (damaged_.size() == known) break;
      // An old bundle rotted on the disk: its pieces come from the server after all.
      report.corrupt_pieces += static_cast<std::uint32_t>(damaged_.size() - known);
      if (auto done = bring_pieces(); !done) return done;
    }
    report.reused_bytes += counts.reused_bytes;
    report.reused_pieces += counts.reused_pieces;
    report.downloaded_pieces += counts.new_pieces;
    return {};
  }

  /// The documents last: a slot with a release.json is a finished one.
  Result<void> finish() {
    return write_file(slot_ + "/release.json.minisig", std::string_view(news_.signature_text))
        .and_then([&] { return write_file(slot_ + "/release.json", std::string_view(news_.text)); })
        .and_then([&] {
          return store_.activate({slot_, news_.text, news_.release});
        });
  }

  [[nodiscard]] std::string piece_file(const ObjectId& id) const {
    return store_.pieces() + "/" + to_hex(id);
  }
  [[nodiscard]] Wanted want(const ObjectId& id, std::uint64_t size) const {
    return {id, size, "objects/" + object_path(id), piece_file(id)};
  }

  const FetchOptions& options_;
  const Store& store_;
  Transfers& transfers_;
  const SignedRelease& news_;
  const std::optional<InstalledRelease>& active_;
  const std::vector<ReleaseBundle>& chosen_;
  std::string slot_;
  PieceSource source_;
  std::vector<Assembly> assemblies_;
  std::set<ObjectId> damaged_;
};

}  // namespace

Result<void> install(const InstallationJob& job, FetchReport& report) {
  return Installation(job).run(report);
}

}  // namespace modar::fetch
