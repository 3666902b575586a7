// The installer of releases (modar::fetch) for update-worker.js: the store is in emscripten's
// files in memory, which the worker loads from the browser's storage and saves there. A run ends
// where a file of the release is missing; the worker downloads it and runs again.
#include <algorithm>
#include <cstdlib>
#include <memory>
#include <string>
#include <vector>

#include <emscripten.h>

#include "formats/bundle_view.hpp"
#include "formats/tracker_record.hpp"
#include "modar/fetch.hpp"
#include "modar/mapped_file.hpp"
#include "whole_number.hpp"

// Files that the worker has downloaded, by its own requests, which have limits: brought(path, from)
// of the module answers {status, bytes, whole}, or nothing for one that is yet to come. The bytes
// are of malloc(); answers the status, 0 where it broke after these bytes, -1 where there is
// nothing yet. Strings have double quotes: C++ reads this, too.
// clang-format off
EM_JS(int, update_take, (const char* path, double from, void** bytes, size_t* size), {
  const file = Module.brought(UTF8ToString(path), from);
  if (!file) return -1;
  const at = _malloc(file.bytes.length + 1);
  if (at === 0) return 0;
  HEAPU8.set(file.bytes, at);
  HEAPU32[bytes >> 2] = at;
  HEAPU32[size >> 2] = file.bytes.length;
  return file.whole ? file.status : 0;
});
// clang-format on

namespace {

using namespace modar;

constexpr int kBroke = 0;
constexpr int kYetToCome = -1;
constexpr int kFound = 200;
constexpr int kPart = 206;

struct Freed {
  void operator()(void* memory) const { std::free(memory); }
};

/// The bytes from `from` on of a file that the worker has downloaded.
Result<void> hand_over(const std::string& path, std::uint64_t from,
                       const std::function<bool(std::span<const std::byte>)>& take) {
  void* bytes = nullptr;
  std::size_t size = 0;
  const int status = update_take(path.c_str(), static_cast<double>(from), &bytes, &size);
  const std::unique_ptr<void, Freed> keeper(bytes);
  if (status == kYetToCome) {
    return fail(kExitNetwork, "fetch.later", path, "it is yet to come",
                "download it and call again");
  }
  if (status == 404 || status == 410) {
    return fail(kExitMixed, "fetch.missing", path, "the server has no such file",
                "publish the release again");
  }
  const bool some = status == kFound || status == kPart || status == kBroke;
  if (some && size > 0) take({static_cast<const std::byte*>(bytes), size});
  if (status == kFound || status == kPart) return {};
  return fail(kExitNetwork, "fetch.network", path, "the connection failed, broke or was too slow",
              "the next visit tries again");
}

struct Update {
  Error error;
  MappedFile file;
  BundleView bundle;
  std::string text;
  std::vector<FileNeed> needs;
};
Update update;

const char* kept(std::string_view text) {
  update.text = text;
  return update.text.c_str();
}

}  // namespace

