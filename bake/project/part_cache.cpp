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

#include "bake/json.hpp"
#include "bake/project/file_digests.hpp"
#include "bake/project/project.hpp"
#include "formats/base/atomic_file.hpp"

namespace modar {
namespace {

namespace fs = std::filesystem;

// The layout of the folder; another layout gets another number.
constexpr const char* kLayout = "v1";
// KEY.modar, KEY.json below a line with its digest, and with a key KEY.minisig over KEY.json
constexpr const char* kParts = "parts";
constexpr const char* kFiles = "files";  // ACTION.txt: a file a line, below a head with a digest

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
  std::error_code error;
  if (errno == EISDIR && fs::remove_all(to, error) != 0 &&  // nothing of others belongs here
      std::rename(from.c_str(), to.c_str()) == 0) {
    return {};
  }
  const std::string cause = std::strerror(errno);
  ::unlink(from.c_str());
  return fail(ExitCode::kIo, "cache.folder", to, "cannot rename: " + cause, "check the disk");
}

Result<void> write_text(const std::string& path, const std::string& text) {
  const std::string own = own_name(path);
  ::unlink(own.c_str());  // what somebody left there is not written through
  MODAR_TRY(write_file(own, std::string_view(text)));
  return move_into_place(own, path);
}

std::string_view text_of(const MappedFile& file) {
  return {reinterpret_cast<const char*>(file.bytes().data()), file.bytes().size()};
}

/// What an entry says of itself.
struct EntryHead {
  std::string key;     ///< of its entry
  std::string name;    ///< of the asset's file
  std::string digest;  ///< of the bundle
  std::string hash;  ///< the same by BLAKE2b, which nobody can meet; empty: the entry is not signed
};

Json entry_json(const EntryHead& head, const PartNotes& notes) {
  const Json diagnostics = Json::list(notes.diagnostics, [&](const Diagnostic& one) {
    return Json::array(
        {one.id, static_cast<int>(one.severity), one.file, one.line, one.message, one.cure});
  });
  return {{"key", head.key},
          {"name", head.name},
          {"bundle", head.digest},
          {"hash", head.hash},
          {"sides", Json::list(notes.model_sides)},
          {"findings", diagnostics}};
}

EntryHead head_of(const Json& json) {
  const auto word = [&](const char* name) {
    return json.find(name).value_or("").text().value_or("");
  };
  return {word("key"), word("name"), word("bundle"), word("hash")};
}

/// The text below a first line with its digest; nothing where that does not hold.
std::optional<std::string_view> below_digest(std::string_view text) {
  const std::string_view digest = text.substr(0, text.find('\n'));
  text.remove_prefix(std::min(digest.size() + 1, text.size()));
  if (digest_of(text) != digest) return std::nullopt;
  return text;
}

std::optional<PartNotes> notes_of(const Json& json) {
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

/// What the folder of a cache holds.
struct CacheFiles {
  std::vector<Entry> entries;      ///< those used longest ago first
  std::vector<std::string> lists;  ///< ACTION.txt
  std::vector<std::string> left;   ///< by processes that were interrupted long ago
};

constexpr const char* kEntryFiles[] = {".modar", ".json", ".minisig"};

/// Any file in the place of an entry's bundle is one, damaged where it is no file.
Result<CacheFiles> files_of_cache(const std::string& folder) {
  std::error_code error;
  if (!fs::is_directory(folder, error)) return folder_error(folder, "there is no such folder");
  CacheFiles files;
  fs::recursive_directory_iterator it(fs::path(folder) / kLayout, error);
  for (; !error && it != fs::recursive_directory_iterator(); it.increment(error)) {
    if (it.depth() < 2) continue;  // KIND, then the first two letters of a name
    it.disable_recursion_pending();
    struct stat status {};
    const std::string path = it->path().string();
    if (::lstat(path.c_str(), &status) != 0) continue;
    const std::string extension = it->path().extension().string();
    if (extension == ".modar") {
      Entry entry{path.substr(0, path.size() - extension.size()), 0, status.st_mtim.tv_sec};
      for (const char* kind : kEntryFiles) {
        struct stat part {};
        const bool there = ::lstat((entry.stem + kind).c_str(), &part) == 0;
        if (there && S_ISREG(part.st_mode)) entry.bytes += static_cast<std::uint64_t>(part.st_size);
      }
      files.entries.push_back(std::move(entry));
    } else if (extension == ".txt") {
      files.lists.push_back(path);
    } else if (extension != ".json" && extension != ".minisig" && S_ISREG(status.st_mode) &&
               std::time(nullptr) - status.st_mtim.tv_sec > kLeftBehindAfter) {
      files.left.push_back(path);
    }
  }
  std::sort(files.entries.begin(), files.entries.end(), [](const Entry& a, const Entry& b) {
    return std::tie(a.used, a.stem) < std::tie(b.used, b.stem);
  });
  return files;
}

/// A folder that somebody made in a file's place goes too: nothing of others belongs into a cache.
void remove_entry(const std::string& stem) {
  std::error_code error;
  for (const char* kind : kEntryFiles) fs::remove_all(stem + kind, error);
}

constexpr const char* kEntryDamaged = "its cache entry was damaged";
constexpr const char* kEntryOther = "its cache entry belongs to another part";
constexpr const char* kEntryUnsigned = "its cache entry is not signed with the cache's key";

/// Whether `signer` has signed the notes, which name the bundle's hash.
bool is_signed(const std::string& stem, std::string_view notes, const SecretKey& signer) {
  const auto file = MappedFile::open(stem + ".minisig");
  const auto signature =
      file ? parse_signature(text_of(*file)) : Result<Signature>(tl::unexpected(file.error()));
  return signature && verify_signature(notes, *signature, signer.public_key).has_value();
}

/// The entry of a key, and of the name of an asset's file (nullptr: any). Nothing: `reason`.
std::optional<CachedPart> read_entry(const std::string& stem, const std::string& key,
                                     const std::string* name,
                                     const std::optional<SecretKey>& signer, std::string& reason) {
  reason = kEntryDamaged;
  const auto notes_file = MappedFile::open(stem + ".json");
  if (!notes_file) return std::nullopt;
  const auto notes_text = below_digest(text_of(*notes_file));
  if (!notes_text) return std::nullopt;
  const Json json = Json::parse(*notes_text);
  auto notes = notes_of(json);
  const EntryHead head = head_of(json);
  CachedPart part;
  auto file = MappedFile::open(stem + ".modar");
  if (!file || !notes) return std::nullopt;
  part.file = std::move(*file);
  part.notes = std::move(*notes);
  const auto bundle = BundleView::open(part.file.bytes());
  const bool whole = bundle && digest_of(text_of(part.file)) == head.digest && part.file.intact();
  if (head.key != key || (name != nullptr && head.name != *name)) reason = kEntryOther;
  if (!whole || reason == kEntryOther) return std::nullopt;
  if (signer && (head.hash != to_hex(bundle_hash(part.file.bytes())) ||
                 !is_signed(stem, text_of(*notes_file), *signer))) {
    reason = kEntryUnsigned;
    return std::nullopt;
  }
  part.bundle = *bundle;
  reason.clear();
  return part;
}

/// The first line of a list of files; below it stands a file a line.
std::string list_head(const std::string& action, const std::string& lines) {
  return action + " " + digest_of(lines) + "\n";
}

/// The lines of a list; nothing where it is damaged or that of another action.
std::optional<std::vector<std::string>> read_list(const std::string& path,
                                                  const std::string& action) {
  const auto file = MappedFile::open(path);
  if (!file) return std::nullopt;
  std::string_view text = text_of(*file);
  const std::size_t head = std::min(text.find('\n') + 1, text.size());
  if (text.substr(0, head) != list_head(action, std::string(text.substr(head))))
    return std::nullopt;
  text.remove_prefix(head);
  std::vector<std::string> files;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    files.emplace_back(text.substr(0, end));
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return files;
}

}  // namespace

PartCache::PartCache(const std::string& folder, std::optional<SecretKey> signer)
    : folder_((fs::path(folder) / kLayout).string()),
      tag_((fs::path(folder) / "CACHEDIR.TAG").string()),
      signer_(std::move(signer)) {}

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
  return read_list(path(kFiles, action, ".txt"), action);
}

