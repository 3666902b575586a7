#include "bake/ship/release_folder.hpp"

#include <sys/stat.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <optional>
#include <set>
#include <utility>

#include "bake/io/output.hpp"
#include "bake/ship/verify_release.hpp"
#include "formats/base/atomic_file.hpp"
#include "formats/base/ranges.hpp"
#include "modar/piece.hpp"
#include "modar/release.hpp"

namespace modar {
namespace {

namespace fs = std::filesystem;

std::optional<std::string> read_text(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) return std::nullopt;
  return std::string(std::istreambuf_iterator<char>(file), {});
}

Result<void> make_folders(const fs::path& path) {
  std::error_code error;
  fs::create_directories(path, error);
  if (error) {
    return fail(ExitCode::kIo, "io.create", path.string(), error.message(),
                "check that the folder is writable");
  }
  return {};
}

/// The number in "12.json"; 0 for other names.
std::uint64_t number_of(const fs::path& path) {
  if (path.extension() != ".json") return 0;
  const std::string stem = path.stem().string();
  std::uint64_t number = 0;
  const auto parsed = std::from_chars(stem.data(), stem.data() + stem.size(), number);
  return parsed.ec == std::errc() && parsed.ptr == stem.data() + stem.size() ? number : 0;
}

std::vector<std::uint64_t> numbers_in(const fs::path& folder) {
  std::vector<std::uint64_t> numbers;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    if (const std::uint64_t number = number_of(entry.path()); number != 0) {
      numbers.push_back(number);
    }
  }
  std::sort(numbers.begin(), numbers.end());
  return numbers;
}

/// Removes what a publisher that was killed left: "NAME.PID.tmp". The folder is locked.
void remove_leftovers(const std::string& path) {
  std::vector<fs::path> leftovers;
  std::error_code error;
  for (const char* folder : {"", "/releases", "/keys", "/roots", "/objects"}) {
    for (fs::recursive_directory_iterator it(path + folder, error), end; !error && it != end;
         it.increment(error)) {
      if (*folder == '\0') it.disable_recursion_pending();
      const fs::path name = it->path().stem();  // without ".tmp"
      const std::string process = name.extension().string();
      if (it->path().extension() == ".tmp" && process.size() > 1 && !name.stem().empty() &&
          process.find_first_not_of("0123456789", 1) == std::string::npos) {
        leftovers.push_back(it->path());
      }
    }
  }
  for (const fs::path& leftover : leftovers) fs::remove(leftover, error);
}

/// Syncs the folders that lead to objects: a release is named only when all of its pieces would
/// survive a power cut. Those that another process created, too, before it was killed.
Result<void> sync_objects(const std::string& path) {
  const fs::path root = fs::absolute(path).lexically_normal();
  std::vector<fs::path> folders = {
      root.has_filename() ? root.parent_path() : root.parent_path().parent_path(), root,
      root / "objects"};
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(root / "objects", error)) {
    if (entry.is_directory(error)) folders.push_back(entry.path());
  }
  for (const fs::path& folder : folders) {
    if (sync_folder(folder.string())) continue;
    return fail(ExitCode::kIo, "io.sync", folder.string(), std::strerror(errno), "check the disk");
  }
  return {};
}

constexpr std::array kParts = {"releases", "keys", "objects"};

/// Copies may lack an empty part; and another publisher may be making them.
bool has_parts(const std::string& path) {
  std::error_code error;
  std::size_t parts = 0;
  std::size_t others = 0;
  for (const auto& entry : fs::directory_iterator(path, error)) {
    ++(ranges::count(kParts, entry.path().filename()) != 0 ? parts : others);
  }
  return parts + 1 >= kParts.size() || others == 0;
}

}  // namespace

ReleaseFolder::ReleaseFolder(std::string path, FolderLock lock)
    : path_(std::move(path)), lock_(std::move(lock)) {}

