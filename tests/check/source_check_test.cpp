// Bundles against their own sources: a good one differs in nothing, and every change to something
// that the device uses is reported although the hashes are right.
#include "bake/check/source/source_check.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <functional>
#include <random>
#include <set>

#include "bake/bundle/bundle_builder.hpp"
#include "bake/check/text_check.hpp"
#include "bake/image/image.hpp"
#include "bake/options/request_text.hpp"
#include "formats/bundle_view.hpp"
#include "formats/colour_grid.hpp"
#include "formats/draw_order.hpp"
#include "formats/pattern_shape.hpp"
#include "formats/tracker_record.hpp"
#include "tests/formats/support.hpp"
#include "tests/texture/texture_samples.hpp"

namespace {

using namespace modar;
using namespace modar::test;

constexpr const char* kModel = R"(mtllib two.mtl
v 0 0 0
v 2 0 0
v 2 1 0
v 0 1 1
vt 0 0
vt 1 0
vt 1 1
usemtl wood
f 1/1 2/2 3/3
usemtl stone
f 1/1 3/2 4/3
)";
constexpr const char* kMaterials = "newmtl wood\nmap_Kd wood.png\nnewmtl stone\nmap_Kd stone.png\n";

/// A ramp that ETC1 holds well; `more` is added to it.
RgbaImage ramp(int more) {
  RgbaImage image{32, 32, {}};
  for (int i = 0; i < 32 * 32; ++i) {
    const auto level = static_cast<std::uint8_t>(40 + 4 * (i % 32) + more);
    image.pixels.insert(image.pixels.end(), {level, level, level, 255});
  }
  return image;
}

/// Squares of random gray levels.
RgbaImage squares() {
  constexpr std::uint32_t kWidth = 160, kHeight = 128, kSquare = 8;
  std::mt19937 random(7);
  std::vector<std::uint8_t> levels(kWidth / kSquare * kHeight / kSquare);
  for (std::uint8_t& level : levels) level = static_cast<std::uint8_t>(random());
  RgbaImage image{kWidth, kHeight, {}};
  for (std::uint32_t i = 0; i < kWidth * kHeight; ++i) {
    const std::uint32_t x = i % kWidth / kSquare;
    const std::uint8_t level = levels[i / kWidth / kSquare * (kWidth / kSquare) + x];
    image.pixels.insert(image.pixels.end(), {level, level, level, 255});
  }
  return image;
}

/// Two triangles with alike textures on a pattern 210 mm wide.
class SourceTest : public ::testing::Test {
 protected:
  void SetUp() override {
    write_file(folder_.file("two.obj"), std::string_view(kModel));
    write_file(folder_.file("two.mtl"), std::string_view(kMaterials));
    ASSERT_TRUE(write_png(ramp(0), folder_.file("wood.png")));
    ASSERT_TRUE(write_png(ramp(5), folder_.file("stone.png")));
    ASSERT_TRUE(write_png(squares(), folder_.file("card.png")));
    ASSERT_TRUE(write_png(ramp(60), folder_.file("room.png")));
    bake();
  }

  void bake(const ShapeRequest& shape = {}) {
    BakeRequest request = sources();
    request.patterns.pop_back();  // the room's picture, which lights the scene
    request.patterns[0].shape = shape;
    request.patterns[0].width_mm = 210;
    request.parameters = {"none"};
    request.loop.trial_views = 8;
    request.loop.score = false;
    SceneRequest scene;
    scene.pattern = "card";
    scene.model = "two";
    scene.size.value = 0.5;
    scene.up = UpAxis::kY;
    scene.offset = {SceneOffset::Unit::kSide, {0.05, 0, 0}};
    scene.light = folder_.file("room.png");
    request.scenes = {scene};
    Report report;
    auto built = build_bundle(request, report);
    ASSERT_TRUE(built) << to_line(built.error());
    content_ = std::move(*built);
    content_.summary.clear();
  }

