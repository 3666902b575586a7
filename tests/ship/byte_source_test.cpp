// An app that downloads the bytes itself: through a source that breaks, deceives and ends.
#include <gtest/gtest.h>

#include <ctime>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "bake/ship/publish.hpp"
#include "formats/bundle_view.hpp"
#include "modar/fetch.hpp"
#include "modar/mapped_file.hpp"
#include "tests/formats/support.hpp"

namespace modar {
namespace {

namespace fs = std::filesystem;

std::string read(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

class ByteSourceTest : public ::testing::Test {
 protected:
  void SetUp() override { publish_as_golden(test::golden_content()); }

  void publish_as_golden(const BundleContent& content, std::int64_t expires = kExpires) {
    std::string name = (fs::temp_directory_path() / "modar-source-XXXXXX").string();
    ASSERT_NE(::mkdtemp(name.data()), nullptr);
    folder_ = name;
    const auto bytes = encode_bundle(content);
    ASSERT_TRUE(bytes);
    std::ofstream(folder_ / "golden.modar", std::ios::binary)
        .write(reinterpret_cast<const char*>(bytes->data()),
               static_cast<std::streamsize>(bytes->size()));
    PublishRequest request;
    request.bundles = {(folder_ / "golden.modar").string()};
    request.folder = (folder_ / "site").string();
    request.expires = expires;
    const auto key = make_key();
    ASSERT_TRUE(key);
    Report report;
    ASSERT_TRUE(publish(request, *key, report));
    options_.store = (folder_ / "store").string();
    options_.trusted_key = public_key_line(key->public_key);
    options_.first_wait_s = 0;
    options_.attempts = 3;
  }
  void TearDown() override { fs::remove_all(folder_); }

  /// A file of the release folder, or fetch.missing.
  [[nodiscard]] Result<std::string> file(const std::string& path) const {
    const fs::path found = folder_ / "site" / path;
    if (fs::is_regular_file(found)) return read(found);
    return fail(ExitCode{13}, "fetch.missing", path, "no such file", "");
  }

  // The year 2100.
  static constexpr std::int64_t kExpires = 4102444800;

  fs::path folder_;
  FetchOptions options_;
};

Result<void> hand_over(std::string_view bytes, std::size_t portion,
                       const std::function<bool(std::span<const std::byte>)>& take) {
  while (!bytes.empty()) {
    const auto now = bytes.substr(0, portion);
    if (!take(std::as_bytes(std::span(now)))) return {};
    bytes.remove_prefix(now.size());
  }
  return {};
}

TEST_F(ByteSourceTest, InstallsThroughALineThatBreaks) {
  std::size_t breaks = 0;
  std::size_t resumed = 0;
  options_.source = [&](const std::string& path, std::uint64_t from,
                        const auto& take) -> Result<void> {
    const auto text = file(path);
    if (!text) return tl::unexpected(text.error());
    resumed += from != 0;
    const std::string_view rest = std::string_view(*text).substr(from);
    if (!path.starts_with("objects/") || from != 0 || rest.size() <= 200) {
      return hand_over(rest, 100, take);
    }
    ++breaks;
    MODAR_TRY(hand_over(rest.substr(0, 200), 70, take));
    return fail(ExitCode::kIo, "app.network", path, "the tunnel", "");
  };
  const auto report = fetch_release(options_);
  ASSERT_TRUE(report) << to_line(report.error());
  EXPECT_EQ(report->version, 1u);
  EXPECT_GT(breaks, 0u);
  EXPECT_EQ(resumed, breaks);
  EXPECT_EQ(report->retries, breaks);
  ASSERT_EQ(report->bundles.size(), 1u);
  EXPECT_EQ(read(report->bundles[0]), read(folder_ / "golden.modar"));
  EXPECT_FALSE(fetch_release(options_)->changed);
}

class PreviewTest : public ByteSourceTest {
 protected:
  void SetUp() override { publish_as_golden(test::acting_content()); }  // media come last
};

TEST_F(PreviewTest, IsThereWhenTheLineIsCutBeforeTheRest) {
  std::vector<std::string> shown;
  bool cut = true;
  options_.first = [&shown](const std::string& path) { shown.push_back(path); };
  options_.source = [&](const std::string& path, std::uint64_t from,
                        const auto& take) -> Result<void> {
    if (cut && !shown.empty()) return fail(ExitCode::kIo, "app.network", path, "no signal", "");
    MODAR_ASSIGN(const std::string text, file(path));
    return hand_over(std::string_view(text).substr(from), 4096, take);
  };
  ASSERT_FALSE(fetch_release(options_));
  ASSERT_EQ(shown, std::vector<std::string>{options_.store + "/pieces/golden.first"});
  EXPECT_EQ(previews(options_.store), shown);
  EXPECT_FALSE(installed_release(options_.store));
  const auto mapped = MappedFile::open(shown[0]);
  ASSERT_TRUE(mapped);
  const auto bundle = BundleView::open(mapped->bytes());
  ASSERT_TRUE(bundle) << to_line(bundle.error());
  EXPECT_EQ(bundle->models().size(), test::acting_content().models.size());
  EXPECT_EQ(bundle->media().size(), 0u);

  cut = false;
  shown.clear();
  const auto report = fetch_release(options_);
  ASSERT_TRUE(report) << to_line(report.error());
  EXPECT_EQ(shown.size(), 1u) << "once more, by another fetch";
  EXPECT_EQ(read(report->bundles.at(0)), read(folder_ / "golden.modar"));
  EXPECT_TRUE(previews(options_.store).empty());
  EXPECT_TRUE(fs::is_empty(folder_ / "store" / "pieces"));
}

TEST_F(ByteSourceTest, ExpiresByTheAppsClock) {
  options_.source = [&](const std::string& path, std::uint64_t from,
                        const auto& take) -> Result<void> {
    MODAR_ASSIGN(const std::string text, file(path));
    return hand_over(std::string_view(text).substr(from), 4096, take);
  };
  options_.now = kExpires;
  const auto late = fetch_release(options_);
  ASSERT_FALSE(late);
  EXPECT_EQ(late.error().code, "fetch.expired");
  options_.now = kExpires - 1;
  EXPECT_TRUE(fetch_release(options_));
}

TEST_F(ByteSourceTest, KnowsThatItIsNotBeforeItsOwnLastCommit) {
  options_.source = [&](const std::string& path, std::uint64_t from,
                        const auto& take) -> Result<void> {
    MODAR_ASSIGN(const std::string text, file(path));
    return hand_over(std::string_view(text).substr(from), 4096, take);
  };
  options_.now = 1;  // a device without a battery
  constexpr std::int64_t kAugust2026 = 1785542400;
  publish_as_golden(test::golden_content(), kAugust2026);
  const auto report = fetch_release(options_);
  ASSERT_FALSE(report);
  EXPECT_EQ(report.error().code, "fetch.expired");
  // No later than today.
  publish_as_golden(test::golden_content(), std::int64_t{std::time(nullptr)});
  EXPECT_TRUE(fetch_release(options_));
}

TEST_F(ByteSourceTest, IsNeededWithoutLibcurl) {
  options_.url = "http://127.0.0.1:1";
  const auto report = fetch_release(options_);
  ASSERT_FALSE(report);
  EXPECT_EQ(report.error().code, "fetch.curl");
}

TEST_F(ByteSourceTest, GivesUpOnLiesAndSilence) {
  const auto fetch_from = [&](ByteSource source) {
    options_.source = std::move(source);
    const auto report = fetch_release(options_);
    EXPECT_FALSE(fs::exists(folder_ / "store" / "golden.modar"));
    return report ? std::string() : report.error().code;
  };
  const auto silence = [](const std::string& path, std::uint64_t, const auto&) -> Result<void> {
    return fail(ExitCode::kIo, "app.network", path, "no signal", "");
  };
  EXPECT_EQ(fetch_from(silence), "fetch.network");
  const auto objects_as = [&](const auto& change) {
    return [&, change](const std::string& path, std::uint64_t, const auto& take) -> Result<void> {
      auto text = file(path);
      if (!text) return tl::unexpected(text.error());
      if (path.starts_with("objects/")) change(*text);
      return hand_over(*text, 1000, take);
    };
  };
  EXPECT_EQ(fetch_from(objects_as([](std::string& text) { text[0] ^= 1; })), "fetch.network");
  EXPECT_EQ(fetch_from(objects_as([](std::string& text) { text += text; })), "fetch.network");
  EXPECT_EQ(fetch_from(objects_as([](std::string& text) { text.pop_back(); })), "fetch.network");
  fs::remove_all(folder_ / "site" / "objects");
  EXPECT_EQ(fetch_from(objects_as([](std::string&) {})), "fetch.missing");
}

}  // namespace
}  // namespace modar
