#include "bake/project/folder_names.hpp"

#include <filesystem>
#include <system_error>

#include "bake/image/image.hpp"
#include "bake/import/read_model.hpp"
#include "formats/base/path.hpp"
#include "formats/base/utf8.hpp"

namespace modar {
namespace {

namespace fs = std::filesystem;

std::string listed(const std::string& folder) {
  return folder.empty() ? "." : folder;
}

}  // namespace

const FolderNames::Names& FolderNames::names_in(const std::string& folder) {
  const std::lock_guard lock(mutex_);
  const auto [known, added] = known_.try_emplace(folder);
  if (!added) return known->second;
  std::error_code error;
  fs::directory_iterator it(listed(folder), error);
  for (; !error && it != fs::directory_iterator(); it.increment(error)) {
    const std::string name = it->path().filename().string();
    if (is_picture_file(name)) known->second.pictures.insert(name);
    known->second.lower.insert(ascii_lower(name));
  }
  return known->second;
}

std::string FolderNames::located(const std::string& folder, const std::string& name) {
  const std::string stated = (fs::path(folder) / name).string();
  std::error_code error;
  if (fs::exists(stated, error)) return stated;
  // The reader looks for the whole path in any case, and for its last part in the folder itself.
  const std::set<std::string>& names = names_in(folder).lower;
  const std::string lower = ascii_lower(name);
  const std::string first = lower.substr(0, lower.find_first_of("/\\"));
  const std::string last = lower.substr(lower.find_last_of("/\\") + 1);
  if (first != "." && first != ".." && !names.contains(first) && !names.contains(last)) {
    return stated;
  }
  std::string found = find_named_file(name, listed(folder));
  return found.empty() ? stated : found;
}

std::set<std::string> FolderNames::textures_of(const std::string& model, bool own_picture) {
  const std::string stem = file_stem(model);
  std::set<std::string> textures;
  for (const std::string& picture : names_in(fs::path(model).parent_path().string()).pictures) {
    const std::string name = file_stem(picture);
    if (is_texture_name(name, stem) || (own_picture && is_own_picture(name, stem))) {
      textures.insert(picture);
    }
  }
  return textures;
}

}  // namespace modar
