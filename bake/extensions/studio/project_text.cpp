#include "bake/extensions/studio/project_text.hpp"

#include <filesystem>
#include <fstream>
#include <iterator>

#include "bake/project/project_edit.hpp"
#include "formats/base/atomic_file.hpp"

namespace modar {
namespace {

namespace fs = std::filesystem;

constexpr std::uintmax_t kMostBytes = 4u << 20;  // of modar.toml; 10,000 scenes are 1 MB
constexpr std::size_t kMostSteps = 200;          // of the history, each a whole text

Error nothing(const char* cause) {
  return {ExitCode::kUsage, "studio.nothing", "", cause, ""};
}

}  // namespace

Result<ProjectText::State> ProjectText::look() {
  std::error_code error;
  std::string text;
  const bool there = fs::exists(file_, error);
  if (there) {
    if (fs::file_size(file_, error) > kMostBytes) {
      return fail(ExitCode::kInvalidInput, "project.toml", file_, "it is larger than 4 MiB",
                  "use globs in place of long lists");
    }
    std::ifstream file(file_, std::ios::binary);
    if (!file) {
      return fail(ExitCode::kIo, "io.open", file_, "the file cannot be read", "check its mode");
    }
    text.assign(std::istreambuf_iterator<char>(file), {});
  }
  if (known_ && text != text_) {
    undo_.push_back(std::move(text_));
    redo_.clear();
    if (undo_.size() > kMostSteps) undo_.erase(undo_.begin());
  }
  known_ = true;
  revision_ = there ? revision_of(text) : "";
  text_ = std::move(text);
  return State{text_, revision_, undo_.size(), redo_.size()};
}

Result<ProjectText::State> ProjectText::read() {
  const std::lock_guard lock(mutex_);
  return look();
}

Result<void> ProjectText::write(const std::string& text) {
  MODAR_TRY(write_file(file_, std::string_view(text)));
  text_ = text;
  revision_ = revision_of(text);
  return {};
}

Result<ProjectText::State> ProjectText::edit(
    const std::string& revision,
    const std::function<Result<std::string>(const std::string&)>& change) {
  const std::lock_guard lock(mutex_);
  MODAR_ASSIGN(const State now, look());
  if (now.revision != revision) {
    return fail(ExitCode::kUsage, "studio.changed", file_,
                "modar.toml was changed elsewhere meanwhile", "look at its present state");
  }
  MODAR_ASSIGN(const std::string text, change(now.text));
  if (text == now.text) return now;
  MODAR_TRY(write(text));
  undo_.push_back(now.text);
  redo_.clear();
  if (undo_.size() > kMostSteps) undo_.erase(undo_.begin());
  return State{text_, revision_, undo_.size(), redo_.size()};
}

Result<ProjectText::State> ProjectText::step(std::vector<std::string>& from,
                                             std::vector<std::string>& to) {
  const std::lock_guard lock(mutex_);
  MODAR_ASSIGN(const State now, look());
  if (from.empty()) return tl::unexpected(nothing("there is no further step"));
  MODAR_TRY(write(from.back()));
  from.pop_back();
  to.push_back(now.text);
  return State{text_, revision_, undo_.size(), redo_.size()};
}

}  // namespace modar
