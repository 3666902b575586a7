// Rules on devices, against devices that are made for one breach each.
#include "bake/check/device/device_rules.hpp"

#include <gtest/gtest.h>

#include <set>
#include <string>
#include <vector>

#include "bake/check/verdict.hpp"
#include "tests/formats/support.hpp"

namespace {

using namespace modar;
using namespace modar::test;

/// Holds golden_content() with ease.
DeviceProfile roomy() {
  DeviceProfile device = *find_device_profile("desktop");
  device.name = "made";
  device.es_version = 20;
  device.extensions = " GL_OES_compressed_ETC1_RGB8_texture GL_OES_vertex_half_float ";
  return device;
}

std::vector<std::string> findings(const Bytes& bytes, const DeviceProfile& device) {
  std::vector<std::string> found;
  const auto view = BundleView::open(bytes);
  bool errors = false;
  const bool good = check_device(*view, device, [&](const Issue& issue) {
    errors = errors || issue.kind->severity == Severity::kError;
    EXPECT_LT(issue.offset, bytes.size());
    found.push_back(std::string(issue.kind->id) + " " + issue.where);
  });
  EXPECT_EQ(good, !errors);
  return found;
}

using Lines = std::vector<std::string>;

TEST(Device, ARoomyOneHoldsEverything) {
  EXPECT_EQ(findings(encode(golden_content()), roomy()), Lines());
}

TEST(Device, EachBreachIsNamedWithItsAsset) {
  const Bytes bytes = encode(golden_content());
  DeviceProfile device = roomy();
  device.max_texture_size = 4;  // the texture has 8 x 4 pixels
  EXPECT_EQ(findings(bytes, device), Lines{"DEVICE_TEXTURE_SIZE texture 'body.png'"});
  device = roomy();
  device.max_vertex_attributes = 2;  // all three layouts have 3
  EXPECT_EQ(findings(bytes, device),
            (Lines{"DEVICE_ATTRIBUTES model 'half'", "DEVICE_ATTRIBUTES model 'integer'",
                   "DEVICE_ATTRIBUTES model 'float'"}));
  device = roomy();
  device.max_vertex_uniform_vectors = 8;
  EXPECT_EQ(findings(bytes, device), Lines{"DEVICE_UNIFORMS shaders"});
  device = roomy();
  device.extensions = " GL_OES_compressed_ETC1_RGB8_texture ";
  EXPECT_EQ(findings(bytes, device), Lines{"DEVICE_HALF_FLOAT model 'half'"});
  device.extensions = " GL_OES_vertex_half_float ";
  EXPECT_EQ(findings(bytes, device), Lines{"DEVICE_ETC1 texture 'body.png'"});
  device.extensions = " ";
  device.es_version = 30;  // has both in its core
  EXPECT_EQ(findings(bytes, device), Lines());
}

TEST(Unseen, APatternThatNoViewOfItsScoreShowsIsNamed) {
  BundleContent content = pattern_content();
  const auto warnings = [&content](float score) {
    content.patterns[0].score = score;
    content.patterns[0].score_version = score < 0 ? 0 : 1;
    Lines found;
    check_whole(encode(content), nullptr,
                [&](const Issue& issue) { found.push_back(issue.kind->id + (" " + issue.where)); });
    return found;
  };
  EXPECT_EQ(warnings(-1), Lines());
  EXPECT_EQ(warnings(3), Lines());
  const Lines found = warnings(0);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_TRUE(found[0].starts_with("PATTERN_UNSEEN pattern '")) << found[0];
}

TEST(Device, MemoryIsHeldAgainstWhatTheBundleTakes) {
  BundleContent content = texture_content();
  content.texture_data[0].resize(3u << 20);
  const Bytes bytes = encode(content);
  DeviceProfile device = roomy();
  device.gpu_memory_mib = 3;
  EXPECT_EQ(findings(bytes, device), Lines());
  device.gpu_memory_mib = 2;
  ASSERT_EQ(findings(bytes, device).size(), 1u);
  EXPECT_TRUE(
      findings(bytes, device)[0].starts_with("DEVICE_GPU_DETAIL texture 'body.png' with 31"));
  // Without ETC1 the same blocks take six times the room.
  device.extensions = " ";
  device.gpu_memory_mib = 17;
  EXPECT_EQ(findings(bytes, device).size(), 2u);
  device.gpu_memory_mib = 18;
  EXPECT_EQ(findings(bytes, device).size(), 1u);
  device = roomy();
  device.ram_mib = 6;
  EXPECT_TRUE(findings(bytes, device).at(0).starts_with("DEVICE_RAM "));
  device = roomy();
  device.storage_mib = 6;
  EXPECT_TRUE(findings(bytes, device).at(0).starts_with("DEVICE_STORAGE "));
}

/// As the renderer does: it leaves out large mip levels and fine levels of chunks, never the last.
TEST(Device, MemoryThatHoldsTheCoarsestLevelsIsEnough) {
  BundleContent content = model_content();  // two chunks, one of them with two levels
  content.vertices.resize(5u << 20);
  DeviceProfile device = roomy();
  device.gpu_memory_mib = 4;
  ASSERT_EQ(findings(encode(content), device).size(), 1u);
  EXPECT_TRUE(findings(encode(content), device)[0].starts_with("DEVICE_GPU_DETAIL "));
  content.layouts[0].stride = 240;
  content.vertices.resize(std::size_t{66000} * 240);
  for (LevelRecord& level : content.levels) level.vertex_count = 65000;
  EXPECT_TRUE(findings(encode(content), device)[0].starts_with("DEVICE_GPU_MEMORY "));
}

/// The renderer reserves half for textures: what then is missing of the coarsest level is not
/// drawn.
TEST(Device, TexturesTakeTheirHalfFromTheCoarsestLevels) {
  BundleContent content = texture_content();
  content.texture_data[0].resize(3u << 20);
  BundleContent model = model_content();
  model.textures = content.textures;
  model.texture_levels = content.texture_levels;
  model.texture_data = content.texture_data;
  model.layouts[0].stride = 240;
  model.vertices.resize(std::size_t{12000} * 240);
  for (LevelRecord& level : model.levels) level.vertex_count = 5000;  // two chunks: 2.4 MB
  DeviceProfile device = roomy();
  device.gpu_memory_mib = 4;  // 2 of them are for geometry
  EXPECT_TRUE(findings(encode(model), device).at(0).starts_with("DEVICE_GPU_MEMORY "));
  device.gpu_memory_mib = 5;
  EXPECT_TRUE(findings(encode(model), device).at(0).starts_with("DEVICE_GPU_DETAIL "));
}

TEST(Verdict, CountsAllButListsTwentyOfAKind) {
  Verdict verdict;
  const IssueKind& kind = workstation_issue_kind(WorkstationRule::kDeviceGpuDetail);
  for (int i = 0; i < 50; ++i) verdict.add({&kind, "texture", 0, ""});
  EXPECT_TRUE(verdict.good());
  EXPECT_EQ(verdict.warnings(), 50u);
  EXPECT_EQ(verdict.issues().size(), 20u);
  EXPECT_EQ(verdict.left_out().at("DEVICE_GPU_DETAIL"), 30u);
  Verdict strict;
  strict.set_warnings_as_errors();
  strict.add({&kind, "texture", 0, ""});
  EXPECT_FALSE(strict.good());
  Verdict deaf;
  ASSERT_TRUE(deaf.override_severity("DEVICE_GPU_DETAIL=ignore"));
  deaf.add({&kind, "texture", 0, ""});
  EXPECT_TRUE(deaf.issues().empty());
}

TEST(Verdict, IdsOfAllKindsDiffer) {
  std::set<std::string> ids;
  for (const IssueKind* kind : all_issue_kinds()) {
    EXPECT_TRUE(ids.insert(kind->id).second) << kind->id;
    EXPECT_NE(std::string(kind->message), "");
    EXPECT_NE(std::string(kind->cure), "");
  }
}

}  // namespace
