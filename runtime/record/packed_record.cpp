// Packs tracker records and unpacks them: the picture as coded_bytes.hpp has it, then places as
// bits.
#include "modar/packed_record.hpp"

#include <algorithm>
#include <bit>
#include <cstring>
#include <memory>
#include <string>
#include <utility>

#include "formats/transport/coded_bytes.hpp"
#include "modar/pattern_record.hpp"
#include "runtime/record/record_parts.hpp"

namespace modar {
namespace {

constexpr std::uint32_t kPackedVersion = 1;

struct PackedHeader {
  std::uint32_t version;
  std::uint16_t width;
  std::uint16_t height;
  std::uint32_t feature_count;  ///< without those that fill up blocks
  std::uint32_t picture_size;   ///< bytes
  std::uint16_t patch_counts[kMaxTrackerImageLevels];
};
static_assert(sizeof(PackedHeader) == 32);

tl::unexpected<Error> broken(const char* cause) {
  return fail(ExitCode::kInvalidInput, "record.packed", "packed record", cause,
              "fetch it again, or publish it again");
}

/// Numbers below known limits, lowest bit first.
class BitString {
 public:
  BitString() = default;
  explicit BitString(std::span<const std::byte> bytes) : bytes_(bytes.begin(), bytes.end()) {}

  void write(std::uint64_t value, std::uint64_t limit) {
    for (int i = 0; i < width_of(limit); ++i, ++at_) {
      if (at_ % 8 == 0) bytes_.push_back(std::byte{0});
      bytes_.back() |= static_cast<std::byte>((value >> i & 1) << at_ % 8);
    }
  }
  std::uint64_t read(std::uint64_t limit) {
    std::uint64_t value = 0;
    for (int i = 0; i < width_of(limit); ++i, ++at_) {
      if (at_ / 8 >= bytes_.size()) continue;
      value |= (std::to_integer<std::uint64_t>(bytes_[at_ / 8]) >> at_ % 8 & 1) << i;
    }
    return value;
  }
  [[nodiscard]] bool used_up() const { return (at_ + 7) / 8 == bytes_.size(); }
  [[nodiscard]] const std::vector<std::byte>& bytes() const { return bytes_; }

 private:
  static int width_of(std::uint64_t limit) { return static_cast<int>(std::bit_width(limit - 1)); }
  std::vector<std::byte> bytes_;
  std::size_t at_ = 0;  ///< bits
};

/// The baked views laid one behind the other: a place is a pixel of them all.
class ViewStrip {
 public:
  ViewStrip(int width, int height) : views_(baked_views(width, height)) {
    for (const AffineView& view : views_) {
      starts_.push_back(total_);
      total_ += static_cast<std::uint64_t>(view.width) * static_cast<std::uint64_t>(view.height);
    }
  }
  struct Pixel {
    const AffineView* view;
    int x;
    int y;
  };
  [[nodiscard]] const std::vector<AffineView>& views() const { return views_; }
  [[nodiscard]] std::uint64_t total() const { return total_; }
  [[nodiscard]] std::uint64_t place(std::size_t view, int x, int y) const {
    return starts_[view] +
           static_cast<std::uint64_t>(y) * static_cast<std::uint64_t>(views_[view].width) +
           static_cast<std::uint64_t>(x);
  }
  /// place: below total().
  [[nodiscard]] Pixel pixel(std::uint64_t place) const {
    const auto after = std::upper_bound(starts_.begin(), starts_.end(), place);
    const auto index = static_cast<std::size_t>(after - starts_.begin()) - 1;
    const auto width = static_cast<std::uint64_t>(views_[index].width);
    const std::uint64_t within = place - starts_[index];
    return {&views_[index], static_cast<int>(within % width), static_cast<int>(within / width)};
  }

 private:
  std::vector<AffineView> views_;
  std::vector<std::uint64_t> starts_;
  std::uint64_t total_ = 0;
};

/// Where patches of a level may be.
struct PatchGrid {
  int columns = 0;
  int rows = 0;

