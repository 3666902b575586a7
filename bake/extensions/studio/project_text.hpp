// modar.toml while it is edited: by the page, and by other editors meanwhile.
#pragma once

#include <functional>
#include <mutex>
#include <string>
#include <vector>

#include "formats/base/error.hpp"

namespace modar {

/// The file's text with its history. Of all threads.
class ProjectText {
 public:
  /// file: path of modar.toml, which need not exist yet.
  explicit ProjectText(std::string file) : file_(std::move(file)) {}

  struct State {
    std::string text;
    std::string revision;  ///< of its bytes; empty where there is no file
    std::size_t undo = 0;  ///< steps
    std::size_t redo = 0;
  };
  /// As the file stands now; a change by another editor is a step of the history.
  /// Errors: kIo "io.open"; kInvalidInput "project.toml" (larger than 4 MiB).
  Result<State> read();
  /// Replaces the file whole, atomically. revision: the one that `change` is for. Errors: kUsage
  /// "studio.changed"; those of `change` and of AtomicFile, after which the file is unchanged.
  Result<State> edit(const std::string& revision,
                     const std::function<Result<std::string>(const std::string&)>& change);
  /// Errors: kUsage "studio.nothing"; as edit().
  Result<State> undo() { return step(undo_, redo_); }
  Result<State> redo() { return step(redo_, undo_); }

 private:
  Result<State> look();
  Result<void> write(const std::string& text);
  Result<State> step(std::vector<std::string>& from, std::vector<std::string>& to);

  std::mutex mutex_;
  std::string file_;
  bool known_ = false;
  std::string text_;
  std::string revision_;
  std::vector<std::string> undo_;
  std::vector<std::string> redo_;
};

}  // namespace modar