bool PartCache::has(const std::string& key) const {
  std::error_code error;
  return fs::exists(path(kParts, key, ".modar"), error) &&
         fs::exists(path(kParts, key, ".json"), error);
}

std::optional<CachedPart> PartCache::read(const std::string& key, const std::string& name,
                                          std::string& reason) const {
  reason.clear();
  if (!has(key)) return std::nullopt;
  const std::string stem = path(kParts, key, "");
  std::optional<CachedPart> part = read_entry(stem, key, &name, signer_, reason);
  if (part) {
    ::utimensat(AT_FDCWD, (stem + ".modar").c_str(), nullptr, 0);  // used now, for prune_cache()
  } else {
    remove_entry(stem);
  }
  return part;
}

Result<void> PartCache::write_files(const std::string& action,
                                    const std::vector<std::string>& files) const {
  MODAR_ASSIGN(const std::string list, place(kFiles, action, ".txt"));
  std::string text;
  for (const std::string& file : files) text += file + "\n";
  return write_text(list, list_head(action, text) + text);
}

Result<void> PartCache::write(const std::string& key, const std::string& name,
                              const BundleContent& content, const PartNotes& notes) const {
  MODAR_ASSIGN(const std::string file, place(kParts, key, ".modar"));
  const std::string own = own_name(file);
  std::error_code error;
  fs::remove_all(own, error);
  MODAR_TRY(save_bundle(content, own));
  EntryHead head{key, name, "", ""};
  {
    MODAR_ASSIGN(const auto saved, MappedFile::open(own));
    head.digest = digest_of(text_of(saved));
    if (signer_) head.hash = to_hex(bundle_hash(saved.bytes()));
  }
  // The bundle last: an entry counts once it is there.
  std::string text = entry_json(head, notes).dump();
  text = digest_of(text) + "\n" + text;
  if (signer_) {
    MODAR_TRY(
        write_text(path(kParts, key, ".minisig"), sign(*signer_, text, "modar cache " + key)));
  }
  MODAR_TRY(write_text(path(kParts, key, ".json"), text));
  return move_into_place(own, file);
}

