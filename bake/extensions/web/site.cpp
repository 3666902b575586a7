// The page's files, copied; and what depends on the bundles: site.json, hints, manifest, sw.js.
#include "bake/extensions/web/site.hpp"

#include <algorithm>
#include <array>
#include <filesystem>
#include <span>
#include <string_view>
#include <thread>

#include "bake/export/model_file.hpp"
#include "bake/export/room_models.hpp"
#include "bake/extensions/web/hint_image.hpp"
#include "bake/extensions/web/packed_bundle.hpp"
#include "bake/extensions/web/page_texts.hpp"
#include "bake/extensions/web/statement.hpp"
#include "bake/io/input.hpp"
#include "bake/io/output.hpp"
#include "bake/json.hpp"
#include "bake/process/process.hpp"
#include "formats/base/html.hpp"
#include "formats/bundle_view.hpp"
#include "formats/check.hpp"
#include "formats/pattern_shape.hpp"
#include "modar/mapped_file.hpp"

namespace modar {
namespace {

namespace fs = std::filesystem;

/// Files copied unchanged; index.html, sw.js and the words are written with changes.
constexpr std::array<std::string_view, 29> kPageFiles = {"app.js",
                                                         "download.js",
                                                         "engine-plain.js",
                                                         "engine-plain.wasm",
                                                         "engine-record-plain.js",
                                                         "engine-record-plain.wasm",
                                                         "engine-record-simd.js",
                                                         "engine-record-simd.wasm",
                                                         "engine-simd.js",
                                                         "engine-simd.wasm",
                                                         "engine.js",
                                                         "icon-180.png",
                                                         "icon-512.png",
                                                         "icon.svg",
                                                         "installed-release.js",
                                                         "lists.js",
                                                         "media.js",
                                                         "modar-worker-plain.js",
                                                         "modar-worker-simd.js",
                                                         "own-picture.js",
                                                         "qr.js",
                                                         "record-worker-plain.js",
                                                         "record-worker-simd.js",
                                                         "record-worker.js",
                                                         "room.svg",
                                                         "style.css",
                                                         "survey.js",
                                                         "viewer-words.js",
                                                         "lod-stream.js"};
/// Modules that app.js contains, for other pages next to this one.
constexpr std::array<std::string_view, 12> kModules = {
    "arrival.js",    "bundle.js",       "camera.js",       "gyroscope.js",
    "modar-view.js", "modar-worker.js", "modar-viewer.js", "modar.js",
    "recorder.js",   "storage.js",      "turntable.js",    "viewer-parts.js"};
/// Next to them where the page updates itself.
constexpr std::array<std::string_view, 3> kUpdateFiles = {"engine-update.js", "engine-update.wasm",
                                                          "update-worker.js"};

/// What bakes visitors' models: of the npm package, requested when one is opened.
constexpr std::array<std::string_view, 5> kBakerFiles = {"bake.js", "bake-worker.js", "platform.js",
                                                         "bin/baker.wasm", "bin/module/baker.js"};

struct Draft {
  const SiteOptions& options;
  std::string page;
  std::vector<std::string> languages;
  Json texts;
  std::size_t texts_used = 0;
  std::uint64_t hash = 14695981039346656037u;
  Json kept = Json::object();         ///< what sw.js keeps: {address: bytes, or 0}
  Json undescribed = Json::object();  ///< {LANGUAGE: [titles of patterns without an `alt`]}
  Site site;
  std::optional<OutputFolder> output;
};

/// FNV-1a: enough to tell one version of a site from the next.
void add_to_hash(std::uint64_t& hash, std::span<const std::byte> bytes) {
  for (const std::byte byte : bytes)
    hash = (hash ^ static_cast<std::uint64_t>(byte)) * 1099511628211u;
}

/// Whether a file has these bytes already.
bool holds(const std::string& path, std::span<const std::byte> bytes) {
  const auto file = MappedFile::open(path);
  return file && std::equal(file->bytes().begin(), file->bytes().end(), bytes.begin(), bytes.end());
}

/// A file that the service worker does not keep.
Result<void> put_online(Draft& draft, const std::string& name, std::span<const std::byte> bytes) {
  // A phone waits for the page to be written again: most of its files stay, and syncing each to the
  // disk takes longer than all else.
  if (!draft.options.live || !holds(draft.output->path(name), bytes))
    MODAR_TRY(draft.output->write(name, bytes));
  add_to_hash(draft.hash, std::as_bytes(std::span(name)));
  add_to_hash(draft.hash, bytes);
  draft.site.files.push_back(name);
  return {};
}

/// version: behind the address under which the page asks for the file, where it has one. Hosts may
/// rewrite pages and pictures: of these no size is reported.
Result<void> put(Draft& draft, const std::string& name, std::span<const std::byte> bytes,
                 const std::string& version = {}) {
  MODAR_TRY(put_online(draft, name, bytes));
  const std::string_view end = std::string_view(name).substr(name.rfind('.') + 1);
  const bool changes =
      end == "html" || end == "css" || end == "webp" || end == "png" || end == "svg";
  draft.kept.set(name + version, changes ? 0 : bytes.size());
  return {};
}

Result<void> put(Draft& draft, const std::string& name, const std::string& text) {
  return put(draft, name, std::as_bytes(std::span(text)));
}

Result<std::string> page_text(const Draft& draft, const std::string& name) {
  MODAR_ASSIGN(const MappedFile file, MappedFile::open(draft.page + "/" + name));
  std::string text(reinterpret_cast<const char*>(file.bytes().data()), file.bytes().size());
  MODAR_TRY(file.intact());
  return text;
}

/// A name as part of an address: anything but a letter, digit or dash becomes a dash.
std::string address(std::string_view name) {
  std::string word;
  for (const char c : name) {
    const bool plain = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9');
    word += plain ? c : '-';
  }
  return word.empty() ? "bundle" : word;
}

/// Folders that may hold LANGUAGE.json: the project's own come first.
std::vector<std::string> word_folders(const Draft& draft) {
  if (draft.options.words.empty()) return {draft.page + "/words"};
  return {draft.options.words, draft.page + "/words"};
}

Result<std::string> words_of(const Draft& draft, const std::string& language) {
  for (const std::string& folder : word_folders(draft)) {
    const std::string path = folder + "/" + language + ".json";
    if (!fs::exists(path)) continue;
    MODAR_ASSIGN(const MappedFile file, MappedFile::open(path));
    return std::string(reinterpret_cast<const char*>(file.bytes().data()), file.bytes().size());
  }
  return fail(ExitCode::kIo, "web.words", language, "its words are gone", "try again");
}

/// Each text that English has is there, as a text, and as two of them for an error.
Result<void> check_words(const Draft& draft, const std::string& language) {
  MODAR_ASSIGN(const std::string english, page_text(draft, "words/en.json"));
  MODAR_ASSIGN(const std::string own, words_of(draft, language));
  const Json wanted = Json::parse(english);
  const Json given = Json::parse(own);
  const auto said = [](const Json& text) { return !text.text().value_or("").empty(); };
  const auto missing = [&](const std::string& text) {
    return fail(ExitCode::kInvalidInput, "web.words", language + ".json",
                "it has no text '" + text + "'", "translate each text of words/en.json");
  };
  for (const std::string& key : wanted.keys()) {
    if (wanted[key].text() && !said(given[key])) return missing(key);
  }
  for (const std::string& each : wanted["errors"].keys()) {
    const Json pair = given["errors/" + each];  // what happened, what to do
    if (!said(pair[0]) || !said(pair[1])) return missing("errors/" + each);
  }
  return {};
}

Result<void> choose_languages(Draft& draft) {
  std::vector<std::string> known;
  std::error_code error;
  for (const std::string& folder : word_folders(draft)) {
    for (const auto& entry : fs::directory_iterator(folder, error)) {
      const std::string name = entry.path().stem().string();
      if (entry.path().extension() != ".json") continue;
      if (std::find(known.begin(), known.end(), name) == known.end()) known.push_back(name);
    }
    if (!error) continue;
    return fail(ExitCode::kIo, "web.words", folder, "it cannot be read: " + error.message(),
                "name a folder of files like de.json");
  }
  // English first: it serves where a visitor reads none of the others.
  std::sort(known.begin(), known.end(), [](const std::string& a, const std::string& b) {
    return (a == "en") != (b == "en") ? a == "en" : a < b;
  });
  draft.languages = draft.options.languages.empty() ? known : draft.options.languages;
  for (const std::string& language : draft.languages) {
    if (std::find(known.begin(), known.end(), language) != known.end()) {
      MODAR_TRY(check_words(draft, language));
      continue;
    }
    std::string all;
    for (const std::string& each : known) all += (all.empty() ? "" : ", ") + each;
    return fail(ExitCode::kUsage, "web.language", language,
                "the page has no translation into this language",
                "choose from " + all + ", or name a folder that has more with --words");
  }
  return {};
}

Result<void> read_texts(Draft& draft) {
  if (draft.options.texts.empty()) return {};
  MODAR_ASSIGN(const MappedFile file, MappedFile::open(draft.options.texts));
  draft.texts = Json::parse(file.bytes());
  if (!draft.texts.is_null() && !draft.texts.is_array()) return {};
  return fail(ExitCode::kInvalidInput, "web.texts", draft.options.texts,
              "this is not a JSON object",
              R"(write {"cover": {"en": {"name": "The cover", "text": "Printed in 1890."}}})");
}

/// The pattern's texts in the site's languages, else those of the bundle; null where none are
/// given.
Result<Json> texts_of(Draft& draft, const BundleView& bundle, const std::string& pattern) {
  const auto given = draft.texts.find(pattern);
  if (!given) return bundle_texts(bundle.meta(), pattern, draft.languages);
  ++draft.texts_used;
  return given_texts(*given, draft.options.texts, pattern, draft.languages);
}

void note_undescribed(Draft& draft, const Json& texts, const std::string& title) {
  for (const std::string& language : draft.languages) {
    if (texts.find(language + "/alt")) continue;
    const std::string name = texts.find(language + "/name").value_or(title).text().value_or("");
    Json names = draft.undescribed.find(language).value_or(Json::array());
    names.push_back(name);
    draft.undescribed.set(language, names);
  }
}

/// The picture that the tracker looks for, as a hint for visitors.
Result<Json> put_hint(Draft& draft, const BundleView& bundle, std::uint32_t pattern,
                      const std::string& file) {
  const std::string name(bundle.name(bundle.patterns()[pattern].name));
  MODAR_ASSIGN(const Hint hint, hint_of(bundle, pattern));
  MODAR_TRY(put(draft, file, hint.file));
  Json json = {{"name", name},
               {"title", title_of(name)},
               {"models", models_on(bundle, pattern)},
               {"image", file},
               {"width", hint.width},
               {"height", hint.height},
               {"flat", bundle.section(SectionType::kPatternShape, pattern).empty()}};
  MODAR_ASSIGN(const Json texts, texts_of(draft, bundle, name));
  if (!texts.is_null()) json.set("texts", texts);
  note_undescribed(draft, texts, title_of(name));
  return json;
}

/// The models of a pattern, for the viewers of phones. stem: of the files' names.
Result<void> put_room(Draft& draft, const BundleView& bundle, std::uint32_t pattern,
                      std::span<const GlbImage> images, const std::string& stem, Json& json) {
  const std::vector<RoomModel> models = models_in_room(bundle, pattern);
  if (models.empty()) return {};
  MODAR_ASSIGN(const auto usdz, encode_usdz(bundle, models, images));
  MODAR_TRY(put_online(draft, stem + ".usdz", usdz));
  MODAR_ASSIGN(const auto glb, encode_glb(bundle, models, images));
  MODAR_TRY(put_online(draft, stem + ".glb", glb));
  json.set("usdz", stem + ".usdz");
  json.set("glb", stem + ".glb");
  return {};
}

/// The bundle, for other pages, and packed, as this page loads it; answers the address that
/// it loads. A page that is written again after each bake stays with the bundle, which packing
/// would make it wait for. stem: of the files' names.
Result<std::string> put_bytes(Draft& draft, const std::string& stem,
                              std::span<const std::byte> bytes, const std::string& version) {
  const std::string raw = stem + ".modar";
  draft.site.bundle_bytes += bytes.size();
  if (draft.options.live) {
    MODAR_TRY(put(draft, raw, bytes, version));
    return raw + version;
  }
  MODAR_TRY(put_online(draft, raw, bytes));
  MODAR_ASSIGN(const BundleView bundle, BundleView::open(bytes));
  const std::vector<std::byte> packed = pack_bundle(bundle, std::thread::hardware_concurrency());
  draft.site.packed_bytes += packed.size();
  // The page asks for what shows something first, where the host has ranges.
  const std::string query = version + "&first=" + std::to_string(shown_bytes(packed));
  // Of a larger one the page downloads visible parts, level by level: a phone that was to keep all
  // of it for visits without a network would fetch hundreds of megabytes in addition.
  const bool whole = bytes.size() <= kMostWhole;
  if (!whole) draft.site.ranged_bytes += packed.size();
  MODAR_TRY(whole ? put(draft, stem + ".packed", packed, query)
                  : put_online(draft, stem + ".packed", packed));
  return stem + ".packed" + query;
}

/// Before anything is written: each bundle is whole, and has what a camera could find.
Result<void> check_bundle_file(const std::string& path) {
  MODAR_ASSIGN(const MappedFile file, MappedFile::open(path));
  MODAR_TRY(require_kind(FileKind::kBundle, path));
  const Result<BundleView> bundle = BundleView::open(file.bytes());
  if (!bundle) return file.settle(Result<void>(in_file(path, bundle.error())));
  if (const auto whole = verify_sections(*bundle); !whole) return in_file(path, whole.error());
  if (!bundle->patterns().empty()) return {};
  return fail(ExitCode::kInvalidInput, "web.pattern", path,
              "it has no pattern that a camera could find", "bake it with --pattern");
}

Result<Json> put_bundle(Draft& draft, const std::string& path, std::vector<std::string>& names) {
  MODAR_ASSIGN(const MappedFile file, MappedFile::open(path));
  const Result<BundleView> bundle = BundleView::open(file.bytes());
  if (!bundle) return in_file(path, bundle.error());
  const std::string stem = fs::path(path).stem().string();
  const std::string name = address(stem);
  if (std::find(names.begin(), names.end(), name) != names.end()) {
    return fail(ExitCode::kUsage, "web.twice", path, "another bundle has the same name",
                "rename one");
  }
  names.push_back(name);
  check_shown(*bundle, [&](const Issue& issue) {
    draft.site.warnings.push_back(path + ": " + issue.where + ": " + issue.detail + "; " +
                                  issue.kind->cure + " [" + issue.kind->id + "]");
  });
  MODAR_ASSIGN(const std::vector<std::byte> trimmed, trim_to_publish(*bundle));
  const std::span<const std::byte> bytes = trimmed.empty() ? file.bytes() : trimmed;
  // An address of these bytes alone: page and service worker may share what a cache holds of it.
  const std::string hash = to_hex(bundle_hash(bytes));
  const std::string version = "?v=" + hash.substr(0, 16);
  MODAR_ASSIGN(const std::string to, put_bytes(draft, "bundles/" + name, bytes, version));
  draft.site.trimmed_bytes += file.bytes().size() - bytes.size();
  Json patterns = Json::array();
  const std::vector<GlbImage> images =
      draft.options.room ? decoded_textures(*bundle) : std::vector<GlbImage>();
  for (std::uint32_t p = 0; p < bundle->patterns().size(); ++p) {
    const std::string beside = "patterns/" + name + "-" + std::to_string(p);
    MODAR_ASSIGN(Json pattern, put_hint(draft, *bundle, p, beside + ".webp"));
    if (draft.options.room) MODAR_TRY(put_room(draft, *bundle, p, images, beside, pattern));
    patterns.push_back(pattern);
  }
  MODAR_TRY(file.intact());
  return Json{{"title", title_of(stem)}, {"file", to}, {"hash", hash}, {"patterns", patterns}};
}

/// Browsers ask for it where somebody debugs the page.
Result<void> put_source_map(Draft& draft, const std::string& script) {
  const std::string name = script + ".map";
  if (!fs::exists(draft.page + "/" + name)) return {};
  MODAR_ASSIGN(const std::string map, page_text(draft, name));
  return put_online(draft, name, std::as_bytes(std::span(map)));
}

Result<void> put_page(Draft& draft) {
  std::vector<std::string_view> names(kPageFiles.begin(), kPageFiles.end());
  if (!draft.options.release.empty()) {
    names.insert(names.end(), kUpdateFiles.begin(), kUpdateFiles.end());
  }
  for (const std::string_view name : names) {
    MODAR_ASSIGN(const std::string content, page_text(draft, std::string(name)));
    MODAR_TRY(put(draft, std::string(name), content));
    draft.site.page_bytes += content.size();
  }
  for (const std::string_view name : kModules) {
    MODAR_ASSIGN(const std::string content, page_text(draft, std::string(name)));
    MODAR_TRY(put_online(draft, std::string(name), std::as_bytes(std::span(content))));
  }
  for (const std::string_view name : kBakerFiles) {
    if (!draft.options.baker) continue;
    MODAR_ASSIGN(const std::string content, page_text(draft, std::string(name)));
    MODAR_TRY(put_online(draft, std::string(name), std::as_bytes(std::span(content))));
  }
  names.insert(names.end(), kModules.begin(), kModules.end());
  for (const std::string_view name : names) MODAR_TRY(put_source_map(draft, std::string(name)));
  for (const std::string& language : draft.languages) {
    MODAR_ASSIGN(const std::string words, words_of(draft, language));
    MODAR_TRY(put(draft, "words/" + language + ".json", words));
    draft.site.page_bytes += words.size();
    const std::string questions = "survey/" + language + ".json";
    const bool own = fs::exists(draft.page + "/" + questions);
    MODAR_ASSIGN(const std::string survey, page_text(draft, own ? questions : "survey/en.json"));
    MODAR_TRY(put(draft, questions, survey));
    draft.site.page_bytes += survey.size();
  }
  return {};
}

/// "Imprint=https://..." as {"text", "url"}.
Result<Json> links_of(const SiteOptions& options) {
  Json links = Json::array();
  for (const std::string& link : options.links) {
    const std::size_t equals = link.find('=');
    const std::string url = equals == std::string::npos ? "" : link.substr(equals + 1);
    if (equals == 0 || !is_link_address(url)) {
      return fail(ExitCode::kUsage, "web.link", link, "this is not a text with an address",
                  "write --link 'Imprint=https://museum.org/imprint'");
    }
    links.push_back({{"text", link.substr(0, equals)}, {"url", url}});
  }
  return links;
}

/// Scheme and host of an address elsewhere; empty for one below the page's own.
std::string origin_of(const std::string& url) {
  const std::size_t scheme = url.find("://");
  if (scheme == std::string::npos) return "";
  return url.substr(0, url.find('/', scheme + 3));
}

/// Where updates come from; null where the page gets none.
Result<Json> release_of(const SiteOptions& options, const std::string& page) {
  if (options.release.empty() && options.trusted_key.empty()) return Json();
  if (options.release.empty() || options.trusted_key.empty()) {
    return fail(ExitCode::kUsage, "web.trust", "--release, --trust", "one is missing",
                "name the release folder's address and the key that signs it, K.pub");
  }
  if (!fs::exists(page + "/engine-update.wasm")) {
    return fail(ExitCode::kUnsupported, "web.page", page, "its engine was built without updates",
                "scripts/sources.sh --libraries, then cmake --preset web and build it again");
  }
  MODAR_ASSIGN(const RootSet key, trusted_keys(options));
  if (origin_of(options.release).find('@') != std::string::npos) {
    return fail(ExitCode::kUsage, "web.login", "--release",
                "the address contains a user name or password, which the page would publish",
                "remove it");
  }
  const bool folder = options.release.ends_with('/');
  // A connection slower than 64 bytes a second for this time is given up, as modar-fetch
  // does.
  constexpr int kStallSeconds = 30;
  return Json{{"url", options.release + (folder ? "" : "/")},
              {"key", root_set_line(key)},
              {"epoch", options.release_epoch},
              {"version", options.release_version},
              {"stall", kStallSeconds}};
}

/// The accessibility statement in the page's languages, in English for one that has none:
/// {LANGUAGE: {"text", "url", "lang"}}.
Result<Json> put_statements(Draft& draft, const Publisher& publisher, const std::string& title) {
  Json links = Json::object();
  for (const std::string& language : draft.languages) {
    const bool own = fs::exists(draft.page + "/statements/" + language + ".json");
    const std::string written = own ? language : "en";
    MODAR_ASSIGN(const std::string file, page_text(draft, "statements/" + written + ".json"));
    const Json texts = Json::parse(file);
    std::vector<std::string> undescribed;
    for (const Json& one : draft.undescribed[language].elements()) {
      undescribed.push_back(one.text().value_or(""));
    }
    const std::string name = "accessibility-" + language + ".html";
    MODAR_TRY(put(draft, name, statement_page(texts, written, title, publisher, undescribed)));
    links.set(language,
              {{"text", texts.find("title").value_or("")}, {"url", name}, {"lang", written}});
  }
  return links;
}

/// What a page that follows its maker looks at, and does when something was written.
constexpr std::string_view kLive =
    R"js(const seen = async () => (await fetch('live.json', { cache: 'no-store' })).text();
let first;
setInterval(async () => {
  const now = await seen().catch(() => first);
  first ??= now;
  if (now === first) return;
  for (const worker of await navigator.serviceWorker?.getRegistrations() ?? []) await worker.unregister();
  for (const name of await globalThis.caches?.keys() ?? []) await caches.delete(name);
  location.reload();
}, 500);
)js";

/// Puts it into the page.
Result<void> add_live(Draft& draft, std::string& html) {
  constexpr std::string_view kEnd = "</head>";
  const std::size_t at = html.find(kEnd);
  if (at != std::string::npos) {
    html.insert(at, "<script type=\"module\" src=\"live.js\"></script>\n");
  }
  return put_online(draft, "live.js", std::as_bytes(std::span(kLive)));
}

/// The text in each language where no script runs; the English text is there.
Result<void> add_unloaded(const Draft& draft, std::string& html) {
  constexpr std::string_view kStart = "<p id=\"unloaded\" role=\"alert\">";
  const std::size_t at = html.find(kStart);
  for (const std::string& language : draft.languages) {
    if (language == "en" || at == std::string::npos) continue;
    MODAR_ASSIGN(const std::string words, words_of(draft, language));
    const std::string text = Json::parse(words).text_at("unloaded");
    html.insert(at + kStart.size(),
                "<a href=\"\" lang=\"" + language + "\">" + escape_html(text) + "</a>");
  }
  return {};
}

/// index.html, the manifest and, last of all, sw.js. The page loads the engine early where it runs:
/// Safari reads the query (width >= 0px), and has SIMD, from 16.4 on; Chrome from 104 and 91 on.
Result<void> put_entry(Draft& draft, const std::string& title) {
  MODAR_ASSIGN(std::string html, page_text(draft, "index.html"));
  constexpr std::string_view kTitle = "<title>ModAR</title>";
  if (const std::size_t at = html.find(kTitle); at != std::string::npos) {
    html.replace(at, kTitle.size(), "<title>" + escape_html(title) + "</title>");
  }
  constexpr std::string_view kConnect = "connect-src 'self'";
  if (const std::size_t at = html.find(kConnect); at != std::string::npos) {
    const std::string origin = origin_of(draft.options.release);
    if (!origin.empty()) html.insert(at + kConnect.size(), " " + escape_html(origin));
  }
  MODAR_TRY(add_unloaded(draft, html));
  if (draft.options.live) MODAR_TRY(add_live(draft, html));
  MODAR_TRY(put(draft, "index.html", html));
  const auto icon = [](const char* file, const char* sizes, const char* type) {
    return Json{{"src", file}, {"sizes", sizes}, {"type", type}};
  };
  const Json manifest = {{"name", title},
                         {"short_name", title},
                         {"start_url", "./"},
                         {"display", "standalone"},
                         {"background_color", "#f4f0e7"},
                         {"theme_color", "#f4f0e7"},
                         {"icons", Json::array({icon("icon.svg", "any", "image/svg+xml"),
                                                icon("icon-512.png", "512x512", "image/png")})}};
  MODAR_TRY(put(draft, "manifest.webmanifest", manifest.dump()));
  MODAR_ASSIGN(const std::string worker, page_text(draft, "sw.js"));
  add_to_hash(draft.hash, std::as_bytes(std::span(worker)));
  const Json kept = {{"hash", std::to_string(draft.hash)}, {"files", draft.kept}};
  draft.site.page_bytes += html.size() + worker.size();
  MODAR_TRY(put(draft, "sw.js", "const SITE = " + kept.dump() + ";\n" + worker));
  if (!draft.options.live) return {};
  const std::string state = Json({{"hash", std::to_string(draft.hash)}}).dump();
  return put_online(draft, "live.json", std::as_bytes(std::span(state)));
}

}  // namespace

