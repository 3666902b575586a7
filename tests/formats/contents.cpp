// Small bundles to test on: all numbers in them are exact, so their bytes are the same everywhere.
#include "tests/formats/support.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <string>
#include <utility>

#include "formats/colour_grid.hpp"
#include "formats/draw_order.hpp"
#include "formats/pattern_shape.hpp"
#include "formats/quantise.hpp"

namespace modar::test {
namespace {

constexpr std::array<std::array<float, 3>, 6> kCorners = {
    {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}}};
constexpr std::array<std::uint16_t, 12> kUpper = {0, 2, 4, 2, 1, 4, 1, 3, 4, 3, 0, 4};
constexpr std::array<std::uint16_t, 12> kLower = {2, 0, 5, 1, 2, 5, 3, 1, 5, 0, 3, 5};

template <class T>
void put(std::vector<std::byte>& out, T value) {
  const auto* bytes = reinterpret_cast<const std::byte*>(&value);
  out.insert(out.end(), bytes, bytes + sizeof(T));
}

AttributeRecord attribute(Semantic semantic, ComponentType type, std::uint8_t components,
                          std::uint16_t offset, bool normalised) {
  return {static_cast<std::uint8_t>(semantic),
          static_cast<std::uint8_t>(type),
          components,
          static_cast<std::uint8_t>(normalised ? 1 : 0),
          offset,
          0};
}

/// Half positions, 8-bit normals, 16-bit uvs.
LayoutRecord half_layout() {
  LayoutRecord layout{};
  layout.stride = 16;
  layout.attribute_count = 3;
  layout.attributes[0] = attribute(Semantic::kPosition, ComponentType::kHalf, 3, 0, false);
  layout.attributes[1] = attribute(Semantic::kNormal, ComponentType::kI8, 3, 8, true);
  layout.attributes[2] = attribute(Semantic::kUv, ComponentType::kU16, 2, 12, true);
  return layout;
}

/// 16-bit integer positions, octahedral normals, colours.
LayoutRecord integer_layout() {
  LayoutRecord layout{};
  layout.stride = 12;
  layout.attribute_count = 3;
  layout.attributes[0] = attribute(Semantic::kPosition, ComponentType::kI16, 3, 0, false);
  layout.attributes[1] = attribute(Semantic::kNormalOct, ComponentType::kI8, 2, 6, true);
  layout.attributes[2] = attribute(Semantic::kColour, ComponentType::kU8, 4, 8, true);
  return layout;
}

LayoutRecord float_layout() {
  LayoutRecord layout{};
  layout.stride = 32;
  layout.attribute_count = 3;
  layout.attributes[0] = attribute(Semantic::kPosition, ComponentType::kF32, 3, 0, false);
  layout.attributes[1] = attribute(Semantic::kNormal, ComponentType::kF32, 3, 12, false);
  layout.attributes[2] = attribute(Semantic::kUv, ComponentType::kF32, 2, 24, false);
  return layout;
}

void put_vertex(std::vector<std::byte>& out, const LayoutRecord& layout,
                const std::array<float, 3>& p) {
  switch (layout.stride) {
    case 16:
      for (const float v : p) put(out, float_to_half(v));
      put(out, std::uint16_t{0});
      for (const float v : p) put(out, float_to_snorm8(v));
      put(out, std::uint8_t{0});
      put(out, float_to_unorm16((p[0] + 1) / 2));
      put(out, float_to_unorm16((p[1] + 1) / 2));
      break;
    case 12:
      for (const float v : p) put(out, static_cast<std::int16_t>(v * 16384.0f));
      // The octahedral square: the lower tip is in its corners.
      put(out, float_to_snorm8(p[2] < 0 ? 1.0f : p[0]));
      put(out, float_to_snorm8(p[2] < 0 ? 1.0f : p[1]));
      for (const float v : p) put(out, float_to_unorm8((v + 1) / 2));
      put(out, std::uint8_t{255});
      break;
    default:
      for (const float v : p) put(out, v);
      for (const float v : p) put(out, v);
      put(out, p[0]);
      put(out, p[1]);
  }
}

ChunkRecord chunk_of(const BundleContent& content, std::uint32_t material, bool upper, float step) {
  ChunkRecord chunk{};
  for (int axis = 0; axis < 3; ++axis) {
    chunk.bounds_min[axis] = -1;
    chunk.bounds_max[axis] = 1;
  }
  (upper ? chunk.bounds_min : chunk.bounds_max)[2] = 0;
  chunk.cone_cutoff = 2;
  if (upper) {
    chunk.cone_axis[2] = 1;
    chunk.cone_cutoff = 0.875f;
  }
  chunk.position_step = step;
  chunk.uv_scale[0] = chunk.uv_scale[1] = 1;
  chunk.material = material;
  chunk.first_level = static_cast<std::uint32_t>(content.levels.size());
  chunk.level_count = upper ? 2 : 1;
  return chunk;
}

void add_level(BundleContent& content, std::uint64_t vertex_offset,
               std::span<const std::uint16_t> indices, float error) {
  LevelRecord level{};
  level.vertex_offset = vertex_offset;
  level.index_offset = content.indices.size();
  level.vertex_count = 6;
  level.index_count = static_cast<std::uint32_t>(indices.size());
  level.error = error;
  content.levels.push_back(level);
  for (const std::uint16_t index : indices) put(content.indices, index);
}

/// An octahedron; both its chunks use the same six vertices.
void add_octahedron(BundleContent& content, const char* name, const LayoutRecord& layout,
                    std::uint32_t material) {
  ModelRecord model{};
  model.name = content.intern(name);
  model.center[0] = 500000.25;
  model.center[2] = -7.5;
  model.scale = 4;
  model.diagonal = 13.856406460551018;
  model.unit_metres = 0.001;
  model.position_error_max = 0.0001220703125;
  model.position_error_rms = 0.00006103515625;
  model.normal_error_max_deg = 0.375f;
  model.normal_error_rms_deg = 0.1875f;
  model.uv_error_max_texels = 0.03125f;
  model.uv_error_rms_texels = 0.015625f;
  model.vertex_count = 12;
  model.triangle_count = 8;
  model.source_vertex_count = 6;
  model.source_face_count = 8;
  model.layout = static_cast<std::uint32_t>(content.layouts.size());
  model.first_chunk = static_cast<std::uint32_t>(content.chunks.size());
  model.chunk_count = 2;
  model.first_material = 0;
  model.material_count = static_cast<std::uint32_t>(content.materials.size());
  model.level_count = 2;
  content.layouts.push_back(layout);
  content.models.push_back(model);

  const std::uint64_t first_vertex = content.vertices.size();
  for (const auto& corner : kCorners) put_vertex(content.vertices, layout, corner);
  const float step = layout.stride == 12 ? 0x1p-14f : 1.0f;
  content.chunks.push_back(chunk_of(content, material, true, step));
  add_level(content, first_vertex, kUpper, 0);
  add_level(content, first_vertex, std::span(kUpper).first(6), 0.25f);
  content.chunks.push_back(chunk_of(content, material, false, step));
  add_level(content, first_vertex, kLower, 0);
}

void add_material(BundleContent& content, const char* name, std::uint32_t texture) {
  MaterialRecord material{};
  material.name = content.intern(name);
  for (int i = 0; i < 3; ++i) {
    material.ambient[i] = 0.25f;
    material.diffuse[i] = 0.75f;
    material.specular[i] = 0.5f;
  }
  material.shininess = 16;
  material.opacity = 1;
  material.texture = texture;
  material.flags = texture == kNone ? kMaterialTwoSided : 0u;
  content.materials.push_back(material);
}

/// 8 x 4 pixels, four levels, alpha twins. Any 8 bytes are an ETC1 block.
void add_texture(BundleContent& content) {
  TextureRecord texture{};
  texture.name = content.intern("body.png");
  texture.width = 8;
  texture.height = 4;
  texture.source_width = 1000;
  texture.source_height = 500;
  texture.format = static_cast<std::uint32_t>(TextureFormat::kEtc1Rgb);
  texture.flags = kTextureAlpha | kTextureRepeat;
  texture.level_count = 4;
  texture.psnr_db = 36.5f;
  texture.ssim = 0.96875f;
  content.textures.push_back(texture);
  std::vector<std::byte> data;
  for (std::uint32_t level = 0; level < 4; ++level) {
    TextureLevelRecord record{};
    record.width = std::max(8u >> level, 1u);
    record.height = std::max(4u >> level, 1u);
    record.size = level == 0 ? 16 : 8;
    record.offset = data.size();
    record.alpha_offset = data.size() + record.size;
    record.psnr_db = 36;
    record.ssim = 0.9375f;
    content.texture_levels.push_back(record);
    for (std::uint32_t i = 0; i < 2 * record.size; ++i) {
      put(data, static_cast<std::uint8_t>(data.size() * 37 + level));
    }
  }
  content.texture_data.push_back(std::move(data));
}

ParameterSetRecord parameter_set(BundleContent& content, const char* name, std::uint32_t id,
                                 Detector detector) {
  const bool orb = detector == Detector::kFastOrb;
  ParameterSetRecord set{};
  set.name = content.intern(name);
  set.id = id;
  set.detector = static_cast<std::uint32_t>(detector);
  if (orb) {
    set.max_features = 2000;
    set.scale_factor = 1.25f;
    set.level_count = 8;
    set.edge_threshold = 31;
    set.wta_k = 2;
    set.harris = 1;
    set.patch_size = 31;
    set.fast_threshold = 20;
  } else {
    set.agast_threshold = 30;
    set.octaves = 3;
    set.pattern_scale = 1;
  }
  set.descriptor_bits = orb ? 256 : 512;
  set.max_distance = orb ? 85 : 170;
  set.min_matches = 8;
  set.min_inliers = 8;
  set.ransac_threshold = 3;
  return set;
}

/// What OpenCV's FileStorage writes of the same, in the least that it reads.
std::string feature_text(const FeatureContent& features) {
  std::string text = "%YAML:1.0\n---\nkeypoints:\n";
  for (const KeypointRecord& k : features.keypoints) {
    text += "   - [ ";
    for (const float value : {k.x, k.y, k.size, k.angle, k.response}) {
      std::array<char, 32> digits{};
      const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), value,
                                     std::chars_format::fixed);
      const std::string number(digits.data(), end.ptr);
      text += number + (number.find('.') == std::string::npos ? "., " : ", ");
    }
    text += std::to_string(k.octave) + ", " + std::to_string(k.class_id) + " ]\n";
  }
  text += "descriptors: !!opencv-matrix\n   rows: " + std::to_string(features.keypoints.size()) +
          "\n   cols: " + std::to_string(features.descriptor_bytes) + "\n   dt: u\n   data: [";
  for (std::size_t i = 0; i < features.descriptors.size(); ++i) {
    text += (i == 0 ? " " : (i % 16 == 0 ? ",\n       " : ", ")) +
            std::to_string(static_cast<unsigned>(features.descriptors[i]));
  }
  return text + " ]\n";
}

