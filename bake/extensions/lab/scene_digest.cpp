// Hashes a bundle as BundleView decodes it, and runs the second reader as a process.
#include "bake/extensions/lab/scene_digest.hpp"

#include <fstream>
#include <string_view>

#include "bake/process/process.hpp"
#include "formats/base/atomic_file.hpp"
#include "formats/bundle_view.hpp"
#include "formats/colour_grid.hpp"
#include "formats/component.hpp"
#include "formats/draw_order.hpp"
#include "formats/field_table.hpp"
#include "formats/pattern_shape.hpp"

#define XXH_INLINE_ALL
#include <xxhash.h>

namespace modar {
namespace {

class Digest {
 public:
  Digest() { XXH64_reset(&state_, 0); }
  void add(const void* bytes, std::size_t size) {
    if (size > 0) XXH64_update(&state_, bytes, size);
  }
  void add(std::string_view text) {
    const std::uint64_t size = text.size();
    add(&size, sizeof size);
    add(text.data(), text.size());
  }
  void add(std::span<const std::byte> bytes) { add(bytes.data(), bytes.size()); }
  [[nodiscard]] std::uint64_t value() const { return XXH64_digest(&state_); }

 private:
  XXH64_state_t state_;
};

template <class T>
void add_table(Digest& digest, const BundleView& view, const char* name, const Table<T>& table) {
  const RecordInfo& info = record_info(name);
  for (std::uint32_t i = 0; i < table.size(); ++i) {
    const auto* record = reinterpret_cast<const std::byte*>(&table[i]);
    for (const FieldInfo& field : info.fields) {
      if (field.reserved) continue;
      if (field.type == FieldType::kName) {
        digest.add(view.name(*reinterpret_cast<const NameRef*>(record + field.offset)));
      } else {
        digest.add(record + field.offset, field.count * field_element_bytes(field.type));
      }
    }
  }
}

/// occlusion: the byte of its vertices that holds it, or kNone.
void add_level(Digest& digest, const BundleView& view, const LayoutRecord& layout,
               const LevelRecord& level, std::uint32_t occlusion) {
  const std::byte* vertex = view.vertices().data() + level.vertex_offset;
  for (std::uint32_t i = 0; i < level.vertex_count; ++i, vertex += layout.stride) {
    for (std::uint32_t a = 0; a < layout.attribute_count; ++a) {
      const AttributeRecord& attribute = layout.attributes[a];
      digest.add(vertex + attribute.offset, attribute.components * component_bytes(attribute.type));
    }
    if (occlusion != kNone) digest.add(vertex + occlusion, 1);
  }
  digest.add(view.indices().data() + level.index_offset, 2 * std::size_t{level.index_count});
}

}  // namespace

std::uint64_t scene_digest(std::span<const std::byte> bytes) {
  const Result<BundleView> opened = BundleView::open(bytes);
  if (!opened) return 0;
  const BundleView& view = *opened;
  Digest digest;
  digest.add(&view.header().minor, sizeof(view.header().minor));
  add_table(digest, view, "ModelRecord", view.models());
  add_table(digest, view, "ChunkRecord", view.chunks());
  add_table(digest, view, "LevelRecord", view.levels());
  add_table(digest, view, "MaterialRecord", view.materials());
  add_table(digest, view, "LayoutRecord", view.layouts());
  add_table(digest, view, "TextureRecord", view.textures());
  add_table(digest, view, "TextureLevelRecord", view.texture_levels());
  add_table(digest, view, "PatternRecord", view.patterns());
  add_table(digest, view, "ParameterSetRecord", view.parameter_sets());
  add_table(digest, view, "SceneRecord", view.scenes());
  add_table(digest, view, "LightRecord", view.lights());
  add_table(digest, view, "OcclusionRecord", view.occlusion());
  add_table(digest, view, "NodeRecord", view.nodes());
  add_table(digest, view, "ActionRecord", view.actions());
  add_table(digest, view, "MediaRecord", view.media());
  add_table(digest, view, "ProxyRecord", view.proxies());
  for (std::uint32_t g = 0; g < view.chunk_groups(); ++g) {
    const ChunkGroup group = view.chunk_group(g);
    const ModelRecord& model = view.models()[group.model];
    for (std::uint32_t c = 0; c < group.chunk_count; ++c) {
      const ChunkRecord& chunk = view.chunks()[group.first_chunk + c];
      for (std::uint32_t l = 0; l < chunk.level_count; ++l) {
        add_level(digest, view, view.layouts()[model.layout], view.levels()[chunk.first_level + l],
                  occlusion_byte(view.occlusion(), model.layout));
      }
    }
  }
  for (std::uint32_t t = 0; t < view.textures().size(); ++t) digest.add(view.texture_data(t));
  for (const SectionEntry& entry : view.sections()) {
    const auto type = static_cast<SectionType>(entry.type);
    if (type != SectionType::kMappedFeatures && type != SectionType::kFeatureYml &&
        type != SectionType::kTrackerRecord && type != SectionType::kShadow &&
        type != SectionType::kPatternColours && type != SectionType::kPatternShape &&
        type != SectionType::kDrawOrder && type != SectionType::kMediaData &&
        type != SectionType::kPatternPicture) {
      continue;
    }
    digest.add(&entry.type, sizeof entry.type);
    digest.add(&entry.owner, sizeof entry.owner);
    digest.add(&entry.variant, sizeof entry.variant);
    digest.add(view.section(type, entry.owner, entry.variant));
  }
  return digest.value();
}

namespace {

tl::unexpected<Error> trouble(const std::string& reader, const std::string& cause) {
  return fail(ExitCode::kIo, "mutate.second-reader", reader, cause,
              "name scripts/read_bundle.py with --second-reader, and install python3");
}

}  // namespace

Result<std::vector<std::string>> read_scenes(const std::string& reader,
                                             const std::vector<std::span<const std::byte>>& files) {
  const TemporaryFolder folder;
  if (folder.path().empty()) return trouble(reader, "there is no space for temporary files");
  ProcessRequest request;
  request.words = {"python3", reader, "--scenes"};
  for (std::size_t i = 0; i < files.size(); ++i) {
    request.words.push_back(folder.path() + "/" + std::to_string(i) + ".modar");
    MODAR_TRY(write_file(request.words.back(), files[i]));
  }
  request.output = folder.path() + "/scenes";
  // 3: it refuses a file and says so in its line.
  if (const int code = run_process(request); code != 0 && code != 3) {
    return trouble(reader, "it could not be run, or failed");
  }
  std::vector<std::string> lines;
  std::ifstream text(request.output);
  for (std::string line; std::getline(text, line);) lines.push_back(line);
  if (lines.size() != files.size()) {
    return trouble(reader, "it answered for " + std::to_string(lines.size()) + " files, not for " +
                               std::to_string(files.size()));
  }
  return lines;
}

}  // namespace modar