Result<ReleaseFolder> ReleaseFolder::open(const std::string& path, bool force) {
  if (!force && !has_parts(path)) {
    MODAR_TRY(keep_foreign_folder(path,
                                  "name a new, an empty or a release's folder; `modar ship publish "
                                  "--force` writes into this one"));
  }
  for (const char* folder : kParts) MODAR_TRY(make_folders(fs::path(path) / folder));
  MODAR_ASSIGN(auto lock, FolderLock::take(path + "/.lock", {kExitLocked, "ship.locked", path,
                                                             "another publisher is using it",
                                                             "wait until it ends"}));
  remove_leftovers(path);
  return ReleaseFolder(path, std::move(lock));
}

std::vector<std::uint64_t> ReleaseFolder::versions() const {
  std::vector<std::pair<std::uint64_t, std::uint64_t>> found;
  for (const std::uint64_t version : numbers_in(path_ + "/releases")) {
    const auto read = release(version);
    found.emplace_back(read ? read->epoch : 0, version);
  }
  std::sort(found.begin(), found.end());
  std::vector<std::uint64_t> versions;
  for (const auto& [epoch, version] : found) versions.push_back(version);
  return versions;
}

Result<std::optional<Release>> ReleaseFolder::newest() const {
  const auto text = read_text(path_ + "/latest");
  if (!text) return std::optional<Release>();
  std::uint64_t version = 0;
  std::from_chars(text->data(), text->data() + text->size(), version);
  MODAR_ASSIGN(auto newest, release(version));
  return std::optional<Release>(std::move(newest));
}

std::int64_t ReleaseFolder::published(std::uint64_t version) const {
  struct stat facts {};
  const std::string file = path_ + "/releases/" + std::to_string(version) + ".json";
  return ::stat(file.c_str(), &facts) == 0 ? facts.st_mtime : 0;
}

Result<RootMetadata> ReleaseFolder::root_metadata() const {
  const auto text = read_text(path_ + "/root.json");
  return text ? parse_root_metadata(*text) : RootMetadata{};
}

Result<void> ReleaseFolder::check_signer(const PublicKey& key) const {
  const auto refuse = [&](const std::array<std::uint8_t, 8>& wanted) {
    return fail(ExitCode::kUsage, "ship.key", path_,
                "it is signed with key " + to_hex(wanted) + ", not with " + to_hex(key.id) +
                    ", which devices would refuse",
                "use that secret key, or move devices to yours: `modar ship rotate`");
  };
  MODAR_ASSIGN(const RootMetadata word, root_metadata());
  const std::uint32_t links = key_rotations();
  if (links > word.links) {
    const std::string path = path_ + "/keys/" + std::to_string(links) + ".json";
    MODAR_ASSIGN(const KeyRotation link, parse_key_rotation(read_text(path).value_or("")));
    MODAR_ASSIGN(const PublicKey last, parse_public_key(link.key));
    return last == key ? Result<void>() : refuse(last.id);
  }
  if (word.epoch != 0) {
    MODAR_ASSIGN(const PublicKey named, parse_public_key(word.key));
    return named == key ? Result<void>() : refuse(named.id);
  }
  MODAR_ASSIGN(const auto last, newest());
  if (!last) return {};
  const std::string path = path_ + "/releases/" + std::to_string(last->version) + ".json.minisig";
  MODAR_ASSIGN(const Signature signature, parse_signature(read_text(path).value_or("")));
  return signature.key_id == key.id ? Result<void>() : refuse(signature.key_id);
}

Result<Release> ReleaseFolder::release(std::uint64_t version) const {
  const std::string path = path_ + "/releases/" + std::to_string(version) + ".json";
  const auto text = read_text(path);
  if (!text) {
    return fail(ExitCode::kIo, "io.open", path, "it cannot be read", "publish the release again");
  }
  return parse_release(*text);
}

std::uint32_t ReleaseFolder::key_rotations() const {
  const auto numbers = numbers_in(path_ + "/keys");
  return numbers.empty() ? 0 : static_cast<std::uint32_t>(numbers.back());
}

Result<std::vector<std::byte>> ReleaseFolder::recipe(const ReleaseBundle& bundle) const {
  const auto stored = read_text(path_ + "/objects/" + object_path(bundle.recipe));
  if (!stored) {
    return fail(ExitCode::kIo, "ship.recipe", object_path(bundle.recipe),
                "a recipe of a kept release is missing", "publish that release again");
  }
  return unpack_zstd(std::as_bytes(std::span(*stored)), bundle.recipe_raw_size);
}

