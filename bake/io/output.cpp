#include "bake/io/output.hpp"

#include <signal.h>
#include <stdlib.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <system_error>
#include <utility>

#include "bake/io/input.hpp"
#include "bake/io/terminal.hpp"
#include "bake/json.hpp"
#include "formats/base/atomic_file.hpp"
#include "formats/base/ranges.hpp"
#include "formats/base/utf8.hpp"
#include "formats/trim.hpp"

namespace modar {
namespace {

namespace fs = std::filesystem;

constexpr const char* kFolderMark = ".modar-output";
constexpr std::string_view kStaging = ".modar-";  ///< and the number of the process

/// Removes what runs that were killed have left of their files.
void remove_left_staging(const std::string& folder) {
  std::error_code ignored;
  std::vector<fs::path> left;
  for (const auto& entry : fs::directory_iterator(folder, ignored)) {
    const std::string name = entry.path().filename().string();
    if (!name.starts_with(kStaging) || !entry.is_directory(ignored)) continue;
    const char* const end = name.data() + name.size();
    ::pid_t process = 0;
    const auto read = std::from_chars(name.data() + kStaging.size(), end, process);
    const bool ours = read.ec == std::errc() && read.ptr == end && process > 0;
    if (ours && ::kill(process, 0) != 0 && errno == ESRCH) left.push_back(entry.path());
  }
  for (const fs::path& path : left) fs::remove_all(path, ignored);
}

}  // namespace

Result<void> make_output_folder(const std::string& folder) {
  std::error_code error;
  constexpr std::array kFiles = {".png",  ".jpg", ".jpeg", ".webp", ".pdf", ".html", ".txt",
                                 ".json", ".csv", ".zip",  ".mp4",  ".obj", ".glb",  ".modar"};
  if (const std::string ending = ascii_lower(fs::path(folder).extension().string());
      !fs::exists(folder, error) &&
      ranges::any_of(kFiles, [&](auto* one) { return ending == one; })) {
    return fail(ExitCode::kUsage, "out.folder", folder,
                "a folder is written, and this names a file",
                "name a folder, or make this one first");
  }
  fs::create_directories(folder, error);
  if (error) {
    return fail(ExitCode::kIo, "io.folder", folder, error.message(),
                "name a folder that can be created");
  }
  return {};
}

Result<void> keep_foreign_folder(const std::string& folder, const std::string& cure) {
  std::error_code error;
  const bool none = !fs::is_directory(folder, error) || fs::is_empty(folder, error);
  if (error || none || fs::exists(fs::path(folder) / kFolderMark, error)) return {};
  return fail(ExitCode::kUsage, "out.foreign-folder", folder,
              "the folder contains files that modar has not written", cure);
}

OutputFolder::OutputFolder(std::string folder, bool made)
    : folder_(std::move(folder)),
      staging_(path(std::string(kStaging) + std::to_string(::getpid()))),
      made_(made) {
  leftovers_.emplace_back(staging_);
  if (made_) leftovers_.emplace_back(folder_);
}

OutputFolder::OutputFolder(OutputFolder&& other) noexcept
    : folder_(std::move(other.folder_)),
      staging_(std::exchange(other.staging_, std::string())),
      made_(other.made_),
      marked_(other.marked_),
      names_(std::move(other.names_)),
      leftovers_(std::move(other.leftovers_)) {}

OutputFolder::~OutputFolder() {
  std::error_code ignored;
  if (staging_.empty()) return;
  fs::remove_all(staging_, ignored);
  if (marked_) fs::remove(path(kFolderMark), ignored);
  if (made_) fs::remove(folder_, ignored);
}

Result<OutputFolder> OutputFolder::claim(const std::string& folder, bool force) {
  std::error_code error;
  remove_left_staging(folder);
  const bool there = fs::exists(folder, error);
  const bool empty = !there || !fs::is_directory(folder, error) || fs::is_empty(folder, error);
  if (!force) {
    MODAR_TRY(keep_foreign_folder(
        folder, "name a new or an empty folder, or write into this one with --force"));
  }
  MODAR_TRY(make_output_folder(folder));
  OutputFolder output(folder, !there);
  constexpr std::string_view kMark = "Files of this folder were written by modar.\n";
  const auto mark = std::as_bytes(std::span(kMark));
  // At once where nothing else is there: a run that is killed leaves a folder that the next takes.
  if (!empty) {
    MODAR_TRY(output.write(kFolderMark, mark));
    return output;
  }
  MODAR_TRY(write_file(output.path(kFolderMark), mark));
  output.marked_ = true;
  output.leftovers_.emplace_back(output.path(kFolderMark));
  return output;
}

Result<void> OutputFolder::write(const std::string& name, std::span<const std::byte> bytes) {
  const fs::path file = fs::path(staging_) / name;
  // Registered before they are made: a signal may come at any time.
  leftovers_.emplace_back(file.parent_path().string());
  leftovers_.emplace_back(file.string());
  MODAR_TRY(make_output_folder(file.parent_path().string()));
  names_.push_back(name);
  auto written = write_file(file.string(), bytes);
  if (!written) written.error().where = path(name);
  return written;
}

Result<void> OutputFolder::commit() {
  // Files that are in their places need the mark.
  leftovers_.erase(leftovers_.begin() + 1, leftovers_.end());
  for (const std::string& name : names_) {
    MODAR_TRY(make_output_folder(fs::path(path(name)).parent_path().string()));
    std::error_code error;
    fs::rename(staging_ + "/" + name, path(name), error);
    if (error) {
      return fail(ExitCode::kIo, "io.commit", path(name), "cannot be replaced: " + error.message(),
                  "check that the folder may be written");
    }
  }
  std::error_code ignored;
  fs::remove_all(std::exchange(staging_, std::string()), ignored);
  return {};
}

Result<void> keep_inputs(const std::string& output, const std::vector<std::string>& inputs) {
  for (const std::string& input : inputs) {
    std::error_code error;
    if (!fs::equivalent(output, input, error) || error) continue;
    return fail(ExitCode::kUsage, "out.input", output,
                "the output would overwrite the input " + input, "name another output");
  }
  return {};
}

Result<void> keep_other_kinds(const std::string& output, const std::string& kind,
                              const std::function<bool(std::string_view)>& is_ours) {
  if (!is_regular_file(output)) return {};
  std::ifstream file(output, std::ios::binary);
  std::string start(4096, '\0');
  file.read(start.data(), static_cast<std::streamsize>(start.size()));
  start.resize(static_cast<std::size_t>(file.gcount()));
  if (start.empty() || is_ours(start)) return {};
  return fail(ExitCode::kUsage, "out.foreign", output,
              "the output would overwrite a file that is not a " + kind, "name another output");
}

Result<void> try_output(const std::string& path, std::uint64_t bytes) {
  std::error_code error;
  if (fs::is_directory(path, error)) {
    return fail(ExitCode::kIo, "io.folder", path, "it is a folder", "name a file in it");
  }
  const fs::path folder = fs::absolute(path, error).parent_path();
  std::string probe = (folder / ".modar-XXXXXX").string();
  const int file = ::mkstemp(probe.data());
  if (file < 0) {
    return fail(ExitCode::kIo, "io.folder", path,
                "its folder cannot be written: " + std::string(std::strerror(errno)),
                "name a writable place");
  }
  ::close(file);
  ::unlink(probe.c_str());
  const fs::space_info space = fs::space(folder, error);
  if (error || space.available >= bytes) return {};
  return fail(ExitCode::kIo, "io.space", path,
              "only " + human_bytes(space.available) + " are free there, and it needs about " +
                  human_bytes(bytes),
              "free some space, or name another place");
}

std::uint64_t file_bytes(const std::vector<std::string>& paths) {
  std::uint64_t sum = 0;
  for (const std::string& path : paths) {
    std::error_code error;
    const std::uintmax_t bytes = fs::file_size(path, error);
    if (!error) sum += bytes;
  }
  return sum;
}

Result<std::vector<std::byte>> trim_to_publish(const BundleView& bundle) {
  const Json options = Json::parse(bundle.meta())["options"];
  const bool named = options["parameters"].size() != 0;
  if (named || bundle.parameter_sets().size() == 0) return std::vector<std::byte>();
  const BundleContent content = trim(bundle);
  if (content.parameter_sets.size() != 0) return std::vector<std::byte>();
  return encode_bundle(content);
}

}  // namespace modar