FeatureContent features_of(const ParameterSetRecord& set, std::uint32_t count) {
  FeatureContent features;
  features.set_id = set.id;
  features.descriptor_bytes = set.descriptor_bits / 8;
  for (std::uint32_t i = 0; i < count; ++i) {
    const auto at = static_cast<float>(i);
    features.keypoints.push_back(
        {4 + at * 1.5f, 8 + at, 31, 22.5f * at, 0.0078125f, static_cast<std::int32_t>(i % 3), -1});
  }
  for (std::uint32_t i = 0; i < count * features.descriptor_bytes; ++i) {
    put(features.descriptors, static_cast<std::uint8_t>(i * 73 + set.id));
  }
  features.yml = feature_text(features);
  return features;
}

void add_pattern(BundleContent& content, const char* name, std::uint32_t width,
                 std::uint32_t height, std::uint32_t features) {
  PatternRecord pattern{};
  pattern.name = content.intern(name);
  pattern.width = width;
  pattern.height = height;
  pattern.width_mm = 210;
  const auto side = static_cast<float>(width > height ? width : height);
  pattern.half_width = static_cast<float>(width) / side;
  pattern.half_height = static_cast<float>(height) / side;
  pattern.score = -1;
  content.patterns.push_back(pattern);
  content.features.emplace_back();
  for (const ParameterSetRecord& set : content.parameter_sets) {
    content.features.back().push_back(features_of(set, features));
  }
}

