// Writes the lines of a content summary, and holds those of a bundle against its other sections.
#include "formats/content_summary.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <functional>

#include "formats/base/shortest_number.hpp"
#include "formats/check_rules.hpp"
#include "formats/component.hpp"
#include "formats/field_table.hpp"
#include "formats/validate.hpp"

namespace modar {
namespace {

/// One line, without its line feed, and the table and record that it describes.
using LineSink =
    std::function<void(std::string_view line, const char* subject, std::uint32_t index)>;

/// Shortest digits that read back as the same number; JSON reads them, too.
template <class T>
void append(std::string& line, T value) {
  std::array<char, 32> text{};
  const auto end = std::to_chars(text.data(), text.data() + text.size(), value);
  line.append(text.data(), end.ptr);
}
#ifndef __cpp_lib_to_chars  // libc++ knows integers only
void append(std::string& line, float value) {
  line += shortest_text(value);
}
void append(std::string& line, double value) {
  line += shortest_text(value);
}
#endif

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
    // Bundles from before it was added have no such field.
    const bool added = std::string_view(field.name) == "copies";
    if (added && load_number<std::uint32_t>(record + field.offset) == 0) continue;
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
                     const LineSink& sink) {
  const RecordInfo& info = record_info(record);
  for (std::uint32_t i = 0; i < table.size(); ++i) {
    sink(record_line(parts, info, i, reinterpret_cast<const std::byte*>(&table[i])), info.table, i);
  }
}

template <class T>
Table<T> table_of(const std::vector<T>& records) {
  return {reinterpret_cast<const std::byte*>(records.data()),
          static_cast<std::uint32_t>(records.size()), sizeof(T)};
}

BundleParts parts_of(const BundleContent& content) {
  BundleParts parts;
  parts.names = std::as_bytes(std::span(content.names));
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
  parts.lights = table_of(content.lights);
  parts.occlusion = table_of(content.occlusion);
  parts.nodes = table_of(content.nodes);
  parts.actions = table_of(content.actions);
  parts.media = table_of(content.media);
  return parts;
}

std::string section_line(const SectionEntry& entry) {
  std::string line = "{\"section\":";
  append(line, entry.type);
  line += ",\"owner\":";
  append(line, entry.owner);
  line += ",\"variant\":";
  append(line, entry.variant);
  line += ",\"bytes\":";
  append(line, entry.size);
  constexpr char kDigits[] = "0123456789abcdef";
  line += ",\"xxh64\":\"";
  for (int shift = 60; shift >= 0; shift -= 4) line += kDigits[entry.hash >> shift & 15];
  return line + "\"}";
}

/// Every line, in order. sections: in the order of the section table.
void summarise(const BundleParts& parts, std::uint16_t minor,
               std::span<const SectionEntry> sections, const LineSink& sink) {
  std::string first = "{\"summary\":1,\"minor\":";
  append(first, std::uint32_t{minor});
  sink(first + "}", "header", 0);
  summarise_table(parts, "ModelRecord", parts.models, sink);
  // Readers that skip clips and proxies expect no lines of them: their sections' hashes are there.
  summarise_table(parts, "ChunkRecord", parts.chunks.own(), sink);
  summarise_table(parts, "LevelRecord", parts.levels.own(), sink);
  summarise_table(parts, "MaterialRecord", parts.materials, sink);
  summarise_table(parts, "LayoutRecord", parts.layouts, sink);
  summarise_table(parts, "TextureRecord", parts.textures, sink);
  summarise_table(parts, "TextureLevelRecord", parts.texture_levels, sink);
  summarise_table(parts, "PatternRecord", parts.patterns, sink);
  summarise_table(parts, "ParameterSetRecord", parts.parameter_sets, sink);
  summarise_table(parts, "SceneRecord", parts.scenes, sink);
  summarise_table(parts, "LightRecord", parts.lights, sink);
  summarise_table(parts, "OcclusionRecord", parts.occlusion, sink);
  summarise_table(parts, "NodeRecord", parts.nodes, sink);
  summarise_table(parts, "ActionRecord", parts.actions, sink);
  summarise_table(parts, "MediaRecord", parts.media, sink);
  std::uint32_t index = 0;
  for (const SectionEntry& entry : sections) {
    if (entry.type != static_cast<std::uint32_t>(SectionType::kContentSummary)) {
      sink(section_line(entry), "section", index);
    }
    ++index;
  }
}

/// Characters of a line that are shown from where two differ.
constexpr std::size_t kShown = 48;

/// The part of a line around where it differs.
std::string around(std::string_view line, std::size_t at) {
  const std::size_t first = at - std::min<std::size_t>(at, kShown / 2);
  return std::string(line.substr(std::min(first, line.size()), kShown));
}

}  // namespace

std::string content_summary_of(const BundleContent& content) {
  std::string text;
  summarise(parts_of(content), minor_version_of(content), section_table(content),
            [&text](std::string_view line, const char*, std::uint32_t) { (text += line) += '\n'; });
  return text;
}

void check_summary(FaultLog& log, const BundleParts& parts) {
  const SectionEntry* entry = find_section(parts.sections, SectionType::kContentSummary, kNone, 0);
  if (entry == nullptr) return;
  const std::span<const std::byte> bytes = section_bytes(parts, *entry);
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  const std::uint16_t minor = reinterpret_cast<const FileHeader*>(parts.bytes.data())->minor;
  std::size_t read = 0;
  summarise(parts, minor, parts.sections,
            [&](std::string_view line, const char* subject, std::uint32_t index) {
              const std::string_view rest = text.substr(std::min(read, text.size()));
              const std::size_t end = std::min(rest.find('\n'), rest.size());
              const std::string_view stated = rest.substr(0, end);
              // The last line has its line feed, too.
              if (stated != line || end == rest.size()) {
                const auto differ =
                    std::mismatch(stated.begin(), stated.end(), line.begin(), line.end());
                const auto at = static_cast<std::size_t>(differ.first - stated.begin());
                log.add(Rule::kContentSummary, entry->offset + read + at,
                        std::string(subject) + " " + std::to_string(index),
                        "it states '" + around(stated, at) + "', the bundle holds '" +
                            around(line, at) + "'");
              }
              read += end + 1;
            });
  if (read >= text.size()) return;
  log.add(Rule::kContentSummary, entry->offset + read, "content summary",
          "{} bytes follow its last line", {text.size() - read});
}

}  // namespace modar
