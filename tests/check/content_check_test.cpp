// What check_content() computes again: a baked bundle keeps every rule, and each change that no
// hash shows breaks one.
#include "bake/check/content/content_check.hpp"

#include <cmath>
#include <cstring>
#include <filesystem>
#include <functional>
#include <set>
#include <string>

#include <gtest/gtest.h>
#include <unistd.h>

#include "bake/bundle/bundle_builder.hpp"
#include "bake/image/image.hpp"
#include "formats/base/atomic_file.hpp"
#include "formats/colour_grid.hpp"
#include "formats/component.hpp"
#include "formats/tracker_record.hpp"
#include "tests/formats/support.hpp"

namespace {

using namespace modar;
using namespace modar::test;
namespace fs = std::filesystem;

/// A picture of blots on a slope.
RgbaImage blots(std::uint32_t side) {
  RgbaImage image{side, side, {}};
  std::uint32_t state = 7;
  std::vector<std::uint8_t> grays(side / 8 * (side / 8));
  for (std::uint8_t& gray : grays) {
    state = state * 1664525 + 1013904223;
    gray = static_cast<std::uint8_t>(state >> 24);
  }
  for (std::uint32_t i = 0; i < side * side; ++i) {
    const std::uint32_t x = i % side;
    const std::uint32_t y = i / side;
    const std::uint32_t blot = grays[y / 8 * (side / 8) + x / 8];
    const auto gray = static_cast<std::uint8_t>(blot / 4 + x + 2 * y);
    image.pixels.insert(image.pixels.end(), {gray, gray, gray, 255});
  }
  return image;
}

/// Squares of 16 x 16 texels, each of one colour: nearly all blocks occur again.
RgbaImage squares(std::uint32_t side) {
  RgbaImage image{side, side, {}};
  for (std::uint32_t i = 0; i < side * side; ++i) {
    const bool dark = (i % side / 16 + i / side / 16) % 2 == 0;
    const std::uint8_t gray = dark ? 60 : 180;
    image.pixels.insert(image.pixels.end(), {gray, 120, gray, 255});
  }
  return image;
}

/// A grid of hills that shows all of a texture, upright on a pattern.
Bytes bake_hills(const RgbaImage& texture = blots(64)) {
  const fs::path folder =
      fs::temp_directory_path() / ("modar_content_" + std::to_string(::getpid()));
  fs::create_directories(folder);
  const auto path = [&folder](const char* name) { return (folder / name).string(); };
  std::string obj = "mtllib hills.mtl\nusemtl hills\ns 1\n";
  constexpr int kSide = 12;
  for (int i = 0; i < kSide * kSide; ++i) {
    const int x = i % kSide;
    const int y = i / kSide;
    obj += "v " + std::to_string(x) + " " + std::to_string((x * 7 + y * 5) % 11 * 0.3) + " " +
           std::to_string(y) + "\nvt " + std::to_string(x / (kSide - 1.0)) + " " +
           std::to_string(y / (kSide - 1.0)) + "\n";
  }
  for (int i = 0; i < kSide * (kSide - 1); ++i) {
    if (i % kSide == kSide - 1) continue;
    obj += "f";
    for (const int v : {i + 1, i + kSide + 1, i + kSide + 2, i + 2}) {
      obj += " " + std::to_string(v) + "/" + std::to_string(v);
    }
    obj += "\n";
  }
  const auto write = [&path](const char* name, const std::string& text) {
    EXPECT_TRUE(write_file(path(name), std::as_bytes(std::span(text))));
  };
  write("hills.obj", obj);
  write("hills.mtl", "newmtl hills\nKd 1 1 1\nmap_Kd hills.png\n");
  EXPECT_TRUE(write_png(texture, path("hills.png")));
  EXPECT_TRUE(write_png(blots(96), path("print.png")));
  BakeRequest request;
  request.models.push_back({path("hills.obj"), ""});
  PatternRequest pattern;
  pattern.path = path("print.png");
  pattern.width_mm = 100;
  request.patterns.push_back(pattern);
  request.parameters = {"none"};
  request.loop.trial_views = 4;
  request.loop.score = false;
  SceneRequest scene;
  scene.pattern = "print";
  scene.model = "hills";
  request.scenes.push_back(scene);
  Report report;
  auto content = build_bundle(request, report);
  EXPECT_TRUE(content) << (content ? "" : to_line(content.error()));
  fs::remove_all(folder);
  content->summary.clear();
  return encode(*content);
}

/// The rules of both checkers that it breaks.
std::set<std::string> broken(const Bytes& bytes) {
  std::set<std::string> ids;
  const IssueSink sink = [&ids](const Issue& issue) { ids.insert(issue.kind->id); };
  if (!check_bundle(bytes, sink)) return ids;
  check_content(*BundleView::open(bytes), sink);
  return ids;
}

class Content : public testing::Test {
 protected:
  /// Expects that what `change` does to the bytes breaks this rule and no other.
  static void expect(const std::string& rule, const std::function<void(Bytes&)>& change) {
    Bytes bytes = good();
    change(bytes);
    rehash(bytes);
    EXPECT_EQ(broken(bytes), std::set<std::string>{rule});
  }
  static const Bytes& good() {
    static const Bytes bytes = bake_hills();
    return bytes;
  }
  /// A byte of the section.
  static std::byte& at(Bytes& bytes, SectionType type, std::size_t offset) {
    return bytes[static_cast<std::size_t>(entry_of(bytes, type).offset) + offset];
  }
};

TEST_F(Content, ABakedBundleKeepsEveryRule) {
  EXPECT_EQ(broken(good()), std::set<std::string>{});
}

TEST_F(Content, NamesWidthsAndScoresAreThoseOfTheMetaText) {
  expect("META_DIFFERS", [](Bytes& bytes) { at(bytes, SectionType::kNames, 0) = std::byte{'p'}; });
  expect("META_DIFFERS", [](Bytes& bytes) {
    record_of<PatternRecord>(bytes, SectionType::kPatterns).width_mm += 1;
  });
  expect("META_DIFFERS",
         [](Bytes& bytes) { record_of<PatternRecord>(bytes, SectionType::kPatterns).score = 50; });
}

TEST_F(Content, ASceneIsWhereTheMetaTextPutsIt) {
  const auto change = [](auto field) {
    // Its shadow is no longer its own, too.
    Bytes bytes = good();
    field(record_of<SceneRecord>(bytes, SectionType::kScenes));
    rehash(bytes);
    EXPECT_TRUE(broken(bytes).contains("META_DIFFERS"));
  };
  change([](SceneRecord& scene) { scene.scale *= 1.001f; });
  change([](SceneRecord& scene) { scene.offset[2] += 0.01f; });
  change([](SceneRecord& scene) {
    std::swap(scene.rotation[0], scene.rotation[3]);
    scene.rotation[0] = -scene.rotation[0];
  });
}

TEST_F(Content, MeshesAreInTheirOrderAndHaveTheirBoxes) {
  expect("CHUNK_CONTENT", [](Bytes& bytes) {  // two triangles change places
    std::byte* indices = &at(bytes, SectionType::kIndices, 0);
    std::swap_ranges(indices, indices + 6, indices + 6);
  });
  expect("CHUNK_CONTENT", [](Bytes& bytes) {  // a vertex moves a little, inside of the box
    at(bytes, SectionType::kVertices, 16 * 70) ^= std::byte{0x40};
  });
  expect("CHUNK_CONTENT", [](Bytes& bytes) {
    record_of<ChunkRecord>(bytes, SectionType::kChunks).cone_cutoff += 0.01f;
  });
  expect("CHUNK_CONTENT", [](Bytes& bytes) {
    record_of<ChunkRecord>(bytes, SectionType::kChunks).uv_offset[0] = 0.5f;
  });
}

TEST_F(Content, FiguresAreWhatRoundingCanGive) {
  const auto change = [](auto field) {
    expect("MODEL_FIGURES",
           [&](Bytes& bytes) { field(record_of<ModelRecord>(bytes, SectionType::kModels)); });
  };
  change([](ModelRecord& model) { model.position_error_max *= 10; });
  change([](ModelRecord& model) { model.normal_error_max_deg = 2; });
  change([](ModelRecord& model) { model.uv_error_max_texels = 1; });
  change([](ModelRecord& model) { --model.vertex_count; });
  change([](ModelRecord& model) { model.source_face_count |= std::uint64_t{1} << 40; });
  expect("NUMBER_TINY", [](Bytes& bytes) {
    record_of<MaterialRecord>(bytes, SectionType::kMaterials).emission[1] = 1e-40f;
  });
}

TEST_F(Content, MipLevelsAreHalves) {
  expect("TEXTURE_CONTENT", [](Bytes& bytes) {  // two blocks of level 0 change places
    std::byte* blocks = &at(bytes, SectionType::kTextureData, 0);
    std::swap_ranges(blocks, blocks + 8, blocks + 8 * 255);
  });
  expect("TEXTURE_CONTENT", [](Bytes& bytes) {
    record_of<TextureLevelRecord>(bytes, SectionType::kTextureLevels).psnr_db += 1;
  });
  expect("TEXTURE_CONTENT", [](Bytes& bytes) {
    record_of<TextureRecord>(bytes, SectionType::kTextures).source_width = 200;
  });
}

TEST_F(Content, ABlockOfAnotherColourIsFoundAmongBlocksThatAreAlike) {
  const Bytes flat = bake_hills(squares(64));
  ASSERT_EQ(broken(flat), std::set<std::string>{});
  for (std::size_t block = 0; block < 16 * 16; block += 15) {
    Bytes bytes = flat;
    at(bytes, SectionType::kTextureData, 8 * block) ^=
        std::byte{0x80};  // red of half of it, by 136
    rehash(bytes);
    EXPECT_EQ(broken(bytes), std::set<std::string>{"TEXTURE_CONTENT"}) << block;
  }
}

TEST_F(Content, PatternsAndShadowsFollowFromWhatIsStored) {
  TrackerRecordHeader header{};
  Bytes copy = good();
  std::memcpy(&header, &at(copy, SectionType::kTrackerRecord, 0), sizeof header);
  for (const std::uint64_t offset : {header.codes_offset + 3, header.features_offset + 8,
                                     header.patches_offset + 6, header.pixels_offset + 48 * 96}) {
    expect("PATTERN_CONTENT", [offset](Bytes& bytes) {
      at(bytes, SectionType::kTrackerRecord, static_cast<std::size_t>(offset)) ^= std::byte{8};
    });
  }
  expect("SCENE_CONTENT", [](Bytes& bytes) {
    at(bytes, SectionType::kShadow, sizeof(ShadowHeader) + 64 * 32 + 32) ^= std::byte{8};
  });
}

TEST_F(Content, TheSmallPictureAndItsColoursAreThoseOfTheRecord) {
  Bytes whole = good();
  const std::size_t middle = entry_of(whole, SectionType::kPatternPicture).size / 2;
  for (const std::size_t offset : {std::size_t{30}, middle}) {
    expect("PATTERN_CONTENT", [offset](Bytes& bytes) {
      at(bytes, SectionType::kPatternPicture, offset) ^= std::byte{0x55};
    });
  }
  // Moves a colour on the scale of the limit, 0.3, to which WebP adds at most 0.04 here.
  const auto moved = [](double by) {
    return [by](Bytes& bytes) {
      std::byte* place = &at(bytes, SectionType::kPatternColours, sizeof(ColourGridHeader) + 6 * 9);
      const double root = std::sqrt(load_number<std::uint16_t>(place) / 65535.0);
      const double other = root > 0.5 ? root - by : root + by;
      const auto code = static_cast<std::uint16_t>(std::lround(65535 * other * other));
      std::memcpy(place, &code, sizeof code);
    };
  };
  expect("PATTERN_CONTENT", moved(0.35));
  Bytes bytes = good();
  moved(0.25)(bytes);
  rehash(bytes);
  EXPECT_EQ(broken(bytes), std::set<std::string>{});
}

TEST_F(Content, BundlesOfOtherWritersAreNotLookedAt) {
  Bytes bytes = good();
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  bytes[text.find("\"modar ") + 2] = std::byte{'a'};
  record_of<PatternRecord>(bytes, SectionType::kPatterns).width_mm += 1;
  rehash(bytes);
  EXPECT_EQ(broken(bytes), std::set<std::string>{});
}

}  // namespace