void add_parameter_sets(BundleContent& content) {
  content.parameter_sets.push_back(parameter_set(content, "orb-2000", 1, Detector::kFastOrb));
  content.parameter_sets.push_back(parameter_set(content, "brisk-3", 5, Detector::kAgastBrisk));
}

void add_scene(BundleContent& content, std::uint32_t pattern, std::uint32_t model) {
  SceneRecord scene{};
  scene.pattern = pattern;
  scene.model = model;
  scene.scale = 0.5f;
  scene.offset[1] = -0.25f;
  scene.rotation[0] = 0.5f;
  scene.rotation[1] = -0.5f;
  scene.rotation[2] = 0.5f;
  scene.rotation[3] = 0.5f;
  content.scenes.push_back(scene);
}

}  // namespace

BundleContent pattern_content() {
  BundleContent content;
  content.meta = "{\"tool\":\"test\"}";
  add_parameter_sets(content);
  add_pattern(content, "box", 64, 48, 9);
  return content;
}

BundleContent model_content() {
  BundleContent content;
  add_material(content, "skin", kNone);
  add_octahedron(content, "octahedron", half_layout(), 0);
  return content;
}

BundleContent texture_content() {
  BundleContent content;
  add_texture(content);
  return content;
}

BundleContent golden_content() {
  BundleContent content;
  content.meta = "{\n \"tool\": \"golden\"\n}\n";
  add_texture(content);
  add_material(content, "skin", 0);
  add_material(content, "glass \xC3\xA9", kNone);
  add_octahedron(content, "half", half_layout(), 0);
  add_octahedron(content, "integer", integer_layout(), 1);
  add_octahedron(content, "float", float_layout(), 0);
  add_parameter_sets(content);
  add_pattern(content, "box", 64, 48, 9);
  add_pattern(content, "poster", 30, 40, 12);
  add_scene(content, 0, 2);
  add_scene(content, 1, 0);
  ExtraSection extra;
  extra.type = 100;
  extra.version = 3;
  extra.owner = 7;
  extra.variant = 9;
  for (const char letter : std::string("from the future")) put(extra.bytes, letter);
  content.extra.push_back(extra);
  return content;
}

