// Damage to payloads of bundles that open.
#include <cstring>

#include "formats/content_summary.hpp"
#include "formats/tracker_record.hpp"
#include "tests/corrupt/cases.hpp"

namespace modar::test {
namespace {

Bytes vertex_damage(std::size_t at, std::byte low, std::byte high) {
  BundleContent content = model_content();
  content.vertices[at] = low;
  content.vertices[at + 1] = high;
  return encode(content);
}

/// A single level of 6 x 4 pixels that repeats.
BundleContent odd_texture() {
  BundleContent content = texture_content();
  content.textures[0].width = 6;
  content.textures[0].level_count = 1;
  content.texture_levels.resize(1);
  content.texture_levels[0].width = 6;
  content.texture_data[0].resize(32);
  return content;
}

template <class Damage>
Bytes changed(BundleContent content, Damage damage) {
  damage(content);
  return encode(content);
}

KeypointRecord& keypoint(BundleContent& content) {
  return content.features[0][0].keypoints[3];
}

constexpr CorruptCase kPayloadCases[] = {
    {"BUNDLE_MINOR",
     [] {
       Bytes bytes = encode(lit_content());
       reinterpret_cast<FileHeader*>(bytes.data())->minor = 1;
       rehash(bytes);
       return bytes;
     }},
    {"SECTION_HASH",
     [] {
       Bytes bytes = encode(pattern_content());
       bytes[entry_of(bytes, SectionType::kMeta).offset] ^= std::byte{1};
       return bytes;
     }},
    {"SECTION_PADDING",
     [] {
       Bytes bytes = encode(pattern_content());
       bytes[entry_of(bytes, SectionType::kMeta).offset - 1] = std::byte{1};
       return bytes;
     }},
    {"META_TEXT",
     [] {
       return changed(pattern_content(), [](auto& c) {
         c.meta = R"({"texts":[{"pattern":"cover","text":{"en":1890}}]})";
       });
     }},
    {"MODEL_PLACEMENT",
     [] { return changed(model_content(), [](auto& c) { c.models[0].diagonal = 1; }); }},
    {"MODEL_COUNTS",
     [] { return changed(model_content(), [](auto& c) { c.models[0].triangle_count = 7; }); }},
    {"MODEL_ERRORS",
     [] { return changed(model_content(), [](auto& c) { c.models[0].position_error_rms = 1; }); }},
    {"CHUNK_BOUNDS",
     [] { return changed(model_content(), [](auto& c) { c.chunks[0].bounds_max[0] = 0.5f; }); }},
    {"CHUNK_LOOSE",
     [] {
       return changed(model_content(), [](auto& c) { c.chunks[1].bounds_min[2] = -1.0005f; });
     }},
    {"CHUNK_OUTSIDE",
     [] { return changed(model_content(), [](auto& c) { c.chunks[1].bounds_max[0] = 1.5f; }); }},
    {"CHUNK_CONE",
     [] { return changed(model_content(), [](auto& c) { c.chunks[0].cone_axis[2] = 0.5f; }); }},
    {"CHUNK_GRID",
     [] {
       return changed(model_content(), [](auto& c) {
         // Halves read as integers: 1 becomes 15360, -1 becomes -17408.
         c.layouts[0].attributes[0].type = static_cast<std::uint8_t>(ComponentType::kI16);
         for (ChunkRecord& chunk : c.chunks) {
           chunk.position_step = 0x1p-15f;
           for (int i = 0; i < 3; ++i) {
             chunk.bounds_min[i] = chunk.bounds_min[i] < 0 ? -17408 * 0x1p-15f : 0;
             chunk.bounds_max[i] = chunk.bounds_max[i] > 0 ? 15360 * 0x1p-15f : 0;
           }
         }
         c.chunks[1].position_offset[0] = 0x1p-17f;
         c.chunks[1].bounds_min[0] += 0x1p-17f;
         c.chunks[1].bounds_max[0] += 0x1p-17f;
       });
     }},
    {"LEVEL_ORDER",
     [] { return changed(model_content(), [](auto& c) { c.levels[0].error = 0.125f; }); }},
    {"LEVEL_INDEX",
     [] { return changed(model_content(), [](auto& c) { c.indices[4] = std::byte{6}; }); }},
    {"VERTEX_NOT_FINITE", [] { return vertex_damage(0, std::byte{0}, std::byte{0x7C}); }},
    {"VERTEX_NORMAL", [] { return vertex_damage(8, std::byte{0}, std::byte{0}); }},
    {"MATERIAL_VALUES",
     [] { return changed(model_content(), [](auto& c) { c.materials[0].opacity = 2; }); }},
    {"TEXTURE_SIDES", [] { return encode(odd_texture()); }},
    {"TEXTURE_OVERLAP",
     [] {
       return changed(texture_content(), [](auto& c) {
         c.texture_levels[1].alpha_offset = c.texture_levels[1].offset;
       });
     }},
    {"TEXTURE_UNREFERENCED",
     [] { return changed(texture_content(), [](auto& c) { c.texture_data[0].resize(96); }); }},
    {"PARAMETER_VALUES",
     [] {
       return changed(pattern_content(), [](auto& c) { c.parameter_sets[0].level_count = 0; });
     }},
    {"KEYPOINT_OUTSIDE",
     [] { return changed(pattern_content(), [](auto& c) { keypoint(c).x = 64.5f; }); }},
    {"KEYPOINT_VALUES",
     [] { return changed(pattern_content(), [](auto& c) { keypoint(c).size = 0; }); }},
    {"DESCRIPTOR_LENGTH",
     [] {
       return changed(pattern_content(), [](auto& c) {
         c.parameter_sets[0].descriptor_bits = 128;
         c.features[0][0].descriptor_bytes = 16;
         c.features[0][0].descriptors.resize(9 * 16);
       });
     }},
    {"PATTERN_WITHOUT_FEATURES",
     [] {
       return changed(pattern_content(), [](auto& c) {
         for (FeatureContent& features : c.features[0]) {
           features.keypoints.resize(3);
           features.descriptors.resize(3 * features.descriptor_bytes);
           features.yml.clear();
         }
       });
     }},
    {"LOOP_RECORD",
     [] {
       return changed(pattern_content(), [](auto& c) {
         // Two patches, the second of a finer level than the first.
         TrackerRecordHeader header{};
         header.describer_version = 1;
         header.patch_count = 2;
         header.width = 64;
         header.height = 48;
         header.level_count = 2;
         header.codes_offset = header.features_offset = header.patches_offset = sizeof header;
         header.pixels_offset = sizeof header + 2 * sizeof(TrackerPatchRecord);
         const TrackerPatchRecord patches[2] = {{640, 640, 1, 0}, {640, 640, 0, 0}};
         ExtraSection section;
         section.type = static_cast<std::uint32_t>(SectionType::kTrackerRecord);
         section.owner = 0;
         section.bytes.resize(header.pixels_offset + 64 * 48);
         std::memcpy(section.bytes.data(), &header, sizeof header);
         std::memcpy(section.bytes.data() + sizeof header, patches, sizeof patches);
         c.extra.push_back(section);
       });
     }},
    {"FEATURE_TEXT",
     [] {
       return changed(pattern_content(), [](auto& c) { c.features[0][1].yml = "keypoints: 9\n"; });
     }},
    {"STATEMENT_DIFFERS",
     [] {
       return changed(model_content(), [](auto& c) {
         c.summary = content_summary_of(c);
         c.materials[0].diffuse[1] = 0.25f;
       });
     }},
    {"MEDIA_FILE",
     [] {
       return changed(acting_content(),
                      [](auto& c) { c.media_data[0] = small_mp4(640, 360, 12, false); });
     }},
    {"CAPTIONS",
     [] {
       return changed(acting_content(),
                      [](auto& c) { c.meta.replace(c.meta.find("00:02.000"), 9, "00:00.400"); });
     }},
    {"VERTEX_OCCLUSION",
     [] { return changed(lit_content(), [](auto& c) { c.vertices[11] = std::byte{128}; }); }},
    {"VERTEX_BONES",
     [] { return changed(skinned_content(), [](auto& c) { c.vertices[20] = std::byte{7}; }); }},
    {"VERTEX_PADDING", [] { return vertex_damage(6, std::byte{1}, std::byte{0}); }},
    {"PATTERN_YML_DIFFERS",
     [] {
       return changed(pattern_content(), [](auto& c) {
         std::string& yml = c.features[0][0].yml;
         yml.replace(yml.find("22.5"), 4, "23.5");
       });
     }},
    {"VERTICES_UNREFERENCED",
     [] { return changed(model_content(), [](auto& c) { c.vertices.resize(6 * 16 + 32); }); }},
    {"INDICES_UNREFERENCED",
     [] { return changed(model_content(), [](auto& c) { c.indices.resize(30 * 2 + 6); }); }},
    {"TRIANGLE_DEGENERATE",
     [] { return changed(model_content(), [](auto& c) { c.indices[0] = c.indices[2]; }); }},
    {"LEVEL_EMPTY",
     [] {
       return changed(model_content(), [](auto& c) {
         c.levels[2].index_count = 0;
         c.indices.resize(18 * 2);
         c.models[0].triangle_count = 4;
       });
     }},
    {"BUNDLE_EMPTY", [] { return encode(BundleContent()); }},
    {"NEVER_SHOWN", [] { return changed(golden_content(), [](auto& c) { c.scenes.pop_back(); }); }},
    {"NODE_TEXT",
     [] {
       return changed(acting_content(), [](auto& c) {
         c.nodes[0] = c.nodes[2];  // a second label
         c.nodes[0].name = c.intern("foot");
         c.nodes[0].group = 4;
         c.actions.resize(1);
       });
     }},
    {"CAPTIONS_MISSING",
     [] {
       return changed(acting_content(),
                      [](auto& c) { c.meta.replace(c.meta.find("captions"), 8, "alt"); });
     }},
    {"MEDIA_FLASHES",
     [] { return changed(acting_content(), [](auto& c) { c.media[0].flags |= kMediaFlashes; }); }},
    {"SECTION_UNKNOWN",
     [] {
       return changed(pattern_content(), [](auto& c) {
         c.extra.push_back({100, 1, 0, kNone, 0, Bytes(4)});
       });
     }},
};

}  // namespace

std::span<const CorruptCase> payload_cases() {
  return kPayloadCases;
}

}  // namespace modar::test
