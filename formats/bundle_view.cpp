// Opens a bundle: validation from end to end, then plain look-ups.
#include "formats/bundle_view.hpp"

#include <bit>

#include "formats/rules.hpp"
#include "formats/validate.hpp"

namespace modar {
namespace {

static_assert(std::endian::native == std::endian::little, "records are read in place");

std::string_view text_of(std::span<const std::byte> bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

}  // namespace

Result<BundleView> BundleView::open(std::span<const std::byte> bytes) {
  FaultLog log;
  BundleParts parts;
  if (validate_sections(bytes, log, parts) && validate_tables(log, parts)) {
    validate_models(log, parts);
    if (!log.stop()) validate_assets(log, parts);
  }
  if (!log.clean()) return tl::unexpected<Error>(log.first());
  return BundleView(parts);
}

std::span<const std::byte> BundleView::section(SectionType type, std::uint32_t owner,
                                               std::uint32_t variant) const {
  const SectionEntry* entry = find_section(parts_.sections, type, owner, variant);
  return entry != nullptr ? section_bytes(parts_, *entry) : std::span<const std::byte>();
}

std::string_view BundleView::name(NameRef ref) const {
  return text_of(parts_.names).substr(ref.offset, ref.length);
}

std::string_view BundleView::meta() const {
  return text_of(section(SectionType::kMeta));
}

std::span<const std::byte> BundleView::texture_data(std::uint32_t texture) const {
  return section(SectionType::kTextureData, texture);
}

ClipTracksView BundleView::clip_tracks(std::uint32_t clip) const {
  ClipTracksView view;
  view_clip_tracks(section(SectionType::kClipTracks, clips()[clip].tracks), joints().size(), view);
  return view;
}

std::span<const std::byte> BundleView::media_data(std::uint32_t media) const {
  return section(SectionType::kMediaData, media);
}

FeatureView BundleView::features(std::uint32_t pattern, std::uint32_t set_id) const {
  const std::span<const std::byte> bytes = section(SectionType::kMappedFeatures, pattern, set_id);
  if (bytes.empty()) return {};
  const auto& header = *reinterpret_cast<const FeatureHeader*>(bytes.data());
  FeatureView view;
  view.keypoints = {reinterpret_cast<const KeypointRecord*>(bytes.data() + header.keypoints_offset),
                    header.count};
  view.descriptors = bytes.subspan(static_cast<std::size_t>(header.descriptors_offset),
                                   std::size_t{header.count} * header.descriptor_bytes);
  view.descriptor_bytes = header.descriptor_bytes;
  return view;
}

std::string_view BundleView::feature_yml(std::uint32_t pattern, std::uint32_t set_id) const {
  return text_of(section(SectionType::kFeatureYml, pattern, set_id));
}

}  // namespace modar