namespace {

/// The first pattern on a cone, the second on two faces of a box.
void add_shapes(BundleContent& content) {
  const auto section = [&content](std::uint32_t pattern, const PatternShapeHeader& header) {
    ExtraSection out;
    out.type = static_cast<std::uint32_t>(SectionType::kPatternShape);
    out.owner = pattern;
    const auto bytes = std::as_bytes(std::span(&header, 1));
    out.bytes.assign(bytes.begin(), bytes.end());
    content.extra.push_back(std::move(out));
  };
  section(0, {static_cast<std::uint32_t>(ShapeKind::kRound), 0, 1.25, -0.125, {}});
  section(1, {static_cast<std::uint32_t>(ShapeKind::kFaces), 2, 0, 0, {}});
  const ShapeFaceRecord faces[] = {
      {{0, 0, 30, 20}, {-0.75f, 0.5f, 0.25f}, {1.5f, 0, 0}, {0, -1.0f, 0}, 0},
      {{2, 20, 20, 20}, {0.75f, 0.5f, 0.25f}, {0, 0, -1.0f}, {0, -1.0f, 0}, 0}};
  const auto bytes = std::as_bytes(std::span(faces));
  content.extra.back().bytes.insert(content.extra.back().bytes.end(), bytes.begin(), bytes.end());
}

}  // namespace

