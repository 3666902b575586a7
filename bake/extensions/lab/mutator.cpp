// Finds the fields of a bundle by the field table and its records, draws mutations and applies
// them.
#include "bake/extensions/lab/mutator.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <map>

#include "formats/colour_grid.hpp"
#include "formats/component.hpp"
#include "formats/draw_order.hpp"
#include "formats/pattern_shape.hpp"
#include "formats/tracker_record.hpp"

#define XXH_INLINE_ALL
#include <xxhash.h>

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
    case Semantic::kJoints:
      return "vertex bones";
    case Semantic::kWeights:
      return "vertex weights";
    case Semantic::kMorphX:
    case Semantic::kMorphY:
    case Semantic::kMorphZ:
      return "vertex morph";
  }
  return "vertex";
}

/// occlusion: the byte of a vertex that holds it, or kNone.
void add_level(Collector& out, const LayoutRecord& layout, const LevelRecord& level,
               std::uint32_t occlusion, std::uint64_t vertices, std::uint64_t indices) {
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
    out.add(byte == occlusion ? "vertex occlusion" : "vertex padding", FieldType::kU8,
            {first + byte, layout.stride, level.vertex_count});
  }
  out.add("index", FieldType::kU16, {indices + level.index_offset, 2, level.index_count});
}

