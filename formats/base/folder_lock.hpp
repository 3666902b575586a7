// One program at a time in a folder: the publisher in the release folder, the installer in its
// store.
#pragma once

#include <string>

#include "formats/base/error.hpp"

namespace modar {

/// Held while the object lives; the system lets go of it when the process ends, however it ends.
class FolderLock {
 public:
  /// Creates `file` where it is missing and takes its advisory lock without waiting.
  /// Errors: kIo "io.create"; `busy` where another process holds it.
  static Result<FolderLock> take(const std::string& file, const Error& busy);
  FolderLock(FolderLock&& other) noexcept;
  FolderLock& operator=(FolderLock&&) = delete;
  FolderLock(const FolderLock&) = delete;
  FolderLock& operator=(const FolderLock&) = delete;
  ~FolderLock();

 private:
  explicit FolderLock(int descriptor) : descriptor_(descriptor) {}
  int descriptor_ = -1;
};

}  // namespace modar