void add_looks(BundleContent& content) {
  LightRecord light{};
  light.scene = 1;
  for (int i = 0; i < 27; ++i) light.sky[i] = 0.5f - 0.03125f * static_cast<float>(i);
  light.direction[0] = 0.6f;
  light.direction[2] = 0.8f;
  light.key[0] = 0.5f;
  light.key[1] = 0.25f;
  content.lights.push_back(light);
  // Behind the three bytes of the normal, of the first model's six vertices.
  content.occlusion.push_back({0, 11});
  for (std::size_t v = 0; v < 6; ++v) {
    content.vertices[v * 16 + 11] = static_cast<std::byte>(127 - 20 * v);
  }
  const ShadowHeader shadow{3, 2, {-1.0f, -0.5f}, {1.25f, 0.75f}, {}};
  content.shadows.resize(2);
  const auto header = std::as_bytes(std::span(&shadow, 1));
  content.shadows[1].assign(header.begin(), header.end());
  for (int i = 0; i < 6; ++i) put(content.shadows[1], static_cast<std::uint8_t>(255 - 30 * i));
  content.materials[1].flags |= kMaterialOccluder;
  const ColourGridHeader grid{2, 1, {}};
  ExtraSection colours;
  colours.type = static_cast<std::uint32_t>(SectionType::kPatternColours);
  colours.owner = 1;
  const auto grid_bytes = std::as_bytes(std::span(&grid, 1));
  colours.bytes.assign(grid_bytes.begin(), grid_bytes.end());
  for (int i = 0; i < 6; ++i) put(colours.bytes, static_cast<std::uint16_t>(9000 * i + 77));
  content.extra.push_back(colours);
  add_shapes(content);
  const std::uint32_t triangles = content.levels[content.chunks[1].first_level].index_count / 3;
  ExtraSection order;
  order.type = static_cast<std::uint32_t>(SectionType::kDrawOrder);
  order.owner = 1;
  for (std::uint32_t i = 0; i <= triangles; ++i) {
    // Turned by turns; the second node has a plane alone.
    const DrawOrderRecord node{{i % 2 == 0 ? 1.0f : 0.0f, i % 2 == 0 ? 0.0f : -1.0f, 0.0f, 0.25f},
                               i % 3 == 0 ? triangles - i : 0,
                               i == 1 ? kNone : (i == 0 ? 0 : i - 1)};
    const auto bytes = std::as_bytes(std::span(&node, 1));
    order.bytes.insert(order.bytes.end(), bytes.begin(), bytes.end());
  }
  content.extra.push_back(order);
}

namespace {

NodeRecord node_of(BundleContent& content, const char* name, std::uint32_t pattern, NodeKind kind) {
  NodeRecord node{};
  node.name = content.intern(name);
  node.pattern = pattern;
  node.kind = static_cast<std::uint32_t>(kind);
  node.subject = kNone;
  node.rotation[3] = 1;
  return node;
}

ActionRecord action_of(ActionEvent event, std::uint32_t source, ActionCommand command,
                       std::uint32_t target) {
  ActionRecord action{};
  action.event = static_cast<std::uint32_t>(event);
  action.command = static_cast<std::uint32_t>(command);
  action.source = source;
  action.target = target;
  return action;
}

}  // namespace

namespace {

/// Numbers of an MP4 file: the first byte is the greatest.
void put_big(Bytes& out, std::uint64_t value, int bytes) {
  for (int i = bytes - 1; i >= 0; --i) put(out, static_cast<std::uint8_t>(value >> (8 * i)));
}

Bytes box(const char* type, const std::vector<Bytes>& parts) {
  Bytes out;
  std::size_t size = 8;
  for (const Bytes& part : parts) size += part.size();
  put_big(out, size, 4);
  for (int i = 0; i < 4; ++i) put(out, type[i]);
  for (const Bytes& part : parts) out.insert(out.end(), part.begin(), part.end());
  return out;
}

Bytes zeros(std::size_t count) {
  return Bytes(count);
}

Bytes text_bytes(const char* text) {
  Bytes out;
  for (; *text != '\0'; ++text) put(out, *text);
  return out;
}

}  // namespace

