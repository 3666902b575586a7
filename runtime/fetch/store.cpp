#include "store.hpp"

#include <dirent.h>
#include <fcntl.h>
#include <sys/stat.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <tuple>
#include <utility>

#include <rapidjson/document.h>
#include <rapidjson/prettywriter.h>

#include "formats/atomic_file.hpp"

namespace modar::fetch {

// --- Files ---

namespace {

tl::unexpected<Error> io(const char* code, const std::string& path, const char* cure) {
  return fail(ExitCode::kIo, code, path, std::strerror(errno), cure);
}

constexpr const char* kStoreCure = "check that the store's folder is writable and has room";

}  // namespace

Result<void> make_folder(const std::string& path) {
  if (::mkdir(path.c_str(), 0755) == 0) return {};
  struct stat info {};
  if (errno == EEXIST && ::stat(path.c_str(), &info) == 0 && S_ISDIR(info.st_mode)) return {};
  return io("io.create", path, kStoreCure);
}

std::vector<std::string> list_folder(const std::string& path) {
  std::vector<std::string> names;
  DIR* folder = ::opendir(path.c_str());
  if (folder == nullptr) return names;
  while (const dirent* entry = ::readdir(folder)) {
    const std::string name = entry->d_name;
    if (name != "." && name != "..") names.push_back(name);
  }
  ::closedir(folder);
  std::sort(names.begin(), names.end());
  return names;
}

std::optional<std::string> read_small_file(const std::string& path, std::size_t limit) {
  const auto size = file_size(path);
  if (!size || *size > limit) return std::nullopt;
  std::FILE* file = std::fopen(path.c_str(), "rbe");
  if (file == nullptr) return std::nullopt;
  std::string text(static_cast<std::size_t>(*size), '\0');
  const bool whole = std::fread(text.data(), 1, text.size(), file) == text.size();
  std::fclose(file);
  if (!whole) return std::nullopt;
  return text;
}

std::optional<std::uint64_t> file_size(const std::string& path) {
  struct stat info {};
  if (::stat(path.c_str(), &info) != 0 || !S_ISREG(info.st_mode)) return std::nullopt;
  return static_cast<std::uint64_t>(info.st_size);
}

Result<void> remove_file(const std::string& path) {
  if (::unlink(path.c_str()) != 0 && errno != ENOENT) return io("io.remove", path, kStoreCure);
  return {};
}

Result<void> rename_file(const std::string& from, const std::string& to) {
  if (std::rename(from.c_str(), to.c_str()) != 0) return io("io.rename", to, kStoreCure);
  return {};
}

Result<void> sync_folder(const std::string& path) {
  const int descriptor = ::open(path.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor < 0) return io("io.sync", path, kStoreCure);
  const int synced = ::fsync(descriptor);
  ::close(descriptor);
  // Some file systems cannot sync a folder; there is nothing more to do on them.
  if (synced != 0 && errno != EINVAL) return io("io.sync", path, kStoreCure);
  return {};
}

Result<bool> switch_link(const std::string& path, const std::string& target) {
  const std::string beside = path + ".new";
  if (!link_target(beside).empty()) MODAR_TRY(remove_file(beside));
  if (::symlink(target.c_str(), beside.c_str()) != 0) {
    // FAT and Android's shared storage.
    if (errno == EPERM || errno == EOPNOTSUPP || errno == ENOSYS || errno == EACCES) return false;
    return io("io.link", beside, kStoreCure);
  }
  MODAR_TRY(rename_file(beside, path));
  return true;
}

bool path_exists(const std::string& path) {
  struct stat info {};
  return ::lstat(path.c_str(), &info) == 0;
}

std::string link_target(const std::string& path) {
  std::array<char, 4096> target{};
  const ssize_t size = ::readlink(path.c_str(), target.data(), target.size());
  return size > 0 ? std::string(target.data(), static_cast<std::size_t>(size)) : std::string();
}

Result<std::uint64_t> free_space(const std::string& path) {
  struct statvfs info {};
  if (::statvfs(path.c_str(), &info) != 0) return io("io.space", path, kStoreCure);
  return static_cast<std::uint64_t>(info.f_bavail) * info.f_frsize;
}

OutputFile::OutputFile(int descriptor, std::string path)
    : descriptor_(descriptor), path_(std::move(path)) {}

OutputFile::OutputFile(OutputFile&& other) noexcept
    : descriptor_(std::exchange(other.descriptor_, -1)), path_(std::move(other.path_)) {}

OutputFile& OutputFile::operator=(OutputFile&& other) noexcept {
  std::swap(descriptor_, other.descriptor_);
  std::swap(path_, other.path_);
  return *this;
}

OutputFile::~OutputFile() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

Result<OutputFile> OutputFile::open(const std::string& path) {
  const int descriptor = ::open(path.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0644);
  if (descriptor < 0) return io("io.create", path, kStoreCure);
  return OutputFile(descriptor, path);
}

Result<void> OutputFile::write_at(std::uint64_t offset, const void* bytes, std::size_t size) {
  const char* from = static_cast<const char*>(bytes);
  while (size != 0) {
    const ssize_t done = ::pwrite(descriptor_, from, size, static_cast<off_t>(offset));
    if (done < 0 && errno == EINTR) continue;
    if (done <= 0) return io("io.write", path_, kStoreCure);
    from += done;
    offset += static_cast<std::uint64_t>(done);
    size -= static_cast<std::size_t>(done);
  }
  return {};
}

Result<void> OutputFile::resize(std::uint64_t size) {
  if (::ftruncate(descriptor_, static_cast<off_t>(size)) == 0) return {};
  // POSIX lets a file system refuse to make a file longer this way; some FAT drivers do.
  if (errno == EPERM && size != 0) return write_at(size - 1, "", 1);
  return io("io.write", path_, kStoreCure);
}

Result<void> OutputFile::sync() {
  if (::fsync(descriptor_) != 0) return io("io.sync", path_, kStoreCure);
  return {};
}

// --- The store ---

namespace {

constexpr std::size_t kMaxStateBytes = 65536;
constexpr std::size_t kMaxPointerBytes = 64;
constexpr std::string_view kBundle = ".modar";
constexpr std::string_view kRecipe = ".recipe";
constexpr std::string_view kLinkTarget = "current/";

/// Temporary files of ours at the top of a store, left behind by a fetch that was killed.
bool is_leftover(const std::string& store, const std::string& name) {
  if (name.ends_with(".new")) return !link_target(store + "/" + name).empty();
  return name.ends_with(".tmp") &&
         (name.starts_with("state.json.") || name.starts_with("current."));
}

/// "0123456789abcdef0123456789abcdef", or that with ".part".
bool is_piece_name(std::string_view name) {
  if (name.ends_with(".part")) name.remove_suffix(5);
  return object_id_of_hex(name).has_value();
}

/// What `current` says, as a link or as a file.
std::string current_slot(const std::string& store) {
  const std::string path = store + "/current";
  std::string target = link_target(path);
  if (target.empty()) target = read_small_file(path, kMaxPointerBytes).value_or("");
  while (!target.empty() && target.back() == '\n') target.pop_back();
  return target;
}

}  // namespace

Store::Store(std::string path, FolderLock lock) : path_(std::move(path)), lock_(std::move(lock)) {}

Result<Store> Store::open(const std::string& path) {
  for (const std::string& folder :
       {path, path + "/slots", path + "/slots/a", path + "/slots/b", path + "/pieces"}) {
    MODAR_TRY(make_folder(folder));
  }
  MODAR_ASSIGN(auto lock, FolderLock::take(path + "/lock", {kExitLocked, "store.locked", path,
                                                            "another fetch is using this store",
                                                            "wait until it ends"}));
  for (const std::string& name : list_folder(path)) {
    if (is_leftover(path, name)) MODAR_TRY(remove_file(path + "/" + name));
  }
  return Store(path, std::move(lock));
}

std::optional<StoreState> parse_state(std::string_view text) {
  rapidjson::Document json;
  json.Parse<rapidjson::kParseIterativeFlag>(text.data(), text.size());
  if (json.HasParseError() || !json.IsObject()) return std::nullopt;
  StoreState state;
  state.fresh = false;
  const auto number = [&](const char* key, std::uint64_t& to) {
    if (!json.HasMember(key)) return key == std::string_view("epoch");  // stores before epochs
    if (!json[key].IsUint64()) return false;
    to = json[key].GetUint64();
    return true;
  };
  const auto key_line = [&](const char* key, std::string& to) {
    if (!json.HasMember(key) || !json[key].IsString()) return false;
    to = json[key].GetString();
    return parse_public_key(to).has_value();
  };
  std::uint64_t serial = 0;
  if (!number("epoch", state.epoch) || !number("version", state.version) ||
      !number("key_serial", serial) || serial > 0xFFFFFFFFu ||
      !key_line("root_key", state.root_key) || !key_line("trusted_key", state.trusted_key)) {
    return std::nullopt;
  }
  state.key_serial = static_cast<std::uint32_t>(serial);
  return state;
}

StoreState Store::state() const {
  StoreState best;
  const auto rank = [](const StoreState& s) {
    return std::tuple(s.epoch, s.key_serial, s.version);
  };
  for (const char* file : {"/state.json", "/slots/state.json"}) {
    const auto text = read_small_file(path_ + file, kMaxStateBytes);
    if (!text) continue;
    auto state = parse_state(*text);
    if (state && (best.fresh || rank(*state) > rank(best))) best = std::move(*state);
  }
  return best;
}

Result<void> Store::save_state(const StoreState& state) const {
  rapidjson::StringBuffer buffer;
  rapidjson::PrettyWriter<rapidjson::StringBuffer> json(buffer);
  json.StartObject();
  json.Key("epoch");
  json.Uint64(state.epoch);
  json.Key("version");
  json.Uint64(state.version);
  json.Key("root_key");
  json.String(state.root_key.c_str());
  json.Key("trusted_key");
  json.String(state.trusted_key.c_str());
  json.Key("key_serial");
  json.Uint(state.key_serial);
  json.EndObject();
  const std::string_view text(buffer.GetString(), buffer.GetSize());
  MODAR_TRY(write_file(path_ + "/state.json", text));
  return write_file(path_ + "/slots/state.json", text);
}

std::optional<InstalledRelease> read_slot(const std::string& folder) {
  auto text = read_small_file(folder + "/release.json", kMaxReleaseBytes);
  if (!text) return std::nullopt;
  auto release = parse_release(*text);
  if (!release) return std::nullopt;
  return InstalledRelease{folder, std::move(*text), std::move(*release)};
}

std::optional<InstalledRelease> Store::active() const {
  const std::string slot = active_slot(path_);
  return slot.empty() ? std::nullopt : read_slot(slot);
}

std::optional<InstalledRelease> Store::other() const {
  return read_slot(spare_folder());
}

std::string Store::spare_folder() const {
  return path_ + (current_slot(path_) == "slots/a" ? "/slots/b" : "/slots/a");
}

Result<void> Store::activate(const InstalledRelease& release) const {
  MODAR_TRY(sync_folder(release.folder));
  const std::string target = release.folder.substr(path_.size() + 1);
  MODAR_ASSIGN(const bool linked, switch_link(path_ + "/current", target));
  if (!linked) MODAR_TRY(write_file(path_ + "/current", std::string_view(target + "\n")));
  MODAR_TRY(link_bundles(release.release));
  return sync_folder(path_);
}

Result<void> Store::link_bundles(const Release& release) const {
  for (const std::string& name : list_folder(path_)) {
    // A link of ours whose bundle is not in use any more.
    const std::string link = path_ + "/" + name;
    if (name.ends_with(kBundle) && link_target(link) == std::string(kLinkTarget) + name &&
        !file_size(link)) {
      MODAR_TRY(remove_file(link));
    }
  }
  if (link_target(path_ + "/current").empty()) return {};  // no symbolic links here
  for (const ReleaseBundle& bundle : release.bundles) {
    const std::string name = bundle.name + std::string(kBundle);
    const std::string target = std::string(kLinkTarget) + name;
    const std::string link = path_ + "/" + name;
    if (!file_size(path_ + "/" + target) || path_exists(link)) continue;
    MODAR_ASSIGN(const bool linked, switch_link(link, target));
    if (!linked) return {};
  }
  return {};
}

std::string active_slot(const std::string& store) {
  const std::string target = current_slot(store);
  return target == "slots/a" || target == "slots/b" ? store + "/" + target : std::string();
}

std::vector<std::string> installed_paths(const std::string& store, const Release& release) {
  std::vector<std::string> paths;
  for (const ReleaseBundle& bundle : release.bundles) {
    const std::string name = bundle.name + std::string(kBundle);
    const std::string installed = current_slot(store) + "/" + name;
    if (!file_size(store + "/" + installed)) continue;
    const bool linked = link_target(store + "/" + name) == std::string(kLinkTarget) + name;
    paths.push_back(store + "/" + (linked ? name : installed));
  }
  return paths;
}

std::vector<std::string> Store::blocked_links(const Release& release) const {
  std::vector<std::string> blocked;
  for (const ReleaseBundle& bundle : release.bundles) {
    const std::string name = bundle.name + std::string(kBundle);
    const std::string path = path_ + "/" + name;
    if (path_exists(path) && link_target(path) != std::string(kLinkTarget) + name) {
      blocked.push_back(path);
    }
  }
  return blocked;
}

Result<void> Store::remove_pieces(const std::set<std::string>& keep) const {
  for (const std::string& name : list_folder(pieces())) {
    if (!is_piece_name(name) || keep.contains(name.substr(0, name.find('.')))) continue;
    MODAR_TRY(remove_file(pieces() + "/" + name));
  }
  return {};
}

Result<void> Store::clear_slot(const std::string& slot, const std::set<std::string>& keep) const {
  // Without its document the slot is no release. A bundle is ours if its recipe lies beside it:
  // that is written first and removed last.
  for (const char* name : {"/release.json", "/release.json.minisig"}) {
    MODAR_TRY(remove_file(slot + name));
  }
  for (const std::string& name : list_folder(slot)) {
    if (!name.ends_with(kRecipe)) continue;
    const std::string bundle = name.substr(0, name.size() - kRecipe.size());
    if (keep.contains(bundle)) continue;
    MODAR_TRY(remove_file(slot + "/" + bundle + std::string(kBundle)));
    MODAR_TRY(remove_file(slot + "/" + name));
  }
  return {};
}

}  // namespace modar::fetch