void add_geometry(Collector& out, const BundleView& bundle) {
  const auto place = [&bundle](std::span<const std::byte> part) {
    return static_cast<std::uint64_t>(part.data() - bundle.bytes().data());
  };
  for (std::uint32_t g = 0; g < bundle.chunk_groups(); ++g) {
    const ChunkGroup group = bundle.chunk_group(g);
    const ModelRecord& model = bundle.models()[group.model];
    for (std::uint32_t c = 0; c < group.chunk_count; ++c) {
      const ChunkRecord& chunk = bundle.chunks()[group.first_chunk + c];
      for (std::uint32_t l = 0; l < chunk.level_count; ++l) {
        add_level(out, bundle.layouts()[model.layout], bundle.levels()[chunk.first_level + l],
                  occlusion_byte(bundle.occlusion(), model.layout), place(bundle.vertices()),
                  place(bundle.indices()));
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

void add_colours(Collector& out, const SectionEntry& entry) {
  out.add_records(record_info("ColourGridHeader"), entry.offset, sizeof(ColourGridHeader), 1);
  out.add(
      "pattern colour", FieldType::kU16,
      {entry.offset + sizeof(ColourGridHeader), 2, (entry.size - sizeof(ColourGridHeader)) / 2});
}

void add_shape(Collector& out, const BundleView& bundle, const SectionEntry& entry) {
  const auto& header =
      *reinterpret_cast<const PatternShapeHeader*>(bundle.bytes().data() + entry.offset);
  out.add_records(record_info("PatternShapeHeader"), entry.offset, sizeof header, 1);
  out.add_records(record_info("ShapeFaceRecord"), entry.offset + sizeof header,
                  sizeof(ShapeFaceRecord), header.face_count);
}

void add_tracks(Collector& out, const BundleView& bundle, const SectionEntry& entry) {
  const auto& header =
      *reinterpret_cast<const ClipTracksHeader*>(bundle.bytes().data() + entry.offset);
  const std::uint64_t keys = sizeof header + header.track_count * sizeof(TrackRecord);
  out.add_records(record_info("ClipTracksHeader"), entry.offset, sizeof header, 1);
  out.add_records(record_info("TrackRecord"), entry.offset + sizeof header, sizeof(TrackRecord),
                  header.track_count);
  out.add("clip keys", FieldType::kU16, {entry.offset + keys, 2, (entry.size - keys) / 2});
}

void add_shadow(Collector& out, const SectionEntry& entry) {
  out.add_records(record_info("ShadowHeader"), entry.offset, sizeof(ShadowHeader), 1);
  out.add("shadow texel", FieldType::kU8,
          {entry.offset + sizeof(ShadowHeader), 1, entry.size - sizeof(ShadowHeader)});
}

void add_section(Collector& out, const BundleView& bundle, const SectionEntry& entry) {
  const SectionInfo* info = section_info(entry.type);
  for (const RecordInfo& record : record_infos()) {
    if (record.table == nullptr || info == nullptr || info->record != std::string_view(record.name))
      continue;
    const auto& header =
        *reinterpret_cast<const TableHeader*>(bundle.bytes().data() + entry.offset);
    out.add_records(record_info("TableHeader"), entry.offset, sizeof(TableHeader), 1);
    out.add_records(record, entry.offset + sizeof(TableHeader), header.stride, header.count);
  }
  if (static_cast<SectionType>(entry.type) == SectionType::kPatternColours)
    return add_colours(out, entry);
  if (static_cast<SectionType>(entry.type) == SectionType::kPatternShape)
    return add_shape(out, bundle, entry);
  if (static_cast<SectionType>(entry.type) == SectionType::kDrawOrder) {
    return out.add_records(record_info("DrawOrderRecord"), entry.offset, sizeof(DrawOrderRecord),
                           entry.size / sizeof(DrawOrderRecord));
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
    case SectionType::kShadow:
      return add_shadow(out, entry);
    case SectionType::kClipTracks:
      return add_tracks(out, bundle, entry);
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

namespace {

constexpr std::size_t kMaxExtension = 64;

template <class T>
void store(std::byte* place, T value) {
  std::memcpy(place, &value, sizeof(T));
}

template <class T>
void set_extreme(std::byte* place, std::uint64_t pick) {
  using Limits = std::numeric_limits<T>;
  if constexpr (Limits::is_iec559) {
    const std::array<T, 8> values = {0,
                                     1,
                                     -1,
                                     Limits::infinity(),
                                     Limits::quiet_NaN(),
                                     Limits::max(),
                                     Limits::lowest(),
                                     Limits::denorm_min()};
    store(place, values[pick % values.size()]);
  } else {
    const std::array<T, 5> values = {0, 1, Limits::max(), static_cast<T>(Limits::max() - 1),
                                     static_cast<T>(Limits::max() / 2 + 1)};
    store(place, values[pick % values.size()]);
  }
}

template <class T>
void step(std::byte* place, std::uint64_t pick) {
  const T value = load_number<T>(place);
  const bool up = pick % 2 == 0;
  if constexpr (std::numeric_limits<T>::is_iec559) {
    const T far = std::numeric_limits<T>::infinity();
    store(place, std::nextafter(value, up ? far : -far));
  } else {
    store(place, static_cast<T>(up ? value + T{1} : value - T{1}));
  }
}

/// Calls `work` with a value of the field's type.
template <class Work>
void with_type(FieldType type, Work work) {
  switch (type) {
    case FieldType::kU8:
      return work(std::uint8_t{});
    case FieldType::kU16:
      return work(std::uint16_t{});
    case FieldType::kU32:
    case FieldType::kI32:
      return work(std::uint32_t{});
    case FieldType::kF32:
      return work(float{});
    case FieldType::kF64:
      return work(double{});
    default:
      return work(std::uint64_t{});
  }
}

}  // namespace

std::vector<ItemArray> item_arrays(const BundleView& bundle) {
  std::vector<ItemArray> arrays;
  const auto add = [&arrays](const char* name, std::uint64_t first, std::uint64_t size,
                             std::uint64_t count) {
    if (count > 1) arrays.push_back({name, first, size, count});
  };
  const auto place = [&bundle](const void* part) {
    return static_cast<std::uint64_t>(static_cast<const std::byte*>(part) - bundle.bytes().data());
  };
  for (std::uint32_t g = 0; g < bundle.chunk_groups(); ++g) {
    const ChunkGroup group = bundle.chunk_group(g);
    const std::uint16_t stride = bundle.layouts()[bundle.models()[group.model].layout].stride;
    for (std::uint32_t c = 0; c < group.chunk_count; ++c) {
      const ChunkRecord& chunk = bundle.chunks()[group.first_chunk + c];
      for (std::uint32_t l = 0; l < chunk.level_count; ++l) {
        const LevelRecord& level = bundle.levels()[chunk.first_level + l];
        add("vertices", place(bundle.vertices().data()) + level.vertex_offset, stride,
            level.vertex_count);
        add("triangles", place(bundle.indices().data()) + level.index_offset, 6,
            level.index_count / 3);
      }
    }
  }
  for (const SectionEntry& entry : bundle.sections()) {
    const std::byte* bytes = bundle.bytes().data() + entry.offset;
    const auto type = static_cast<SectionType>(entry.type);
    if (type == SectionType::kTextureData) {
      add("blocks", entry.offset, 8, entry.size / 8);
    } else if (type == SectionType::kMappedFeatures) {
      const auto& header = *reinterpret_cast<const FeatureHeader*>(bytes);
      add("descriptors", entry.offset + header.descriptors_offset, header.descriptor_bytes,
          header.count);
    } else if (type == SectionType::kTrackerRecord) {
      const auto& header = *reinterpret_cast<const TrackerRecordHeader*>(bytes);
      add("codes", entry.offset + header.codes_offset, kTrackerCodeBytes, header.feature_count);
    }
  }
  return arrays;
}

Mutator::Mutator(std::span<const std::byte> bytes, std::uint64_t seed)
    : bytes_(bytes.begin(), bytes.end()), size_(bytes.size()), whole_(bytes.size()), random_(seed) {
  const Result<BundleView> view = BundleView::open(bytes);
  section_count_ = view->sections().size();
  fields_ = mutation_fields(*view);
  for (const ItemArray& array : item_arrays(*view)) {
    const auto same = [&](const auto& kind) { return std::strcmp(kind[0].name, array.name) == 0; };
    const auto kind = std::find_if(arrays_.begin(), arrays_.end(), same);
    if (kind == arrays_.end()) {
      arrays_.push_back({array});
    } else {
      kind->push_back(array);
    }
  }
  head_.assign(bytes.begin(),
               bytes.begin() + static_cast<std::ptrdiff_t>(sizeof(FileHeader) +
                                                           section_count_ * sizeof(SectionEntry)));
  bytes_.resize(whole_ + kMaxExtension);
}

SectionEntry& Mutator::entry(std::size_t i) {
  return *reinterpret_cast<SectionEntry*>(bytes_.data() + sizeof(FileHeader) +
                                          i * sizeof(SectionEntry));
}

/// Makes the hashes of sections that touch [from, to) true, and then that of the header.
void Mutator::rehash(std::uint64_t from, std::uint64_t to) {
  auto& header = *reinterpret_cast<FileHeader*>(bytes_.data());
  const bool table = from < head_.size();
  for (std::size_t i = 0; i < section_count_; ++i) {
    SectionEntry& section = entry(i);
    if (section.offset > size_ || section.size > size_ - section.offset) continue;
    if (!table && (to <= section.offset || from >= section.offset + section.size)) continue;
    section.hash = XXH64(bytes_.data() + section.offset, section.size, 0);
  }
  XXH64_state_t state;
  XXH64_reset(&state, 0);
  XXH64_update(&state, bytes_.data(), offsetof(FileHeader, hash));
  const std::size_t room = (size_ - std::min(size_, sizeof(FileHeader))) / sizeof(SectionEntry);
  XXH64_update(&state, bytes_.data() + sizeof(FileHeader),
               std::min<std::size_t>(header.section_count, room) * sizeof(SectionEntry));
  header.hash = XXH64_digest(&state);
}

Mutation Mutator::next(bool rehashed) {
  // Fields are the many, the file as a whole is one thing.
  const std::uint64_t pick = draw(rehashed ? 32 : 8);
  Mutation mutation = pick == 0                ? truncate(rehashed)
                      : pick == 1              ? swap_sections(rehashed)
                      : rehashed && pick < 6   ? permute(rehashed)
                      : !rehashed && pick == 2 ? extend()
                      : !rehashed && pick < 6  ? flip_bit()
                                               : edit_field(rehashed);
  mutation.rehashed = rehashed;
  if (!rehashed) mutation.kind += " unhashed";
  return mutation;
}

void Mutator::undo() {
  size_ = whole_;
  std::copy(saved_.begin(), saved_.end(), bytes_.begin() + static_cast<std::ptrdiff_t>(saved_at_));
  saved_.clear();
  std::copy(head_.begin(), head_.end(), bytes_.begin());
}

/// Changes one element and names the kind of change.
const char* Mutator::change(const MutationField& field, std::uint64_t place) {
  std::byte* at = bytes_.data() + place;
  const std::size_t size = field_element_bytes(field.type);
  const std::vector<std::byte> before(at, at + size);
  const char* kind = "field bit";
  const std::uint64_t pick = draw(5);
  if (pick == 1) {
    kind = "field extreme";
    with_type(field.type, [&](auto zero) { set_extreme<decltype(zero)>(at, random_()); });
  } else if (pick == 2) {
    kind = "field step";
    with_type(field.type, [&](auto zero) { step<decltype(zero)>(at, random_()); });
  } else if (pick == 3) {
    kind = "field random";
    store(at, static_cast<std::uint8_t>(random_()));
    for (std::size_t i = 1; i < size; ++i) store(at + i, static_cast<std::uint8_t>(random_()));
  } else if (pick == 4) {
    kind = "field copied";
    std::memcpy(at, bytes_.data() + field.place(draw(field.elements())), size);
  }
  if (!std::equal(before.begin(), before.end(), at)) return kind;
  const std::uint64_t bit = draw(8 * size);
  at[bit / 8] ^= std::byte{static_cast<unsigned char>(1u << (bit % 8))};
  return "field bit";
}

Mutation Mutator::edit_field(bool rehashed) {
  const MutationField* field = nullptr;
  do {
    field = &fields_[draw(fields_.size())];
  } while (rehashed && field->hash);
  Mutation mutation;
  mutation.field = field->name;
  mutation.offset = field->place(draw(field->elements()));
  const std::size_t size = field_element_bytes(field->type);
  const std::byte* at = bytes_.data() + mutation.offset;
  saved_at_ = mutation.offset;
  saved_.assign(at, at + size);
  mutation.before = saved_;
  mutation.kind = change(*field, mutation.offset);
  mutation.after.assign(at, at + size);
  if (rehashed) rehash(mutation.offset, mutation.offset + size);
  return mutation;
}

/// Swaps two items, or rotates the parts of one: its two-byte parts for a triangle, which flips or
/// turns it, its bytes otherwise.
Mutation Mutator::permute(bool rehashed) {
  if (arrays_.empty()) return edit_field(rehashed);
  // The kind first: a bundle has hundreds of chunks, and few arrays of descriptors.
  const std::vector<ItemArray>& kind = arrays_[draw(arrays_.size())];
  const ItemArray& array = kind[draw(kind.size())];
  const bool triangle = std::strcmp(array.name, "triangles") == 0;
  const bool swap = draw(2) == 0;
  const std::uint64_t a = draw(array.count);
  const std::uint64_t b = swap ? (a + 1 + draw(array.count - 1)) % array.count : a;
  const std::uint64_t from = array.first + std::min(a, b) * array.size;
  const std::uint64_t to = array.first + (std::max(a, b) + 1) * array.size;
  std::byte* const at = bytes_.data() + from;
  const std::vector<std::byte> before(at, bytes_.data() + to);
  if (swap) {
    std::swap_ranges(at, at + array.size, bytes_.data() + to - array.size);
  } else if (triangle) {
    std::swap_ranges(at, at + 2, at + 2 + 2 * draw(2));
  } else {
    std::rotate(at, at + 1 + draw(array.size - 1), at + array.size);
  }
  if (std::equal(before.begin(), before.end(), at)) return edit_field(rehashed);
  saved_at_ = from;
  saved_ = before;
  if (rehashed) rehash(from, to);
  Mutation mutation{std::string(array.name) + (swap       ? " swapped"
                                               : triangle ? " flipped"
                                                          : " rotated"),
                    "",
                    from,
                    {},
                    {},
                    false};
  return mutation;
}

Mutation Mutator::flip_bit() {
  const std::uint64_t bit = draw(8 * std::uint64_t{whole_});
  Mutation mutation{"bit", "", bit / 8, {}, {}, false};
  std::byte& byte = bytes_[bit / 8];
  saved_at_ = bit / 8;
  saved_ = mutation.before = {byte};
  byte ^= std::byte{static_cast<unsigned char>(1u << (bit % 8))};
  mutation.after = {byte};
  return mutation;
}

/// Cuts the file; rehashed, header and section table state the rest.
Mutation Mutator::truncate(bool rehashed) {
  size_ = draw(whole_);
  Mutation mutation{"truncation", "", size_, {}, {}, false};
  if (!rehashed || size_ < head_.size()) return mutation;
  auto& header = *reinterpret_cast<FileHeader*>(bytes_.data());
  std::uint32_t kept = 0;
  std::uint64_t end = head_.size();
  for (std::size_t i = 0; i < section_count_; ++i) {
    SectionEntry& section = entry(i);
    if (section.offset >= size_) {
      section = SectionEntry{};
      continue;
    }
    section.size = std::min<std::uint64_t>(section.size, size_ - section.offset);
    end = section.offset + section.size;
    ++kept;
  }
  header.section_count = kept;
  header.file_size = size_ = end;
  rehash(0, size_);
  return mutation;
}

Mutation Mutator::extend() {
  const std::size_t more = 1 + draw(kMaxExtension);
  size_ = whole_ + more;
  return {"longer file", "", whole_, {}, {}, false};
}

/// Exchanges the bytes of two sections: in place where their sizes allow it, else their places.
Mutation Mutator::swap_sections(bool rehashed) {
  if (section_count_ < 2) return edit_field(rehashed);
  Mutation mutation{"sections swapped", "", 0, {}, {}, false};
  const std::size_t a = draw(section_count_);
  const std::size_t b = (a + 1 + draw(section_count_ - 1)) % section_count_;
  SectionEntry& one = entry(a);
  SectionEntry& two = entry(b);
  mutation.offset = one.offset;
  mutation.field = std::to_string(one.type) + " and " + std::to_string(two.type);
  std::swap(one.offset, two.offset);
  std::swap(one.size, two.size);
  if (draw(2) == 0) std::swap(one, two);  // the table stays in the order of places
  if (rehashed) rehash(0, size_);
  return mutation;
}

}  // namespace modar
