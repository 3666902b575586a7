#include "bake/project/part_cache.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <ctime>
#include <filesystem>

#define XXH_INLINE_ALL
#include <xxhash.h>

#include "bake/json.hpp"
#include "bake/project/file_digests.hpp"
#include "bake/project/project.hpp"
#include "formats/atomic_file.hpp"

namespace modar {
namespace {

namespace fs = std::filesystem;

// The layout of the folder; another layout gets another number.
constexpr const char* kLayout = "v1";
constexpr const char* kParts = "parts";  // KEY.modar, and KEY.json below a line with its digest
constexpr const char* kFiles = "files";  // ACTION.txt: a file a line

// Backup programs leave out folders that hold such a file (bford.info/cachedir).
constexpr const char* kTag =
    "Signature: 8a477f597d28d172789f06886806bc55\n"
    "# A cache of `modar bake`: it may be removed at any time.\n";

constexpr std::int64_t kLeftBehindAfter = 24 * 3600;  // seconds: no write takes that long

tl::unexpected<Error> folder_error(const std::string& folder, const std::string& cause) {
  return fail(ExitCode::kIo, "cache.folder", folder, cause, "name another with --cache");
}

/// A name that no other process on any machine uses at this time.
std::string own_name(const std::string& path) {
  char host[256] = "host";
  ::gethostname(host, sizeof host - 1);
  return path + "." + host + "." + std::to_string(::getpid());
}

Result<void> move_into_place(const std::string& from, const std::string& to) {
  if (std::rename(from.c_str(), to.c_str()) == 0) return {};
  const std::string cause = std::strerror(errno);
  ::unlink(from.c_str());
  return fail(ExitCode::kIo, "cache.folder", to, "cannot rename: " + cause, "check the disk");
}

Result<void> write_text(const std::string& path, const std::string& text) {
  const std::string own = own_name(path);
  MODAR_TRY(write_file(own, std::string_view(text)));
  return move_into_place(own, path);
}

bool hashes_hold(const BundleView& bundle) {
  const auto sections = bundle.sections();
  return std::all_of(sections.begin(), sections.end(), [&](const SectionEntry& section) {
    return XXH64(bundle.bytes().data() + section.offset, section.size, 0) == section.hash;
  });
}

Json notes_json(const PartNotes& notes) {
  Json diagnostics = Json::array();
  for (const Diagnostic& one : notes.diagnostics) {
    diagnostics.push_back(Json::array(
        {one.id, static_cast<int>(one.severity), one.file, one.line, one.message, one.cure}));
  }
  return {{"sides", Json::list(notes.model_sides)}, {"findings", diagnostics}};
}

std::optional<PartNotes> read_notes(const std::string& path) {
  const auto file = MappedFile::open(path);
  if (!file) return std::nullopt;
  std::string_view text(reinterpret_cast<const char*>(file->bytes().data()), file->bytes().size());
  const std::string_view digest = text.substr(0, text.find('\n'));
  text.remove_prefix(std::min(digest.size() + 1, text.size()));
  if (digest_of(text) != digest) return std::nullopt;
  const Json json = Json::parse(text);
  const auto sides = json.find("sides");
  const auto findings = json.find("findings");
  if (!sides || !findings || sides->size() != 3) return std::nullopt;
  PartNotes notes;
  for (std::size_t i = 0; i < 3; ++i) notes.model_sides[i] = sides->at(i)->number().value_or(0);
  for (std::size_t i = 0; i < findings->size(); ++i) {
    const Json one = *findings->at(i);
    const auto words = [&](std::size_t k) { return one.at(k).value_or("").text().value_or(""); };
    const auto count = [&](std::size_t k) { return one.at(k).value_or(0).count().value_or(0); };
    notes.diagnostics.push_back(
        {words(0), static_cast<DiagnosticSeverity>(std::min<std::uint64_t>(count(1), 2)), words(2),
         count(3), words(4), words(5)});
  }
  return notes;
}

/// An entry's files, which are used and removed together.
struct Entry {
  std::string stem;  ///< path without extension
  std::uint64_t bytes = 0;
  std::int64_t used = 0;  ///< seconds
};

/// All entries of a cache, and what processes left that were interrupted long ago.
Result<std::vector<Entry>> entries_of(const std::string& folder, std::vector<std::string>& left) {
  std::error_code error;
  if (!fs::is_directory(folder, error)) return folder_error(folder, "there is no such folder");
  std::vector<Entry> entries;
  fs::recursive_directory_iterator it(fs::path(folder) / kLayout, error);
  for (; !error && it != fs::recursive_directory_iterator(); it.increment(error)) {
    struct stat status {};
    const std::string path = it->path().string();
    if (::stat(path.c_str(), &status) != 0 || !S_ISREG(status.st_mode)) continue;
    const std::string extension = it->path().extension().string();
    if (extension == ".modar") {
      fs::path stem = it->path();
      stem.replace_extension();
      struct stat notes {};
      const bool noted = ::stat((stem.string() + ".json").c_str(), &notes) == 0;
      entries.push_back({stem.string(),
                         static_cast<std::uint64_t>(status.st_size + (noted ? notes.st_size : 0)),
                         status.st_mtim.tv_sec});
    } else if (extension != ".json" && extension != ".txt" &&
               std::time(nullptr) - status.st_mtim.tv_sec > kLeftBehindAfter) {
      left.push_back(path);
    }
  }
  std::sort(entries.begin(), entries.end(), [](const Entry& a, const Entry& b) {
    return std::tie(a.used, a.stem) < std::tie(b.used, b.stem);
  });
  return entries;
}

void remove_entry(const std::string& stem) {
  ::unlink((stem + ".modar").c_str());
  ::unlink((stem + ".json").c_str());
}

std::optional<CachedPart> read_entry(const std::string& stem) {
  CachedPart part;
  auto file = MappedFile::open(stem + ".modar");
  auto notes = read_notes(stem + ".json");
  if (!file || !notes) return std::nullopt;
  part.file = std::move(*file);
  part.notes = std::move(*notes);
  const auto bundle = BundleView::open(part.file.bytes());
  if (!bundle || !hashes_hold(*bundle)) return std::nullopt;
  part.bundle = *bundle;
  return part;
}

}  // namespace

PartCache::PartCache(const std::string& folder)
    : folder_((fs::path(folder) / kLayout).string()),
      tag_((fs::path(folder) / "CACHEDIR.TAG").string()) {}

std::string PartCache::path(const char* kind, const std::string& key, const char* extension) const {
  return folder_ + "/" + kind + "/" + key.substr(0, 2) + "/" + key + extension;
}

Result<std::string> PartCache::place(const char* kind, const std::string& key,
                                     const char* extension) const {
  std::string file = path(kind, key, extension);
  std::error_code error;
  fs::create_directories(fs::path(file).parent_path(), error);
  if (error) return folder_error(folder_, error.message());
  if (!fs::exists(tag_, error)) {
    MODAR_TRY(write_text(tag_, kTag));
  }
  return file;
}

std::optional<std::vector<std::string>> PartCache::files_of(const std::string& action) const {
  const std::string list = path(kFiles, action, ".txt");
  std::error_code error;
  if (!fs::exists(list, error)) return std::nullopt;
  std::vector<std::string> files;
  const auto file = MappedFile::open(list);
  if (!file) return files;  // an empty list is an empty file
  std::string_view text(reinterpret_cast<const char*>(file->bytes().data()), file->bytes().size());
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    files.emplace_back(text.substr(0, end));
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return files;
}

bool PartCache::has(const std::string& key) const {
  std::error_code error;
  return fs::exists(path(kParts, key, ".modar"), error) &&
         fs::exists(path(kParts, key, ".json"), error);
}

std::optional<CachedPart> PartCache::read(const std::string& key, bool& damaged) const {
  damaged = false;
  if (!has(key)) return std::nullopt;
  const std::string file = path(kParts, key, ".modar");
  std::optional<CachedPart> part = read_entry(path(kParts, key, ""));
  if (!part) {
    remove_entry(path(kParts, key, ""));
    damaged = true;
  } else {
    ::utimensat(AT_FDCWD, file.c_str(), nullptr, 0);  // used now, for prune_cache()
  }
  return part;
}

Result<void> PartCache::write_files(const std::string& action,
                                    const std::vector<std::string>& files) const {
  MODAR_ASSIGN(const std::string list, place(kFiles, action, ".txt"));
  std::string text;
  for (const std::string& file : files) text += file + "\n";
  return write_text(list, text);
}

Result<void> PartCache::write(const std::string& key, const BundleContent& content,
                              const PartNotes& notes) const {
  // The notes first: an entry counts once its bundle is there.
  MODAR_ASSIGN(const std::string noted, place(kParts, key, ".json"));
  const std::string text = notes_json(notes).dump();
  MODAR_TRY(write_text(noted, digest_of(text) + "\n" + text));
  MODAR_ASSIGN(const std::string file, place(kParts, key, ".modar"));
  const std::string own = own_name(file);
  MODAR_TRY(save_bundle(content, own));
  return move_into_place(own, file);
}

Result<CacheSummary> summarise_cache(const std::string& folder) {
  std::vector<std::string> left;
  MODAR_ASSIGN(const auto entries, entries_of(folder, left));
  CacheSummary summary;
  summary.entries = entries.size();
  for (const Entry& entry : entries) summary.bytes += entry.bytes;
  return summary;
}

Result<CacheSummary> prune_cache(const std::string& folder, std::uint64_t bytes, bool dry_run) {
  std::vector<std::string> left;
  MODAR_ASSIGN(const auto entries, entries_of(folder, left));
  for (const std::string& path : left) {
    if (!dry_run) ::unlink(path.c_str());
  }
  std::uint64_t sum = 0;
  for (const Entry& entry : entries) sum += entry.bytes;
  CacheSummary removed;
  for (const Entry& entry : entries) {
    if (sum <= bytes) break;
    if (!dry_run) remove_entry(entry.stem);
    sum -= entry.bytes;
    removed.bytes += entry.bytes;
    ++removed.entries;
  }
  return removed;
}

Result<CacheSummary> verify_cache(const std::string& folder) {
  std::vector<std::string> left;
  MODAR_ASSIGN(const auto entries, entries_of(folder, left));
  CacheSummary summary;
  for (const Entry& entry : entries) {
    ++summary.entries;
    summary.bytes += entry.bytes;
    if (read_entry(entry.stem)) continue;
    remove_entry(entry.stem);
    summary.damaged.push_back(entry.stem + ".modar");
  }
  return summary;
}

}  // namespace modar
