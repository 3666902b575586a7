// Lays the sections out, hashes them where they are, and streams them: no payload is copied.
#include "formats/bundle_writer.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <tuple>
#include <utility>

#include "formats/base/atomic_file.hpp"
#include "formats/base/utf8.hpp"
#include "formats/colour_grid.hpp"
#include "formats/draw_order.hpp"
#include "formats/pattern_shape.hpp"
#include "formats/texture_format.hpp"
#include "formats/validate.hpp"

#define XXH_INLINE_ALL
#include <xxhash.h>

namespace modar {
namespace {

static_assert(std::endian::native == std::endian::little, "records are written from memory");

using Bytes = std::span<const std::byte>;
constexpr std::array<std::byte, kGpuAlignment> kZeros{};

/// A section before it has an offset: up to four pieces that follow each other in the file.
struct Section {
  SectionEntry entry{};
  std::array<Bytes, 4> pieces;
};

auto key(const Section& section) {
  return std::make_tuple(section.entry.type, section.entry.owner, section.entry.variant);
}

std::uint64_t align(std::uint64_t offset, std::uint64_t alignment) {
  return (offset + alignment - 1) / alignment * alignment;
}

template <class T>
Bytes bytes_of(const T& record) {
  return std::as_bytes(std::span(&record, 1));
}

/// The sections of a content, with the headers that the content itself does not hold.
class SectionList {
 public:
  /// At most `capacity` headers of each kind: pieces point at them, so they must not move.
  explicit SectionList(std::size_t capacity) {
    table_headers_.reserve(kSections.size());
    feature_headers_.reserve(capacity);
  }

  void add(SectionType type, std::uint32_t owner, std::uint32_t variant,
           const std::array<Bytes, 4>& pieces) {
    Section section;
    section.entry.type = static_cast<std::uint32_t>(type);
    section.entry.version = 1;
    section.entry.flags = section_info(section.entry.type)->flags;
    section.entry.owner = owner;
    section.entry.variant = variant;
    section.pieces = pieces;
    sections_.push_back(section);
  }

  void add_blob(SectionType type, std::uint32_t owner, Bytes bytes) {
    if (!bytes.empty()) add(type, owner, 0, {bytes});
  }

  template <class T>
  void add_table(SectionType type, const std::vector<T>& records) {
    if (records.empty()) return;
    table_headers_.push_back({static_cast<std::uint32_t>(records.size()), sizeof(T), 0});
    add(type, kNone, 0, {bytes_of(table_headers_.back()), std::as_bytes(std::span(records))});
  }

  /// Numbers chunks and levels of proxies behind those of models.
  void add_proxies(const BundleContent& content) {
    proxies_ = content.proxies;
    proxy_chunks_ = content.proxy_chunks;
    for (ProxyRecord& proxy : proxies_) {
      proxy.first_chunk += static_cast<std::uint32_t>(content.chunks.size());
    }
    for (ChunkRecord& chunk : proxy_chunks_) {
      chunk.first_level += static_cast<std::uint32_t>(content.levels.size());
    }
    add_table(SectionType::kProxies, proxies_);
    add_table(SectionType::kProxyChunks, proxy_chunks_);
    add_table(SectionType::kProxyLevels, content.proxy_levels);
  }

  void add_features(std::uint32_t pattern, const FeatureContent& features) {
    FeatureHeader header{};
    header.count = static_cast<std::uint32_t>(features.keypoints.size());
    header.descriptor_bytes = features.descriptor_bytes;
    header.keypoints_offset = sizeof(FeatureHeader);
    const std::uint64_t end =
        header.keypoints_offset + features.keypoints.size() * sizeof(KeypointRecord);
    header.descriptors_offset = align(end, 16);
    feature_headers_.push_back(header);
    add(SectionType::kMappedFeatures, pattern, features.set_id,
        {bytes_of(feature_headers_.back()), std::as_bytes(std::span(features.keypoints)),
         Bytes(kZeros).first(static_cast<std::size_t>(header.descriptors_offset - end)),
         Bytes(features.descriptors)});
    if (!features.yml.empty()) {
      add(SectionType::kFeatureYml, pattern, features.set_id,
          {std::as_bytes(std::span(features.yml.data(), features.yml.size()))});
    }
  }

