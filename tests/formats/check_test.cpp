// The checker proves itself: no flipped bit goes unseen, and every issue has a file that shows it.
#include "formats/check.hpp"
#include "formats/content_summary.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <limits>
#include <set>
#include <sstream>
#include <string>

#include "formats/bundle_view.hpp"
#include "formats/pattern_shape.hpp"
#include "formats/rules.hpp"
#include "tests/corrupt/cases.hpp"
#include "tests/formats/support.hpp"
#include "tests/soak.hpp"

namespace {

using namespace modar;
using namespace modar::test;
namespace fs = std::filesystem;

std::vector<CorruptCase> all_cases() {
  std::vector<CorruptCase> cases(structure_cases().begin(), structure_cases().end());
  cases.insert(cases.end(), payload_cases().begin(), payload_cases().end());
  return cases;
}

std::vector<std::string> lines_of(const std::string& path) {
  const Bytes bytes = read_file(path);
  std::stringstream stream(std::string(reinterpret_cast<const char*>(bytes.data()), bytes.size()));
  std::vector<std::string> lines;
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

std::string corrupt_path(const std::string& id, const char* extension) {
  return source_path("tests/corrupt/" + id + extension);
}

TEST(Check, GoodBundlesAreGood) {
  EXPECT_EQ(report(encode(pattern_content())), std::vector<std::string>{"good"});
  EXPECT_EQ(report(encode(model_content())), std::vector<std::string>{"good"});
  const auto golden = report(encode(golden_content()));
  ASSERT_EQ(golden.size(), 3u) << golden[0];
  EXPECT_EQ(golden[0].substr(0, 20), "info SECTION_UNKNOWN");
  EXPECT_EQ(golden[1].substr(0, 35), "warning NEVER_SHOWN model 'integer'");
  EXPECT_EQ(golden[2], "good");
}

/// Every bit under `scripts/test.sh --soak`, two or three of each byte otherwise.
TEST(Check, NoFlippedBitGoesUnseen) {
  const std::size_t step = modar::testing::soak() ? 1 : 3;
  const IssueSink ignore = [](const Issue&) {};
  for (const BundleContent& content : {pattern_content(), model_content()}) {
    Bytes bytes = encode(content);
    for (std::size_t bit = 0; bit < bytes.size() * 8; bit += step) {
      std::byte& byte = bytes[bit / 8];
      const std::byte mask{static_cast<unsigned char>(1u << (bit % 8))};
      byte ^= mask;
      ASSERT_FALSE(check_bundle(bytes, ignore)) << "bit " << bit;
      byte ^= mask;
    }
  }
}

/// The faces of an octahedron lean atan(sqrt 2) out of its axis: the sine is sqrt(2/3).
TEST(Check, VerifyingFindsEveryChangedByteOfASection) {
  Bytes bytes = encode(pattern_content());
  std::size_t opened = 0;
  for (std::byte& byte : bytes) {
    const auto offset = static_cast<std::size_t>(&byte - bytes.data());
    const bool inside =
        std::ranges::any_of(BundleView::open(bytes)->sections(), [&](const SectionEntry& entry) {
          return offset >= entry.offset && offset - entry.offset < entry.size;
        });
    byte ^= std::byte{0x10};
    if (const auto view = BundleView::open(bytes)) {
      const auto whole = verify_sections(*view);
      ASSERT_EQ(whole.has_value(), !inside) << offset;
      ASSERT_TRUE(whole || whole.error().code == "section.hash");
      ++opened;
    }
    byte ^= std::byte{0x10};
  }
  EXPECT_GT(opened, bytes.size() / 2) << "opening alone finds most changes";
}

TEST(Check, ConesHoldTheNormalsOfTheirTriangles) {
  const auto said = [](float cutoff, bool turned) {
    BundleContent content = model_content();
    content.chunks[0].cone_cutoff = cutoff;
    if (turned) std::swap(content.indices[0], content.indices[2]);  // one triangle of level 0
    return report(encode(content));
  };
  EXPECT_EQ(said(0.8165f, false), std::vector<std::string>{"good"});
  EXPECT_EQ(said(2.0f, true), std::vector<std::string>{"good"});
  EXPECT_EQ(said(0.81f, false),
            (std::vector<std::string>{"error CHUNK_CONE model 'octahedron', chunk 0, level 0 (byte "
                                      "8192): 4 triangles face out of the cone",
                                      "error CHUNK_CONE model 'octahedron', chunk 0, level 1 (byte "
                                      "8216): 2 triangles face out of the cone",
                                      "bad"}));
  EXPECT_EQ(said(0.8165f, true).front(),
            "error CHUNK_CONE model 'octahedron', chunk 0, level 0 (byte 8192): 1 triangles face "
            "out of the cone");
}

/// What a writer of other bundles may get wrong though no hash tells: a change to a good bundle
/// with all of 1.2, and its first issue.
template <class Damage>
std::string said_of(Damage damage) {
  Bytes bytes = encode(lit_content());
  damage(bytes);
  rehash(bytes);
  return report(bytes).front();
}

TEST(Check, ProxiesAreWholeAndInOrder) {
  const auto said = [](auto damage) {
    BundleContent content = lit_content();
    add_proxies(content);
    Bytes bytes = encode(content);
    damage(bytes);
    rehash(bytes);
    const std::string line = report(bytes).front();
    return line.substr(0, line.find(' ', line.find(' ') + 1));
  };
  const auto proxy = [](Bytes& b, std::uint32_t i) -> ProxyRecord& {
    return record_of<ProxyRecord>(b, SectionType::kProxies, i);
  };
  const auto level = [](Bytes& b, std::uint32_t i) -> LevelRecord& {
    return record_of<LevelRecord>(b, SectionType::kProxyLevels, i);
  };
  const std::string wrong = "error BUNDLE_PROXY";
  EXPECT_EQ(said([](Bytes&) {}), "good");
  EXPECT_EQ(said([&](Bytes& b) { proxy(b, 2).model = 3; }), wrong);
  EXPECT_EQ(said([&](Bytes& b) { proxy(b, 0).model = 1; }), wrong);
  EXPECT_EQ(said([&](Bytes& b) { proxy(b, 0).first_chunk = 5; }), wrong);
  EXPECT_EQ(said([&](Bytes& b) { proxy(b, 2).chunk_count = 2; }), wrong);
  EXPECT_EQ(said([&](Bytes& b) { proxy(b, 1).first_chunk = 0xFFFFFFFFu; }), wrong);
  EXPECT_EQ(said([&](Bytes& b) { level(b, 0).error = 0.25f; }), wrong);
  EXPECT_EQ(said([&](Bytes& b) { proxy(b, 1).reserved = 1; }), "error BUNDLE_RESERVED");
  EXPECT_EQ(said([&](Bytes& b) { level(b, 2).error = 0.0625f; }), "error LEVEL_ORDER");
  EXPECT_EQ(said([&](Bytes& b) { level(b, 3).vertex_count = 60000; }), "error BUNDLE_LEVEL_RANGE");
  EXPECT_EQ(said([](Bytes& b) {
              record_of<ChunkRecord>(b, SectionType::kProxyChunks, 1).first_level = 2;
            }),
            "error BUNDLE_CHUNK_RANGE");
  EXPECT_EQ(said([](Bytes& b) {
              record_of<ChunkRecord>(b, SectionType::kProxyChunks, 1).level_count = 2;
              record_of<ChunkRecord>(b, SectionType::kProxyChunks, 2).first_level = 12;
            }),
            wrong);
  EXPECT_EQ(said([](Bytes& b) {
              record_of<ChunkRecord>(b, SectionType::kProxyChunks, 3).bounds_max[2] = 0.5f;
            }),
            "error CHUNK_LOOSE");
}

TEST(Check, NumbersOfTheWorldHaveBounds) {
  EXPECT_EQ(said_of([](Bytes&) {}), "good");
  const auto bad = [](auto damage) {
    return said_of(damage).substr(0, 19) == "error BUNDLE_NUMBER";
  };
  for (const double width : {1e300, -1.0, 1e-5, 2e7}) {
    EXPECT_TRUE(bad([width](Bytes& b) {
      record_of<PatternRecord>(b, SectionType::kPatterns).width_mm = width;
    })) << width;
  }
  for (const double unit : {1e300, 1e-10, -1.0}) {
    EXPECT_TRUE(bad([unit](Bytes& b) {
      record_of<ModelRecord>(b, SectionType::kModels).unit_metres = unit;
    })) << unit;
  }
  for (const float scale : {1e30f, 1e-12f, 0.0f}) {
    EXPECT_TRUE(bad([scale](Bytes& b) {
      record_of<SceneRecord>(b, SectionType::kScenes).scale = scale;
    })) << scale;
  }
  EXPECT_TRUE(
      bad([](Bytes& b) { record_of<SceneRecord>(b, SectionType::kScenes).offset[1] = -1e30f; }));
  EXPECT_TRUE(bad([](Bytes& b) {
    const std::uint64_t at = entry_of(b, SectionType::kShadow).offset;
    reinterpret_cast<ShadowHeader*>(b.data() + at)->high[0] = 1e30f;
  }));
}

TEST(Check, MarksOfLabelsHave1To32Bytes) {
  for (const std::size_t size : {0u, 1u, 32u, 33u}) {
    BundleContent content = acting_content();
    const auto label = std::ranges::find(
        content.nodes, static_cast<std::uint32_t>(NodeKind::kLabel), &NodeRecord::kind);
    label->mark = content.intern(std::string(size, 'x'));
    const std::string first = report(encode(content)).front();
    EXPECT_EQ(first.starts_with("error BUNDLE_NODE"), size == 0 || size == 33) << first;
  }
}

TEST(Check, CornersOfBoxesLieNearTheirPattern) {
  for (const float place : {1e30f, -1e30f, std::numeric_limits<float>::infinity(), 1001.0f}) {
    const std::string said = said_of([place](Bytes& b) {
      // The second pattern's: two faces.
      for (std::size_t i = 0; i < BundleView::open(b)->sections().size(); ++i) {
        const SectionEntry& entry = BundleView::open(b)->sections()[i];
        if (entry.type != static_cast<std::uint32_t>(SectionType::kPatternShape) ||
            entry.owner != 1)
          continue;
        auto* face = reinterpret_cast<ShapeFaceRecord*>(b.data() + entry.offset +
                                                        sizeof(PatternShapeHeader));
        face->corner[2] = place;
        return;
      }
    });
    EXPECT_EQ(said.substr(0, 20), "error BUNDLE_PATTERN") << place << ": " << said;
  }
}

TEST(Check, PatternPicturesAreWebPFilesOfAtMost32KiB) {
  const auto good = [](std::size_t size, std::size_t stated, const char* magic) {
    BundleContent content = pattern_content();
    ExtraSection picture;
    picture.type = static_cast<std::uint32_t>(SectionType::kPatternPicture);
    picture.owner = 0;
    picture.bytes.resize(size);
    const auto number = static_cast<std::uint32_t>(stated - 8);
    std::memcpy(picture.bytes.data(), "RIFF", 4);
    std::memcpy(picture.bytes.data() + 4, &number, sizeof number);
    std::memcpy(picture.bytes.data() + 8, magic, 4);
    content.extra.push_back(picture);
    const Bytes bytes = encode(content);
    EXPECT_TRUE(BundleView::open(bytes)) << "players open a bundle before its pictures have come";
    const std::string said = report(bytes)[0];
    EXPECT_TRUE(said == "good" || said.starts_with("error BUNDLE_PATTERN")) << said;
    return said == "good";
  };
  EXPECT_TRUE(good(13, 13, "WEBP"));
  EXPECT_TRUE(good(32768, 32768, "WEBP"));
  EXPECT_FALSE(good(32769, 32769, "WEBP"));
  EXPECT_FALSE(good(12, 12, "WEBP")) << "nothing behind the header";
  EXPECT_FALSE(good(100, 101, "WEBP")) << "cut short";
  EXPECT_FALSE(good(100, 99, "WEBP")) << "too long";
  EXPECT_FALSE(good(100, 100, "WAVE"));
}

/// The bounds hold for every light that can be: those of a single lamp in any direction, whose
/// coefficients are the greatest, are good.
TEST(Check, LightsThatCannotBeAreFound) {
  const auto said = [](const std::array<double, 9>& sky, float key) {
    return said_of([&](Bytes& b) {
      auto& light = record_of<LightRecord>(b, SectionType::kLights);
      for (std::size_t i = 0; i < 27; ++i) light.sky[i] = static_cast<float>(sky[i / 3]);
      std::fill(std::begin(light.key), std::end(light.key), key);
    });
  };
  for (int i = 0; i < 200; ++i) {
    const double z = 1 - 2 * (i + 0.5) / 200;
    const double x = std::sqrt(1 - z * z) * std::cos(2.4 * i);
    const double y = std::sqrt(1 - z * z) * std::sin(2.4 * i);
    // Of a lamp in (x, y, z), by the integrals of the polynomials' squares and the weights 1, 2/3
    // and 1/4 of Ramamoorthi and Hanrahan, 2001.
    EXPECT_EQ(said({1, 2 * y, 2 * z, 2 * x, 3.75 * x * y, 3.75 * y * z, 0.3125 * (3 * z * z - 1),
                    3.75 * z * x, 0.9375 * (x * x - y * y)},
                   0.5f),
              "good")
        << x << " " << y << " " << z;
  }
  const std::string found = "error LIGHT_VALUES light 0";
  EXPECT_EQ(said({0.5, 0, 1.1, 0, 0, 0, 0, 0, 0}, 1.0f).substr(0, found.size()), found);
  EXPECT_EQ(said({-0.5, 0, 0, 0, 0, 0, 0, 0, 0}, 1.0f).substr(0, found.size()), found);
  EXPECT_EQ(said({1e30, 0, 0, 0, 0, 0, 0, 0, 0}, 1.0f).substr(0, found.size()), found);
  EXPECT_EQ(said({1, 0, 0, 0, 0, 0, 0, 0, 0}, -0.25f).substr(0, 19), "error BUNDLE_NUMBER");
}

/// A wrong hash does not keep records from being held against what they refer to.
TEST(Check, RecordsAreBoundedWhereAHashIsWrong) {
  for (const bool node : {false, true}) {
    Bytes bytes = encode(acting_content());
    if (node) {
      record_of<NodeRecord>(bytes, SectionType::kNodes).name.offset = 1u << 30;
    } else {
      record_of<OcclusionRecord>(bytes, SectionType::kOcclusion).offset = 1u << 30;
    }
    rehash(bytes);
    bytes[entry_of(bytes, SectionType::kMeta).offset] ^= std::byte{1};
    const auto issues = report(bytes);
    EXPECT_TRUE(issues.front().starts_with("error SECTION_HASH")) << issues.front();
    const std::string wanted =
        node ? "error BUNDLE_NAME node 0" : "error BUNDLE_LAYOUT occlusion 0";
    EXPECT_TRUE(std::any_of(issues.begin(), issues.end(), [&](const std::string& issue) {
      return issue.starts_with(wanted);
    })) << wanted;
  }
}

TEST(Check, CopiesOfAPatternAreTwoToSixteenAndNeedTheVersionThatAddedThem) {
  const auto said = [](std::uint32_t copies, std::uint16_t minor) {
    BundleContent content = lit_content();
    content.patterns[0].copies = copies;
    content.summary.clear();
    content.summary = content_summary_of(content);
    Bytes bytes = encode(content);
    EXPECT_EQ(reinterpret_cast<FileHeader*>(bytes.data())->minor, copies > 0 ? 4 : 2);
    const std::string text(reinterpret_cast<const char*>(content.summary.data()),
                           content.summary.size());
    EXPECT_EQ(text.find("\"copies\":" + std::to_string(copies)) != std::string::npos, copies > 0);
    reinterpret_cast<FileHeader*>(bytes.data())->minor = minor;
    rehash(bytes);
    const std::string line = report(bytes).front();
    return line.substr(0, line.find(' ', line.find(' ') + 1));
  };
  EXPECT_EQ(said(0, 2), "good");
  EXPECT_EQ(said(2, 4), "good");
  EXPECT_EQ(said(16, 4), "good");
  EXPECT_EQ(said(1, 4), "error BUNDLE_PATTERN");
  EXPECT_EQ(said(17, 4), "error BUNDLE_PATTERN");
  EXPECT_EQ(said(2, 3), "error BUNDLE_MINOR");
}

TEST(Check, ANewerMinorVersionIsForDevicesOnly) {
  Bytes bytes = encode(lit_content());
  reinterpret_cast<FileHeader*>(bytes.data())->minor = kMinorVersion + 5;
  rehash(bytes);
  EXPECT_EQ(report(bytes).front(),
            "error BUNDLE_MINOR header (byte 10): it states 1.9, this program knows up to 1.4 and "
            "cannot judge what that added");
  EXPECT_EQ(first_error(bytes), "BUNDLE_MINOR header");
  EXPECT_EQ(first_error(bytes, {.release = {}, .accept_newer = true}), "");
}

/// By the fast look at many vertices and by the slow one, which a layout of floats gets.
TEST(Check, OcclusionEndsAt127) {
  for (int value : {127, 128, 255}) {
    const std::string said = said_of([value](Bytes& b) {
      b[entry_of(b, SectionType::kVertices).offset + 2 * 16 + 11] =
          std::byte{static_cast<unsigned char>(value)};
    });
    EXPECT_EQ(said.substr(0, 22), value == 127 ? "good" : "error VERTEX_OCCLUSION") << said;
  }
}

TEST(Check, GivesBackEveryByteOfTheGreatBuffersOnceAndInOrder) {
  BundleContent content = model_content();
  // Great enough for several releases; bytes that no level refers to are read, too.
  content.vertices.resize(5u << 20);
  content.indices.resize(3u << 20);
  Bytes bytes = encode(content);
  const std::byte* const begin = bytes.data();
  std::vector<std::pair<std::size_t, std::size_t>> ranges;
  CheckOptions options;
  options.release = [&](std::span<const std::byte> part) {
    const auto first = static_cast<std::size_t>(part.data() - begin);
    ranges.emplace_back(first, first + part.size());
  };
  EXPECT_TRUE(check_bundle(
      bytes, [](const Issue&) {}, options));
  std::sort(ranges.begin(), ranges.end());
  for (const SectionType type : {SectionType::kVertices, SectionType::kIndices}) {
    const SectionEntry& entry = entry_of(bytes, type);
    std::size_t at = entry.offset;
    for (const auto& [first, end] : ranges) {
      if (first < entry.offset || first >= entry.offset + entry.size) continue;
      EXPECT_EQ(first, at);
      at = end;
    }
    EXPECT_EQ(at, entry.offset + entry.size);
  }
  for (const SectionType type : {SectionType::kVertices, SectionType::kIndices}) {
    std::byte& last = bytes[entry_of(bytes, type).offset + entry_of(bytes, type).size - 1];
    last ^= std::byte{1};
    EXPECT_FALSE(check_bundle(
        bytes, [](const Issue&) {}, options));
    last ^= std::byte{1};
  }
}

/// With true hashes the semantic rules stand alone. Whatever they say, nothing may crash, and what
/// they pass has to open.
TEST(Check, RehashedByteChangesNeverCrash) {
  const IssueSink ignore = [](const Issue&) {};
  const Bytes whole = encode(golden_content());
  const std::size_t tables = 3776;
  for (std::size_t at = 64; at < tables; ++at) {
    for (const auto value :
         {std::byte{0}, std::byte{1}, std::byte{0x7F}, std::byte{0x80}, std::byte{0xFF}}) {
      Bytes bytes = whole;
      bytes[at] = value;
      rehash(bytes);
      if (check_bundle(bytes, ignore)) {
        ASSERT_TRUE(BundleView::open(bytes)) << at;
      }
    }
  }
}

// bundle.md: mirrored and clamped only with repeat, and never both along one axis.
TEST(Check, FlagsBeyondTheUnitSquareAgree) {
  const auto reported = [](std::uint32_t flags) {
    Bytes bytes = encode(texture_content());
    record_of<TextureRecord>(bytes, SectionType::kTextures).flags = flags;
    rehash(bytes);
    const std::vector<std::string> lines = report(bytes);
    return std::count_if(lines.begin(), lines.end(), [](const std::string& line) {
      return line.starts_with("error BUNDLE_TEXTURE_RANGE");
    });
  };
  for (const std::uint32_t good : {0u, 2u, 2u + 8, 2u + 16, 2u + 32, 2u + 64, 2u + 8 + 64}) {
    EXPECT_EQ(reported(good), 0) << good;
  }
  for (const std::uint32_t bad : {8u, 16u, 32u, 64u, 2u + 8 + 32, 2u + 16 + 64}) {
    EXPECT_EQ(reported(bad), 1) << bad;
  }
}

TEST(Issues, IdsAndFilesAndCasesAreTheSameSet) {
  std::set<std::string> ids;
  for (const IssueKind& kind : issue_kinds()) EXPECT_TRUE(ids.insert(kind.id).second) << kind.id;
  std::set<std::string> bundles;
  std::set<std::string> reports;
  for (const auto& file : fs::directory_iterator(source_path("tests/corrupt"))) {
    if (file.path().extension() == ".modar") bundles.insert(file.path().stem());
    if (file.path().extension() == ".txt") reports.insert(file.path().stem());
  }
  std::set<std::string> cases;
  for (const CorruptCase& made : all_cases()) cases.insert(made.id);
  EXPECT_EQ(ids, bundles);
  EXPECT_EQ(ids, reports);
  EXPECT_EQ(ids, cases);
}

TEST(Issues, EveryIdHasAFileThatShowsIt) {
  for (const IssueKind& kind : issue_kinds()) {
    SCOPED_TRACE(kind.id);
    const Bytes bytes = read_file(corrupt_path(kind.id, ".modar"));
    const auto found = report(bytes);
    EXPECT_EQ(found, lines_of(corrupt_path(kind.id, ".txt")));
    if (std::strcmp(kind.id, "PATTERN_YML_DIFFERS") == 0) {
      // Only OpenCV's parser can tell: the rest of the checker finds nothing.
      EXPECT_EQ(found, std::vector<std::string>{"good"});
      continue;
    }
    const char* severities[] = {"error ", "warning ", "info "};
    const std::string wanted =
        severities[static_cast<int>(kind.severity)] + std::string(kind.id) + " ";
    EXPECT_TRUE(std::any_of(found.begin(), found.end(), [&wanted](const std::string& line) {
      return line.starts_with(wanted);
    }));
    EXPECT_EQ(found.back(), kind.severity == Severity::kError ? "bad" : "good");
  }
}

TEST(Issues, FilesAreWhatTheirGeneratorWrites) {
  for (const CorruptCase& made : all_cases()) {
    EXPECT_EQ(made.make(), read_file(corrupt_path(made.id, ".modar"))) << made.id;
  }
}

TEST(Issues, StructureCasesDoNotOpenAndPayloadCasesDo) {
  for (const CorruptCase& made : structure_cases()) {
    const Bytes bytes = made.make();
    const auto view = BundleView::open(bytes);
    ASSERT_FALSE(view) << made.id;
    std::string id = view.error().code;
    std::replace_if(
        id.begin(), id.end(), [](char c) { return c == '.' || c == '-'; }, '_');
    std::transform(id.begin(), id.end(), id.begin(), [](char c) {
      return c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c;
    });
    EXPECT_EQ(id, made.id);
    EXPECT_FALSE(view.error().cure.empty());
  }
  for (const CorruptCase& made : payload_cases()) {
    EXPECT_TRUE(BundleView::open(made.make())) << made.id;
  }
}

TEST(Issues, MarkdownTellsEveryId) {
  const std::string text = issues_markdown();
  for (const IssueKind& kind : issue_kinds()) {
    EXPECT_NE(text.find(std::string("| ") + kind.id + " | "), std::string::npos) << kind.id;
  }
}

}  // namespace
