// libFuzzer target: any bytes as one document of a release folder, the others good, read as a
// page's worker reads them: it learns the missing files, downloads them and asks again. Documents
// with a key's signature are signed, so that fuzzed ones are accepted. The first byte chooses the
// document.
#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <system_error>
#include <vector>

#include "bake/ship/keys/keys.hpp"
#include "modar/fetch.hpp"
#include "tests/fuzz/input_file.hpp"
#include "tests/fuzz/need.hpp"

namespace {

using namespace modar;
using test::need;

constexpr std::int64_t kNow = 1'900'000'000;

/// Secret keys of nobody, in minisign's files, so that each run signs the same.
constexpr const char* kKeys[] = {
    "RWQAAEIyAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAABbhOz1eMzBGtRRWBG4"
    "KvqyLE9ATvcgJU4KaKdNO0PsrBVWSNaLxORxoRzV4or5VHgJ58hX53tAhPV1b/TQ62LASQj2j17RUJCx2Fl0QYx+EF"
    "AOX2rqrzDTT+jgeNHjhAaMLb07FE56I=",
    "RWQAAEIyAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAx6+dPrqu8J/7PVYg77"
    "QItH/79gef9UoF7+KCi937YbNp2IFlI57wyqQ9J5GQuvf6eNVqJHz/XnHkY1mSH74layF/8WYsHXk5AjxJWw4+6S+Y"
    "W2wU5HLgScg6zGi1jtVOsuRT64+NTV8=",
    "RWQAAEIyAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAA34fN77mP30m9i1UfE8"
    "ReDWi7gwCSDNa6CtdrkewcDM0RJwM4cPjYJGHC0uk6HlnNtzJJu4onzuhEhnALtK5TUQ21iKq+1jagdorVCS2JunI9"
    "OkQgblT25Xt9sFiWHAaGUTwWLsq1ylQ=",
    "RWQAAEIyAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAdhl1V3w0l3vSLWF+1/"
    "pbPyk2b6fjpfGPUqIzhAoUwpXOtmtM6C1zNGRZEKSYkfVcz00uUk6j7ueM76Wosv783I/WW0hQfBfXjDSKERKlHsZC"
    "kEkOPGOjBR7+h/Nl1EJdXgLwYKlfhoM=",
    "RWQAAEIyAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAA/pZ4PZE9fgWISgx/bT"
    "3x6e1AWWpWGfLcRgrWqyYuJg9Y6dZqHnMOaWsBZL4iGlniAai1HVgAaue+kHoM4XJx4GPkqpSDq7/vc07CgfScLADb"
    "RcuJchUD4x0HjFB0JIPz68pwhQKTLCA=",
};

/// 1 to 5.
SecretKey key_of(std::size_t number) {
  return *parse_secret_key(std::string("untrusted comment: of nobody\n") + kKeys[number - 1] + "\n",
                           "");
}

struct Folder {
  std::map<std::string, std::string> files;
  void add(const std::string& path, const std::string& text, const SecretKey& key) {
    files[path] = text;
    files[path + ".minisig"] = sign(key, text, "fuzz");
  }
};

Release good_release() {
  Release release;
  release.epoch = 1;
  release.version = 3;
  release.expires = kNow + 1000;
  release.fresh_days = 7;
  ReleaseBundle bundle;
  bundle.name = "vase";
  bundle.size = 4096;
  bundle.recipe_size = 64;
  bundle.recipe_raw_size = 64;
  bundle.pieces = 0;
  release.bundles = {bundle};
  return release;
}

/// Root keys 1, 2 and 3, of which two agree; 4 signs, by a link from 5.
Folder good_folder() {
  Folder folder;
  const std::array<SecretKey, 3> roots = {key_of(1), key_of(2), key_of(3)};
  const auto add_root = [&](const std::string& path, const std::string& text) {
    folder.files[path] = text;
    for (const SecretKey& root : roots) {
      folder.files[signature_path(path, root.public_key)] = sign(root, text, "fuzz");
    }
  };
  RootRotation link{1, *make_root_set({roots[0].public_key, roots[1].public_key}, 2)};
  add_root(root_rotation_path(1), root_rotation_text(link));
  add_root("root.json", root_metadata_text({1, 0, public_key_line(key_of(5).public_key)}));
  folder.add("keys/1.json", key_rotation_text({1, public_key_line(key_of(4).public_key)}),
             key_of(5));
  folder.files["latest"] = "3\n";
  folder.add("releases/3.json", release_text(good_release()), key_of(4));
  folder.add(freshness_path(3), freshness_text({1, 3, kNow - 5, kNow + 500}), key_of(4));
  return folder;
}

/// Puts the fuzzed text in the place of a document, signed as it has to be.
void place(Folder& folder, std::uint8_t choice, const std::string& text) {
  static const std::vector<std::string> paths = {"latest",
                                                 "releases/3.json",
                                                 "releases/3.json.minisig",
                                                 "releases/3.fresh.json",
                                                 "root.json",
                                                 "roots/1.json",
                                                 "keys/1.json",
                                                 signature_path("root.json", key_of(1).public_key)};
  const std::string& path = paths[choice % paths.size()];
  folder.files[path] = text;
  if (!path.ends_with(".json")) return;
  if (path.starts_with("root")) {
    for (std::size_t i = 1; i <= 3; ++i) {
      folder.files[signature_path(path, key_of(i).public_key)] = sign(key_of(i), text, "fuzz");
    }
  } else {
    folder.add(path, text, key_of(path.starts_with("keys") ? 5 : 4));
  }
}

/// One run after the other until nothing more is requested, as update-worker.js does.
Result<FetchReport> run(FetchOptions options, const Folder& folder) {
  std::map<std::string, std::string> brought;
  std::vector<FileNeed> needs;
  options.needs = [&needs](std::span<const FileNeed> list) {
    needs.assign(list.begin(), list.end());
  };
  options.source = [&](const std::string& path, std::uint64_t from,
                       const auto& take) -> Result<void> {
    const auto found = brought.find(path);
    if (found == brought.end()) {
      return fail(kExitNetwork, "fetch.later", path, "it is yet to come", "download it");
    }
    if (!folder.files.contains(path)) {
      return fail(kExitMixed, "fetch.missing", path, "there is no such file", "publish it");
    }
    const std::string_view rest = found->second;
    if (from < rest.size()) take(std::as_bytes(std::span(rest.substr(from))));
    return {};
  };
  for (int i = 0; i < 2000; ++i) {
    auto report = fetch_release(options);
    if (report || report.error().code != "fetch.later") return report;
    need(!needs.empty());
    for (const FileNeed& file : needs) {
      const auto found = folder.files.find(file.path);
      brought[file.path] = found == folder.files.end() ? "" : found->second;
    }
  }
  std::abort();  // it asks for ever
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  static const test::InputFile beside("beside");
  static const std::string store = beside.folder() + "/store";
  static const std::string trust = root_set_line(
      *make_root_set({key_of(1).public_key, key_of(2).public_key, key_of(3).public_key}, 2));
  std::error_code left;
  std::filesystem::remove_all(store, left);
  Folder folder = good_folder();
  place(folder, data[0], {reinterpret_cast<const char*>(data + 1), size - 1});
  FetchOptions options;
  options.store = store;
  options.trusted_key = trust;
  options.attempts = 1;
  options.first_wait_s = 0;
  options.now = kNow;
  options.least_epoch = 1;
  options.least_version = 2;
  const auto report = run(options, folder);
  // No object of the release is there: nothing can be installed, whatever is believed.
  need(!report.has_value());
  test::need_told(report.error());
  return 0;
}