  [[nodiscard]] BakeRequest sources() const {
    BakeRequest request;
    request.models = {folder_.file("two.obj")};
    request.patterns = {{folder_.file("card.png"), 0.0}, {folder_.file("room.png"), 0.0}};
    return request;
  }

  /// Ids of what the check finds in the bundle after `change`, with what it states of the bake.
  std::set<std::string> issues(const std::function<void(BundleContent&)>& change = {}) {
    BundleContent content = content_;
    if (change) change(content);
    if (other_version_) {
      const std::string tool = R"("tool": "modar )";
      content.meta.insert(content.meta.find(tool) + tool.size(), "0.0.9");
    }
    const Bytes bytes = encode(content);
    const auto bundle = BundleView::open(bytes);
    if (!bundle) return {to_line(bundle.error())};
    BakeRequest request = sources();
    request.parameters = {"none"};
    if (!room_given_) request.patterns.pop_back();
    if (model_alone_) request.patterns.clear();
    read_bake_options(bundle->meta(), request);
    std::set<std::string> ids;
    Report report;
    const auto fit = check_source(
        *bundle, request,
        [&](const Issue& issue) {
          ids.insert(issue.kind->id);
          details_ += issue.where + ": " + issue.detail + "\n";
        },
        report);
    if (!fit) ids.insert(to_line(fit.error()));
    return ids;
  }

  /// The tracker record with its codes (or its image) replaced by `fill`.
  static void fill_record(BundleContent& content, bool codes,
                          const std::function<std::uint8_t(std::uint8_t)>& fill) {
    for (ExtraSection& section : content.extra) {
      if (section.type != static_cast<std::uint32_t>(SectionType::kTrackerRecord)) continue;
      TrackerRecordView record;
      ASSERT_FALSE(view_tracker_record(section.bytes, record));
      const auto part = codes ? record.codes : record.pixels;
      ASSERT_FALSE(part.empty());
      auto* bytes = const_cast<std::uint8_t*>(part.data());
      std::transform(bytes, bytes + part.size(), bytes, fill);
    }
  }

  ScratchFolder folder_;
  BundleContent content_;
  bool room_given_ = true;
  bool model_alone_ = false;
  bool other_version_ = false;  ///< of this program baked the bundle
  std::string details_;         ///< of all issues so far
};

using Ids = std::set<std::string>;

TEST_F(SourceTest, AGoodBundleDiffersInNothing) {
  EXPECT_EQ(issues(), Ids());
}

TEST_F(SourceTest, MessagesNameThePartThatDiffers) {
  issues([](BundleContent& content) {
    content.vertices[0] ^= std::byte{1};  // of both chunks
    content.scenes[0].scale *= 1.1f;
  });
  EXPECT_EQ(details_,
            "model 'two': chunk 0, level 0: not as baked again, and 1 other part\n"
            "scene 0 of model 'two' on pattern 'card': its place: not as baked again\n");
  details_.clear();
  issues([](BundleContent& content) {
    for (ChunkRecord& chunk : content.chunks) chunk.uv_scale[0] *= 2;
    content.shadows[0].clear();
  });
  EXPECT_EQ(details_,
            "model 'two': chunk 0: not as baked again, and 1 other part\n"
            "scene 0 of model 'two' on pattern 'card': its shadow: missing\n");
}

