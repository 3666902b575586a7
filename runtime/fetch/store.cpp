#include "store.hpp"

#include <utility>

#include <rapidjson/document.h>
#include <rapidjson/prettywriter.h>

#include "files.hpp"
#include "formats/atomic_file.hpp"

namespace modar::fetch {
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
    if (auto made = make_folder(folder); !made) return tl::unexpected(made.error());
  }
  auto lock = FolderLock::take(
      path + "/lock", {kExitLocked, "store.locked", path, "another fetch is at work on this store",
                       "wait until it ends"});
  if (!lock) return tl::unexpected(lock.error());
  // What a fetch that was cut off was writing.
  for (const std::string& name : list_folder(path)) {
    if (!name.ends_with(".tmp") && !name.ends_with(".new")) continue;
    if (auto gone = remove_file(path + "/" + name); !gone) return tl::unexpected(gone.error());
  }
  return Store(path, std::move(*lock));
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
  if (auto synced = sync_folder(release.folder); !synced) return synced;
  const std::string target = release.folder.substr(path_.size() + 1);
  if (auto switched = switch_link(path_ + "/current", target); !switched) return switched;
  if (auto linked = link_bundles(release.release); !linked) return linked;
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
    if (auto gone = remove_file(path_ + "/" + name); !gone) return gone;
  }
  for (const ReleaseBundle& bundle : release.bundles) {
    const std::string target = "current/" + bundle.name + kExtension;
    const std::string link = path_ + "/" + bundle.name + kExtension;
    if (!file_size(path_ + "/" + target) || link_target(link) == target) continue;
    if (auto linked = switch_link(link, target); !linked) return linked;
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