  void add_extra(const ExtraSection& extra) {
    Section section;
    section.entry.type = extra.type;
    section.entry.version = extra.version;
    section.entry.flags = extra.flags;
    section.entry.owner = extra.owner;
    section.entry.variant = extra.variant;
    section.pieces = {Bytes(extra.bytes)};
    sections_.push_back(section);
  }

  /// Sorts, and gives each section its size, hash and place. False where two have one key.
  [[nodiscard]] bool finish() {
    std::sort(sections_.begin(), sections_.end(),
              [](const Section& a, const Section& b) { return key(a) < key(b); });
    std::uint64_t offset = sizeof(FileHeader) + sections_.size() * sizeof(SectionEntry);
    XXH64_state_t state;
    for (std::size_t i = 0; i < sections_.size(); ++i) {
      if (i > 0 && key(sections_[i - 1]) == key(sections_[i])) return false;
      SectionEntry& entry = sections_[i].entry;
      XXH64_reset(&state, 0);
      for (const Bytes piece : sections_[i].pieces) {
        if (!piece.empty()) XXH64_update(&state, piece.data(), piece.size());
        entry.size += piece.size();
      }
      entry.hash = XXH64_digest(&state);
      entry.offset = align(offset, entry.flags & kSectionGpu ? kGpuAlignment : kSectionAlignment);
      offset = entry.offset + entry.size;
    }
    file_size_ = offset;
    return true;
  }

  /// minor: of the format version that the content needs.
  [[nodiscard]] FileHeader header(std::uint16_t minor) const {
    FileHeader header{};
    std::copy(kMagic.begin(), kMagic.end(), header.magic);
    header.major = kMajorVersion;
    header.minor = minor;
    header.section_count = static_cast<std::uint32_t>(sections_.size());
    header.file_size = file_size_;
    header.table_offset = sizeof(FileHeader);
    header.entry_size = sizeof(SectionEntry);
    XXH64_state_t state;
    XXH64_reset(&state, 0);
    XXH64_update(&state, &header, offsetof(FileHeader, hash));
    for (const Section& section : sections_) {
      XXH64_update(&state, &section.entry, sizeof(SectionEntry));
    }
    header.hash = XXH64_digest(&state);
    return header;
  }

  [[nodiscard]] const std::vector<Section>& sections() const { return sections_; }