namespace {

constexpr std::uint32_t kTimeScale = 600;

/// An MP4 file of one track without samples.
Bytes one_track(const char* handler, const Bytes& codec, std::uint32_t seconds, bool index_first) {
  Bytes times = zeros(12);
  put_big(times, kTimeScale, 4);
  put_big(times, std::uint64_t{kTimeScale} * seconds, 4);
  put_big(times, 0, 4);
  Bytes entries = zeros(4);
  put_big(entries, 1, 4);
  const Bytes media =
      box("mdia", {box("mdhd", {times}), box("hdlr", {zeros(8), text_bytes(handler), zeros(13)}),
                   box("minf", {box("stbl", {box("stsd", {entries, codec})})})});
  const Bytes index = box("moov", {box("trak", {media})});
  const Bytes data = box("mdat", {zeros(16)});
  Bytes file = box("ftyp", {text_bytes("isom"), zeros(4)});
  for (const Bytes* part : {index_first ? &index : &data, index_first ? &data : &index}) {
    file.insert(file.end(), part->begin(), part->end());
  }
  return file;
}

}  // namespace

Bytes small_mp4(std::uint16_t width, std::uint16_t height, std::uint32_t seconds, bool index_first,
                std::uint8_t profile) {
  Bytes sides;
  put_big(sides, width, 2);
  put_big(sides, height, 2);
  const Bytes settings = {std::byte{1}, std::byte{profile}, std::byte{0xC0}, std::byte{30}};
  return one_track("vide", box("avc1", {zeros(24), sides, zeros(50), box("avcC", {settings})}),
                   seconds, index_first);
}

Bytes small_sound(std::uint32_t seconds) {
  return one_track("soun", box("mp4a", {zeros(28)}), seconds, true);
}

void add_nodes(BundleContent& content) {
  NodeRecord model = node_of(content, "pot", 0, NodeKind::kModel);
  model.subject = 0;
  model.group = 4;
  NodeRecord picture = node_of(content, "map", 0, NodeKind::kPicture);
  picture.subject = 0;
  picture.flags = kNodeHidden;
  picture.group = 4;
  picture.place[2] = 0.25f;
  for (float& part : picture.rotation) part = 0.5f;
  picture.half_size[0] = 0.5f;
  picture.half_size[1] = 0.25f;
  NodeRecord label = node_of(content, "rim", 0, NodeKind::kLabel);
  label.place[0] = -0.75f;
  label.mark = content.intern("1");
  NodeRecord video = node_of(content, "trailer", 0, NodeKind::kVideo);
  video.subject = 0;
  video.flags = kNodePlays | kNodeLoops;
  video.half_size[0] = 1;
  video.half_size[1] = 0.5625f;
  video.alpha = static_cast<std::uint32_t>(VideoAlpha::kKey);
  video.key[1] = 1;
  video.reach = 0.25f;
  NodeRecord sound = node_of(content, "voice", 0, NodeKind::kSound);
  sound.subject = 1;
  content.nodes = {model, picture, label, video, sound};
  MediaRecord media{};
  media.name = content.intern("trailer.mp4");
  media.kind = static_cast<std::uint32_t>(MediaKind::kVideo);
  media.width = 640;
  media.height = 360;
  media.seconds = 12;
  MediaRecord voice{};
  voice.name = content.intern("voice.m4a");
  voice.kind = static_cast<std::uint32_t>(MediaKind::kSound);
  voice.flags = kMediaSound;
  voice.seconds = 3;
  voice.poster = kNone;
  content.media = {media, voice};
  content.media_data = {small_mp4(640, 360, 12), small_sound(3)};
  ExtraSection preview;
  preview.type = static_cast<std::uint32_t>(SectionType::kPatternPicture);
  preview.owner = 0;
  for (const char letter : std::string_view("RIFF\x0a\0\0\0WEBPVP8 \0\0", 18)) {
    preview.bytes.push_back(static_cast<std::byte>(letter));
  }
  content.extra.push_back(preview);
  ActionRecord tap = action_of(ActionEvent::kTap, 0, ActionCommand::kNext, 1);
  tap.part = content.intern("skin");
  ActionRecord after = action_of(ActionEvent::kAfter, 0, ActionCommand::kTurn, 0);
  after.seconds = 2.5f;
  after.duration = 1.5f;
  after.axis[2] = 1;
  after.degrees = 90;
  ActionRecord link = action_of(ActionEvent::kTap, 1, ActionCommand::kLink, kNone);
  link.address = content.intern("https://museum.org/pot");
  content.actions = {action_of(ActionEvent::kFound, 0, ActionCommand::kShow, 0),
                     action_of(ActionEvent::kLost, 0, ActionCommand::kHide, 1),
                     tap,
                     after,
                     link,
                     action_of(ActionEvent::kTap, 1, ActionCommand::kText, 2),
                     action_of(ActionEvent::kTap, 2, ActionCommand::kToggle, 1),
                     action_of(ActionEvent::kTap, 3, ActionCommand::kPause, 3),
                     action_of(ActionEvent::kTap, 2, ActionCommand::kPlay, 4)};
  content.meta = R"({"tool":"golden","nodes":[{"pattern":"box","node":"rim",)"
                 R"("title":{"en":"The rim"},"text":{"en":"Chipped."}},)"
                 R"({"pattern":"box","node":"voice","captions":)"
                 R"({"en":"WEBVTT\n\n00:00.500 --> 00:02.000\nA pot.\n"}}]})";
}

