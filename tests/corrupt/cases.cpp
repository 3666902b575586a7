// Damage to the structure of a bundle.
#include "tests/corrupt/cases.hpp"

#include <limits>

namespace modar::test {
namespace {

FileHeader& header_of(Bytes& bytes) {
  return *reinterpret_cast<FileHeader*>(bytes.data());
}

/// A good bundle, damaged, with its hashes made true again.
template <class Damage>
Bytes damaged(const BundleContent& content, Damage damage) {
  Bytes bytes = encode(content);
  damage(bytes);
  rehash(bytes);
  return bytes;
}

/// The same with the hashes left unchanged.
template <class Damage>
Bytes broken(const BundleContent& content, Damage damage) {
  Bytes bytes = encode(content);
  damage(bytes);
  return bytes;
}

/// One scene on nothing else.
BundleContent scene_content() {
  BundleContent content = golden_content();
  content.extra.clear();
  return content;
}

constexpr CorruptCase kSectionCases[] = {
    {"BUNDLE_TRUNCATED", [] { return broken(pattern_content(), [](Bytes& b) { b.pop_back(); }); }},
    {"BUNDLE_MAGIC",
     [] { return broken(pattern_content(), [](Bytes& b) { header_of(b).magic[0] = 'M'; }); }},
    {"BUNDLE_VERSION",
     [] { return damaged(pattern_content(), [](Bytes& b) { header_of(b).major = 2; }); }},
    {"BUNDLE_FILE_SIZE",
     [] { return broken(pattern_content(), [](Bytes& b) { b.push_back(std::byte{0}); }); }},
    {"BUNDLE_HEADER",
     [] { return broken(pattern_content(), [](Bytes& b) { header_of(b).entry_size = 56; }); }},
    {"BUNDLE_HEADER_HASH",
     [] { return broken(pattern_content(), [](Bytes& b) { header_of(b).hash ^= 1; }); }},
    {"BUNDLE_SECTION_COUNT",
     [] {
       return broken(pattern_content(), [](Bytes& b) { header_of(b).section_count = 60000; });
     }},
    {"BUNDLE_SECTION_REQUIRED",
     [] {
       BundleContent content = pattern_content();
       content.extra.push_back({200, 1, kSectionRequired, kNone, 0, Bytes(4)});
       return encode(content);
     }},
    {"BUNDLE_SECTION_VERSION",
     [] {
       return damaged(pattern_content(),
                      [](Bytes& b) { entry_of(b, SectionType::kMeta).version = 2; });
     }},
    {"BUNDLE_SECTION_FLAGS",
     [] {
       return damaged(pattern_content(),
                      [](Bytes& b) { entry_of(b, SectionType::kMeta).flags = kSectionRequired; });
     }},
    {"BUNDLE_SECTION_ORDER",
     [] {
       return damaged(pattern_content(), [](Bytes& b) {
         entry_of(b, SectionType::kMeta).type = static_cast<std::uint32_t>(SectionType::kNames);
       });
     }},
    {"BUNDLE_SECTION_OWNER",
     [] {
       return damaged(pattern_content(),
                      [](Bytes& b) { entry_of(b, SectionType::kMappedFeatures).variant = 2; });
     }},
    {"BUNDLE_SECTION_ALIGNMENT",
     [] {
       return damaged(pattern_content(),
                      [](Bytes& b) { entry_of(b, SectionType::kMeta).offset += 8; });
     }},
    {"BUNDLE_SECTION_RANGE",
     [] {
       return damaged(pattern_content(), [](Bytes& b) {
         entry_of(b, SectionType::kMeta).size = std::uint64_t{1} << 40;
       });
     }},
    {"BUNDLE_TABLE_SHAPE",
     [] {
       return damaged(pattern_content(), [](Bytes& b) {
         const std::uint64_t offset = entry_of(b, SectionType::kPatterns).offset;
         reinterpret_cast<TableHeader*>(b.data() + offset)->count = 2;
       });
     }},
    {"BUNDLE_RESERVED",
     [] {
       return damaged(pattern_content(), [](Bytes& b) {
         record_of<PatternRecord>(b, SectionType::kPatterns).reserved[4] = 1;
       });
     }},
    {"BUNDLE_ENUM",
     [] {
       return damaged(pattern_content(), [](Bytes& b) {
         record_of<ParameterSetRecord>(b, SectionType::kParameterSets).detector = 9;
       });
     }},
    {"BUNDLE_NUMBER",
     [] {
       return damaged(pattern_content(), [](Bytes& b) {
         record_of<PatternRecord>(b, SectionType::kPatterns).width_mm =
             std::numeric_limits<double>::quiet_NaN();
       });
     }},
    {"BUNDLE_NAME",
     [] {
       return damaged(pattern_content(), [](Bytes& b) {
         record_of<PatternRecord>(b, SectionType::kPatterns).name.length = 1000;
       });
     }},
    {"BUNDLE_MODEL_RANGE",
     [] {
       return damaged(model_content(),
                      [](Bytes& b) { record_of<ModelRecord>(b, SectionType::kModels).layout = 7; });
     }},
    {"BUNDLE_CHUNK_RANGE",
     [] {
       return damaged(model_content(), [](Bytes& b) {
         record_of<ChunkRecord>(b, SectionType::kChunks, 1).bounds_min[1] = 2;
       });
     }},
    {"BUNDLE_PROXY",
     [] {
       BundleContent content = scene_content();
       add_proxies(content);
       return damaged(content, [](Bytes& b) {
         record_of<ProxyRecord>(b, SectionType::kProxies, 1).model = 3;
       });
     }},
    {"BUNDLE_CLIP",
     [] {
       BundleContent content = scene_content();
       add_clips(content);
       return damaged(content, [](Bytes& b) {
         record_of<JointRecord>(b, SectionType::kJoints, 1).parent = 1;
       });
     }},
    {"BUNDLE_LEVEL_RANGE",
     [] {
       return damaged(model_content(), [](Bytes& b) {
         record_of<LevelRecord>(b, SectionType::kLevels, 1).vertex_count = 60000;
       });
     }},
    {"BUNDLE_MATERIAL_RANGE",
     [] {
       return damaged(model_content(), [](Bytes& b) {
         record_of<MaterialRecord>(b, SectionType::kMaterials).texture = 3;
       });
     }},
    {"BUNDLE_LAYOUT",
     [] {
       return damaged(model_content(), [](Bytes& b) {
         record_of<LayoutRecord>(b, SectionType::kLayouts).attributes[1].offset = 4;
       });
     }},
    {"BUNDLE_TEXTURE_RANGE",
     [] {
       return damaged(texture_content(), [](Bytes& b) {
         record_of<TextureRecord>(b, SectionType::kTextures).level_count = 3;
       });
     }},
    {"BUNDLE_TEXTURE_LEVEL",
     [] {
       return damaged(texture_content(), [](Bytes& b) {
         record_of<TextureLevelRecord>(b, SectionType::kTextureLevels, 1).size = 16;
       });
     }},
    {"BUNDLE_PATTERN",
     [] {
       return damaged(pattern_content(), [](Bytes& b) {
         record_of<PatternRecord>(b, SectionType::kPatterns).half_width = 0.875f;
       });
     }},
    {"BUNDLE_PARAMETER_SET",
     [] {
       BundleContent content = pattern_content();
       content.features.clear();
       content.parameter_sets[1].id = content.parameter_sets[0].id;
       return encode(content);
     }},
    {"BUNDLE_FEATURES",
     [] {
       return damaged(pattern_content(), [](Bytes& b) {
         const std::uint64_t offset = entry_of(b, SectionType::kMappedFeatures).offset;
         reinterpret_cast<FeatureHeader*>(b.data() + offset)->count += 1;
       });
     }},
    {"BUNDLE_SCENE",
     [] {
       return damaged(scene_content(), [](Bytes& b) {
         record_of<SceneRecord>(b, SectionType::kScenes, 1).pattern = 2;
       });
     }},
    {"LIGHT_VALUES",
     [] {
       return damaged(lit_content(), [](Bytes& b) {
         record_of<LightRecord>(b, SectionType::kLights).sky[4] = -1.5f;
       });
     }},
    {"BUNDLE_NODE",
     [] {
       return damaged(acting_content(), [](Bytes& b) {
         record_of<NodeRecord>(b, SectionType::kNodes, 1).name =
             record_of<NodeRecord>(b, SectionType::kNodes, 0).name;
       });
     }},
    {"BUNDLE_ACTION",
     [] {
       return damaged(acting_content(), [](Bytes& b) {
         record_of<ActionRecord>(b, SectionType::kActions, 2).target = 3;
       });
     }},
    {"ACTION_LINK",
     [] {
       BundleContent content = acting_content();
       content.actions[4].address = content.intern("http://museum.org/pot");
       return encode(content);
     }},
};

}  // namespace

std::span<const CorruptCase> structure_cases() {
  return kSectionCases;
}

}  // namespace modar::test
