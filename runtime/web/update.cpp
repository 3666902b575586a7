// The installer of releases (modar::fetch) for update-worker.js: the store lies in emscripten's
// files in memory, which the worker brings from the browser's storage and saves there; files of the
// release come by the worker's own requests.
#include <algorithm>
#include <cstdlib>
#include <memory>
#include <set>
#include <string>

#include <emscripten.h>

#include "formats/bundle_view.hpp"
#include "formats/tracker_record.hpp"
#include "modar/fetch.hpp"
#include "modar/mapped_file.hpp"

// A worker may wait for an answer. The answer's bytes are of malloc(); answers the status, 0 for
// none. Strings stand in double quotes: C++ reads this, too.
// clang-format off
EM_JS(int, update_get, (const char* url, int fresh, double from, void** bytes, size_t* size), {
  const request = new XMLHttpRequest();
  try {
    request.open("GET", UTF8ToString(url) + (fresh ? "?" + Date.now() : ""), false);
    request.responseType = "arraybuffer";
    if (from > 0) request.setRequestHeader("Range", "bytes=" + from + "-");
    request.send();
  } catch (error) {
    return 0;
  }
  const answer = new Uint8Array(request.response ?? 0);
  const at = _malloc(answer.length + 1);
  if (at === 0) return 0;
  HEAPU8.set(answer, at);
  HEAPU32[bytes >> 2] = at;
  HEAPU32[size >> 2] = answer.length;
  return request.status;
});
// clang-format on

namespace {

using namespace modar;

constexpr int kFound = 200;
constexpr int kPart = 206;

struct Freed {
  void operator()(void* memory) const { std::free(memory); }
};

/// Paths that this visit has asked for.
std::set<std::string> asked;

/// What must not come from the browser's cache: documents, which may have been mended since, and
/// pieces that are asked for again, since the copy that came first was no good.
bool past_caches(const std::string& path) {
  return !asked.insert(path).second || !path.starts_with("objects/");
}

Result<void> bring(const std::string& folder, const std::string& path, std::uint64_t from,
                   const std::function<bool(std::span<const std::byte>)>& take) {
  const std::string url = folder + path;
  void* bytes = nullptr;
  std::size_t size = 0;
  const int status =
      update_get(url.c_str(), past_caches(path) ? 1 : 0, static_cast<double>(from), &bytes, &size);
  const std::unique_ptr<void, Freed> keeper(bytes);
  if (status == 404 || status == 410) {
    return fail(kExitMixed, "fetch.missing", path, "the server has no such file",
                "publish the release again");
  }
  if (status != kFound && status != kPart) {
    return fail(kExitNetwork, "fetch.network", path, "the connection failed or broke",
                "the next visit tries again");
  }
  std::span<const std::byte> all(static_cast<const std::byte*>(bytes), size);
  // A server without ranges begins at the first byte.
  if (status == kFound)
    all = all.subspan(static_cast<std::size_t>(std::min<std::uint64_t>(from, size)));
  take(all);
  return {};
}

struct Update {
  Error error;
  MappedFile file;
  BundleView bundle;
  TrackerRecordView picture;
  std::string text;
};
Update update;

const char* kept(std::string_view text) {
  update.text = text;
  return update.text.c_str();
}

}  // namespace

extern "C" {

/// Brings the store in `store` up to date. now: seconds since 1970, of JavaScript's clock. 1:
/// something new is installed; 0: nothing is; -1: update_error().
EMSCRIPTEN_KEEPALIVE int update_run(const char* url, const char* key, const char* store,
                                    double now) {
  FetchOptions options;
  options.url = url;
  options.store = store;
  options.trusted_key = key;
  options.now = static_cast<std::int64_t>(now);
  // The next visit tries again, with the pieces that this one has brought.
  options.attempts = 2;
  options.first_wait_s = 0.1;
  options.source = [&](const std::string& path, std::uint64_t from, const auto& take) {
    return bring(options.url, path, from, take);
  };
  auto report = fetch_release(options);
  if (!report) {
    update.error = report.error();
    return -1;
  }
  return report->changed ? 1 : 0;
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

/// What is looked for: gray pixels row by row; null where the pattern has no tracker record.
EMSCRIPTEN_KEEPALIVE const uint8_t* update_picture(uint32_t index) {
  const auto record = update.bundle.section(SectionType::kTrackerRecord, index);
  if (record.empty() || view_tracker_record(record, update.picture)) return nullptr;
  return update.picture.pixels.data();
}
EMSCRIPTEN_KEEPALIVE uint32_t update_picture_width() {
  return update.picture.header.width;
}
EMSCRIPTEN_KEEPALIVE uint32_t update_picture_height() {
  return update.picture.header.height;
}

}  // extern "C"