namespace {

/// A turn of half a circle about z, then a move along x: two tracks of two and one key.
Bytes tracks_of_clip() {
  Bytes bytes;
  put(bytes, ClipTracksHeader{2, 121, {0, 0}});
  put(bytes, TrackRecord{0, 2, 0, 2, 96, {0, 0, 0}, {0, 0, 0}, 0});
  put(bytes, TrackRecord{1, 1, 0, 1, 112, {0, 0.25f, 0}, {0.5f, 0, 0}, 0});
  for (const int sample : {0, 120}) put(bytes, static_cast<std::uint16_t>(sample));
  for (const auto& rotation : {std::array<double, 4>{0, 0, 0, 1}, {0, 0, 1, 0}}) {
    for (const std::uint16_t word : pack_rotation(rotation)) put(bytes, word);
  }
  for (const int word : {0, 1, 0, 0}) put(bytes, static_cast<std::uint16_t>(word));
  return bytes;
}

}  // namespace

void add_clips(BundleContent& content) {
  ModelRecord& model = content.models[2];
  model.first_material = static_cast<std::uint32_t>(content.materials.size());
  model.material_count = 1;
  add_material(content, "arm", kNone);
  for (std::uint32_t c = 0; c < model.chunk_count; ++c) {
    content.chunks[model.first_chunk + c].material = model.first_material;
  }
  JointRecord joint{};
  joint.model = 2;
  joint.parent = kNone;
  joint.rotation[3] = 1;
  for (int i = 0; i < 3; ++i) joint.before[5 * i] = joint.scale[i] = 1;
  content.joints = {joint, joint};
  content.joints[1].parent = 0;
  content.joints[1].translation[1] = 0.25f;
  BoneRecord bone{};
  bone.joint = 1;
  for (int i = 0; i < 3; ++i) bone.inverse[5 * i] = 1;
  bone.inverse[7] = -0.25f;
  content.bones = {bone};
  content.parts = {{model.first_material, 0, 1, 0, {-1.5f, -1.5f, -1}, {1.5f, 1.5f, 1}}};
  const NameRef wave = content.intern("wave");
  const NameRef again = content.intern("wave again");
  content.clips = {{wave, 2, 0, 1, 0.0009765625f, {0, 0}}, {again, 2, 0, 2, 0.0009765625f, {0, 0}}};
  content.clip_tracks = {tracks_of_clip(), {}};
  content.scene_clips = {{0, 1, kSceneClipLoops, 0}};
}

