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

Result<void> empty_folder(const std::string& path) {
  for (const std::string& name : list_folder(path)) {
    MODAR_TRY(remove_file(path + "/" + name));
  }
  return {};
}

std::optional<std::string> read_small_file(const std::string& path, std::size_t limit) {
  const auto size = file_size(path);
  if (!size || *size > limit) return std::nullopt;
  std::FILE* file = std::fopen(path.c_str(), "rbe");
  if (file == nullptr) return std::nullopt;
  std::string text(*size, '\0');
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

Result<void> switch_link(const std::string& path, const std::string& target) {
  const std::string beside = path + ".new";
  MODAR_TRY(remove_file(beside));
  if (::symlink(target.c_str(), beside.c_str()) != 0) return io("io.link", beside, kStoreCure);
  return rename_file(beside, path);
}

bool share_file(const std::string& path, const std::string& second) {
  return ::link(path.c_str(), second.c_str()) == 0;
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
  const int descriptor = ::open(path.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0644);
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
  if (::ftruncate(descriptor_, static_cast<off_t>(size)) != 0)
    return io("io.write", path_, kStoreCure);
  return {};
}

Result<void> OutputFile::sync() {
  if (::fsync(descriptor_) != 0) return io("io.sync", path_, kStoreCure);
  return {};
}

// --- The store ---

namespace {

constexpr std::size_t kMaxStateBytes = 65536;
constexpr const char* kExtension = ".modar";

std::string slot_name(const std::string& store, const char* slot) {
  return store + "/slots/" + slot;
}

bool ends_with_extension(const std::string& name) {
  return name.ends_with(kExtension);
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
  // Left behind by a fetch that was killed.
  for (const std::string& name : list_folder(path)) {
    if (!name.ends_with(".tmp") && !name.ends_with(".new")) continue;
    MODAR_TRY(remove_file(path + "/" + name));
  }
  return Store(path, std::move(lock));
}

StoreState Store::state() const {
  StoreState state;
  const auto text = read_small_file(path_ + "/state.json", kMaxStateBytes);
  if (!text) return state;
  rapidjson::Document json;
  json.Parse<rapidjson::kParseIterativeFlag>(text->data(), text->size());
  if (json.HasParseError() || !json.IsObject()) return state;
  const auto string = [&](const char* key) -> std::string {
    return json.HasMember(key) && json[key].IsString() ? json[key].GetString() : "";
  };
  if (json.HasMember("version") && json["version"].IsUint64()) {
    state.version = json["version"].GetUint64();
  }
  if (json.HasMember("key_serial") && json["key_serial"].IsUint()) {
    state.key_serial = json["key_serial"].GetUint();
  }
  state.root_key = string("root_key");
  state.trusted_key = string("trusted_key");
  return state;
}

Result<void> Store::save_state(const StoreState& state) const {
  rapidjson::StringBuffer buffer;
  rapidjson::PrettyWriter<rapidjson::StringBuffer> json(buffer);
  json.StartObject();
  json.Key("version");
  json.Uint64(state.version);
  json.Key("root_key");
  json.String(state.root_key.c_str());
  json.Key("trusted_key");
  json.String(state.trusted_key.c_str());
  json.Key("key_serial");
  json.Uint(state.key_serial);
  json.EndObject();
  return write_file(path_ + "/state.json", std::string_view(buffer.GetString(), buffer.GetSize()));
}

std::optional<InstalledRelease> read_slot(const std::string& folder) {
  auto text = read_small_file(folder + "/release.json", kMaxReleaseBytes);
  if (!text) return std::nullopt;
  auto release = parse_release(*text);
  if (!release) return std::nullopt;
  return InstalledRelease{folder, std::move(*text), std::move(*release)};
}

std::optional<InstalledRelease> Store::active() const {
  const std::string target = link_target(path_ + "/current");
  if (target != "slots/a" && target != "slots/b") return std::nullopt;
  return read_slot(path_ + "/" + target);
}

std::optional<InstalledRelease> Store::other() const {
  return read_slot(spare_folder());
}

std::string Store::spare_folder() const {
  return slot_name(path_, link_target(path_ + "/current") == "slots/a" ? "b" : "a");
}

Result<void> Store::activate(const InstalledRelease& release) const {
  MODAR_TRY(sync_folder(release.folder));
  const std::string target = release.folder.substr(path_.size() + 1);
  MODAR_TRY(switch_link(path_ + "/current", target));
  MODAR_TRY(link_bundles(release.release));
  return sync_folder(path_);
}

Result<void> Store::link_bundles(const Release& release) const {
  for (const std::string& name : list_folder(path_)) {
    if (!ends_with_extension(name)) continue;
    bool wanted = false;
    for (const ReleaseBundle& bundle : release.bundles) {
      wanted = wanted || bundle.name + kExtension == name;
    }
    if (wanted) continue;
    MODAR_TRY(remove_file(path_ + "/" + name));
  }
  for (const ReleaseBundle& bundle : release.bundles) {
    const std::string target = "current/" + bundle.name + kExtension;
    const std::string link = path_ + "/" + bundle.name + kExtension;
    if (!file_size(path_ + "/" + target) || link_target(link) == target) continue;
    MODAR_TRY(switch_link(link, target));
  }
  return {};
}

std::vector<std::string> Store::bundle_paths(const Release& release) const {
  std::vector<std::string> paths;
  for (const ReleaseBundle& bundle : release.bundles) {
    const std::string path = path_ + "/" + bundle.name + ".modar";
    if (file_size(path)) paths.push_back(path);
  }
  return paths;
}

}  // namespace modar::fetch