Result<RootSet> trusted_keys(const SiteOptions& options) {
  MODAR_ASSIGN(const MappedFile file, MappedFile::open(options.trusted_key));
  auto keys =
      parse_root_set({reinterpret_cast<const char*>(file.bytes().data()), file.bytes().size()});
  return keys ? std::move(keys) : in_file(options.trusted_key, keys.error());
}

Result<std::string> find_page() {
  const fs::path programs = program_folder();
  for (const fs::path& folder :
       {programs / "../share/modar/web", programs / "../../web/web", programs / ".."}) {
    if (fs::exists(folder / "engine-plain.wasm")) return folder.lexically_normal().string();
  }
  return fail(ExitCode::kUnsupported, "web.page", "modar web", "the page's engine was not built",
              "cmake --preset web && cmake --build --preset web (Debian: emscripten), or name its "
              "folder with --page");
}

Result<Site> write_site(const SiteOptions& options) {
  Draft draft{options,        options.page,   {}, {}, 0, 14695981039346656037u,
              Json::object(), Json::object(), {}, {}};
  if (draft.page.empty()) {
    MODAR_ASSIGN(draft.page, find_page());
  } else if (!fs::exists(draft.page + "/words/en.json")) {
    return fail(ExitCode::kIo, "web.page", draft.page, "this folder contains no page",
                "leave out --page, or name the folder that the preset web builds");
  }
  if (options.baker && !fs::exists(draft.page + "/" + std::string(kBakerFiles[0]))) {
    return fail(ExitCode::kUnsupported, "web.page", draft.page, "it contains no baker",
                "scripts/wasm/package.sh FOLDER, then --page FOLDER; or npx modar web --baker");
  }
  MODAR_TRY(choose_languages(draft));
  MODAR_TRY(read_texts(draft));
  MODAR_ASSIGN(const Json release, release_of(options, draft.page));
  MODAR_ASSIGN(const Json links, links_of(options));
  Publisher publisher;
  if (!options.statement.empty()) {
    MODAR_ASSIGN(publisher, read_publisher(options.statement));
  }
  for (const std::string& path : options.bundles) MODAR_TRY(check_bundle_file(path));
  MODAR_ASSIGN(OutputFolder output, OutputFolder::claim(options.output, options.force));
  draft.output.emplace(std::move(output));
  std::vector<std::string> names;
  Json bundles = Json::array();
  for (const std::string& path : options.bundles) {
    MODAR_ASSIGN(const Json bundle, put_bundle(draft, path, names));
    bundles.push_back(bundle);
  }
  if (draft.texts_used < draft.texts.size()) {
    return fail(ExitCode::kInvalidInput, "web.texts", options.texts,
                "it has texts for a pattern that no bundle contains",
                "name patterns as `modar inspect` prints them");
  }
  const std::string title = options.title.empty()
                                ? title_of(fs::path(options.bundles.front()).stem().string())
                                : options.title;
  Json site = {{"title", title}, {"languages", Json::list(draft.languages)}, {"bundles", bundles}};
  if (links.size() != 0) site.set("links", links);
  if (!release.is_null()) site.set("release", release);
  if (options.baker) site.set("baker", true);
  if (!options.statement.empty()) {
    MODAR_ASSIGN(const Json statements, put_statements(draft, publisher, title));
    site.set("statements", statements);
  }
  MODAR_TRY(put(draft, "site.json", site.dump()));
  MODAR_TRY(put_page(draft));
  MODAR_TRY(put_entry(draft, title));
  MODAR_TRY(draft.output->commit());
  return draft.site;
}

}  // namespace modar
