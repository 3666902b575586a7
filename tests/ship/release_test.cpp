// Release documents and their signatures: read back, and refused for every flipped bit.
#include "modar/release.hpp"

#include <gtest/gtest.h>

#include "bake/ship/keys/keys.hpp"

namespace modar {
namespace {

Release sample() {
  Release release;
  release.version = 7;
  release.expires = 1798761600;  // 2027-01-01
  ReleaseBundle bundle;
  bundle.name = "vase";
  bundle.size = 12345;
  bundle.hash.fill(0xab);
  bundle.recipe.fill(0x01);
  bundle.recipe_size = 100;
  bundle.recipe_raw_size = 192;
  bundle.pieces = 2;
  bundle.download_size = 999;
  bundle.devices = {"ace2", "mali400"};
  release.bundles = {bundle};
  bundle.name = "mural.2";
  bundle.devices.clear();
  release.bundles.push_back(bundle);
  return release;
}

TEST(Release, ReadsWhatItWrites) {
  const std::string text = release_text(sample());
  const auto back = parse_release(text);
  ASSERT_TRUE(back) << to_line(back.error());
  EXPECT_EQ(release_text(*back), text);
  EXPECT_NE(text.find("\"expires\": \"2027-01-01T00:00:00Z\""), std::string::npos);
  EXPECT_EQ(back->bundles[0].devices, (std::vector<std::string>{"ace2", "mali400"}));
}

TEST(Release, HoldsFiveThousandBundles) {
  Release release = sample();
  const ReleaseBundle one = release.bundles[0];
  for (int i = 0; i < 5000; ++i) {
    release.bundles.push_back(one);
    release.bundles.back().name = "a-name-of-thirty-letters-" + std::to_string(10000 + i);
  }
  const std::string text = release_text(release);
  EXPECT_GT(text.size(), 1u << 20);
  const auto back = parse_release(text);
  ASSERT_TRUE(back) << to_line(back.error());
  EXPECT_EQ(release_text(*back), text);
}

TEST(Release, RefusesWhatLeadsElsewhere) {
  for (const char* name : {"", "../vase", "a/b", ".hidden", "a b", "caf\u00e9"}) {
    Release release = sample();
    release.bundles[0].name = name;
    EXPECT_FALSE(parse_release(release_text(release))) << name;
  }
  Release twice = sample();
  twice.bundles[1].name = "vase";
  EXPECT_FALSE(parse_release(release_text(twice)));
  Release none = sample();
  none.bundles.clear();
  EXPECT_FALSE(parse_release(release_text(none)));
  EXPECT_FALSE(parse_release(std::string(200'000, '[')));
  EXPECT_FALSE(parse_release(""));
}

TEST(Release, EveryFlippedBitIsRefused) {
  const auto key = make_key();
  ASSERT_TRUE(key);
  const std::string text = release_text(sample());
  const std::string signed_by = sign(*key, text, "modar release 7");
  const auto holds = [&](const std::string& document, const std::string& signature) {
    const auto parsed = parse_signature(signature);
    return parsed && verify_signature(document, *parsed, key->public_key) &&
           parse_release(document);
  };
  ASSERT_TRUE(holds(text, signed_by));
  for (std::size_t bit = 0; bit < 8 * text.size(); ++bit) {
    std::string flipped = text;
    flipped[bit / 8] = static_cast<char>(flipped[bit / 8] ^ 1 << bit % 8);
    EXPECT_FALSE(holds(flipped, signed_by)) << bit;
  }
  // The first line of a signature is a comment for people that nothing signs.
  const std::size_t comment = signed_by.find('\n') + 1;
  for (std::size_t bit = 8 * comment; bit < 8 * signed_by.size(); ++bit) {
    std::string flipped = signed_by;
    flipped[bit / 8] = static_cast<char>(flipped[bit / 8] ^ 1 << bit % 8);
    EXPECT_FALSE(holds(text, flipped)) << bit / 8 << " of " << signed_by;
  }
}

TEST(Release, AnotherKeySaysSo) {
  const auto key = make_key();
  const auto other = make_key();
  ASSERT_TRUE(key && other);
  const auto signature = parse_signature(sign(*key, "text", "comment"));
  ASSERT_TRUE(signature);
  const auto verdict = verify_signature("text", *signature, other->public_key);
  ASSERT_FALSE(verdict);
  EXPECT_EQ(verdict.error().exit, kExitWrongKey);
  EXPECT_EQ(verdict.error().code, "signature.key");
}

TEST(Release, SecretKeysComeBack) {
  const auto key = make_key();
  ASSERT_TRUE(key);
  const auto text = secret_key_text(*key, "");
  ASSERT_TRUE(text);
  EXPECT_FALSE(needs_pass_phrase(*text));
  const auto back = parse_secret_key(*text, "");
  ASSERT_TRUE(back);
  EXPECT_EQ(back->bytes, key->bytes);
  EXPECT_EQ(back->public_key, key->public_key);
  std::string damaged = *text;
  damaged[damaged.size() - 20] = damaged[damaged.size() - 20] == 'A' ? 'B' : 'A';
  EXPECT_FALSE(parse_secret_key(damaged, ""));
  const auto mistaken = parse_public_key(*text);
  ASSERT_FALSE(mistaken);
  EXPECT_NE(mistaken.error().cause.find("secret key"), std::string::npos);
  const auto public_back = parse_public_key(public_key_text(key->public_key));
  ASSERT_TRUE(public_back);
  EXPECT_EQ(*public_back, key->public_key);
}

TEST(Release, TimesAreReadStrictly) {
  EXPECT_EQ(parse_time("1970-01-02T00:00:01Z").value(), 86401);
  // By GNU date, behind where 32 bits end.
  EXPECT_EQ(parse_time("2050-06-30T23:59:58Z").value(), 2540246398);
  EXPECT_EQ(time_text(2540246398), "2050-06-30T23:59:58Z");
  for (const char* text :
       {"2027-02-30T00:00:00Z", "2027-13-01T00:00:00Z", "2027-01-01 00:00:00Z",
        "2027-01-01T00:00:00", "2027-01-01T25:00:00Z", "tomorrow", "", "2027-1-01T00:00:000Z"}) {
    EXPECT_FALSE(parse_time(text)) << text;
  }
}

}  // namespace
}  // namespace modar
