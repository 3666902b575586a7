// Files next to an asset under names that the asset does not state exactly.
#pragma once

#include <map>
#include <mutex>
#include <set>
#include <string>

namespace modar {

/// Folders are listed once: files that come later are seen by the next run. May be called by
/// several threads.
class FolderNames {
 public:
  /// Path of the file that `name`, relative to `folder`, refers to: if none exists, of the one that
  /// find_named_file() takes instead; else unchanged.
  std::string located(const std::string& folder, const std::string& name);

  /// Names of pictures next to a model file that may be its texture by their name:
  /// is_texture_name(), and with own_picture is_own_picture().
  std::set<std::string> textures_of(const std::string& model, bool own_picture);

 private:
  struct Names {
    std::set<std::string> lower;     ///< of all, in small letters
    std::set<std::string> pictures;  ///< unchanged
  };
  const Names& names_in(const std::string& folder);

  std::mutex mutex_;
  std::map<std::string, Names> known_;
};

}  // namespace modar
