// Whether the files of a folder have changed.
#pragma once

#include <cstdint>
#include <string>

namespace modar {

/// Change with the names, sizes and times of a folder's files: FNV-1a.
struct FolderState {
  std::uint64_t all = 14695981039346656037U;
  std::uint64_t sources = all;  ///< modar.toml and bundles left out
};

/// Hidden files and those under construction are left out. Costs a stat of each of the others.
FolderState folder_state(const std::string& folder);

}  // namespace modar