/// Of another version, what no one sees is not reported as wrong.
TEST_F(SourceTest, OfAnotherVersionSurfacesPicturesCodesAndPlacesCount) {
  other_version_ = true;
  EXPECT_EQ(issues(), Ids());
  constexpr double kStated = 0.01;  // by the bundle; its source's positions are exact
  const auto shifted = [&](double by) {
    return issues([by](BundleContent& content) {
      ModelRecord& model = content.models[0];
      model.position_error_max = kStated;
      model.center[0] += by;
    });
  };
  EXPECT_EQ(shifted(0.99 * kStated), Ids{"SOURCE_BYTES"});
  EXPECT_EQ(shifted(1.01 * kStated), (Ids{"SOURCE_BYTES", "SOURCE_SURFACE"}));
  const auto scaled = [&](float by) {
    return issues([by](BundleContent& content) { content.scenes[0].scale *= by; });
  };
  EXPECT_EQ(scaled(1 + 5e-6f), Ids{"SOURCE_BYTES"});
  EXPECT_EQ(scaled(1 + 3e-5f), (Ids{"SOURCE_BYTES", "SOURCE_SCENE"}));
  std::mt19937 random(5);
  const auto textured = [&](std::size_t count) {
    return issues([&](BundleContent& content) {
      for (std::size_t i = 0; i < count; ++i) {
        content.texture_data[0][i] = static_cast<std::byte>(random());
      }
    });
  };
  EXPECT_EQ(textured(1), Ids{"SOURCE_BYTES"});
  EXPECT_EQ(textured(256), (Ids{"SOURCE_BYTES", "SOURCE_COLOUR"}));
  const Ids pattern = {"SOURCE_BYTES", "SOURCE_PATTERN"};
  EXPECT_EQ(issues([&](BundleContent& content) {
              fill_record(content, true,
                          [&](std::uint8_t) { return static_cast<std::uint8_t>(random()); });
            }),
            pattern);
  EXPECT_EQ(issues([&](BundleContent& content) {
              fill_record(content, false,
                          [](std::uint8_t level) { return static_cast<std::uint8_t>(~level); });
            }),
            pattern);
  EXPECT_EQ(issues([](BundleContent& content) { content.patterns[0].width_mm = 200; }), pattern);
  EXPECT_EQ(issues([](BundleContent& content) { content.materials[0].diffuse[1] *= 0.5f; }),
            Ids{"SOURCE_COLOUR"});
  EXPECT_EQ(issues([](BundleContent& content) { ++content.models[0].source_vertex_count; }),
            (Ids{"SOURCE_BYTES", "SOURCE_COUNTS"}));
}

TEST_F(SourceTest, TexturesThatAreAlikeHaveChangedPlaces) {
  EXPECT_TRUE(issues([](BundleContent& content) {
                std::swap(content.materials[0].texture, content.materials[1].texture);
              }).count("SOURCE_COLOUR"));
  EXPECT_TRUE(issues([](BundleContent& content) {
                std::swap(content.texture_data[0], content.texture_data[1]);
              }).count("SOURCE_COLOUR"));
}

TEST_F(SourceTest, ScenesAreWhereTheyWereAskedFor) {
  const std::function<void(SceneRecord&)> changes[] = {
      [](SceneRecord& scene) { scene.scale *= 1.1f; },
      [](SceneRecord& scene) { scene.offset[0] += 0.01f; },
      [](SceneRecord& scene) { scene.rotation[0] = -scene.rotation[0]; },
  };
  for (const auto& change : changes) {
    EXPECT_EQ(issues([&](BundleContent& content) { change(content.scenes[0]); }),
              Ids{"SOURCE_SCENE"});
  }
}

TEST_F(SourceTest, ShadowsAndLightsAreThoseOfTheirSources) {
  ASSERT_FALSE(content_.shadows.empty() || content_.shadows[0].empty());
  ASSERT_EQ(content_.lights.size(), 1u);
  const std::function<void(BundleContent&)> changes[] = {
      [](BundleContent& content) {  // all black
        std::fill(content.shadows[0].begin() + sizeof(ShadowHeader), content.shadows[0].end(),
                  std::byte{0});
      },
      [](BundleContent& content) { content.shadows[0].clear(); },
      [](BundleContent& content) {
        ShadowHeader header{};
        std::memcpy(&header, content.shadows[0].data(), sizeof header);
        header.high[0] += 1;
        std::memcpy(content.shadows[0].data(), &header, sizeof header);
      },
      [](BundleContent& content) { content.lights.clear(); },
      [](BundleContent& content) { content.lights[0].key[0] *= 3; },
      [](BundleContent& content) { content.lights[0].sky[1] += 0.5f; },
      [](BundleContent& content) {
        for (float& part : content.lights[0].direction) part = -part;
      }};
  for (const auto& change : changes) EXPECT_EQ(issues(change), Ids{"SOURCE_SCENE"});
  room_given_ = false;  // then nothing is known of the light, and of the shadow that it casts
  EXPECT_EQ(issues(), Ids{"SOURCE_MISSING"});
}

