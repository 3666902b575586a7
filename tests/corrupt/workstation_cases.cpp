// Bundles that are good by their bytes, and bad for a device or next to a source.
#include <algorithm>
#include <cstring>

#include "formats/tracker_record.hpp"
#include "tests/corrupt/cases.hpp"

namespace modar::test {
namespace {

/// A texture of one level, without alpha; nothing repeats.
BundleContent picture(std::uint32_t width, std::uint32_t height) {
  BundleContent content = texture_content();
  TextureRecord& texture = content.textures[0];
  texture.width = width;
  texture.height = height;
  texture.flags = 0;
  texture.level_count = 1;
  content.texture_levels.resize(1);
  TextureLevelRecord& level = content.texture_levels[0];
  level.width = width;
  level.height = height;
  level.size = width / 4 * (height / 4) * 8;
  level.alpha_offset = kNoOffset;
  content.texture_data[0].assign(level.size, std::byte{0});
  return content;
}

/// The same with all mip levels.
BundleContent picture_with_mips(std::uint32_t width, std::uint32_t height) {
  BundleContent content = picture(width, height);
  TextureLevelRecord level = content.texture_levels[0];
  while (level.width > 1 || level.height > 1) {
    level.offset += level.size;
    level.width = std::max(1u, level.width / 2);
    level.height = std::max(1u, level.height / 2);
    level.size = (level.width + 3) / 4 * ((level.height + 3) / 4) * 8;
    content.texture_levels.push_back(level);
  }
  content.textures[0].level_count = static_cast<std::uint32_t>(content.texture_levels.size());
  content.texture_data[0].assign(level.offset + level.size, std::byte{0});
  return content;
}

/// The octahedron with the material that an OBJ without one gets.
Bytes plain_octahedron() {
  BundleContent content = model_content();
  MaterialRecord& material = content.materials[0];
  std::fill_n(material.ambient, 3, 0.2f);
  std::fill_n(material.diffuse, 3, 229.0f / 255.0f);
  std::fill_n(material.specular, 3, 0.0f);
  material.shininess = 0;
  material.flags = 0;
  return encode(content);
}

/// A tracker record without features, of an image of zeros.
ExtraSection empty_record(std::uint32_t width, std::uint32_t height) {
  TrackerRecordHeader header{};
  header.describer_version = kTrackerExtractorVersion;
  header.width = width;
  header.height = height;
  header.level_count = 1;
  header.features_offset = header.codes_offset = header.patches_offset = header.pixels_offset =
      sizeof header;
  ExtraSection section;
  section.type = static_cast<std::uint32_t>(SectionType::kTrackerRecord);
  section.owner = 0;
  section.bytes.resize(sizeof header + std::size_t{width} * height);
  std::memcpy(section.bytes.data(), &header, sizeof header);
  return section;
}

/// The octahedron on the pattern, a tenth larger than the bundle says that it was requested.
Bytes scaled_scene() {
  BundleContent content = model_content();
  const BundleContent pattern = pattern_content();
  content.patterns = pattern.patterns;
  content.patterns[0].name = content.intern("box");
  content.extra.push_back(empty_record(pattern.patterns[0].width, pattern.patterns[0].height));
  content.meta = R"({"scenes":[{"pattern":"box","model":"octahedron","scale":1,"up":2}]})";
  SceneRecord scene{};
  scene.scale = 1.1f;
  scene.offset[2] = 1.1f;
  scene.rotation[3] = 1;
  content.scenes.push_back(scene);
  return encode(content);
}

/// A content as if `modar bake` had made it, with these assets in its meta text.
Bytes baked(BundleContent content, const std::string& assets) {
  content.meta = "{\"tool\":\"modar 0\"," + assets + "}";
  return encode(content);
}

/// The octahedron, changed. Its chunks are in an order of their own.
Bytes baked_model(void (*change)(BundleContent&)) {
  BundleContent content = model_content();
  change(content);
  return baked(content, R"("models":[{"file":"octahedron.obj"}])");
}

/// The pattern with a record of a picture that gives none.
BundleContent recorded_pattern() {
  BundleContent content = pattern_content();
  content.extra.push_back(empty_record(content.patterns[0].width, content.patterns[0].height));
  return content;
}

constexpr CorruptCase kWorkstationCases[] = {
    {"DEVICE_TEXTURE_SIZE", [] { return encode(picture(64, 8)); }},
    {"DEVICE_ATTRIBUTES", [] { return encode(model_content()); }},
    {"DEVICE_UNIFORMS", [] { return encode(model_content()); }},
    // 256 KiB of blocks are six times as much once they are decoded.
    {"DEVICE_GPU_MEMORY", [] { return encode(picture(1024, 512)); }},
    {"DEVICE_GPU_DETAIL", [] { return encode(picture_with_mips(1024, 512)); }},
    // Half of the least memory, and a header.
    {"DEVICE_RAM", [] { return encode(picture(1024, 1024)); }},
    {"DEVICE_STORAGE", [] { return encode(picture(1024, 1024)); }},
    {"DEVICE_HALF_FLOAT", [] { return encode(model_content()); }},
    {"DEVICE_ETC1", [] { return encode(texture_content()); }},
    {"SOURCE_MISSING", [] { return encode(model_content()); }},
    {"SOURCE_BYTES", plain_octahedron},
    {"SOURCE_READER", plain_octahedron},
    {"SOURCE_SURFACE", [] { return encode(model_content()); }},
    {"SOURCE_COLOUR", [] { return encode(texture_content()); }},
    {"SOURCE_COUNTS", [] { return encode(model_content()); }},
    {"SOURCE_PATTERN",
     [] {
       BundleContent content = pattern_content();
       content.extra.push_back(empty_record(content.patterns[0].width, content.patterns[0].height));
       return encode(content);
     }},
    {"SOURCE_SCENE", scaled_scene},
    {"POSE_RANGE", [] { return encode(pattern_content()); }},
    {"VISUAL_DIFFERS", [] { return encode(model_content()); }},
    {"META_DIFFERS", [] { return baked(model_content(), R"("models":[{"file":"cube.obj"}])"); }},
    {"RECORD_UNUSED",
     [] { return baked_model([](BundleContent& content) { content.names += "left over"; }); }},
    {"NUMBER_TINY",
     [] {
       return baked_model([](BundleContent& content) { content.materials[0].shininess = 1e-40f; });
     }},
    {"MODEL_FIGURES",
     [] { return baked_model([](BundleContent& content) { --content.models[0].vertex_count; }); }},
    {"CHUNK_CONTENT", [] { return baked_model([](BundleContent&) {}); }},
    {"TEXTURE_CONTENT",
     [] {
       BundleContent content = texture_content();
       content.textures[0].psnr_db += 1;
       return baked(content, R"("models":[])");
     }},
    {"PATTERN_CONTENT", [] { return baked(recorded_pattern(), R"("patterns":[{"file":"box"}])"); }},
    {"SCENE_CONTENT",
     [] {
       BundleContent content = recorded_pattern();
       const BundleContent model = model_content();
       content.models = model.models;
       content.chunks = model.chunks;
       content.levels = model.levels;
       content.materials = model.materials;
       content.layouts = model.layouts;
       content.vertices = model.vertices;
       content.indices = model.indices;
       content.models[0].name = content.materials[0].name = content.intern("octahedron");
       SceneRecord scene{};
       scene.scale = 1;
       scene.rotation[3] = 1;
       content.scenes.push_back(scene);
       content.shadows = {std::vector<std::byte>(sizeof(ShadowHeader) + 1)};
       const ShadowHeader header{1, 1, {-1, -1}, {1, 1}, {}};
       std::memcpy(content.shadows[0].data(), &header, sizeof header);
       return baked(content, R"("models":[{"file":"octahedron"}],"patterns":[{"file":"box"}])");
     }},
};

}  // namespace

std::span<const CorruptCase> workstation_cases() {
  return kWorkstationCases;
}

}  // namespace modar::test