BundleContent skinned_content() {
  BundleContent content = model_content();
  LayoutRecord& layout = content.layouts[0];
  const std::uint16_t stride = layout.stride;
  layout.attributes[layout.attribute_count++] = {6, 5, 4, 0, stride, 0};
  layout.attributes[layout.attribute_count++] = {7, 5, 4, 1, static_cast<std::uint16_t>(stride + 4),
                                                 0};
  for (const int i : {0, 1, 2}) {
    const auto at = static_cast<std::uint16_t>(stride + 8 + 4 * i);
    layout.attributes[layout.attribute_count++] = {
        static_cast<std::uint8_t>(8 + i), 2, 2, 0, at, 0};
  }
  layout.stride = static_cast<std::uint16_t>(stride + 20);
  Bytes vertices;
  for (std::size_t v = 0; v < content.vertices.size(); v += stride) {
    vertices.insert(vertices.end(), content.vertices.begin() + static_cast<std::ptrdiff_t>(v),
                    content.vertices.begin() + static_cast<std::ptrdiff_t>(v + stride));
    for (const int byte : {1, 0, 0, 0, 200, 55, 0, 0}) {
      vertices.push_back(static_cast<std::byte>(byte));
    }
    for (const int way : {100, -32767, 0, 7, 32767, 0})
      put(vertices, static_cast<std::int16_t>(way));
  }
  content.vertices = std::move(vertices);
  JointRecord joint{};
  joint.parent = kNone;
  joint.rotation[3] = 1;
  BoneRecord bone{};
  for (int i = 0; i < 3; ++i) joint.before[5 * i] = joint.scale[i] = bone.inverse[5 * i] = 1;
  content.joints = {joint, joint};
  content.bones = {bone, bone, bone, bone};
  content.bones[1].joint = content.bones[3].joint = 1;
  content.parts = {{0, 0, 2, 2, {-2, -2, -2}, {2, 2, 2}}};
  content.clips = {{content.intern("wave"), 0, 0, 1, 0.0009765625f, {0, 0}}};
  content.clip_tracks = {tracks_of_clip()};
  return content;
}

BundleContent acting_content() {
  BundleContent content = lit_content();
  add_nodes(content);
  return content;
}

namespace {

/// One chunk of `triangles` over a model's vertices, as the last proxy's.
void add_proxy_chunk(BundleContent& content, const ModelRecord& model, bool upper,
                     std::size_t triangles, float error) {
  ChunkRecord chunk = content.chunks[model.first_chunk + (upper ? 0u : 1u)];
  chunk.first_level = static_cast<std::uint32_t>(content.proxy_levels.size());
  chunk.level_count = 1;
  LevelRecord level = content.levels[content.chunks[model.first_chunk].first_level];
  level.index_offset = content.indices.size();
  level.index_count = static_cast<std::uint32_t>(3 * triangles);
  level.error = error;
  for (const std::uint16_t index : std::span(upper ? kUpper : kLower).first(3 * triangles)) {
    put(content.indices, index);
  }
  content.proxy_chunks.push_back(chunk);
  content.proxy_levels.push_back(level);
  ++content.proxies.back().chunk_count;
}

}  // namespace

void add_proxies(BundleContent& content) {
  const auto add = [&content](std::uint32_t model) {
    content.proxies.push_back(
        {model, static_cast<std::uint32_t>(content.proxy_chunks.size()), 0, 0});
  };
  add(0);
  add_proxy_chunk(content, content.models[0], true, 4, 0.125f);
  add_proxy_chunk(content, content.models[0], false, 4, 0.125f);
  add(0);
  add_proxy_chunk(content, content.models[0], true, 3, 0.5f);
  add(2);
  add_proxy_chunk(content, content.models[2], false, 4, 0.25f);
}

BundleContent lit_content() {
  BundleContent content = golden_content();
  content.extra.clear();
  add_looks(content);
  add_scene(content, 0, 1);  // nothing is never shown
  return content;
}

}  // namespace modar::test