/// One byte or number at a time, as a foreign writer may get it wrong behind right hashes.
TEST_F(SourceTest, EveryLevelIsThatOfItsSource) {
  ASSERT_EQ(content_.models.size(), 1u);
  const LayoutRecord& layout = content_.layouts[content_.models[0].layout];
  const auto place_of = [&layout](Semantic semantic) {
    for (std::uint32_t i = 0; i < layout.attribute_count; ++i) {
      const AttributeRecord& attribute = layout.attributes[i];
      if (attribute.semantic == static_cast<std::uint8_t>(semantic)) return attribute.offset;
    }
    return std::uint16_t{0xFFFF};
  };
  const std::uint16_t uv = place_of(Semantic::kUv);
  const std::uint16_t normal = place_of(Semantic::kNormal);
  ASSERT_NE(uv, 0xFFFF);
  ASSERT_NE(normal, 0xFFFF);
  const std::function<void(BundleContent&)> changes[] = {
      [uv](BundleContent& c) { c.vertices[uv + 1] ^= std::byte{0x40}; },
      [normal](BundleContent& c) {
        for (std::size_t i = 0; i < 3; ++i) c.vertices[normal + i] = ~c.vertices[normal + i];
      },
      [](BundleContent& c) { std::swap(c.indices[0], c.indices[2]); },
      [](BundleContent& c) { c.chunks[0].uv_offset[0] += 0.25f; },
      [](BundleContent& c) { c.chunks[1].uv_scale[1] *= 0.5f; },
  };
  for (const auto& change : changes) {
    const Ids found = issues(change);
    EXPECT_TRUE(found.count("SOURCE_SURFACE")) << (found.empty() ? "" : *found.begin());
  }
}

TEST_F(SourceTest, FlagsColoursAndNamesAreThoseOfTheirSources) {
  EXPECT_TRUE(issues([](BundleContent& content) {
                content.textures[0].flags ^= kTextureRepeat;
              }).count("SOURCE_COLOUR"));
  EXPECT_EQ(issues([](BundleContent& content) {
              for (ExtraSection& extra : content.extra) {
                if (extra.type != static_cast<std::uint32_t>(SectionType::kPatternColours))
                  continue;
                extra.bytes[sizeof(ColourGridHeader) + 1] ^= std::byte{0x40};
              }
            }),
            Ids{"SOURCE_PATTERN"});
  EXPECT_EQ(issues([](BundleContent& content) {
              content.scenes.clear(), content.lights.clear(), content.shadows.clear();
            }),
            Ids{"SOURCE_SCENE"});
  EXPECT_TRUE(issues([](BundleContent& content) {
                content.patterns[0].name = content.intern("cart");
              }).count("SOURCE_MISSING"));
}

/// A model alone, by default options.
class SourceModel : public SourceTest {
 protected:
  void SetUp() override { model_alone_ = true; }

  void bake(const std::string& obj, const std::string& materials = "",
            std::optional<PositionKind> positions = {}) {
    write_file(folder_.file("two.obj"), std::string_view(obj));
    write_file(folder_.file("two.mtl"), std::string_view(materials));
    Report report;
    BakeRequest request = sources();
    request.patterns.clear();
    request.positions = positions;
    auto built = build_bundle(request, report);
    ASSERT_TRUE(built) << to_line(built.error());
    content_ = std::move(*built);
    content_.summary.clear();
  }
};

