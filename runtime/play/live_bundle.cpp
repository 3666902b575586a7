#include "live_bundle.hpp"

#include <sys/stat.h>

#include "pipeline.hpp"

namespace modar {
namespace {

/// Empty while there is no file: it may be between two names.
std::string state_of(const std::string& path) {
  struct stat status {};
  if (stat(path.c_str(), &status) != 0) return "";
  return std::to_string(status.st_ino) + ' ' + std::to_string(status.st_size) + ' ' +
         std::to_string(status.st_mtim.tv_sec) + '.' + std::to_string(status.st_mtim.tv_nsec);
}

}  // namespace

BundleWatch::BundleWatch(std::string path) : path_(std::move(path)), state_(state_of(path_)) {}

Result<std::shared_ptr<const LiveBundle>> BundleWatch::look() {
  constexpr std::int64_t kEveryNs = 100'000'000;  // soon enough for an eye, and no load
  if (now_ns() < next_ns_) return nullptr;
  next_ns_ = now_ns() + kEveryNs;
  std::string state = state_of(path_);
  if (state.empty() || state == state_) return nullptr;
  state_ = std::move(state);
  MODAR_ASSIGN(MappedFile file, MappedFile::open(path_));
  auto live = std::make_shared<LiveBundle>(LiveBundle{std::move(file), {}});
  Result<BundleView> view = open_bundle(live->file);
  if (!view) {
    Error error = view.error();
    error.where = path_ + ":" + error.where;
    return tl::unexpected(std::move(error));
  }
  live->view = *view;
  return live;
}

}  // namespace modar
