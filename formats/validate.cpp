// Validates a bundle's structure: the header, the section table, every record of every table.
// Payloads are bounded here; verify_sections() hashes them, check_bundle() judges them.
#include "formats/validate.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <tuple>

#include "formats/base/bits.hpp"
#include "formats/base/utf8.hpp"
#include "formats/check.hpp"
#include "formats/colour_grid.hpp"
#include "formats/draw_order.hpp"
#include "formats/pattern_shape.hpp"
#include "formats/texture_format.hpp"

#define XXH_INLINE_ALL
#include <xxhash.h>

namespace modar {
namespace {

auto key(const SectionEntry& entry) {
  return std::make_tuple(entry.type, entry.owner, entry.variant);
}

std::uint64_t header_hash(std::span<const std::byte> bytes, const FileHeader& header) {
  XXH64_state_t state;
  XXH64_reset(&state, 0);
  XXH64_update(&state, bytes.data(), offsetof(FileHeader, hash));
  XXH64_update(&state, bytes.data() + header.table_offset,
               std::size_t{header.section_count} * sizeof(SectionEntry));
  return XXH64_digest(&state);
}

/// The fields that decide whether the rest of the file can be looked at. False: it cannot.
bool readable(std::span<const std::byte> bytes, FaultLog& log) {
  const auto refuse = [&log](Rule rule, std::uint64_t offset, std::string_view detail) {
    log.add(rule, offset, "header", detail);
    return false;
  };
  if (bytes.size() < sizeof(FileHeader)) {
    return refuse(Rule::kTruncated, bytes.size(),
                  with_numbers("the file has {} bytes, a header has 64", {bytes.size()}));
  }
  if (reinterpret_cast<std::uintptr_t>(bytes.data()) % alignof(std::uint64_t) != 0) {
    return refuse(Rule::kHeader, 0, "the first byte is at an address that 8 does not divide");
  }
  const auto& header = *reinterpret_cast<const FileHeader*>(bytes.data());
  if (std::memcmp(header.magic, kMagic.data(), kMagic.size()) != 0) {
    return refuse(Rule::kMagicBytes, 0, "the first eight bytes are not those of a bundle");
  }
  if (header.major != kMajorVersion) {
    return refuse(Rule::kVersion, offsetof(FileHeader, major),
                  with_numbers("the file has version {}.{}, this program reads 1.x",
                               {header.major, header.minor}));
  }
  const auto sizes = [&] {
    return with_numbers("the header states {} bytes, the file has {}",
                        {header.file_size, bytes.size()});
  };
  if (bytes.size() < header.file_size) return refuse(Rule::kTruncated, bytes.size(), sizes());
  if (bytes.size() > header.file_size) {
    return refuse(Rule::kFileSize, offsetof(FileHeader, file_size), sizes());
  }
  if (header.table_offset != sizeof(FileHeader) || header.entry_size != sizeof(SectionEntry)) {
    return refuse(Rule::kHeader, offsetof(FileHeader, table_offset),
                  "the section table is not at byte 64 with entries of 48 bytes");
  }
  if (header.section_count > kMaxSections ||
      header.section_count > (bytes.size() - sizeof(FileHeader)) / sizeof(SectionEntry)) {
    return refuse(Rule::kSectionCount, offsetof(FileHeader, section_count),
                  with_numbers("{} sections do not fit", {header.section_count}));
  }
  return true;
}

/// Type, version, flags and owner of one entry.
void check_kind(const RecordCheck& check, const SectionEntry& entry, bool newer) {
  if (!newer && (entry.flags & ~(kSectionRequired | kSectionGpu)) != 0) {
    check.fault(Rule::kReserved, &entry.flags, "flags {} have unknown bits", {entry.flags});
  }
  check.reserved(&entry.reserved, sizeof(entry.reserved));
  const SectionInfo* known = section_info(entry.type);
  if (known == nullptr) {
    if ((entry.flags & kSectionRequired) != 0) {
      check.fault(Rule::kSectionRequired, &entry.type, "section type {} is required and unknown",
                  {entry.type});
    }
    return;
  }
  if (entry.version != 1) {
    check.fault(Rule::kSectionVersion, &entry.version,
                "section type {} has version {}, this program reads 1",
                {entry.type, entry.version});
  }
  if ((entry.flags & (kSectionRequired | kSectionGpu)) != known->flags) {
    check.fault(Rule::kSectionFlags, &entry.flags, "section type {} has flags {}, not {}",
                {entry.type, entry.flags, known->flags});
  }
  if (known->owner == SectionOwner::kNothing && (entry.owner != kNone || entry.variant != 0)) {
    check.fault(Rule::kSectionOwner, &entry.owner, "section type {} belongs to no record",
                {entry.type});
  }
}

/// True if the section is inside the file, behind `end`.
bool check_place(const RecordCheck& check, const SectionEntry& entry, std::uint64_t end,
                 std::uint64_t file_size) {
  const std::uint64_t alignment =
      (entry.flags & kSectionGpu) != 0 ? kGpuAlignment : kSectionAlignment;
  if (entry.offset % alignment != 0) {
    check.fault(Rule::kSectionUnaligned, &entry.offset, "offset {} is no multiple of {}",
                {entry.offset, alignment});
    return false;
  }
  if (entry.offset < end || entry.offset > file_size || entry.size > file_size - entry.offset) {
    check.fault(Rule::kSectionRange, &entry.offset,
                "{} bytes at {} are not between byte {} and the end, {}",
                {entry.size, entry.offset, end, file_size});
    return false;
  }
  return true;
}

/// The header of a table whose records have `size` bytes, if it has the right shape; its records
/// follow it. nullptr and true: the bundle has no such table.
bool find_header(FaultLog& log, const BundleParts& parts, SectionType type, std::size_t size,
                 const TableHeader*& found) {
  const SectionEntry* entry = find_section(parts.sections, type, kNone, 0);
  if (entry == nullptr) return true;
  const std::span<const std::byte> bytes = section_bytes(parts, *entry);
  const auto refuse = [&](std::string_view detail) {
    log.add(Rule::kTableShape, entry->offset, with_numbers("section type {}", {entry->type}),
            detail);
    return false;
  };
  if (bytes.size() < sizeof(TableHeader)) return refuse("it is too small for a table's header");
  const auto& header = *reinterpret_cast<const TableHeader*>(bytes.data());
  if (header.stride < size || header.stride % 8 != 0 ||
      (header.stride != size && !newer_minor(parts))) {
    return refuse(with_numbers("its records have {} bytes, not {}", {header.stride, size}));
  }
  // Neither factor exceeds 32 bits, so the product cannot overflow.
  if (std::uint64_t{header.count} * header.stride != bytes.size() - sizeof(TableHeader)) {
    return refuse(with_numbers("{} records of {} bytes do not fill {} bytes",
                               {header.count, header.stride, bytes.size()}));
  }
  if (header.reserved != 0 && !newer_minor(parts)) {
    log.add(Rule::kReserved, entry->offset + offsetof(TableHeader, reserved),
            with_numbers("section type {}", {entry->type}), "a reserved field is not zero");
  }
  found = &header;
  return true;
}

/// A table section and where it goes.
struct TableSlot {
  SectionType type;
  std::uint32_t size;  ///< bytes of a record
  TableBytes* table;
};

template <class T>
TableSlot slot(SectionType type, Table<T>& table) {
  return {type, sizeof(T), &table};
}

bool find_table(FaultLog& log, const BundleParts& parts, const TableSlot& slot) {
  const TableHeader* header = nullptr;
  if (!find_header(log, parts, slot.type, slot.size, header)) return false;
  if (header != nullptr) {
    *slot.table =
        TableBytes(reinterpret_cast<const std::byte*>(header + 1), header->count, header->stride);
  }
  return true;
}

void check_names(FaultLog& log, const BundleParts& parts) {
  std::string_view rest(reinterpret_cast<const char*>(parts.names.data()), parts.names.size());
  while (!rest.empty()) {
    const std::size_t length = utf8_character(rest);
    if (length == 0) {
      const auto* at = reinterpret_cast<const std::byte*>(rest.data());
      log.add(Rule::kName, static_cast<std::uint64_t>(at - parts.bytes.data()), "names",
              "a byte is not part of a printable UTF-8 character");
      return;
    }
    rest.remove_prefix(length);
  }
}

}  // namespace

bool known_section_type(std::uint32_t type) {
  return section_info(type) != nullptr;
}

std::uint16_t section_since(std::uint32_t type) {
  const SectionInfo* known = section_info(type);
  return known != nullptr ? known->since : 0;
}

const SectionEntry* find_section(std::span<const SectionEntry> sections, SectionType type,
                                 std::uint32_t owner, std::uint32_t variant) {
  const auto wanted = std::make_tuple(static_cast<std::uint32_t>(type), owner, variant);
  const auto found = std::lower_bound(
      sections.begin(), sections.end(), wanted,
      [](const SectionEntry& entry, const auto& value) { return key(entry) < value; });
  return found != sections.end() && key(*found) == wanted ? &*found : nullptr;
}

bool validate_sections(std::span<const std::byte> bytes, FaultLog& log, BundleParts& parts) {
  if (!readable(bytes, log)) return false;
  const auto& header = *reinterpret_cast<const FileHeader*>(bytes.data());
  parts.bytes = bytes;
  parts.sections = {reinterpret_cast<const SectionEntry*>(bytes.data() + header.table_offset),
                    header.section_count};
  if (header_hash(bytes, header) != header.hash) {
    log.add(Rule::kHeaderHash, offsetof(FileHeader, hash), "header",
            "the hash of header and section table differs from the stated one");
  }
  const RecordCheck header_check(log, parts, "header", 0);
  header_check.reserved(&header.reserved0, sizeof(header.reserved0));
  header_check.reserved(header.reserved1, sizeof(header.reserved1));
  bool placed = true;
  std::uint64_t end =
      header.table_offset + std::uint64_t{header.section_count} * sizeof(SectionEntry);
  for (std::uint32_t i = 0; i < header.section_count && !log.stop(); ++i) {
    const SectionEntry& entry = parts.sections[i];
    const RecordCheck check(log, parts, "section", i);
    if (i > 0 && !(key(parts.sections[i - 1]) < key(entry))) {
      check.fault(Rule::kSectionOrder, &entry.type,
                  "it does not sort behind the one before by type, owner and variant");
      placed = false;
    }
    check_kind(check, entry, newer_minor(parts));
    if (check_place(check, entry, end, header.file_size)) {
      end = entry.offset + entry.size;
    } else {
      placed = false;
    }
  }
  if (placed && !log.stop() && end != header.file_size) {
    log.add(Rule::kFileSize, end, "header", "the last section ends at byte {}, the file at {}",
            {end, header.file_size});
  }
  return placed && !log.stop();
}

bool validate_tables(FaultLog& log, BundleParts& parts) {
  const auto blob = [&parts](SectionType type) {
    const SectionEntry* entry = find_section(parts.sections, type, kNone, 0);
    return entry != nullptr ? section_bytes(parts, *entry) : std::span<const std::byte>();
  };
  parts.names = blob(SectionType::kNames);
  parts.vertices = blob(SectionType::kVertices);
  parts.indices = blob(SectionType::kIndices);
  check_names(log, parts);
  Table<ChunkRecord> chunks;
  Table<LevelRecord> levels;
  const TableSlot slots[] = {
      slot(SectionType::kModels, parts.models),
      slot(SectionType::kChunks, parts.chunks),
      slot(SectionType::kLevels, parts.levels),
      slot(SectionType::kMaterials, parts.materials),
      slot(SectionType::kLayouts, parts.layouts),
      slot(SectionType::kTextures, parts.textures),
      slot(SectionType::kTextureLevels, parts.texture_levels),
      slot(SectionType::kPatterns, parts.patterns),
      slot(SectionType::kParameterSets, parts.parameter_sets),
      slot(SectionType::kScenes, parts.scenes),
      slot(SectionType::kLights, parts.lights),
      slot(SectionType::kOcclusion, parts.occlusion),
      slot(SectionType::kNodes, parts.nodes),
      slot(SectionType::kActions, parts.actions),
      slot(SectionType::kMedia, parts.media),
      slot(SectionType::kProxies, parts.proxies),
      slot(SectionType::kClips, parts.clips),
      slot(SectionType::kJoints, parts.joints),
      slot(SectionType::kBones, parts.bones),
      slot(SectionType::kParts, parts.parts),
      slot(SectionType::kSceneClips, parts.scene_clips),
      slot(SectionType::kProxyChunks, chunks),
      slot(SectionType::kProxyLevels, levels),
  };
  bool walkable = true;
  for (const TableSlot& each : slots) walkable &= find_table(log, parts, each);
  parts.chunks.append(chunks);
  parts.levels.append(levels);
  return walkable && !log.stop();
}

void RecordCheck::fault(Rule rule, const void* field, std::string_view detail) const {
  const auto offset = static_cast<const std::byte*>(field) - parts_.bytes.data();
  log_.add(rule, static_cast<std::uint64_t>(offset), what_ + with_numbers(" {}", {index_}), detail);
}

void RecordCheck::fault(Rule rule, const void* field, const char* detail,
                        std::initializer_list<std::uint64_t> numbers) const {
  fault(rule, field, std::string_view(with_numbers(detail, numbers)));
}

void RecordCheck::check_number(const void* field, const char* name, double value, double low,
                               double high) const {
  if (value >= low && value <= high) return;
  fault(Rule::kNumber, field, name + (" is " + number_text(value)));
}

void RecordCheck::reserved(const void* field, std::size_t bytes) const {
  if (newer_minor(parts_)) return;
  const auto* byte = static_cast<const std::byte*>(field);
  for (std::size_t i = 0; i < bytes; ++i) {
    if (byte[i] != std::byte{0}) {
      return fault(Rule::kReserved, byte + i, "a reserved byte is not zero");
    }
  }
}

void RecordCheck::flags(const std::uint32_t& field, std::uint32_t known) const {
  if ((field & ~known) == 0 || newer_minor(parts_)) return;
  fault(Rule::kReserved, &field, "flags {} have unknown bits", {field});
}

void RecordCheck::name(const NameRef& ref) const {
  const std::uint64_t end = std::uint64_t{ref.offset} + ref.length;
  const auto starts_character = [this](std::uint64_t at) {
    return at == parts_.names.size() ||
           !utf8_continues(static_cast<char>(parts_.names[static_cast<std::size_t>(at)]));
  };
  if (ref.length > kMaxNameBytes || end > parts_.names.size() || !starts_character(ref.offset) ||
      !starts_character(end)) {
    fault(Rule::kName, &ref, "{} bytes at {} are not whole characters of the {} bytes of names",
          {ref.length, ref.offset, parts_.names.size()});
  }
}

bool RecordCheck::range(Rule rule, const std::uint32_t& first, std::uint32_t count,
                        std::uint64_t expected, std::uint32_t size, const char* name) const {
  if (first == expected && std::uint64_t{first} + count <= size) return true;
  fault(rule, &first,
        name + with_numbers(" {} and {} in all do not follow the {} before them within {}",
                            {first, count, expected, size}));
  return false;
}

namespace {

/// What ES 2.0 can be handed for a semantic.
bool components_fit(std::uint8_t semantic, std::uint8_t components) {
  switch (static_cast<Semantic>(semantic)) {
    case Semantic::kPosition:
      return components == 3 || components == 4;
    case Semantic::kNormal:
      return components == 3;
    case Semantic::kUv:
    case Semantic::kNormalOct:
      return components == 2;
    case Semantic::kColour:
    case Semantic::kJoints:
    case Semantic::kWeights:
      return components == 4;
    case Semantic::kMorphX:
    case Semantic::kMorphY:
    case Semantic::kMorphZ:
      return components >= 1 && components <= kMostPartTargets;
  }
  return false;
}

bool known_semantic(std::uint8_t semantic) {
  return semantic >= static_cast<std::uint8_t>(Semantic::kPosition) &&
         semantic <= static_cast<std::uint8_t>(Semantic::kMorphZ);
}

bool is_float(std::uint8_t type) {
  return type == static_cast<std::uint8_t>(ComponentType::kHalf) ||
         type == static_cast<std::uint8_t>(ComponentType::kF32);
}

void check_attribute(const RecordCheck& check, const LayoutRecord& layout,
                     const AttributeRecord& attribute) {
  const std::uint32_t size = component_bytes(attribute.type);
  check.reserved(&attribute.reserved, sizeof(attribute.reserved));
  if (!known_semantic(attribute.semantic) || size == 0 || attribute.normalised > 1) {
    return check.fault(Rule::kEnum, &attribute,
                       "an attribute has semantic {}, type {}, normalised {}",
                       {attribute.semantic, attribute.type, attribute.normalised});
  }
  const std::uint32_t end = attribute.offset + size * attribute.components;
  if (!components_fit(attribute.semantic, attribute.components) ||
      (is_float(attribute.type) && attribute.normalised != 0) || attribute.offset % 2 != 0 ||
      attribute.offset % size != 0 || end > layout.stride) {
    check.fault(Rule::kLayout, &attribute,
                "an attribute of {} components of {} bytes at {} does not suit its meaning or the "
                "stride {}",
                {attribute.components, size, attribute.offset, layout.stride});
  }
}

/// True if two attributes share a meaning or a byte.
bool collide(const AttributeRecord& a, const AttributeRecord& b) {
  const bool normal_twice =
      std::min(a.semantic, b.semantic) == static_cast<std::uint8_t>(Semantic::kNormal) &&
      std::max(a.semantic, b.semantic) == static_cast<std::uint8_t>(Semantic::kNormalOct);
  const std::uint32_t a_end = a.offset + component_bytes(a.type) * a.components;
  const std::uint32_t b_end = b.offset + component_bytes(b.type) * b.components;
  return a.semantic == b.semantic || normal_twice || (a.offset < b_end && b.offset < a_end);
}

void check_layout(const RecordCheck& check, const LayoutRecord& layout) {
  check.reserved(&layout.reserved, sizeof(layout.reserved));
  const std::uint32_t count = layout.attribute_count;
  if (layout.stride == 0 || layout.stride % 4 != 0 || layout.stride > kMaxVertexStride ||
      count == 0 || count > std::size(layout.attributes)) {
    return check.fault(Rule::kLayout, &layout, "stride {} and {} attributes are not possible",
                       {layout.stride, count});
  }
  std::uint32_t positions = 0;
  for (std::uint32_t i = 0; i < count; ++i) {
    check_attribute(check, layout, layout.attributes[i]);
    positions += layout.attributes[i].semantic == static_cast<std::uint8_t>(Semantic::kPosition);
    for (std::uint32_t j = 0; j < i; ++j) {
      if (collide(layout.attributes[i], layout.attributes[j])) {
        check.fault(Rule::kLayout, &layout.attributes[i], "attributes {} and {} collide", {j, i});
      }
    }
  }
  if (positions == 0) check.fault(Rule::kLayout, &layout, "it has no position");
  check.reserved(&layout.attributes[count],
                 (std::size(layout.attributes) - count) * sizeof(AttributeRecord));
}

void check_material(const RecordCheck& check, const BundleParts& parts,
                    const MaterialRecord& material) {
  check.name(material.name);
  check.numbers(material.ambient, "ambient");
  check.numbers(material.diffuse, "diffuse");
  check.numbers(material.specular, "specular");
  check.numbers(material.emission, "emission");
  check.number(material.shininess, "shininess");
  check.number(material.opacity, "opacity");
  check.flags(material.flags, known_flags("MaterialRecord"));
  check.reserved(material.reserved, sizeof(material.reserved));
  if (material.texture != kNone && material.texture >= parts.textures.size()) {
    check.fault(Rule::kMaterialRange, &material.texture, "texture {} is not there",
                {material.texture});
  }
}

void check_level(const RecordCheck& check, const BundleParts& parts, const LevelRecord& level,
                 std::uint32_t stride) {
  check.number(level.error, "error", 0.0);
  check.reserved(&level.reserved, sizeof(level.reserved));
  const std::uint64_t vertex_bytes = std::uint64_t{level.vertex_count} * stride;
  if (level.vertex_count > kMaxChunkVertices || level.vertex_offset % 4 != 0 ||
      level.vertex_offset > parts.vertices.size() ||
      vertex_bytes > parts.vertices.size() - level.vertex_offset) {
    check.fault(Rule::kLevelRange, &level.vertex_offset,
                "{} vertices of {} bytes at {} are not in the {} bytes of vertices",
                {level.vertex_count, stride, level.vertex_offset, parts.vertices.size()});
  }
  const std::uint64_t index_bytes = std::uint64_t{level.index_count} * 2;
  if (level.index_count % 3 != 0 || level.index_offset % 2 != 0 ||
      level.index_offset > parts.indices.size() ||
      index_bytes > parts.indices.size() - level.index_offset) {
    check.fault(Rule::kLevelRange, &level.index_offset,
                "{} indices at {} are no triangles in the {} bytes of indices",
                {level.index_count, level.index_offset, parts.indices.size()});
  }
}

void check_chunk(const RecordCheck& check, const ModelRecord& model, const ChunkRecord& chunk) {
  check.numbers(chunk.bounds_min, "bounds_min");
  check.numbers(chunk.bounds_max, "bounds_max");
  for (int axis = 0; axis < 3; ++axis) {
    if (chunk.bounds_min[axis] > chunk.bounds_max[axis]) {
      check.fault(Rule::kChunkRange, &chunk.bounds_min[axis], "its box is inside out");
    }
  }
  check.numbers(chunk.cone_axis, "cone_axis");
  check.number(chunk.cone_cutoff, "cone_cutoff");
  check.numbers(chunk.position_offset, "position_offset");
  check.number(chunk.position_step, "position_step", std::numeric_limits<float>::denorm_min());
  check.numbers(chunk.uv_offset, "uv_offset");
  check.numbers(chunk.uv_scale, "uv_scale");
  check.reserved(&chunk.reserved, sizeof(chunk.reserved));
  if (chunk.level_count == 0) {
    check.fault(Rule::kChunkRange, &chunk.level_count, "it has no level");
  }
  // The model's own range was held against the table before.
  if (chunk.material < model.first_material ||
      chunk.material - model.first_material >= model.material_count) {
    check.fault(Rule::kMaterialRange, &chunk.material, "material {} is not one of its model's",
                {chunk.material});
  }
}

void check_model(const RecordCheck& check, const BundleParts& parts, const ModelRecord& model) {
  check.name(model.name);
  check.numbers(model.center, "center");
  check.number(model.scale, "scale", std::numeric_limits<double>::denorm_min());
  check.number(model.diagonal, "diagonal", 0.0);
  check.size(model.unit_metres, "unit_metres", kLeastUnitMetres, kMostUnitMetres);
  check.number(model.position_error_max, "position_error_max", 0.0);
  check.number(model.position_error_rms, "position_error_rms", 0.0);
  check.number(model.normal_error_max_deg, "normal_error_max_deg", 0.0, 180.0);
  check.number(model.normal_error_rms_deg, "normal_error_rms_deg", 0.0, 180.0);
  check.number(model.uv_error_max_texels, "uv_error_max_texels", 0.0);
  check.number(model.uv_error_rms_texels, "uv_error_rms_texels", 0.0);
  check.reserved(model.reserved, sizeof(model.reserved));
  if (model.layout >= parts.layouts.size()) {
    check.fault(Rule::kModelRange, &model.layout, "layout {} is not there", {model.layout});
  }
  if (std::uint64_t{model.first_material} + model.material_count > parts.materials.size()) {
    check.fault(Rule::kModelRange, &model.first_material, "its materials are not there");
  }
}

/// Where ranges have to begin that follow each other.
struct NextPlaces {
  std::uint64_t chunk = 0;
  std::uint64_t level = 0;
};

/// Chunks of a model, or of one of its proxies, and their levels, which are in the first `levels`
/// of the table.
void check_chunks(FaultLog& log, const BundleParts& parts, const ChunkGroup& group,
                  std::uint32_t levels, std::uint64_t& next_level) {
  const ModelRecord& model = parts.models[group.model];
  const std::uint32_t stride =
      model.layout < parts.layouts.size() ? parts.layouts[model.layout].stride : 0;
  for (std::uint32_t i = 0; i < group.chunk_count && !log.stop(); ++i) {
    const std::uint32_t index = group.first_chunk + i;
    const ChunkRecord& chunk = parts.chunks[index];
    const RecordCheck check(log, parts, "chunk", index);
    check_chunk(check, model, chunk);
    const bool found = check.range(Rule::kChunkRange, chunk.first_level, chunk.level_count,
                                   next_level, levels, "level");
    next_level += chunk.level_count;
    for (std::uint32_t j = 0; found && j < chunk.level_count && !log.stop(); ++j) {
      const std::uint32_t level = chunk.first_level + j;
      check_level(RecordCheck(log, parts, "level", level), parts, parts.levels[level], stride);
    }
  }
}

/// Ranges follow each other without gap or overlap: each chunk has one model and each level one
/// chunk, and the time taken does not exceed the size of the tables.
void check_groups(FaultLog& log, const BundleParts& parts, NextPlaces& next) {
  const std::uint64_t faults = log.errors();
  const std::uint32_t chunks = parts.chunks.own().size();
  const std::uint32_t levels = parts.levels.own().size();
  for (std::uint32_t i = 0; i < parts.models.size() && !log.stop(); ++i) {
    const ModelRecord& model = parts.models[i];
    const RecordCheck check(log, parts, "model", i);
    check_model(check, parts, model);
    const bool found = check.range(Rule::kModelRange, model.first_chunk, model.chunk_count,
                                   next.chunk, chunks, "chunk");
    next.chunk += model.chunk_count;
    if (found) check_chunks(log, parts, parts.chunk_group(i), levels, next.level);
  }
  if (log.errors() != faults) return;
  if (next.chunk != chunks) {
    log.add(Rule::kModelRange, 0, "chunks", "{} chunks belong to no model", {chunks - next.chunk});
  } else if (next.level != levels) {
    log.add(Rule::kChunkRange, 0, "levels", "{} levels belong to no chunk", {levels - next.level});
  }
}

/// One level a chunk, and one error for all: a proxy is drawn as a whole.
void check_proxy(const RecordCheck& check, const BundleParts& parts, std::uint32_t index) {
  const ProxyRecord& proxy = parts.proxies[index];
  bool good = proxy.chunk_count > 0;
  for (std::uint32_t c = 0; good && c < proxy.chunk_count; ++c) {
    const ChunkRecord& first = parts.chunks[proxy.first_chunk];
    const ChunkRecord& chunk = parts.chunks[proxy.first_chunk + c];
    good = chunk.level_count == 1 &&
           parts.levels[chunk.first_level].error == parts.levels[first.first_level].error;
  }
  if (!good) {
    check.fault(Rule::kProxy, &proxy.first_chunk,
                "it has no chunks, or not one level of one error in each");
  }
}

void check_proxies(FaultLog& log, const BundleParts& parts, NextPlaces& next) {
  const std::uint64_t faults = log.errors();
  std::uint32_t last = 0;
  for (std::uint32_t i = 0; i < parts.proxies.size() && !log.stop(); ++i) {
    const ProxyRecord& proxy = parts.proxies[i];
    const RecordCheck check(log, parts, "proxy", i);
    check.reserved(&proxy.reserved, sizeof(proxy.reserved));
    if (proxy.model >= parts.models.size() || proxy.model < last) {
      return check.fault(Rule::kProxy, &proxy.model, "model {} is not there or out of order",
                         {proxy.model});
    }
    last = proxy.model;
    if (!check.range(Rule::kProxy, proxy.first_chunk, proxy.chunk_count, next.chunk,
                     parts.chunks.size(), "chunk")) {
      return;
    }
    next.chunk += proxy.chunk_count;
    check_chunks(log, parts, parts.chunk_group(parts.models.size() + i), parts.levels.size(),
                 next.level);
    if (log.errors() == faults) check_proxy(check, parts, i);
  }
  if (log.errors() == faults &&
      (next.chunk != parts.chunks.size() || next.level != parts.levels.size())) {
    log.add(Rule::kProxy, 0, "proxies", "{} chunks and {} levels belong to none",
            {parts.chunks.size() - next.chunk, parts.levels.size() - next.level});
  }
}

}  // namespace

void validate_models(FaultLog& log, const BundleParts& parts) {
  for (std::uint32_t i = 0; i < parts.layouts.size() && !log.stop(); ++i) {
    check_layout(RecordCheck(log, parts, "layout", i), parts.layouts[i]);
  }
  for (std::uint32_t i = 0; i < parts.materials.size() && !log.stop(); ++i) {
    check_material(RecordCheck(log, parts, "material", i), parts, parts.materials[i]);
  }
  // Hashes that are wrong are faults before these.
  const std::uint64_t faults = log.errors();
  NextPlaces next;
  check_groups(log, parts, next);
  if (log.errors() != faults) return;
  check_proxies(log, parts, next);
  if (log.errors() != faults) return;
  // Levels that shared indices could make a small file cost any time to draw or check.
  std::uint64_t index_bytes = 0;
  for (const LevelRecord& level : parts.levels) {
    index_bytes += std::uint64_t{level.index_count} * 2;
  }
  if (index_bytes > parts.indices.size()) {
    log.add(Rule::kLevelRange, 0, "levels",
            "levels use {} bytes of indices where {} are: some are shared",
            {index_bytes, parts.indices.size()});
  }
}

namespace {

/// Above what one wrong step in the largest texture gives.
constexpr double kMaxPsnr = 140.0;

void check_texture(const RecordCheck& check, const TextureRecord& texture) {
  check.name(texture.name);
  check.number(texture.psnr_db, "psnr_db", 0.0, kMaxPsnr);
  check.number(texture.ssim, "ssim", -1.0, 1.0);
  check.flags(texture.flags, known_flags("TextureRecord"));
  if ((texture.flags & (kTextureAlpha | kTextureCutOut)) == kTextureCutOut) {
    check.fault(Rule::kTextureRange, &texture.flags, "it is cut out, and has no alpha");
  }
  constexpr std::uint32_t kAlongU = kTextureMirrorU | kTextureClampU;
  constexpr std::uint32_t kAlongV = kTextureMirrorV | kTextureClampV;
  const bool repeats = (texture.flags & kTextureRepeat) != 0;
  if ((texture.flags & kAlongU) == kAlongU || (texture.flags & kAlongV) == kAlongV ||
      (!repeats && (texture.flags & (kAlongU | kAlongV)) != 0)) {
    check.fault(Rule::kTextureRange, &texture.flags,
                "it is mirrored or clamped, and does not repeat, or both along one axis");
  }
  check.reserved(texture.reserved, sizeof(texture.reserved));
  if (find_texture_format(texture.format) == nullptr) {
    check.fault(Rule::kEnum, &texture.format, "format {} is not known", {texture.format});
  }
  const std::uint32_t side = std::max(texture.width, texture.height);
  if (std::min(texture.width, texture.height) == 0 || side > kMaxTextureSide ||
      std::min(texture.source_width, texture.source_height) == 0) {
    check.fault(Rule::kTextureRange, &texture.width, "{} x {} pixels is not a possible size",
                {texture.width, texture.height});
    return;
  }
  const auto chain = static_cast<std::uint32_t>(bit_width(side));
  if (texture.level_count != 1 && texture.level_count != chain) {
    check.fault(Rule::kTextureRange, &texture.level_count,
                "{} levels are neither 1 nor the full chain of {}", {texture.level_count, chain});
  }
}

void check_texture_level(const RecordCheck& check, const TextureRecord& texture,
                         const TextureLevelRecord& level, std::uint32_t number,
                         std::uint64_t data_size) {
  check.number(level.psnr_db, "psnr_db", 0.0, kMaxPsnr);
  check.number(level.ssim, "ssim", -1.0, 1.0);
  check.reserved(&level.reserved, sizeof(level.reserved));
  const std::uint32_t width = std::max(1u, number < 32 ? texture.width >> number : 0u);
  const std::uint32_t height = std::max(1u, number < 32 ? texture.height >> number : 0u);
  const TextureFormatInfo* format = find_texture_format(texture.format);
  const std::uint64_t size = format != nullptr ? format->bytes(width, height) : 0;
  if (level.width != width || level.height != height || level.size != size) {
    check.fault(Rule::kTextureLevel, &level.size,
                "{} x {} pixels in {} bytes are not {} x {} in {}",
                {level.width, level.height, level.size, width, height, size});
  }
  const auto inside = [&](std::uint64_t offset) {
    return offset % 8 == 0 && offset <= data_size && level.size <= data_size - offset;
  };
  const bool alpha = (texture.flags & kTextureAlpha) != 0;
  if (!inside(level.offset) ||
      (alpha ? !inside(level.alpha_offset) : level.alpha_offset != kNoOffset)) {
    check.fault(Rule::kTextureLevel, &level.offset,
                "its blocks at {} or their alpha twin at {} are not in the {} bytes of the texture",
                {level.offset, level.alpha_offset, data_size});
  }
}

void check_textures(FaultLog& log, const BundleParts& parts) {
  std::uint64_t next_level = 0;
  for (std::uint32_t i = 0; i < parts.textures.size() && !log.stop(); ++i) {
    const TextureRecord& texture = parts.textures[i];
    const RecordCheck check(log, parts, "texture", i);
    check_texture(check, texture);
    const SectionEntry* data = find_section(parts.sections, SectionType::kTextureData, i, 0);
    const bool found = check.range(Rule::kTextureRange, texture.first_level, texture.level_count,
                                   next_level, parts.texture_levels.size(), "level");
    next_level += texture.level_count;
    for (std::uint32_t j = 0; found && j < texture.level_count && !log.stop(); ++j) {
      const std::uint32_t level = texture.first_level + j;
      check_texture_level(RecordCheck(log, parts, "texture level", level), texture,
                          parts.texture_levels[level], j, data != nullptr ? data->size : 0);
    }
  }
  if (log.clean() && next_level != parts.texture_levels.size()) {
    log.add(Rule::kTextureRange, 0, "texture levels", "{} levels belong to no texture",
            {parts.texture_levels.size() - next_level});
  }
}

void check_pattern(const RecordCheck& check, const PatternRecord& pattern) {
  check.name(pattern.name);
  check.size(pattern.width_mm, "width_mm", kLeastPatternMm, kMostPatternMm);
  check.number(pattern.score, "score", -1.0, 100.0);
  check.reserved(pattern.reserved, sizeof(pattern.reserved));
  if (pattern.copies == 1 || pattern.copies > kMaxCopies) {
    check.fault(Rule::kPattern, &pattern.copies, "{} copies are not 0 or 2 to {}",
                {pattern.copies, kMaxCopies});
  }
  const std::uint32_t side = std::max(pattern.width, pattern.height);
  if (std::min(pattern.width, pattern.height) == 0 || side > kMaxPatternSide) {
    return check.fault(Rule::kPattern, &pattern.width, "{} x {} pixels is not a possible size",
                       {pattern.width, pattern.height});
  }
  const double half_width = static_cast<double>(pattern.width) / side;
  const double half_height = static_cast<double>(pattern.height) / side;
  // Written so that NaN fails.
  if (!(std::fabs(static_cast<double>(pattern.half_width) - half_width) <= 1e-6) ||
      !(std::fabs(static_cast<double>(pattern.half_height) - half_height) <= 1e-6)) {
    check.fault(Rule::kPattern, &pattern.half_width,
                "half sides " + number_text(static_cast<double>(pattern.half_width)) + ", " +
                    number_text(static_cast<double>(pattern.half_height)) +
                    " do not follow from its pixels");
  }
}

void check_parameter_set(const RecordCheck& check, const BundleParts& parts, std::uint32_t index) {
  const ParameterSetRecord& set = parts.parameter_sets[index];
  check.name(set.name);
  check.number(set.scale_factor, "scale_factor", 0.0);
  check.number(set.pattern_scale, "pattern_scale", 0.0);
  check.number(set.ransac_threshold, "ransac_threshold", 0.0);
  check.reserved(set.reserved, sizeof(set.reserved));
  if (set.detector != static_cast<std::uint32_t>(Detector::kFastOrb) &&
      set.detector != static_cast<std::uint32_t>(Detector::kAgastBrisk)) {
    check.fault(Rule::kEnum, &set.detector, "detector {} is not known", {set.detector});
  }
  if (set.harris > 1) {
    check.fault(Rule::kEnum, &set.harris, "harris is {}", {set.harris});
  }
  if (index > 0 && parts.parameter_sets[index - 1].id >= set.id) {
    check.fault(Rule::kParameterSet, &set.id, "ids do not rise from set to set");
  }
  if (set.descriptor_bits == 0 || set.descriptor_bits % 8 != 0 ||
      set.descriptor_bits > kMaxDescriptorBits) {
    check.fault(Rule::kParameterSet, &set.descriptor_bits,
                "{} bits is not a possible descriptor size", {set.descriptor_bits});
  }
}

void check_twin(const RecordCheck& check, const BundleParts& parts, const SectionEntry& entry,
                const ParameterSetRecord& set) {
  const std::span<const std::byte> bytes = section_bytes(parts, entry);
  if (bytes.size() < sizeof(FeatureHeader)) {
    return check.fault(Rule::kFeatures, &entry.size, "it is too small for its header");
  }
  const auto& header = *reinterpret_cast<const FeatureHeader*>(bytes.data());
  check.reserved(&header.reserved, sizeof(header.reserved));
  const std::uint64_t keypoint_bytes = std::uint64_t{header.count} * sizeof(KeypointRecord);
  const std::uint64_t descriptor_bytes = std::uint64_t{header.count} * header.descriptor_bytes;
  const std::uint64_t first = header.keypoints_offset;
  const std::uint64_t second = header.descriptors_offset;
  if (header.descriptor_bytes != set.descriptor_bits / 8) {
    check.fault(Rule::kFeatures, &header.descriptor_bytes,
                "descriptors of {} bytes are not the {} bits of its parameter set",
                {header.descriptor_bytes, set.descriptor_bits});
  }
  if (first != sizeof(FeatureHeader) || second % 16 != 0 || second > bytes.size() ||
      second < first + keypoint_bytes || second - first - keypoint_bytes >= 16 ||
      descriptor_bytes != bytes.size() - second) {
    check.fault(Rule::kFeatures, &header.keypoints_offset,
                "{} keypoints at {} and descriptors at {} do not fill its {} bytes",
                {header.count, first, second, bytes.size()});
  }
}

void check_shadow(const RecordCheck& check, const BundleParts& parts, const SectionEntry& entry) {
  const std::span<const std::byte> bytes = section_bytes(parts, entry);
  if (bytes.size() < sizeof(ShadowHeader)) {
    return check.fault(Rule::kScene, &entry.size, "its shadow is too small for its header");
  }
  const auto& header = *reinterpret_cast<const ShadowHeader*>(bytes.data());
  check.numbers(header.low, "low", -kMostSceneNumber, kMostSceneNumber);
  check.numbers(header.high, "high", -kMostSceneNumber, kMostSceneNumber);
  check.reserved(header.reserved, sizeof(header.reserved));
  const bool sized = std::min(header.width, header.height) >= 1 &&
                     std::max(header.width, header.height) <= kMaxShadowSide;
  if (!sized || bytes.size() - sizeof(ShadowHeader) != header.width * header.height ||
      !(header.low[0] < header.high[0]) || !(header.low[1] < header.high[1])) {
    check.fault(Rule::kScene, &header.width,
                "{} x {} texels of a shadow do not fill its section, or its rectangle is empty",
                {header.width, header.height});
  }
}

void check_colours(const RecordCheck& check, const BundleParts& parts, const SectionEntry& entry) {
  const std::span<const std::byte> bytes = section_bytes(parts, entry);
  if (bytes.size() < sizeof(ColourGridHeader)) {
    return check.fault(Rule::kPattern, &entry.size, "its colours are too few for their header");
  }
  const auto& header = *reinterpret_cast<const ColourGridHeader*>(bytes.data());
  check.reserved(header.reserved, sizeof(header.reserved));
  const bool sized = std::min(header.columns, header.rows) >= 1 &&
                     std::max(header.columns, header.rows) <= kMaxColourCells;
  constexpr std::size_t kCell = 3 * sizeof(std::uint16_t);
  if (!sized || bytes.size() - sizeof header != header.columns * header.rows * kCell) {
    check.fault(Rule::kPattern, &header.columns, "{} x {} colours do not fill their section",
                {header.columns, header.rows});
  }
}

void check_shape(const RecordCheck& check, const BundleParts& parts, const SectionEntry& entry) {
  const PatternRecord& pattern = parts.patterns[entry.owner];
  PatternSurface surface;
  const char* fault =
      view_pattern_shape(section_bytes(parts, entry), pattern.width, pattern.height, surface);
  if (fault != nullptr) {
    return check.fault(Rule::kPattern, &entry.size, std::string("the pattern's shape: ") + fault);
  }
  const auto& header =
      *reinterpret_cast<const PatternShapeHeader*>(section_bytes(parts, entry).data());
  check.reserved(header.reserved, sizeof(header.reserved));
  for (const ShapeFaceRecord& face : surface.faces()) {
    check.reserved(&face.reserved, sizeof(face.reserved));
  }
}

/// What a walk needs to stay in its bytes: check_bundle() sees whether it is a tree.
void check_draw_order(const RecordCheck& check, const BundleParts& parts,
                      const SectionEntry& entry) {
  const std::span<const std::byte> bytes = section_bytes(parts, entry);
  const auto* first = reinterpret_cast<const DrawOrderRecord*>(bytes.data());
  const std::span nodes(first, bytes.size() / sizeof(DrawOrderRecord));
  const std::uint32_t level = parts.chunks[entry.owner].first_level;
  const std::size_t triangles =
      level < parts.levels.size() ? parts.levels[level].index_count / 3 : 0;
  std::size_t found = 0;
  bool good = bytes.size() % sizeof(DrawOrderRecord) == 0;
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    check.numbers(nodes[i].plane, "plane");
    const bool has = nodes[i].triangle != kNone;
    found += has;
    good = good && nodes[i].behind < nodes.size() - i && (!has || nodes[i].triangle < triangles);
  }
  if (!good || found != triangles) {
    check.fault(Rule::kChunkRange, &entry.size,
                "its draw order does not hold the {} triangles of chunk {}",
                {triangles, entry.owner});
  }
}

/// What a section's owner may be.
struct Owners {
  const char* name;
  std::uint32_t count;
};

Owners owners_of(const BundleParts& parts, SectionOwner owner) {
  switch (owner) {
    case SectionOwner::kNothing:
      break;
    case SectionOwner::kPattern:
      return {"pattern", parts.patterns.size()};
    case SectionOwner::kScene:
      return {"scene", parts.scenes.size()};
    case SectionOwner::kChunk:
      return {"chunk", parts.chunks.own().size()};
    case SectionOwner::kTexture:
      return {"texture", parts.textures.size()};
    case SectionOwner::kClip:
      return {"clip", parts.clips.size()};
    case SectionOwner::kMedia:
      return {"media", parts.media.size()};
  }
  return {};
}

/// A section that belongs to a record: the record is there, and so is the parameter set.
void check_owned_section(const RecordCheck& check, const BundleParts& parts,
                         const SectionEntry& entry) {
  const SectionInfo* info = section_info(entry.type);
  if (info == nullptr || info->owner == SectionOwner::kNothing) return;
  const Owners owners = owners_of(parts, info->owner);
  const bool features =
      info->type == SectionType::kMappedFeatures || info->type == SectionType::kFeatureYml;
  const std::uint32_t set = features ? find_parameter_set(parts.parameter_sets, entry.variant) : 0;
  if (entry.owner >= owners.count || set == kNone || (!features && entry.variant != 0)) {
    return check.fault(Rule::kSectionOwner, &entry.owner,
                       owners.name + (with_numbers(" {}", {entry.owner})) +
                           (features ? with_numbers(" or parameter set {}", {entry.variant}) : "") +
                           " is not there");
  }
  switch (info->type) {
    case SectionType::kMappedFeatures:
      return check_twin(check, parts, entry, parts.parameter_sets[set]);
    case SectionType::kPatternColours:
      return check_colours(check, parts, entry);
    case SectionType::kPatternShape:
      return check_shape(check, parts, entry);
    case SectionType::kShadow:
      return check_shadow(check, parts, entry);
    case SectionType::kDrawOrder:
      return check_draw_order(check, parts, entry);
    default:
      return;
  }
}

void check_scene(const RecordCheck& check, const BundleParts& parts, const SceneRecord& scene) {
  check.number(scene.scale, "scale", kLeastSceneScale, kMostSceneNumber);
  check.numbers(scene.offset, "offset", -kMostSceneNumber, kMostSceneNumber);
  check.numbers(scene.rotation, "rotation");
  check.reserved(scene.reserved, sizeof(scene.reserved));
  if (scene.pattern >= parts.patterns.size() || scene.model >= parts.models.size()) {
    check.fault(Rule::kScene, &scene.pattern, "pattern {} or model {} is not there",
                {scene.pattern, scene.model});
  }
  if (!unit_length(scene.rotation)) {
    check.fault(Rule::kScene, scene.rotation, "its rotation is not a unit quaternion");
  }
}

/// Light is nowhere negative, and so has a positive mean that bounds all that varies: of any light,
/// the coefficients behind the first are at most 2, 15/8 or 15/16 times as great as that one.
void check_sky(const RecordCheck& check, const LightRecord& light) {
  constexpr double kRounding = 1e-3;
  for (std::size_t i = 0; i < std::size(light.sky); ++i) {
    const auto mean = static_cast<double>(light.sky[i % 3]);
    const auto value = static_cast<double>(light.sky[i]);
    const bool good = i < 3 ? value >= 0.0 && value <= kMostLight
                            : std::fabs(value) <= 2.0 * mean * (1.0 + kRounding) + kRounding;
    if (good) continue;
    return check.fault(Rule::kLightValues, &light.sky[i],
                       "coefficient " + std::to_string(i / 3) + " is " + number_text(value) +
                           ", the mean light " + number_text(mean));
  }
}

void check_light(const RecordCheck& check, const BundleParts& parts, std::uint32_t index) {
  const LightRecord& light = parts.lights[index];
  check.numbers(light.sky, "sky");
  check.numbers(light.key, "key", 0.0, kMostLight);
  check_sky(check, light);
  check.numbers(light.direction, "direction");
  check.reserved(&light.reserved0, sizeof(light.reserved0));
  check.reserved(&light.reserved1, sizeof(light.reserved1));
  if (light.scene >= parts.scenes.size() ||
      (index > 0 && parts.lights[index - 1].scene >= light.scene)) {
    check.fault(Rule::kScene, &light.scene, "scene {} is not there or out of order", {light.scene});
  }
  if (!unit_length(light.direction)) {
    check.fault(Rule::kScene, light.direction, "the direction to its light has no unit length");
  }
}

/// The byte belongs to no attribute of the layout.
void check_occlusion(const RecordCheck& check, const BundleParts& parts, std::uint32_t index) {
  const OcclusionRecord& record = parts.occlusion[index];
  const bool first = index == 0 || parts.occlusion[index - 1].layout < record.layout;
  bool good = first && record.layout < parts.layouts.size();
  if (good) {
    const LayoutRecord& layout = parts.layouts[record.layout];
    good = record.offset < layout.stride;
    // The layout itself may be wrong: statements about it elsewhere end no check of this record.
    const std::size_t count =
        std::min<std::size_t>(layout.attribute_count, std::size(layout.attributes));
    for (std::size_t i = 0; i < count; ++i) {
      const AttributeRecord& other = layout.attributes[i];
      const std::uint32_t end = other.offset + component_bytes(other.type) * other.components;
      good = good && (record.offset < other.offset || record.offset >= end);
    }
  }
  if (!good) {
    check.fault(Rule::kLayout, &record.layout,
                "byte {} of layout {} is not free, or the layout out of order",
                {record.offset, record.layout});
  }
}

}  // namespace

