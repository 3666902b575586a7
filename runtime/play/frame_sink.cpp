// Files and folders that outputs go to.
#include <dirent.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <vector>

#include "frame_sink.hpp"

namespace modar {
namespace {

bool same_file(const std::string& a, const std::string& b) {
  struct stat first {};
  struct stat second {};
  return stat(a.c_str(), &first) == 0 && stat(b.c_str(), &second) == 0 &&
         first.st_dev == second.st_dev && first.st_ino == second.st_ino;
}

std::vector<std::string> names_in(const std::string& folder) {
  std::vector<std::string> names;
  DIR* open = opendir(folder.c_str());
  if (open == nullptr) return names;
  while (const dirent* entry = readdir(open)) names.emplace_back(entry->d_name);
  closedir(open);
  return names;
}

bool is_frame(std::string_view name) {
  if (!name.starts_with("frame_") || !(name.ends_with(".png") || name.ends_with(".ppm"))) {
    return false;
  }
  const std::string_view number = name.substr(6, name.size() - 10);
  return number.size() >= 6 && number.find_first_not_of("0123456789") == std::string_view::npos;
}

/// What --out and --report write. Names with a leading dot are those of unfinished files.
bool is_ours(std::string_view name) {
  constexpr std::array<std::string_view, 5> kReport = {
      "overlay.mp4", "poster.png", "contact_sheet.png", "frames.jsonl", "index.html"};
  for (const std::string_view each : kReport) {
    if (name.starts_with(each)) return true;
  }
  return name.starts_with('.') || is_frame(name);
}

Result<void> check_folder(const std::string& folder, const PlayOptions& options) {
  for (const std::string& name : names_in(folder)) {
    if (is_ours(name) || options.force) continue;
    return fail(ExitCode::kUsage, "out.foreign", folder,
                "the folder holds other files, such as " + name,
                "name a folder of its own, or give --force");
  }
  return {};
}

/// An input in the output's folder whose name will be written.
bool will_be_replaced(const std::string& input, const std::string& folder) {
  const std::size_t slash = input.rfind('/');
  const std::string name = slash == std::string::npos ? input : input.substr(slash + 1);
  return is_ours(name) && same_file(input, folder + "/" + name);
}

}  // namespace

Result<void> check_outputs(const PlayOptions& options) {
  const std::array<const std::string*, 4> inputs = {&options.bundle, &options.input,
                                                    &options.golden, &options.camera_file};
  for (const std::string* output : {&options.out, &options.report, &options.record, &options.qos}) {
    for (const std::string* input : inputs) {
      if (output->empty() || input->empty()) continue;
      if (!same_file(*output, *input) && !will_be_replaced(*input, *output)) continue;
      return fail(ExitCode::kUsage, "out.input", *output,
                  "the output would overwrite the input " + *input, "name another output");
    }
  }
  if (!options.out.empty()) MODAR_TRY(check_folder(options.out, options));
  if (!options.report.empty()) MODAR_TRY(check_folder(options.report, options));
  return {};
}

void remove_frames(const std::string& folder) {
  for (const std::string& name : names_in(folder)) {
    if (is_frame(name)) std::remove((folder + "/" + name).c_str());
  }
}

NewFolders::NewFolders(const PlayOptions& options) {
  const std::string frames = options.record.empty() ? "" : options.record + "/frames";
  for (const std::string& path : {options.out, options.report, frames}) {
    for (std::size_t end = path.find('/', 1); !path.empty(); end = path.find('/', end + 1)) {
      struct stat status {};
      const std::string part = path.substr(0, end);
      if (stat(part.c_str(), &status) != 0) paths_.push_back(part);
      if (end == std::string::npos) break;
    }
  }
}

void NewFolders::remove_empty() const {
  for (auto path = paths_.rbegin(); path != paths_.rend(); ++path) rmdir(path->c_str());
}

Result<void> make_folder(const std::string& path) {
  for (std::size_t end = path.find('/', 1);; end = path.find('/', end + 1)) {
    const std::string part = path.substr(0, end);
    if (mkdir(part.c_str(), 0777) != 0 && errno != EEXIST) {
      return fail(ExitCode::kIo, "out.create", part,
                  std::string("the folder cannot be made: ") + std::strerror(errno),
                  "choose a place that can be written");
    }
    if (end == std::string::npos) break;
  }
  struct stat status {};
  if (stat(path.c_str(), &status) == 0 && S_ISDIR(status.st_mode)) return {};
  return fail(ExitCode::kIo, "out.create", path, "it exists and is not a folder",
              "choose another place");
}

}  // namespace modar
