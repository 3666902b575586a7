// Writes the lines of a content summary, and holds those of a bundle against its other sections.
#include "formats/content_summary.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cstring>

#include "formats/check_rules.hpp"
#include "formats/component.hpp"
#include "formats/field_table.hpp"
#include "formats/validate.hpp"

namespace modar {
namespace {

using Words [[gnu::vector_size(16)]] = std::uint16_t;
using Sums [[gnu::vector_size(32)]] = std::uint32_t;
constexpr std::size_t kLanes = 8;
constexpr std::size_t kMaxVectors = 4;
/// Rows whose words surely add up to less than 2^32.
constexpr std::size_t kRowsBetweenCarries = 65535;

/// Sums of whole vectors from each row on; lanes beyond the row are for nobody. Answers the rows
/// that were read: the last ones, whose vectors would leave the bytes, are not.
template <std::size_t kVectors>
std::size_t sum_rows(std::span<const std::byte> bytes, std::size_t stride,
                     std::span<std::uint64_t> sums) {
  const std::size_t reach = kVectors * sizeof(Words);
  const std::size_t rows = bytes.size() < reach ? 0 : (bytes.size() - reach) / stride + 1;
  for (std::size_t first = 0; first < rows; first += kRowsBetweenCarries) {
    const std::size_t end = std::min(rows, first + kRowsBetweenCarries);
    std::array<Sums, kVectors> part{};
    for (std::size_t row = first; row < end; ++row) {
      const std::byte* at = bytes.data() + row * stride;
      for (std::size_t v = 0; v < kVectors; ++v) {
        Words words;
        std::memcpy(&words, at + v * sizeof words, sizeof words);
        part[v] += __builtin_convertvector(words, Sums);
      }
    }
    for (std::size_t i = 0; i < sums.size(); ++i) sums[i] += part[i / kLanes][i % kLanes];
  }
  return rows;
}

/// sums[i] += word i of every row, little-endian. bytes: whole rows of 2 * sums.size() bytes.
void add_column_checksums(std::span<const std::byte> bytes, std::span<std::uint64_t> sums) {
  const std::size_t stride = 2 * sums.size();
  std::size_t row = 0;
  if (sums.size() <= kLanes) {
    row = sum_rows<1>(bytes, stride, sums);
  } else if (sums.size() <= 2 * kLanes) {
    row = sum_rows<2>(bytes, stride, sums);
  } else if (sums.size() <= kMaxVectors * kLanes) {
    row = sum_rows<kMaxVectors>(bytes, stride, sums);
  }
  for (std::size_t at = row * stride; at < bytes.size(); at += stride) {
    for (std::size_t i = 0; i < sums.size(); ++i)
      sums[i] += load_number<std::uint16_t>(bytes.data() + at + 2 * i);
  }
}

/// The same for an array in which rows have `sums.size()` words, a power of two up to 8, read many
/// rows at a time. bytes: any number of whole rows.
void add_array_sums(std::span<const std::byte> bytes, std::span<std::uint64_t> sums) {
  const std::size_t whole = bytes.size() / sizeof(Words) * sizeof(Words);
  std::array<std::uint64_t, kLanes> lanes{};
  add_column_checksums(bytes.first(whole), lanes);
  for (std::size_t i = 0; i < kLanes; ++i) sums[i % sums.size()] += lanes[i];
  for (std::size_t at = whole; at < bytes.size(); at += 2) {
    sums[(at - whole) / 2 % sums.size()] += load_number<std::uint16_t>(bytes.data() + at);
  }
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
      return append(line, std::uint32_t{load_number<std::uint8_t>(place)});
    case FieldType::kU16:
      return append(line, std::uint32_t{load_number<std::uint16_t>(place)});
    case FieldType::kU32:
      return append(line, load_number<std::uint32_t>(place));
    case FieldType::kU64:
      return append(line, load_number<std::uint64_t>(place));
    case FieldType::kI32:
      return append(line, load_number<std::int32_t>(place));
    case FieldType::kF32:
      return append(line, load_number<float>(place));
    case FieldType::kF64:
      return append(line, load_number<double>(place));
    case FieldType::kName:
      return append_name(line, parts, load_number<NameRef>(place));
    case FieldType::kAttributes:
      return append_attribute(line, load_number<AttributeRecord>(place));
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
void summarise_table(const BundleParts& parts, const char* record, const Table<T>& table,
                     const SummarySink& sink) {
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

void summarise_records(const BundleParts& parts, std::uint16_t minor, const SummarySink& sink) {
  std::string first = "{\"statement\":1,\"minor\":";
  append(first, std::uint32_t{minor});
  sink(first + "}", "header", 0);
  summarise_table(parts, "ModelRecord", parts.models, sink);
  summarise_table(parts, "ChunkRecord", parts.chunks, sink);
  summarise_table(parts, "LevelRecord", parts.levels, sink);
  summarise_table(parts, "MaterialRecord", parts.materials, sink);
  summarise_table(parts, "LayoutRecord", parts.layouts, sink);
  summarise_table(parts, "TextureRecord", parts.textures, sink);
  summarise_table(parts, "TextureLevelRecord", parts.texture_levels, sink);
  summarise_table(parts, "PatternRecord", parts.patterns, sink);
  summarise_table(parts, "ParameterSetRecord", parts.parameter_sets, sink);
  summarise_table(parts, "SceneRecord", parts.scenes, sink);
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

std::string tracker_record_line(std::uint32_t pattern, std::span<const std::byte> record) {
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

std::string content_summary_of(const BundleContent& content) {
  const BundleParts parts = parts_of(content);
  std::string text;
  const auto add = [&text](std::string_view line) { (text += line) += '\n'; };
  summarise_records(parts, kMinorVersion,
                    [&](std::string_view line, const char*, std::uint32_t) { add(line); });
  for (std::uint32_t p = 0; p < content.features.size(); ++p) {
    for (const FeatureContent& features : content.features[p]) {
      add(feature_line({p, features.set_id, static_cast<std::uint32_t>(features.keypoints.size()),
                        features.yml.size()}));
    }
  }
  for (const ExtraSection& extra : content.extra) {
    if (extra.type == static_cast<std::uint32_t>(SectionType::kTrackerRecord)) {
      add(tracker_record_line(extra.owner, extra.bytes));
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

namespace {

/// Characters of a line that are shown from where two differ.
constexpr std::size_t kShown = 48;

std::string_view from_difference(std::string_view line, std::size_t at) {
  return line.substr(std::min(at, line.size()), kShown);
}

}  // namespace

SummaryCheck::SummaryCheck(FaultLog& log, const BundleParts& parts)
    : log_(log),
      parts_(parts),
      entry_(find_section(parts.sections, SectionType::kContentSummary, kNone, 0)) {
  if (entry_ == nullptr) return;
  const std::span<const std::byte> bytes = section_bytes(parts, *entry_);
  text_ = {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

void SummaryCheck::expect(std::string_view line, const char* subject, std::uint32_t index) {
  const std::string_view rest = text_.substr(std::min(read_, text_.size()));
  const std::size_t end = std::min(rest.find('\n'), rest.size());
  const std::string_view told = rest.substr(0, end);
  // The last line has its end, too.
  if (told != line || end == rest.size()) {
    const auto [a, b] = std::mismatch(told.begin(), told.end(), line.begin(), line.end());
    const auto at = static_cast<std::size_t>(a - told.begin());
    const std::size_t shown = at - std::min<std::size_t>(at, kShown / 2);
    log_.add(Rule::kContentSummary, entry_->offset + read_ + at,
             std::string(subject) + " " + std::to_string(index),
             "it states '" + std::string(from_difference(told, shown)) + "', the bundle holds '" +
                 std::string(from_difference(line, shown)) + "'");
  }
  read_ += end + 1;
}

void SummaryCheck::records() {
  if (entry_ == nullptr) return;
  const std::uint16_t minor = reinterpret_cast<const FileHeader*>(parts_.bytes.data())->minor;
  summarise_records(parts_, minor,
                    [this](std::string_view line, const char* subject, std::uint32_t index) {
                      expect(line, subject, index);
                    });
  for (const SectionEntry& twin : parts_.sections) {
    if (twin.type != static_cast<std::uint32_t>(SectionType::kMappedFeatures)) continue;
    const SectionEntry* text =
        find_section(parts_.sections, SectionType::kFeatureYml, twin.owner, twin.variant);
    const auto& header =
        *reinterpret_cast<const FeatureHeader*>(section_bytes(parts_, twin).data());
    expect(feature_line({twin.owner, twin.variant, header.count, text != nullptr ? text->size : 0}),
           "features", twin.owner);
  }
  tracker_records();
}

void SummaryCheck::tracker_records() {
  for (const SectionEntry& entry : parts_.sections) {
    if (entry.type != static_cast<std::uint32_t>(SectionType::kTrackerRecord)) continue;
    expect(tracker_record_line(entry.owner, section_bytes(parts_, entry)), "tracker record",
           entry.owner);
  }
}

void SummaryCheck::level(std::uint32_t index, std::uint32_t stride) {
  if (entry_ != nullptr) expect(level_line(parts_, index, stride), "payload of level", index);
}

void SummaryCheck::texture_level(std::uint32_t index, std::span<const std::byte> data) {
  if (entry_ != nullptr) {
    expect(texture_level_line(parts_, index, data), "payload of texture level", index);
  }
}

void SummaryCheck::finish() {
  if (entry_ == nullptr || read_ >= text_.size()) return;
  log_.add(Rule::kContentSummary, entry_->offset + read_, "content summary",
           std::to_string(text_.size() - read_) + " bytes follow its last line");
}

}  // namespace modar