extern "C" {

/// Updates the store in `store`. now: seconds since 1970, of JavaScript's clock. epoch,
/// version: of the release that came with the page, 0 for none known. 1: something new is
/// installed; 0: nothing is; 2: update_need() tells what has to be downloaded first; -1:
/// update_error().
EMSCRIPTEN_KEEPALIVE int update_run(const char* url, const char* key, const char* store, double now,
                                    double epoch, double version) {
  const auto seconds = whole_number(now);
  const auto least_epoch = whole_number(epoch);
  const auto least_version = whole_number(version);
  if (!seconds || !least_epoch || !least_version) {
    update.error = {ExitCode::kUsage, "capi.number", "update_run",
                    "a time, epoch or version is not a number from 0 to 2^53 - 1",
                    "make the page again"};
    return -1;
  }
  FetchOptions options;
  options.url = url;
  options.store = store;
  options.trusted_key = key;
  options.now = static_cast<std::int64_t>(*seconds);
  options.least_epoch = *least_epoch;
  options.least_version = *least_version;
  // The worker counts how often it downloads a file.
  options.attempts = 2;
  options.first_wait_s = 0;
  options.source = hand_over;
  options.needs = [](std::span<const FileNeed> needs) {
    update.needs.assign(needs.begin(), needs.end());
  };
  auto report = fetch_release(options);
  if (report) return report->changed ? 1 : 0;
  if (report.error().code == "fetch.later") return 2;
  update.error = report.error();
  return -1;
}

/// The path of a file to download; null behind the last.
EMSCRIPTEN_KEEPALIVE const char* update_need(uint32_t index) {
  return index < update.needs.size() ? update.needs[index].path.c_str() : nullptr;
}
/// Its first byte that is wanted, and how many bytes it has at most.
EMSCRIPTEN_KEEPALIVE double update_need_from(uint32_t index) {
  return static_cast<double>(update.needs[index].from);
}
EMSCRIPTEN_KEEPALIVE double update_need_limit(uint32_t index) {
  return static_cast<double>(update.needs[index].limit);
}

/// field: 0 code, 1 where, 2 cause, 3 cure.
EMSCRIPTEN_KEEPALIVE const char* update_error(int field) {
  const std::string* const fields[] = {&update.error.code, &update.error.where, &update.error.cause,
                                       &update.error.cure};
  return fields[field]->c_str();
}

/// Opens an installed bundle for the functions below; 0 where it cannot be read.
EMSCRIPTEN_KEEPALIVE int update_open(const char* path) {
  auto file = MappedFile::open(path);
  if (!file) return 0;
  auto bundle = BundleView::open(file->bytes());
  if (!bundle) return 0;
  update.file = std::move(*file);
  update.bundle = *bundle;
  return 1;
}

/// How the bundle was made: JSON.
EMSCRIPTEN_KEEPALIVE const char* update_meta() {
  const auto meta = update.bundle.section(SectionType::kMeta);
  return kept({reinterpret_cast<const char*>(meta.data()), meta.size()});
}

/// A pattern's name; null behind the last.
EMSCRIPTEN_KEEPALIVE const char* update_pattern(uint32_t index) {
  if (index >= update.bundle.patterns().size()) return nullptr;
  return kept(update.bundle.name(update.bundle.patterns()[index].name));
}

/// Names of the models of a pattern's scenes, each once.
EMSCRIPTEN_KEEPALIVE const char* update_models(uint32_t index) {
  std::vector<std::string_view> names;
  for (const SceneRecord& scene : update.bundle.scenes()) {
    const std::string_view name = update.bundle.name(update.bundle.models()[scene.model].name);
    const bool known = std::find(names.begin(), names.end(), name) != names.end();
    if (scene.pattern == index && !known) names.push_back(name);
  }
  std::string all;
  for (const std::string_view name : names) all.append(all.empty() ? "" : ", ").append(name);
  return kept(all);
}

/// The print: a WebP file; of no bytes in bundles of before 1.3.
EMSCRIPTEN_KEEPALIVE const std::byte* update_picture(uint32_t index) {
  return update.bundle.section(SectionType::kPatternPicture, index).data();
}
EMSCRIPTEN_KEEPALIVE size_t update_picture_bytes(uint32_t index) {
  return update.bundle.section(SectionType::kPatternPicture, index).size();
}
/// Of the tracker's picture, pixels; 0 where the pattern has no tracker record. down: 1 for the
/// height.
EMSCRIPTEN_KEEPALIVE uint32_t update_picture_side(uint32_t index, int down) {
  TrackerRecordView picture;
  const auto record = update.bundle.section(SectionType::kTrackerRecord, index);
  if (record.empty() || view_tracker_record(record, picture)) return 0;
  return down != 0 ? picture.header.height : picture.header.width;
}

}  // extern "C"