TEST_F(SourceModel, TrianglesWithoutAreaOnceRoundedAreNotMissed) {
  // One that half floats cannot tell from a point, off the others.
  const std::string speck =
      "v 1.9 0.1 -0.9\nv 1.900001 0.1 -0.9\nv 1.9 0.100001 -0.9\nf 5/1 6/2 7/3\n";
  bake(kModel + speck);
  ASSERT_EQ(content_.models[0].triangle_count, 2u);
  EXPECT_EQ(issues(), Ids());
  const Ids found = issues([](BundleContent& content) {
    content.levels[0].index_count = 0;
    content.models[0].triangle_count = 1;
  });
  EXPECT_TRUE(found.count("SOURCE_SURFACE"));
  EXPECT_TRUE(found.count("SOURCE_COUNTS"));
}

TEST_F(SourceModel, VerticesThatChunksShareAreThoseOfTheirTriangles) {
  // Two materials far apart: integers of either chunk count from a place of its own.
  constexpr const char* kParts =
      "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 9 9 9\nv 9 8 9\nv 9 9 8\nusemtl a\nf 1 2 3\nusemtl b\nf 4 5 "
      "6\n";
  bake(kParts, "", PositionKind::kInt16);
  ASSERT_EQ(content_.chunks.size(), 2u);
  ASSERT_EQ(content_.levels[0].vertex_offset, content_.levels[1].vertex_offset);
  ASSERT_NE(content_.chunks[0].position_offset[0], content_.chunks[1].position_offset[0]);
  EXPECT_EQ(issues(), Ids());
}

TEST_F(SourceModel, SheetsOfSeveralColoursAtOnePlaceAreTheirSources) {
  constexpr const char* kSheets =
      "v 0 0 0 1 0 0\nv 2 0 0 1 0 0\nv 0 1 1 1 0 0\nv 0 0 0 0 0 1\nv 2 0 0 0 0 1\nv 0 1 1 0 0 1\n"
      "f 1 2 3\nf 4 6 5\n";
  bake(kSheets);
  EXPECT_EQ(issues(), Ids());
  const Ids found = issues([](BundleContent& content) {
    const AttributeRecord* colour = content.layouts[0].attributes;
    while (colour->semantic != static_cast<std::uint8_t>(Semantic::kColour)) ++colour;
    content.vertices[colour->offset + 1] = std::byte{255};  // green
  });
  EXPECT_EQ(found, Ids{"SOURCE_SURFACE"});
}

TEST_F(SourceModel, CardsOfGlassThatAreCutAreTheirSources) {
  constexpr const char* kCards =
      "mtllib two.mtl\nv 0 0 1\nv 2 0 1\nv 2 2 1\nv 0 2 1\nv 1 0 0\nv 1 0 2\nv 1 2 2\nv 1 2 0\n"
      "usemtl glass\nf 1 2 3 4\nf 5 6 7 8\n";
  bake(kCards, "newmtl glass\nKd 1 1 1\nd 0.5\n");
  ASSERT_GT(content_.models[0].triangle_count, 4u);
  EXPECT_EQ(issues(), Ids());
}