Result<CacheSummary> summarise_cache(const std::string& folder) {
  MODAR_ASSIGN(const auto files, files_of_cache(folder));
  CacheSummary summary;
  summary.entries = files.entries.size();
  for (const Entry& entry : files.entries) summary.bytes += entry.bytes;
  return summary;
}

Result<CacheSummary> prune_cache(const std::string& folder, std::uint64_t bytes, bool dry_run) {
  MODAR_ASSIGN(const auto files, files_of_cache(folder));
  for (const std::string& path : files.left) {
    if (!dry_run) ::unlink(path.c_str());
  }
  std::uint64_t sum = 0;
  for (const Entry& entry : files.entries) sum += entry.bytes;
  CacheSummary removed;
  for (const Entry& entry : files.entries) {
    if (sum <= bytes) break;
    if (!dry_run) remove_entry(entry.stem);
    sum -= entry.bytes;
    removed.bytes += entry.bytes;
    ++removed.entries;
  }
  return removed;
}

Result<CacheSummary> verify_cache(const std::string& folder, const std::string& cache_key) {
  MODAR_ASSIGN(const auto signer, read_cache_key(cache_key));
  MODAR_ASSIGN(const auto files, files_of_cache(folder));
  CacheSummary summary;
  for (const Entry& entry : files.entries) {
    ++summary.entries;
    summary.bytes += entry.bytes;
    std::string reason;
    const std::string key = fs::path(entry.stem).filename().string();
    if (read_entry(entry.stem, key, nullptr, signer, reason)) continue;
    remove_entry(entry.stem);
    summary.damaged.push_back(entry.stem + ".modar");
  }
  for (const std::string& path : files.lists) {
    if (read_list(path, fs::path(path).stem().string())) continue;
    std::error_code error;
    fs::remove_all(path, error);
    summary.damaged.push_back(path);
  }
  return summary;
}

Result<std::optional<SecretKey>> read_cache_key(const std::string& path) {
  if (path.empty()) return std::optional<SecretKey>();
  MODAR_ASSIGN(const auto file, MappedFile::open(path));
  if (needs_pass_phrase(text_of(file))) {
    return fail(ExitCode::kInvalidInput, "key.pass-phrase", path, "the secret key is encrypted",
                "make a separate key for the cache, without a pass phrase: `modar ship keygen`");
  }
  auto key = parse_secret_key(text_of(file), "");
  if (!key) key.error().where = path;
  MODAR_ASSIGN(auto made, std::move(key));
  return std::optional<SecretKey>(std::move(made));
}

}  // namespace modar