std::uint32_t find_parameter_set(const Table<ParameterSetRecord>& sets, std::uint32_t id) {
  std::uint32_t low = 0;
  std::uint32_t high = sets.size();
  while (low < high) {
    const std::uint32_t middle = low + (high - low) / 2;
    if (sets[middle].id < id) {
      low = middle + 1;
    } else {
      high = middle;
    }
  }
  return low < sets.size() && sets[low].id == id ? low : kNone;
}

void validate_assets(FaultLog& log, const BundleParts& parts) {
  check_textures(log, parts);
  for (std::uint32_t i = 0; i < parts.patterns.size() && !log.stop(); ++i) {
    check_pattern(RecordCheck(log, parts, "pattern", i), parts.patterns[i]);
  }
  for (std::uint32_t i = 0; i < parts.parameter_sets.size() && !log.stop(); ++i) {
    check_parameter_set(RecordCheck(log, parts, "parameter set", i), parts, i);
  }
  for (std::uint32_t i = 0; i < parts.sections.size() && !log.stop(); ++i) {
    check_owned_section(RecordCheck(log, parts, "section", i), parts, parts.sections[i]);
  }
  for (std::uint32_t i = 0; i < parts.scenes.size() && !log.stop(); ++i) {
    check_scene(RecordCheck(log, parts, "scene", i), parts, parts.scenes[i]);
  }
  for (std::uint32_t i = 0; i < parts.lights.size() && !log.stop(); ++i) {
    check_light(RecordCheck(log, parts, "light", i), parts, i);
  }
  for (std::uint32_t i = 0; i < parts.occlusion.size() && !log.stop(); ++i) {
    check_occlusion(RecordCheck(log, parts, "occlusion", i), parts, i);
  }
  if (!log.stop()) validate_clips(log, parts);
  if (!log.stop()) validate_nodes(log, parts);
}

Result<void> verify_sections(const BundleView& bundle) {
  for (const SectionEntry& entry : bundle.sections()) {
    const auto bytes = bundle.bytes().subspan(static_cast<std::size_t>(entry.offset),
                                              static_cast<std::size_t>(entry.size));
    if (XXH64(bytes.data(), bytes.size(), 0) == entry.hash) continue;
    return tl::unexpected(wrong_section(bundle, entry));
  }
  return {};
}

Error wrong_section(const BundleView& bundle, const SectionEntry& entry) {
  FaultLog log;
  log.add(Rule::kSectionHash, entry.offset,
          "section " + std::to_string(&entry - bundle.sections().data()),
          "it has {} bytes of type {}", {entry.size, entry.type});
  return log.first();
}

}  // namespace modar