 private:
  std::vector<Section> sections_;
  std::vector<TableHeader> table_headers_;
  std::vector<FeatureHeader> feature_headers_;
  std::vector<ProxyRecord> proxies_;
  std::vector<ChunkRecord> proxy_chunks_;
  std::uint64_t file_size_ = 0;
};

/// What contradicts itself in a content, or nullptr.
const char* contradiction(const BundleContent& content) {
  if (content.features.size() > content.patterns.size()) return "features of a missing pattern";
  if (content.texture_data.size() > content.textures.size()) return "data of a missing texture";
  for (const auto& list : content.features) {
    for (const FeatureContent& features : list) {
      if (features.descriptors.size() != features.keypoints.size() * features.descriptor_bytes) {
        return "descriptors that do not match their keypoints";
      }
    }
  }
  return nullptr;
}

void collect(const BundleContent& content, SectionList& list) {
  list.add_blob(SectionType::kNames, kNone, std::as_bytes(std::span(content.names)));
  list.add_blob(SectionType::kMeta, kNone, std::as_bytes(std::span(content.meta)));
  list.add_blob(SectionType::kContentSummary, kNone, std::as_bytes(std::span(content.summary)));
  list.add_table(SectionType::kModels, content.models);
  list.add_table(SectionType::kChunks, content.chunks);
  list.add_table(SectionType::kLevels, content.levels);
  list.add_table(SectionType::kMaterials, content.materials);
  list.add_table(SectionType::kLayouts, content.layouts);
  list.add_table(SectionType::kTextures, content.textures);
  list.add_table(SectionType::kTextureLevels, content.texture_levels);
  list.add_table(SectionType::kPatterns, content.patterns);
  list.add_table(SectionType::kParameterSets, content.parameter_sets);
  list.add_table(SectionType::kScenes, content.scenes);
  list.add_table(SectionType::kLights, content.lights);
  list.add_table(SectionType::kOcclusion, content.occlusion);
  list.add_table(SectionType::kNodes, content.nodes);
  list.add_table(SectionType::kActions, content.actions);
  list.add_table(SectionType::kMedia, content.media);
  list.add_table(SectionType::kClips, content.clips);
  list.add_table(SectionType::kJoints, content.joints);
  list.add_table(SectionType::kBones, content.bones);
  list.add_table(SectionType::kParts, content.parts);
  list.add_table(SectionType::kSceneClips, content.scene_clips);
  list.add_proxies(content);
  for (std::uint32_t pattern = 0; pattern < content.features.size(); ++pattern) {
    for (const FeatureContent& features : content.features[pattern]) {
      list.add_features(pattern, features);
    }
  }
  for (std::uint32_t scene = 0; scene < content.shadows.size(); ++scene) {
    list.add_blob(SectionType::kShadow, scene, content.shadows[scene]);
  }
  for (std::uint32_t media = 0; media < content.media_data.size(); ++media) {
    list.add_blob(SectionType::kMediaData, media, content.media_data[media]);
  }
  for (std::uint32_t clip = 0; clip < content.clip_tracks.size(); ++clip) {
    list.add_blob(SectionType::kClipTracks, clip, content.clip_tracks[clip]);
  }
  list.add_blob(SectionType::kVertices, kNone, content.vertices);
  list.add_blob(SectionType::kIndices, kNone, content.indices);
  for (std::uint32_t texture = 0; texture < content.texture_data.size(); ++texture) {
    list.add_blob(SectionType::kTextureData, texture, content.texture_data[texture]);
  }
  for (const ExtraSection& extra : content.extra) list.add_extra(extra);
}

std::size_t feature_count(const BundleContent& content) {
  std::size_t count = 0;
  for (const auto& list : content.features) count += list.size();
  return count;
}

/// Counts what went through, so that padding needs no bookkeeping elsewhere.
class Stream {
 public:
  explicit Stream(const ByteSink& sink) : sink_(sink) {}
  [[nodiscard]] bool put(Bytes bytes) {
    position_ += bytes.size();
    return bytes.empty() || sink_(bytes);
  }
  [[nodiscard]] bool pad_to(std::uint64_t offset) {
    return put(Bytes(kZeros).first(static_cast<std::size_t>(offset - position_)));
  }