Result<void> ReleaseFolder::check_objects(const ReleaseBundle& bundle, ObjectLedger& ledger) const {
  const auto check = [&](const ObjectId& id) -> Result<void> {
    if (ledger.holds(id)) return {};
    return fail(ExitCode::kIo, "ship.damaged", path_ + "/objects/" + object_path(id),
                "it is missing or damaged, and the bundle " + bundle.name + " needs it",
                "publish " + bundle.name + ".modar again, or take it out: --drop " + bundle.name);
  };
  MODAR_TRY(check(bundle.recipe));
  MODAR_ASSIGN(const auto raw, recipe(bundle));
  MODAR_ASSIGN(const auto view, open_recipe(raw));
  for (const PieceRecord& piece : view.pieces) {
    if (piece.stored_size != 0) MODAR_TRY(check(std::to_array(piece.id)));
  }
  return {};
}

Result<std::uint64_t> ReleaseFolder::add_objects(const PublishedBundle& bundle,
                                                 ObjectLedger& ledger) const {
  std::uint64_t added = 0;
  const auto add = [&](const ObjectId& id, std::span<const std::byte> bytes) -> Result<void> {
    if (ledger.holds(id)) return {};
    const fs::path path = path_ + "/objects/" + object_path(id);
    MODAR_TRY(make_folders(path.parent_path()));
    // A link or a pipe in the object's place is not written through.
    std::error_code error;
    if (!fs::is_directory(path, error)) fs::remove(path, error);
    added += bytes.size();
    return write_file(path.string(), bytes);
  };
  for (const auto& [id, bytes] : bundle.objects) {
    MODAR_TRY(add(id, bytes));
  }
  MODAR_TRY(add(bundle.recipe_id, bundle.recipe_object));
  return added;
}

Result<void> ReleaseFolder::add_freshness(const Release& release, std::int64_t now,
                                          const SecretKey& key) const {
  if (release.fresh_days == 0) return {};
  constexpr std::int64_t kDay = 86400;
  const std::string path = path_ + "/" + freshness_path(release.version);
  const std::string text =
      freshness_text({release.epoch, release.version, now,
                      now + kDay * static_cast<std::int64_t>(release.fresh_days)});
  const std::string signature = sign(key, text, "modar fresh " + std::to_string(release.version));
  MODAR_TRY(write_file(path + ".minisig", std::string_view(signature)));
  return write_file(path, std::string_view(text));
}

Result<void> ReleaseFolder::add_release(const Release& release, std::int64_t now,
                                        const SecretKey& key) const {
  const std::string number = std::to_string(release.version);
  const std::string path = path_ + "/releases/" + number + ".json";
  const std::string text = release_text(release);
  const std::string signature = sign(key, text, "modar release " + number);
  MODAR_TRY(sync_objects(path_));
  return write_file(path + ".minisig", std::string_view(signature))
      .and_then([&] { return write_file(path, std::string_view(text)); })
      .and_then([&] { return add_freshness(release, now, key); })
      .and_then([&] { return write_file(path_ + "/latest", std::string_view(number + "\n")); });
}

std::uint32_t ReleaseFolder::root_rotations() const {
  const auto numbers = numbers_in(path_ + "/roots");
  return numbers.empty() ? 0 : static_cast<std::uint32_t>(numbers.back());
}

Result<RootSet> ReleaseFolder::roots(const RootSet& trust) const {
  return follow_root_chain(read_release_folder(path_), trust);
}