  explicit PatchGrid(const GrayPicture& level)
      : columns(std::max(0, (level.width - 2 * kPatchBorder + kPatchStep - 1) / kPatchStep)),
        rows(std::max(0, (level.height - 2 * kPatchBorder + kPatchStep - 1) / kPatchStep)) {}
  [[nodiscard]] std::uint64_t cells() const {
    return static_cast<std::uint64_t>(columns) * static_cast<std::uint64_t>(rows);
  }
};

/// A feature alone in a picture just large enough to describe it.
constexpr int kAlone = 2 * kTrackerBorder + 1;

/// Describes features again where views show them.
class FeatureRestorer {
 public:
  explicit FeatureRestorer(const std::vector<ViewLevel>& levels) : levels_(levels) {
    DetectOptions detection = baked_detection();
    // The corner is known to be one: of dim pictures, too.
    detection.threshold = 1;
    extractor_ = FeatureExtractor::create(kAlone, kAlone, detection);
  }

  std::optional<RecordFeature> restore(const ViewStrip::Pixel& pixel) {
    const AffineView& view = *pixel.view;
    if (pixel.x < kTrackerBorder || pixel.y < kTrackerBorder ||
        pixel.x >= view.width - kTrackerBorder || pixel.y >= view.height - kTrackerBorder) {
      return std::nullopt;
    }
    const GrayPicture around = render_part(
        levels_, view, {pixel.x - kTrackerBorder, pixel.y - kTrackerBorder, kAlone, kAlone});
    extractor_->set_frame(around.view());
    const auto features = extractor_->features();
    const auto place = to_picture(view, static_cast<double>(pixel.x), static_cast<double>(pixel.y));
    const GrayImage picture = levels_[0].view();
    if (features.size() != 1 || place[0] < -0.5 || place[1] < -0.5 ||
        place[0] > picture.width - 0.5 || place[1] > picture.height - 0.5) {
      return std::nullopt;
    }
    return record_feature(view, features[0], place);
  }

 private:
  const std::vector<ViewLevel>& levels_;
  std::unique_ptr<FeatureExtractor> extractor_;
};

/// A feature of a record as bytes that tell it from others, and its number.
struct FeatureKey {
  std::array<std::uint8_t, sizeof(TrackerFeatureRecord) + kTrackerCodeBytes> bytes{};
  std::size_t index = 0;