 private:
  const ByteSink& sink_;
  std::uint64_t position_ = 0;
};

bool stream(const SectionList& list, std::uint16_t minor, const ByteSink& sink) {
  Stream out(sink);
  const FileHeader header = list.header(minor);
  if (!out.put(bytes_of(header))) return false;
  for (const Section& section : list.sections()) {
    if (!out.put(bytes_of(section.entry))) return false;
  }
  for (const Section& section : list.sections()) {
    if (!out.pad_to(section.entry.offset)) return false;
    for (const Bytes piece : section.pieces) {
      if (!out.put(piece)) return false;
    }
  }
  return true;
}

}  // namespace

std::uint16_t minor_version_of(const BundleContent& content) {
  std::uint16_t minor = 1;  // the content summary's
  const auto need = [&minor](std::uint16_t since) { minor = std::max(minor, since); };
  const auto need_section = [&need](SectionType type) {
    need(section_since(static_cast<std::uint32_t>(type)));
  };
  for (const ExtraSection& section : content.extra) need(section_since(section.type));
  for (const MaterialRecord& material : content.materials) {
    need(flags_since("MaterialRecord", material.flags));
  }
  for (const TextureRecord& texture : content.textures) {
    need(flags_since("TextureRecord", texture.flags));
  }
  for (const PatternRecord& pattern : content.patterns) need(pattern.copies > 0 ? 4 : 0);
  for (const auto& shadow : content.shadows) {
    if (!shadow.empty()) need_section(SectionType::kShadow);
  }
  if (!content.lights.empty()) need_section(SectionType::kLights);
  if (!content.occlusion.empty()) need_section(SectionType::kOcclusion);
  if (!content.nodes.empty()) need_section(SectionType::kNodes);
  if (!content.actions.empty()) need_section(SectionType::kActions);
  if (!content.media.empty()) need_section(SectionType::kMedia);
  if (!content.proxies.empty()) need_section(SectionType::kProxies);
  if (!content.parts.empty()) need_section(SectionType::kParts);
  return minor;
}

NameRef BundleContent::intern(std::string_view name) {
  std::string clean;
  while (!name.empty()) {
    const std::size_t length = utf8_character(name);
    const std::string_view character = length != 0 ? name.substr(0, length) : "\xEF\xBF\xBD";
    if (clean.size() + character.size() > kMaxNameBytes) break;
    clean += character;
    name.remove_prefix(length != 0 ? length : 1);
  }
  if (clean.empty()) return {0, 0};
  // A well-formed needle is found at character boundaries only, so a part of a name serves too.
  std::size_t offset = names.find(clean);
  if (offset == std::string::npos) {
    offset = names.size();
    names += clean;
  }
  return {static_cast<std::uint32_t>(offset), static_cast<std::uint32_t>(clean.size())};
}

std::vector<SectionEntry> section_table(const BundleContent& content) {
  SectionList list(feature_count(content));
  if (contradiction(content) == nullptr) collect(content, list);
  std::vector<SectionEntry> entries;
  if (!list.finish()) return entries;  // write_bundle() reports it
  for (const Section& section : list.sections()) entries.push_back(section.entry);
  return entries;
}

Result<void> write_bundle(const BundleContent& content, const ByteSink& sink) {
  const char* wrong = contradiction(content);
  SectionList list(feature_count(content));
  if (wrong == nullptr) {
    collect(content, list);
    if (!list.finish()) wrong = "two sections of one type, owner and variant";
  }
  if (wrong == nullptr && list.sections().size() > kMaxSections) wrong = "too many sections";
  if (wrong != nullptr) {
    return fail(ExitCode::kInternal, "bundle.content", "bundle",
                std::string("the content to write has ") + wrong,
                "this is a bug of the program that fills the bundle; please report it");
  }
  // Version 1.1 added the content summary; a bundle without one is readable as 1.0.
  const std::uint16_t needed = minor_version_of(content);
  const std::uint16_t minor = content.summary.empty() && needed == 1 ? std::uint16_t{0} : needed;
  if (!stream(list, minor, sink)) {
    return fail(ExitCode::kIo, "io.write", "bundle", "the bundle could not be written in full",
                "make room on the disk and try again");
  }
  return {};
}

Result<std::vector<std::byte>> encode_bundle(const BundleContent& content) {
  std::vector<std::byte> bytes;
  const auto written = write_bundle(content, [&bytes](Bytes part) {
    bytes.insert(bytes.end(), part.begin(), part.end());
    return true;
  });
  if (!written) return tl::unexpected<Error>(written.error());
  return bytes;
}

Result<void> save_bundle(const BundleContent& content, const std::string& path) {
  auto file = AtomicFile::create(path);
  if (!file) return tl::unexpected<Error>(std::move(file.error()));
  Result<void> file_state;
  auto written = write_bundle(content, [&](Bytes part) {
    file_state = file->write(part);
    return file_state.has_value();
  });
  if (!file_state) return file_state;
  if (!written) return written;
  return file->commit();
}

}  // namespace modar