Result<void> ReleaseFolder::add_signed(
    const std::string& path, const std::string& text,
    const std::vector<std::pair<PublicKey, std::string>>& signatures) const {
  const fs::path file = fs::path(path_) / path;
  MODAR_TRY(make_folders(file.parent_path()));
  // Of the document before: they verify nothing any more.
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(file.parent_path(), error)) {
    const std::string name = entry.path().filename().string();
    if (name.starts_with(file.filename().string() + ".") && name.ends_with(".minisig")) {
      fs::remove(entry.path(), error);
    }
  }
  for (const auto& [key, signature] : signatures) {
    MODAR_TRY(write_file(signature_path(file.string(), key), std::string_view(signature)));
  }
  if (path == "root.json" && !signatures.empty()) {
    // For devices that were given this key alone.
    const std::string& first = signatures.front().second;
    MODAR_TRY(write_file(file.string() + ".minisig", std::string_view(first)));
  }
  return write_file(file.string(), std::string_view(text));
}

Result<RootMetadata> ReleaseFolder::add_root_metadata(const PublicKey& next,
                                                      const SecretKey& root) const {
  const std::string path = path_ + "/root.json";
  MODAR_ASSIGN(RootMetadata word, root_metadata());
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(path_, error)) {
    const std::string name = entry.path().filename().string();
    const bool several =
        name.starts_with("root.json.") && name.ends_with(".minisig") && name != "root.json.minisig";
    if (!several && root_rotations() == 0) continue;
    return fail(ExitCode::kUsage, "ship.root", path_, "several root keys must agree here",
                "write a draft for all to sign: `modar ship root --draft FILE`");
  }
  if (word.epoch != 0) {
    MODAR_ASSIGN(const Signature before,
                 parse_signature(read_text(path + ".minisig").value_or("")));
    if (before.key_id != root.public_key.id) {
      return fail(ExitCode::kUsage, "ship.root", path,
                  "key " + to_hex(before.key_id) + " signed the word before, not " +
                      to_hex(root.public_key.id),
                  "give the root key that devices trust");
    }
  }
  ++word.epoch;
  word.links = key_rotations();
  word.key = public_key_line(next);
  const std::string text = root_metadata_text(word);
  const std::string signature = sign(root, text, "modar root " + std::to_string(word.epoch));
  MODAR_TRY(write_file(path + ".minisig", std::string_view(signature)));
  MODAR_TRY(write_file(path, std::string_view(text)));
  return word;
}

Result<void> ReleaseFolder::add_key(const PublicKey& next, const SecretKey& key) const {
  const KeyRotation link{key_rotations() + 1, public_key_line(next)};
  const std::string path = path_ + "/keys/" + std::to_string(link.serial) + ".json";
  const std::string text = key_rotation_text(link);
  const std::string signature = sign(key, text, "modar key " + std::to_string(link.serial));
  return write_file(path + ".minisig", std::string_view(signature)).and_then([&] {
    return write_file(path, std::string_view(text));
  });
}

Result<std::uint64_t> ReleaseFolder::prune(std::uint64_t keep) const {
  std::vector<std::uint64_t> all = versions();
  const std::size_t gone = all.size() > keep ? all.size() - keep : 0;
  std::set<std::string> needed;
  for (std::size_t i = gone; i < all.size(); ++i) {
    MODAR_ASSIGN(const auto kept, release(all[i]));
    for (const ReleaseBundle& bundle : kept.bundles) {
      needed.insert(to_hex(bundle.recipe));
      MODAR_ASSIGN(const auto raw, recipe(bundle));
      MODAR_ASSIGN(const auto view, open_recipe(raw));
      for (const PieceRecord& piece : view.pieces) needed.insert(to_hex(piece.id));
    }
  }
  std::uint64_t bytes = 0;
  std::error_code error;
  // Documents first: no remaining document names a removed object.
  for (std::size_t i = 0; i < gone; ++i) {
    const std::string document = "releases/" + std::to_string(all[i]) + ".json";
    for (const std::string& name : {document, freshness_path(all[i])}) {
      fs::remove(fs::path(path_) / name, error);
      fs::remove(fs::path(path_) / (name + ".minisig"), error);
    }
  }
  for (const auto& entry : fs::recursive_directory_iterator(path_ + "/objects", error)) {
    if (!entry.is_regular_file() || needed.contains(entry.path().filename().string())) continue;
    bytes += entry.file_size();
    fs::remove(entry.path(), error);
  }
  return bytes;
}

}  // namespace modar
