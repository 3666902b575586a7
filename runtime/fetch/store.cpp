#include "store.hpp"

#include <algorithm>
#include <tuple>
#include <utility>

#include <rapidjson/document.h>

#include "formats/json_writer.hpp"

namespace modar::fetch {

namespace {

constexpr std::size_t kMaxStateBytes = 65536;
constexpr std::size_t kMaxPointerBytes = 64;
constexpr std::uint64_t kMaxTime = 253402300799;  // the end of 9999
constexpr std::string_view kRecipe = ".recipe";
constexpr std::string_view kLinkTarget = "current/";

/// Our temporary files at the top of a store, left behind by a fetch that was killed.
bool is_leftover(const Folder& store, const std::string& name) {
  if (name.ends_with(".new")) return !store.link_target(name).empty();
  return name.ends_with(".tmp") &&
         (name.starts_with("state.json.") || name.starts_with("current."));
}

/// "0123456789abcdef0123456789abcdef", or that with ".part".
bool is_piece_name(std::string_view name) {
  if (name.ends_with(".part")) name.remove_suffix(5);
  return object_id_of_hex(name).has_value();
}

/// A preview, or what a fetch that was killed while making one left behind.
bool is_first_name(std::string_view name) {
  const std::size_t at = name.rfind(kFirst);
  if (at == std::string_view::npos) return false;
  const std::string_view end = name.substr(at + std::string_view(kFirst).size());
  return end.empty() || end == ".part" || (end.starts_with('.') && end.ends_with(".tmp"));
}

/// What `current` says, as a link or as a file.
std::string current_slot(const Folder& store) {
  std::string target = store.link_target("current");
  if (target.empty()) target = store.read("current", kMaxPointerBytes).value_or("");
  while (!target.empty() && target.back() == '\n') target.pop_back();
  return target;
}

}  // namespace

Store::Store(Folder root, Folder slots, Folder a, Folder b, Folder pieces, FolderLock lock)
    : root_(std::move(root)),
      slots_(std::move(slots)),
      a_(std::move(a)),
      b_(std::move(b)),
      pieces_(std::move(pieces)),
      lock_(std::move(lock)) {}

Result<Store> Store::open(const std::string& path) {
  MODAR_ASSIGN(auto root, Folder::open(path, true));
  MODAR_ASSIGN(auto slots, root.below("slots", true));
  MODAR_ASSIGN(auto a, slots.below("a", true));
  MODAR_ASSIGN(auto b, slots.below("b", true));
  MODAR_ASSIGN(auto pieces, root.below("pieces", true));
  MODAR_ASSIGN(auto lock, FolderLock::take(path + "/lock", {kExitLocked, "store.locked", path,
                                                            "another fetch is using this store",
                                                            "wait until it ends"}));
  for (const std::string& name : root.list()) {
    if (is_leftover(root, name)) MODAR_TRY(root.remove(name));
  }
  return Store(std::move(root), std::move(slots), std::move(a), std::move(b), std::move(pieces),
               std::move(lock));
}

std::optional<StoreState> parse_state(std::string_view text) {
  rapidjson::Document json;
  json.Parse<rapidjson::kParseIterativeFlag>(text.data(), text.size());
  if (json.HasParseError() || !json.IsObject()) return std::nullopt;
  StoreState state;
  state.fresh = false;
  const auto number = [&](const char* key, std::uint64_t& to) {
    if (!json.HasMember(key)) {
      const std::string_view name = key;  // older stores lack these
      return name == "epoch" || name == "time" || name == "root_serial";
    }
    if (!json[key].IsUint64()) return false;
    to = json[key].GetUint64();
    return true;
  };
  const auto string = [&](const char* key, std::string& to) {
    if (!json.HasMember(key) || !json[key].IsString()) return false;
    to = json[key].GetString();
    return true;
  };
  std::uint64_t serial = 0;
  std::uint64_t root_serial = 0;
  std::uint64_t time = 0;
  if (!number("epoch", state.epoch) || !number("version", state.version) ||
      !number("key_serial", serial) || !number("time", time) || time > kMaxTime ||
      !number("root_serial", root_serial) || std::max(serial, root_serial) > 0xFFFFFFFFu ||
      !string("root_key", state.root_key) || !parse_root_set(state.root_key) ||
      !string("trusted_key", state.trusted_key)) {
    return std::nullopt;
  }
  if (!state.trusted_key.empty() && !parse_public_key(state.trusted_key)) return std::nullopt;
  if (json.HasMember("roots") && (!string("roots", state.roots) || !parse_root_set(state.roots))) {
    return std::nullopt;
  }
  state.root_serial = static_cast<std::uint32_t>(root_serial);
  state.key_serial = static_cast<std::uint32_t>(serial);
  state.time = static_cast<std::int64_t>(time);
  return state;
}

StoreState Store::state() const {
  StoreState best;
  const auto rank = [](const StoreState& s) {
    return std::tuple(s.root_serial, s.epoch, s.key_serial, s.version, s.time);
  };
  for (const Folder* folder : {&root_, &slots_}) {
    const auto text = folder->read("state.json", kMaxStateBytes);
    if (!text) continue;
    auto state = parse_state(*text);
    if (state && (best.fresh || rank(*state) > rank(best))) best = std::move(*state);
  }
  return best;
}

Result<void> Store::save_state(const StoreState& state) const {
  JsonWriter json(4);
  json.object([&] {
    json.put("epoch", state.epoch);
    json.put("version", state.version);
    json.put("root_key", state.root_key);
    if (!state.roots.empty()) {
      json.put("roots", state.roots);
      json.put("root_serial", state.root_serial);
    }
    json.put("trusted_key", state.trusted_key);
    json.put("key_serial", state.key_serial);
    json.put("time", state.time);
  });
  MODAR_TRY(root_.replace("state.json", json.str()));
  return slots_.replace("state.json", json.str());
}

std::optional<InstalledRelease> read_slot(const Folder& folder) {
  auto text = folder.read("release.json", kMaxReleaseBytes);
  if (!text) return std::nullopt;
  auto release = parse_release(*text);
  if (!release) return std::nullopt;
  return InstalledRelease{folder, std::move(*text), std::move(*release)};
}

std::string active_slot(const Folder& store) {
  const std::string target = current_slot(store);
  return target == "slots/a" || target == "slots/b" ? target : std::string();
}

std::optional<InstalledRelease> active_release(const Folder& store) {
  const std::string target = active_slot(store);
  if (target.empty()) return std::nullopt;
  const auto slot = store.below("slots", false).and_then([&](const Folder& slots) {
    return slots.below(target.substr(target.size() - 1), false);
  });
  return slot ? read_slot(*slot) : std::nullopt;
}

std::optional<InstalledRelease> Store::active() const {
  return active_release(root_);
}

std::optional<InstalledRelease> Store::other() const {
  return read_slot(spare_folder());
}

const Folder& Store::spare_folder() const {
  return current_slot(root_) == "slots/a" ? b_ : a_;
}

Result<void> Store::activate(const InstalledRelease& release) const {
  for (const Folder* folder : {&release.folder, &slots_, &root_}) MODAR_TRY(folder->sync());
  const std::string target = release.folder.path().substr(root_.path().size() + 1);
  MODAR_ASSIGN(const bool linked, root_.switch_link("current", target));
  if (!linked) MODAR_TRY(root_.replace("current", target + "\n"));
  MODAR_TRY(link_bundles(release.release));
  return root_.sync();
}

Result<void> Store::link_bundles(const Release& release) const {
  const Folder& slot = current_slot(root_) == "slots/a" ? a_ : b_;
  for (const std::string& name : root_.list()) {
    // One of our links whose bundle is not in use any more.
    if (name.ends_with(kWhole) && root_.link_target(name) == std::string(kLinkTarget) + name &&
        !slot.size(name)) {
      MODAR_TRY(root_.remove(name));
    }
  }
  if (root_.link_target("current").empty()) return {};  // no symbolic links here
  for (const ReleaseBundle& bundle : release.bundles) {
    const std::string name = bundle.name + kWhole;
    if (!slot.size(name) || root_.has(name)) continue;
    MODAR_ASSIGN(const bool linked, root_.switch_link(name, std::string(kLinkTarget) + name));
    if (!linked) return {};
  }
  return {};
}

std::vector<std::string> installed_paths(const Folder& store, const InstalledRelease& release) {
  std::vector<std::string> paths;
  for (const ReleaseBundle& bundle : release.release.bundles) {
    const std::string name = bundle.name + kWhole;
    if (!release.folder.size(name)) continue;
    const bool linked = store.link_target(name) == std::string(kLinkTarget) + name;
    paths.push_back(linked ? store.path_of(name) : release.folder.path_of(name));
  }
  return paths;
}

std::vector<std::string> first_paths(const Folder& store,
                                     const std::optional<InstalledRelease>& release) {
  std::vector<std::string> paths;
  const auto pieces = store.below("pieces", false);
  if (!pieces) return paths;
  for (const std::string& name : pieces->list()) {
    if (!name.ends_with(kFirst) || !pieces->size(name)) continue;
    const std::string whole = name.substr(0, name.rfind('.')) + kWhole;
    if (!release || !release->folder.size(whole)) paths.push_back(pieces->path_of(name));
  }
  return paths;
}

std::vector<std::string> Store::blocked_links(const Release& release) const {
  std::vector<std::string> blocked;
  for (const ReleaseBundle& bundle : release.bundles) {
    const std::string name = bundle.name + kWhole;
    if (root_.has(name) && root_.link_target(name) != std::string(kLinkTarget) + name) {
      blocked.push_back(root_.path_of(name));
    }
  }
  return blocked;
}

Result<void> Store::remove_pieces(const std::set<std::string>& keep) const {
  for (const std::string& name : pieces_.list()) {
    const bool ours = is_first_name(name) || is_piece_name(name);
    const bool kept = keep.contains(is_piece_name(name) ? name.substr(0, name.find('.')) : name);
    if (!ours || kept) continue;
    MODAR_TRY(pieces_.remove(name));
  }
  return {};
}

Result<void> Store::clear_slot(const Folder& slot, const std::set<std::string>& keep) const {
  // Without its document the slot is no release. A bundle is ours if its recipe is next to it:
  // that is written first and removed last.
  for (const char* name : {"release.json", "release.json.minisig", "fresh.json"}) {
    MODAR_TRY(slot.remove(name));
  }
  for (const std::string& name : slot.list()) {
    if (!name.ends_with(kRecipe)) continue;
    const std::string bundle = name.substr(0, name.size() - kRecipe.size());
    if (keep.contains(bundle)) continue;
    MODAR_TRY(slot.remove(bundle + kWhole));
    MODAR_TRY(slot.remove(name));
  }
  return {};
}

}  // namespace modar::fetch