  FeatureKey(const TrackerFeatureRecord& record, const std::array<std::uint8_t, 32>& code,
             std::size_t number)
      : index(number) {
    std::memcpy(bytes.data(), &record, sizeof record);
    std::copy(code.begin(), code.end(), bytes.begin() + sizeof record);
  }
  bool operator<(const FeatureKey& other) const { return bytes < other.bytes; }
};

std::array<std::uint8_t, 32> code_at(const TrackerRecordView& record, std::size_t index) {
  std::array<std::uint8_t, 32> code{};
  const std::size_t block = index / kTrackerBlockCodes;
  for (std::size_t k = 0; k < code.size(); ++k) {
    code[k] = record.codes[(block * kTrackerCodeBytes + k) * kTrackerBlockCodes +
                           index % kTrackerBlockCodes];
  }
  return code;
}

/// The features of both groups, without those that only fill up blocks.
std::vector<FeatureKey> keys_of(const TrackerRecordView& record) {
  std::vector<FeatureKey> keys;
  const std::size_t bright = record.header.bright_count;
  for (std::size_t first = 0; first < record.features.size();) {
    const std::size_t end = first < bright ? bright : record.features.size();
    const std::size_t group = keys.size();
    for (; first < end; ++first) {
      keys.emplace_back(record.features[first], code_at(record, first), keys.size());
    }
    while (keys.size() > group + 1 && keys.back().bytes == keys[keys.size() - 2].bytes) {
      keys.pop_back();
    }
  }
  return keys;
}

/// Where each feature was found; nothing where one was not found.
std::optional<std::vector<std::uint64_t>> places_of(const std::vector<ViewLevel>& levels,
                                                    const ViewStrip& strip,
                                                    std::vector<FeatureKey> keys) {
  std::sort(keys.begin(), keys.end());
  std::vector<std::uint64_t> places(keys.size(), strip.total());
  for (std::size_t v = 0; v < strip.views().size(); ++v) {
    const AffineView& view = strip.views()[v];
    const GrayPicture picture = render_view(levels, view, nullptr);
    const auto extractor =
        FeatureExtractor::create(picture.width, picture.height, baked_detection());
    extractor->set_frame(picture.view());
    for (const TrackerFeature& feature : extractor->features()) {
      const double x = static_cast<double>(feature.x);
      const double y = static_cast<double>(feature.y);
      const RecordFeature made = record_feature(view, feature, to_picture(view, x, y));
      const FeatureKey key(stored_feature(made), made.code, 0);
      const auto [first, last] = std::equal_range(keys.begin(), keys.end(), key);
      for (auto it = first; it != last; ++it) {
        places[it->index] = strip.place(v, static_cast<int>(x), static_cast<int>(y));
      }
    }
  }
  const bool all = std::none_of(places.begin(), places.end(),
                                [&](std::uint64_t place) { return place == strip.total(); });
  return all ? std::optional(std::move(places)) : std::nullopt;
}

GrayImage picture_of(const TrackerRecordView& record) {
  return {record.pixels.data(), static_cast<int>(record.header.width),
          static_cast<int>(record.header.height), static_cast<std::ptrdiff_t>(record.header.width)};
}

/// Writes the cells of all patches; false where one is in none.
bool write_patches(const TrackerRecordView& record, const std::vector<ViewLevel>& levels,
                   PackedHeader& header, BitString& bits) {
  for (const TrackerPatchRecord& patch : record.patches) {
    if (patch.level >= levels.size()) return false;
    const PatchGrid grid(levels[patch.level]);
    const int unit = 64 << patch.level;  // a pixel of the level
    const int column = (patch.x / unit - kPatchBorder) / kPatchStep;
    const int row = (patch.y / unit - kPatchBorder) / kPatchStep;
    if (column < 0 || row < 0 || column >= grid.columns || row >= grid.rows) return false;
    bits.write(static_cast<std::uint64_t>(row * grid.columns + column), grid.cells());
    ++header.patch_counts[patch.level];
  }
  return true;
}

Result<std::vector<TrackerPatchRecord>> read_patches(const PackedHeader& header,
                                                     const std::vector<ViewLevel>& levels,
                                                     BitString& bits) {
  std::vector<TrackerPatchRecord> patches;
  for (std::size_t level = 0; level < std::size(header.patch_counts); ++level) {
    const std::uint32_t count = header.patch_counts[level];
    if (count == 0) continue;
    if (level >= levels.size()) return broken("it has patches of a level that it lacks");
    const PatchGrid grid(levels[level]);
    if (grid.cells() == 0 || patches.size() + count > kMaxTrackerPatches) {
      return broken("it has too many patches");
    }
    for (std::uint32_t i = 0; i < count; ++i) {
      const std::uint64_t cell = bits.read(grid.cells());
      if (cell >= grid.cells()) return broken("a patch is outside the picture");
      const auto columns = static_cast<std::uint64_t>(grid.columns);
      const int x = kPatchBorder + kPatchStep * static_cast<int>(cell % columns);
      const int y = kPatchBorder + kPatchStep * static_cast<int>(cell / columns);
      patches.push_back(patch_record(x, y, level, patch_score(levels[level], x, y)));
    }
  }
  return patches;
}

Result<std::vector<RecordFeature>> read_features(const PackedHeader& header,
                                                 const std::vector<ViewLevel>& levels,
                                                 BitString& bits) {
  const ViewStrip strip(header.width, header.height);
  FeatureRestorer restorer(levels);
  std::vector<RecordFeature> features;
  for (std::uint32_t i = 0; i < header.feature_count; ++i) {
    const std::uint64_t place = bits.read(strip.total());
    const auto feature =
        place < strip.total() ? restorer.restore(strip.pixel(place)) : std::nullopt;
    if (!feature) return broken("no feature is where it says");
    features.push_back(*feature);
  }
  return features;
}

/// packed: as long as the whole, of which the header is there.
Result<PackedHeader> packed_header(std::span<const std::byte> packed) {
  PackedHeader header{};
  if (packed.size() < sizeof header) return broken("it ends in its header");
  std::memcpy(&header, packed.data(), sizeof header);
  if (header.version != kPackedVersion) return broken("its version is unknown");
  if (!is_pattern_size(header.width, header.height)) {
    return broken("a side is not 32 to 1023 pixels");
  }
  if (header.feature_count > kMaxTrackerFeatures) return broken("it has too many features");
  if (header.picture_size > packed.size() - sizeof header) return broken("it ends in its picture");
  return header;
}

}  // namespace

std::optional<std::vector<std::byte>> pack_tracker_record(std::span<const std::byte> record) {
  TrackerRecordView view;
  if (view_tracker_record(record, view)) return std::nullopt;
  const GrayImage picture = picture_of(view);
  if (!is_pattern_size(picture.width, picture.height)) return std::nullopt;
  const std::vector<ViewLevel> levels = view_levels(picture);
  const std::vector<FeatureKey> keys = keys_of(view);
  const ViewStrip strip(picture.width, picture.height);
  const auto places = places_of(levels, strip, keys);
  if (!places) return std::nullopt;
  PackedHeader header{};
  header.version = kPackedVersion;
  header.width = static_cast<std::uint16_t>(picture.width);
  header.height = static_cast<std::uint16_t>(picture.height);
  header.feature_count = static_cast<std::uint32_t>(keys.size());
  BitString bits;
  for (const std::uint64_t place : *places) bits.write(place, strip.total());
  if (!write_patches(view, levels, header, bits)) return std::nullopt;
  const auto coded = encode_picture(levels[0].pixels, header.width);
  header.picture_size = static_cast<std::uint32_t>(coded.size());
  std::vector<std::byte> packed(sizeof header);
  std::memcpy(packed.data(), &header, sizeof header);
  packed.insert(packed.end(), coded.begin(), coded.end());
  packed.insert(packed.end(), bits.bytes().begin(), bits.bytes().end());
  const auto again = unpack_tracker_record(packed);
  if (!again || !std::equal(again->begin(), again->end(), record.begin(), record.end())) {
    return std::nullopt;
  }
  return packed;
}

RecordUnpacker::RecordUnpacker(std::span<const std::byte> packed) : packed_(packed) {}
RecordUnpacker::RecordUnpacker(RecordUnpacker&&) noexcept = default;
RecordUnpacker& RecordUnpacker::operator=(RecordUnpacker&&) noexcept = default;
RecordUnpacker::~RecordUnpacker() = default;

void RecordUnpacker::go_on(std::size_t there) {
  if (there < sizeof(PackedHeader)) return;
  if (!picture_) {
    const auto header = packed_header(packed_);
    if (!header) return;  // finish() tells
    picture_ = std::make_unique<PictureDecoder>(
        packed_.subspan(sizeof *header, header->picture_size), header->width, header->height);
  }
  picture_->go_on(there - sizeof(PackedHeader));
}

Result<std::vector<std::byte>> RecordUnpacker::finish() {
  MODAR_ASSIGN(const PackedHeader header, packed_header(packed_));
  go_on(packed_.size());
  auto pixels = picture_->finish();
  if (!pixels) return broken("its picture ends too early");
  const std::vector<ViewLevel> levels =
      view_levels({pixels->data(), header.width, header.height, header.width});
  BitString bits(packed_.subspan(sizeof header + header.picture_size));
  MODAR_ASSIGN(const auto features, read_features(header, levels, bits));
  MODAR_ASSIGN(const auto patches, read_patches(header, levels, bits));
  if (!bits.used_up()) return broken("it holds more than it says");
  return assemble_record({levels.begin(), levels.end()}, features, patches);
}

Result<std::vector<std::byte>> unpack_tracker_record(std::span<const std::byte> packed) {
  return RecordUnpacker(packed).finish();
}

}  // namespace modar