TEST(SourceTexts, AreThoseOfTheProject) {
  BundleContent content = pattern_content();
  content.meta =
      R"({"texts":[{"pattern":"p","model":"m","text":{"en":"A vase.","de":"Eine Vase."}}]})";
  const Bytes bytes = encode(content);
  const auto bundle = BundleView::open(bytes);
  ASSERT_TRUE(bundle);
  const auto said = [&](const std::vector<SceneText>& texts) {
    std::string all;
    check_texts(*bundle, texts, [&all](const Issue& issue) {
      all += std::string(issue.kind->id) + " " + issue.where + ": " + issue.detail + "\n";
    });
    return all;
  };
  EXPECT_EQ(said({{"p", "m", {{"en", "A vase."}, {"de", "Eine Vase."}}}}), "");
  EXPECT_EQ(said({{"p", "m", {{"en", "A jar."}, {"de", "Eine Vase."}}}}),
            "SOURCE_SCENE pattern 'p', model 'm': its text in 'en' is 'A vase.', the source's is "
            "'A jar.'\n");
  EXPECT_EQ(said({{"p", "m", {{"en", "A vase."}, {"fr", "Un vase."}}}}),
            "SOURCE_SCENE pattern 'p', model 'm': its text in 'fr' is missing\n");
  EXPECT_EQ(said({{"p", "m", {{"en", "A vase."}}}}),
            "SOURCE_SCENE pattern 'p', model 'm': it has a text in a language that the source "
            "lacks\n");
  EXPECT_EQ(said({{"p", "m", {{"en", "A vase."}, {"de", "Eine Vase."}}, {{"en", "A red vase"}}}}),
            "SOURCE_SCENE pattern 'p', model 'm': its text is missing\n");
  EXPECT_EQ(said({}), "SOURCE_SCENE texts: it has 1, the source 0\n");
  EXPECT_EQ(said({{"q", "m", {{"en", "A cup."}}}}),
            "SOURCE_SCENE pattern 'q', model 'm': its text is missing\n"
            "SOURCE_SCENE texts: it has 1, the source 1\n");
}

TEST_F(SourceTest, CornersHaveTheShadesOfTheirSource) {
  ASSERT_EQ(content_.occlusion.size(), 1u);
  const Ids found = issues([](BundleContent& content) {
    const std::size_t stride = content.layouts[content.occlusion[0].layout].stride;
    for (std::size_t v = content.occlusion[0].offset; v < content.vertices.size(); v += stride) {
      content.vertices[v] = content.vertices[v] < std::byte{64} ? std::byte{127} : std::byte{0};
    }
  });
  EXPECT_EQ(found, Ids{"SOURCE_SURFACE"});
  EXPECT_TRUE(
      issues([](BundleContent& content) { content.occlusion.clear(); }).count("SOURCE_COLOUR"));
}

TEST_F(SourceTest, GlassIsDrawnInTheOrderOfItsSource) {
  const DrawOrderRecord node{{0, 0, 1, 0}, 0, 0};
  ExtraSection order;
  order.type = static_cast<std::uint32_t>(SectionType::kDrawOrder);
  order.owner = 0;
  const auto bytes = std::as_bytes(std::span(&node, 1));
  order.bytes.assign(bytes.begin(), bytes.end());
  EXPECT_EQ(issues([&](BundleContent& content) { content.extra.push_back(order); }),
            Ids{"SOURCE_COLOUR"});
}

TEST_F(SourceTest, PatternsHaveTheShapesOfTheirSources) {
  const auto shape = parse_shape("cylinder,diameter=100mm");
  ASSERT_TRUE(shape);
  bake(*shape);
  EXPECT_EQ(issues(), Ids());
  const Ids found = issues([](BundleContent& content) {
    std::erase_if(content.extra, [](const ExtraSection& extra) {
      return extra.type == static_cast<std::uint32_t>(SectionType::kPatternShape);
    });
  });
  EXPECT_TRUE(found.count("SOURCE_PATTERN"));
}

TEST_F(SourceTest, PatternsHaveTheirCodesImagesAndWidths) {
  std::mt19937 random(3);
  const Ids found = {"SOURCE_PATTERN"};
  EXPECT_EQ(issues([&](BundleContent& content) {
              fill_record(content, true,
                          [&](std::uint8_t) { return static_cast<std::uint8_t>(random()); });
            }),
            found);
  EXPECT_EQ(issues([&](BundleContent& content) {
              fill_record(content, false,
                          [](std::uint8_t level) { return static_cast<std::uint8_t>(~level); });
            }),
            found);
  EXPECT_EQ(issues([](BundleContent& content) { content.patterns[0].width_mm = 200; }),
            Ids{"SOURCE_PATTERN"});
}

}  // namespace
