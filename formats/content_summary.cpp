// Writes the lines of a statement.
#include "formats/content_summary.hpp"

#include <array>
#include <charconv>
#include <cstring>

#include "formats/column_checksums.hpp"
#include "formats/field_table.hpp"

namespace modar {
namespace {

template <class T>
T load(const std::byte* place) {
  T value;
  std::memcpy(&value, place, sizeof(T));
  return value;
}

/// Shortest digits that read back as the same number; JSON reads them, too.
template <class T>
void append(std::string& line, T value) {
  std::array<char, 32> text{};
  const auto end = std::to_chars(text.data(), text.data() + text.size(), value);
  line.append(text.data(), end.ptr);
}

void append_name(std::string& line, const BundleParts& parts, NameRef ref) {
  const auto* text = reinterpret_cast<const char*>(parts.names.data());
  line += '"';
  for (std::uint32_t i = 0; i < ref.length; ++i) {
    const char letter = text[ref.offset + i];
    if (letter == '"' || letter == '\\') line += '\\';
    line += letter;
  }
  line += '"';
}

void append_attribute(std::string& line, const AttributeRecord& a) {
  const std::uint32_t numbers[] = {a.semantic, a.type, a.components, a.normalised, a.offset};
  char separator = '[';
  for (const std::uint32_t number : numbers) {
    line += separator;
    append(line, number);
    separator = ',';
  }
  line += ']';
}

void append_element(std::string& line, const BundleParts& parts, FieldType type,
                    const std::byte* place) {
  switch (type) {
    case FieldType::kU8:
      return append(line, std::uint32_t{load<std::uint8_t>(place)});
    case FieldType::kU16:
      return append(line, std::uint32_t{load<std::uint16_t>(place)});
    case FieldType::kU32:
      return append(line, load<std::uint32_t>(place));
    case FieldType::kU64:
      return append(line, load<std::uint64_t>(place));
    case FieldType::kI32:
      return append(line, load<std::int32_t>(place));
    case FieldType::kF32:
      return append(line, load<float>(place));
    case FieldType::kF64:
      return append(line, load<double>(place));
    case FieldType::kName:
      return append_name(line, parts, load<NameRef>(place));
    case FieldType::kAttributes:
      return append_attribute(line, load<AttributeRecord>(place));
  }
}

std::string record_line(const BundleParts& parts, const RecordInfo& info, std::uint32_t index,
                        const std::byte* record) {
  std::string line = std::string("{\"") + info.table + "\":";
  append(line, index);
  for (const FieldInfo& field : info.fields) {
    if (field.reserved) continue;
    line += std::string(",\"") + field.name + "\":";
    const bool array = field.count > 1;
    for (std::size_t i = 0; i < field.count; ++i) {
      if (array) line += i == 0 ? '[' : ',';
      append_element(line, parts, field.type,
                     record + field.offset + i * field_element_bytes(field.type));
    }
    if (array) line += ']';
  }
  return line + "}";
}

template <class T>
void state_table(const BundleParts& parts, const char* record, const Table<T>& table,
                 const StatementSink& sink) {
  const RecordInfo& info = record_info(record);
  for (std::uint32_t i = 0; i < table.size(); ++i) {
    sink(record_line(parts, info, i, reinterpret_cast<const std::byte*>(&table[i])), info.table, i);
  }
}

void append_sums(std::string& line, const char* key, std::span<const std::uint64_t> sums) {
  line += std::string(",\"") + key + "\":";
  for (std::size_t i = 0; i < sums.size(); ++i) {
    line += i == 0 ? '[' : ',';
    append(line, sums[i]);
  }
  line += ']';
}

std::span<const std::byte> part(std::span<const std::byte> bytes, std::uint64_t offset,
                                std::uint64_t size) {
  return bytes.subspan(static_cast<std::size_t>(offset), static_cast<std::size_t>(size));
}

template <class T>
Table<T> table_of(const std::vector<T>& records) {
  return {reinterpret_cast<const std::byte*>(records.data()),
          static_cast<std::uint32_t>(records.size()), sizeof(T)};
}

BundleParts parts_of(const BundleContent& content) {
  BundleParts parts;
  parts.names = std::as_bytes(std::span(content.names));
  parts.vertices = content.vertices;
  parts.indices = content.indices;
  parts.models = table_of(content.models);
  parts.chunks = table_of(content.chunks);
  parts.levels = table_of(content.levels);
  parts.materials = table_of(content.materials);
  parts.layouts = table_of(content.layouts);
  parts.textures = table_of(content.textures);
  parts.texture_levels = table_of(content.texture_levels);
  parts.patterns = table_of(content.patterns);
  parts.parameter_sets = table_of(content.parameter_sets);
  parts.scenes = table_of(content.scenes);
  return parts;
}

}  // namespace

void state_records(const BundleParts& parts, std::uint16_t minor, const StatementSink& sink) {
  std::string first = "{\"statement\":1,\"minor\":";
  append(first, std::uint32_t{minor});
  sink(first + "}", "header", 0);
  state_table(parts, "ModelRecord", parts.models, sink);
  state_table(parts, "ChunkRecord", parts.chunks, sink);
  state_table(parts, "LevelRecord", parts.levels, sink);
  state_table(parts, "MaterialRecord", parts.materials, sink);
  state_table(parts, "LayoutRecord", parts.layouts, sink);
  state_table(parts, "TextureRecord", parts.textures, sink);
  state_table(parts, "TextureLevelRecord", parts.texture_levels, sink);
  state_table(parts, "PatternRecord", parts.patterns, sink);
  state_table(parts, "ParameterSetRecord", parts.parameter_sets, sink);
  state_table(parts, "SceneRecord", parts.scenes, sink);
}

std::string feature_line(const FeatureFact& fact) {
  std::string line = "{\"features\":";
  append(line, fact.pattern);
  line += ",\"set\":";
  append(line, fact.set_id);
  line += ",\"count\":";
  append(line, fact.count);
  line += ",\"text_bytes\":";
  append(line, fact.text_bytes);
  return line + "}";
}

std::string loop_line(std::uint32_t pattern, std::span<const std::byte> record) {
  std::string line = "{\"loop_record\":";
  append(line, pattern);
  line += ",\"bytes\":";
  append(line, std::uint64_t{record.size()});
  std::array<std::uint64_t, 4> sums{};
  // An odd byte at the end would be half a word: records end with pixels of any number.
  add_array_sums(record.first(record.size() / 2 * 2), sums);
  append_sums(line, "sums", sums);
  line += ",\"last\":";
  append(line, record.empty() ? 0u : std::to_integer<std::uint32_t>(record.back()));
  return line + "}";
}

std::string level_line(const BundleParts& parts, std::uint32_t level, std::uint32_t stride) {
  const LevelRecord& record = parts.levels[level];
  std::string line = "{\"level_sums\":";
  append(line, level);
  if (record.vertex_count <= record.index_count) {
    std::vector<std::uint64_t> sums(stride / 2);
    add_column_checksums(
        part(parts.vertices, record.vertex_offset, std::uint64_t{record.vertex_count} * stride),
        sums);
    append_sums(line, "vertices", sums);
  }
  std::array<std::uint64_t, 1> sum{};
  add_array_sums(part(parts.indices, record.index_offset, 2ull * record.index_count), sum);
  line += ",\"indices\":";
  append(line, sum[0]);
  return line + "}";
}

std::string texture_level_line(const BundleParts& parts, std::uint32_t level,
                               std::span<const std::byte> data) {
  const TextureLevelRecord& record = parts.texture_levels[level];
  std::string line = "{\"texture_level_sums\":";
  append(line, level);
  std::array<std::uint64_t, 4> sums{};
  add_array_sums(part(data, record.offset, record.size), sums);
  append_sums(line, "blocks", sums);
  if (record.alpha_offset != kNoOffset) {
    sums = {};
    add_array_sums(part(data, record.alpha_offset, record.size), sums);
    append_sums(line, "alpha_blocks", sums);
  }
  return line + "}";
}

std::string statement_of(const BundleContent& content) {
  const BundleParts parts = parts_of(content);
  std::string text;
  const auto add = [&text](std::string_view line) { (text += line) += '\n'; };
  state_records(parts, kMinorVersion,
                [&](std::string_view line, const char*, std::uint32_t) { add(line); });
  for (std::uint32_t p = 0; p < content.features.size(); ++p) {
    for (const FeatureContent& features : content.features[p]) {
      add(feature_line({p, features.set_id, static_cast<std::uint32_t>(features.keypoints.size()),
                        features.yml.size()}));
    }
  }
  for (const ExtraSection& extra : content.extra) {
    if (extra.type == static_cast<std::uint32_t>(SectionType::kTrackerRecord)) {
      add(loop_line(extra.owner, extra.bytes));
    }
  }
  for (const ModelRecord& model : content.models) {
    const std::uint32_t stride = content.layouts[model.layout].stride;
    for (std::uint32_t c = 0; c < model.chunk_count; ++c) {
      const ChunkRecord& chunk = content.chunks[model.first_chunk + c];
      for (std::uint32_t l = 0; l < chunk.level_count; ++l) {
        add(level_line(parts, chunk.first_level + l, stride));
      }
    }
  }
  for (std::size_t t = 0; t < content.textures.size(); ++t) {
    const TextureRecord& texture = content.textures[t];
    for (std::uint32_t l = 0; l < texture.level_count; ++l) {
      add(texture_level_line(parts, texture.first_level + l, content.texture_data[t]));
    }
  }
  return text;
}

}  // namespace modar
