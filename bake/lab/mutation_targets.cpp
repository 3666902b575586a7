// Walks over records by the field table, and over payloads by what the records say.
#include "bake/lab/mutation_targets.hpp"

#include <algorithm>
#include <array>
#include <map>

namespace modar {
namespace {

/// Collects places under the names of their fields, in the order of first use.
class Collector {
 public:
  void add(const std::string& name, FieldType type, PlaceRange range, bool hash = false) {
    if (range.count == 0) return;
    const auto [found, fresh] = index_.try_emplace(name, fields_.size());
    if (fresh) fields_.push_back({name, type, hash, {}});
    fields_[found->second].places.push_back(range);
  }

  /// `count` records of one struct from byte `first` on.
  void add_records(const RecordInfo& record, std::uint64_t first, std::uint64_t step,
                   std::uint64_t count) {
    for (const FieldInfo& field : record.fields) {
      if (field.type == FieldType::kAttributes) {
        const RecordInfo& attribute = record_info("AttributeRecord");
        for (std::uint64_t i = 0; i < count; ++i) {
          add_records(attribute, first + i * step + field.offset, sizeof(AttributeRecord),
                      field.count);
        }
        continue;
      }
      const bool name = field.type == FieldType::kName;
      const FieldType type = name ? FieldType::kU32 : field.type;
      const std::uint64_t elements = name ? 2 : field.count;
      const std::string label = std::string(record.name) + "." + field.name;
      const bool hash = label == "FileHeader.hash" || label == "SectionEntry.hash";
      for (std::uint64_t i = 0; i < elements; ++i) {
        add(label, type, {first + field.offset + i * field_element_bytes(type), step, count}, hash);
      }
    }
  }

  std::vector<MutationField> take() { return std::move(fields_); }

 private:
  std::vector<MutationField> fields_;
  std::map<std::string, std::size_t> index_;
};

FieldType type_of(std::uint8_t component) {
  switch (static_cast<ComponentType>(component)) {
    case ComponentType::kI8:
    case ComponentType::kU8:
      return FieldType::kU8;
    case ComponentType::kF32:
      return FieldType::kF32;
    default:
      return FieldType::kU16;
  }
}

const char* semantic_name(std::uint8_t semantic) {
  switch (static_cast<Semantic>(semantic)) {
    case Semantic::kPosition:
      return "vertex position";
    case Semantic::kNormal:
      return "vertex normal";
    case Semantic::kUv:
      return "vertex uv";
    case Semantic::kColour:
      return "vertex colour";
    case Semantic::kNormalOct:
      return "vertex octahedral normal";
  }
  return "vertex";
}

void add_level(Collector& out, const LayoutRecord& layout, const LevelRecord& level,
               std::uint64_t vertices, std::uint64_t indices) {
  std::array<bool, kMaxVertexStride> owned{};
  const std::uint64_t first = vertices + level.vertex_offset;
  for (std::uint32_t a = 0; a < layout.attribute_count; ++a) {
    const AttributeRecord& attribute = layout.attributes[a];
    const FieldType type = type_of(attribute.type);
    const std::size_t size = field_element_bytes(type);
    for (std::size_t c = 0; c < attribute.components; ++c) {
      out.add(semantic_name(attribute.semantic), type,
              {first + attribute.offset + c * size, layout.stride, level.vertex_count});
    }
    std::fill_n(owned.begin() + attribute.offset, size * attribute.components, true);
  }
  for (std::uint64_t byte = 0; byte < layout.stride; ++byte) {
    if (owned[byte]) continue;
    out.add("vertex padding", FieldType::kU8, {first + byte, layout.stride, level.vertex_count});
  }
  out.add("index", FieldType::kU16, {indices + level.index_offset, 2, level.index_count});
}

void add_geometry(Collector& out, const BundleView& bundle) {
  const auto place = [&bundle](std::span<const std::byte> part) {
    return static_cast<std::uint64_t>(part.data() - bundle.bytes().data());
  };
  for (std::uint32_t m = 0; m < bundle.models().size(); ++m) {
    const ModelRecord& model = bundle.models()[m];
    for (std::uint32_t c = 0; c < model.chunk_count; ++c) {
      const ChunkRecord& chunk = bundle.chunks()[model.first_chunk + c];
      for (std::uint32_t l = 0; l < chunk.level_count; ++l) {
        add_level(out, bundle.layouts()[model.layout], bundle.levels()[chunk.first_level + l],
                  place(bundle.vertices()), place(bundle.indices()));
      }
    }
  }
}

void add_twin(Collector& out, const SectionEntry& entry, const FeatureHeader& header) {
  out.add_records(record_info("FeatureHeader"), entry.offset, sizeof(FeatureHeader), 1);
  out.add_records(record_info("KeypointRecord"), entry.offset + header.keypoints_offset,
                  sizeof(KeypointRecord), header.count);
  out.add("descriptor", FieldType::kU8,
          {entry.offset + header.descriptors_offset, 1,
           std::uint64_t{header.count} * header.descriptor_bytes});
}

void add_section(Collector& out, const BundleView& bundle, const SectionEntry& entry) {
  for (const RecordInfo& record : record_infos()) {
    if (record.table == nullptr || static_cast<std::uint32_t>(record.section) != entry.type)
      continue;
    const auto& header =
        *reinterpret_cast<const TableHeader*>(bundle.bytes().data() + entry.offset);
    out.add_records(record_info("TableHeader"), entry.offset, sizeof(TableHeader), 1);
    out.add_records(record, entry.offset + sizeof(TableHeader), header.stride, header.count);
  }
  const PlaceRange all{entry.offset, 1, entry.size};
  switch (static_cast<SectionType>(entry.type)) {
    case SectionType::kNames:
      return out.add("names", FieldType::kU8, all);
    case SectionType::kMeta:
      return out.add("meta", FieldType::kU8, all);
    case SectionType::kContentSummary:
      return out.add("statement", FieldType::kU8, all);
    case SectionType::kFeatureYml:
      return out.add("feature text", FieldType::kU8, all);
    case SectionType::kTrackerRecord:
      return out.add("loop record", FieldType::kU8, all);
    case SectionType::kTextureData:
      return out.add("texture block", FieldType::kU64, {entry.offset, 8, entry.size / 8});
    case SectionType::kMappedFeatures:
      return add_twin(
          out, entry,
          *reinterpret_cast<const FeatureHeader*>(bundle.bytes().data() + entry.offset));
    default:
      return;
  }
}

}  // namespace

std::uint64_t MutationField::elements() const {
  std::uint64_t sum = 0;
  for (const PlaceRange& range : places) sum += range.count;
  return sum;
}

std::uint64_t MutationField::place(std::uint64_t i) const {
  for (const PlaceRange& range : places) {
    if (i < range.count) return range.first + i * range.step;
    i -= range.count;
  }
  return 0;
}

std::vector<MutationField> mutation_fields(const BundleView& bundle) {
  Collector out;
  out.add_records(record_info("FileHeader"), 0, sizeof(FileHeader), 1);
  out.add_records(record_info("SectionEntry"), sizeof(FileHeader), sizeof(SectionEntry),
                  bundle.sections().size());
  std::uint64_t end = sizeof(FileHeader) + bundle.sections().size_bytes();
  for (const SectionEntry& entry : bundle.sections()) {
    out.add("padding between sections", FieldType::kU8, {end, 1, entry.offset - end});
    add_section(out, bundle, entry);
    end = entry.offset + entry.size;
  }
  add_geometry(out, bundle);
  return out.take();
}

}  // namespace modar
