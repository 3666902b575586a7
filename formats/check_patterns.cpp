// Rules on patterns: parameters that their detector can run with, and features that lie in the
// image.
#include <algorithm>
#include <cmath>
#include <cstddef>

#include "formats/check_rules.hpp"
#include "formats/tracker_record_view.hpp"
#include "formats/validate.hpp"

namespace modar {
namespace {

bool is_orb(const ParameterSetRecord& set) {
  return set.detector == static_cast<std::uint32_t>(Detector::kFastOrb);
}

/// What the device's detectors take, too: a set that they refuse is not to travel.
bool can_run(const ParameterSetRecord& set) {
  const bool common = set.min_matches >= 4 && set.min_inliers >= 4 && set.ransac_threshold > 0.0f &&
                      set.max_distance > 0 && set.max_distance <= set.descriptor_bits;
  if (is_orb(set)) {
    return common && set.max_features >= 1 && set.max_features <= 100000 &&
           set.scale_factor > 1.0f && set.scale_factor <= 4.0f && set.level_count >= 1 &&
           set.level_count <= 16 && set.edge_threshold <= 1024 &&
           set.first_level < set.level_count && set.wta_k >= 2 && set.wta_k <= 4 &&
           set.patch_size >= 2 && set.patch_size <= 255 && set.fast_threshold >= 1 &&
           set.fast_threshold <= 255 && set.agast_threshold == 0 && set.octaves == 0 &&
           set.pattern_scale == 0.0f;
  }
  return common && set.agast_threshold >= 1 && set.agast_threshold <= 255 && set.octaves <= 8 &&
         set.pattern_scale >= 0.1f && set.pattern_scale <= 10.0f && set.max_features == 0 &&
         set.scale_factor == 0.0f && set.level_count == 0 && set.edge_threshold == 0 &&
         set.first_level == 0 && set.wta_k == 0 && set.harris == 0 && set.patch_size == 0 &&
         set.fast_threshold == 0;
}

void check_parameter_set(FaultLog& log, const BundleParts& parts, const ParameterSetRecord& set) {
  const std::uint32_t bits = is_orb(set) ? 256 : 512;
  if (set.descriptor_bits != bits) {
    log.add(
        Rule::kDescriptorLength, offset_of(parts, &set.descriptor_bits),
        label(parts, "parameter set", set.name),
        std::to_string(set.descriptor_bits) + " bits, the detector makes " + std::to_string(bits));
  }
  if (!can_run(set)) {
    log.add(Rule::kParameterValues, offset_of(parts, &set), label(parts, "parameter set", set.name),
            "see PARAMETER_VALUES in bundle.md");
  }
}

void check_twin(FaultLog& log, const BundleParts& parts, const ParameterSetRecord& set,
                const SectionEntry& entry, const std::string& where) {
  const PatternRecord& pattern = parts.patterns[entry.owner];
  constexpr std::uint32_t kAny = 1u << 31;
  const std::uint32_t octaves = is_orb(set) ? set.level_count : kAny;
  const std::span<const std::byte> bytes = section_bytes(parts, entry);
  const auto& header = *reinterpret_cast<const FeatureHeader*>(bytes.data());
  const std::span keypoints(
      reinterpret_cast<const KeypointRecord*>(bytes.data() + header.keypoints_offset),
      header.count);
  Tally values;
  Tally outside;
  for (const KeypointRecord& k : keypoints) {
    // Comparisons are written so that NaN fails.
    if (!(k.size > 0.0f && std::isfinite(k.size) && std::fabs(k.angle) <= 360.0f &&
          std::isfinite(k.response) && static_cast<std::uint32_t>(k.octave) < octaves &&
          std::isfinite(k.x) && std::isfinite(k.y))) {
      values.hit(offset_of(parts, &k));
    } else if (!(k.x >= 0.0f && k.y >= 0.0f &&
                 static_cast<double>(k.x) <= static_cast<double>(pattern.width) &&
                 static_cast<double>(k.y) <= static_cast<double>(pattern.height))) {
      outside.hit(offset_of(parts, &k));
    }
  }
  const auto tell = [&](Rule rule, const Tally& tally) {
    if (tally.count == 0) return;
    log.add(rule, tally.first, where, std::to_string(tally.count) + " keypoints");
  };
  tell(Rule::kKeypointValues, values);
  tell(Rule::kKeypointOutside, outside);
  const std::uint64_t end = header.keypoints_offset + keypoints.size_bytes();
  for (std::uint64_t i = end; i < header.descriptors_offset; ++i) {
    if (bytes[static_cast<std::size_t>(i)] == std::byte{0}) continue;
    log.add(Rule::kPadding, entry.offset + i, where,
            "a byte between keypoints and descriptors is not zero");
    break;
  }
}

void check_text(FaultLog& log, const BundleParts& parts, const SectionEntry& entry,
                const std::string& where) {
  const std::span<const std::byte> bytes = section_bytes(parts, entry);
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  if (!text.starts_with("%YAML:1.0")) {
    log.add(Rule::kFeatureYml, entry.offset, where, "it does not start with %YAML:1.0");
  }
  if (find_section(parts.sections, SectionType::kMappedFeatures, entry.owner, entry.variant) ==
      nullptr) {
    log.add(Rule::kFeatureYml, entry.offset, where, "it has no mapped twin");
  }
}

void check_loop_record(FaultLog& log, const BundleParts& parts, const PatternRecord& pattern,
                       const SectionEntry& entry) {
  const std::string where = label(parts, "pattern", pattern.name) + ", loop record";
  TrackerRecordView view;
  if (const auto fault = view_tracker_record(section_bytes(parts, entry), view)) {
    log.add(Rule::kTrackerRecord, entry.offset + fault->offset, where, fault->cause);
  } else if (view.header.describer_version != kFeatureExtractor) {
    log.add(Rule::kTrackerRecord, entry.offset, where, "its describer's version is unknown");
  } else if (view.header.width != pattern.width || view.header.height != pattern.height) {
    log.add(Rule::kTrackerRecord, entry.offset + offsetof(TrackerRecordHeader, width), where,
            "its image has another size than the pattern");
  }
}

/// The twins of a pattern lie side by side in the section table.
void check_findable(FaultLog& log, const BundleParts& parts, std::uint32_t index) {
  if (find_section(parts.sections, SectionType::kTrackerRecord, index, 0) != nullptr) return;
  constexpr auto kTwin = static_cast<std::uint32_t>(SectionType::kMappedFeatures);
  const auto first =
      std::lower_bound(parts.sections.begin(), parts.sections.end(), index,
                       [](const SectionEntry& entry, std::uint32_t owner) {
                         return entry.type < kTwin || (entry.type == kTwin && entry.owner < owner);
                       });
  for (auto entry = first;
       entry != parts.sections.end() && entry->type == kTwin && entry->owner == index; ++entry) {
    const auto& header =
        *reinterpret_cast<const FeatureHeader*>(section_bytes(parts, *entry).data());
    const std::uint32_t set = find_parameter_set(parts.parameter_sets, entry->variant);
    if (header.count >= parts.parameter_sets[set].min_matches) return;
  }
  const PatternRecord& pattern = parts.patterns[index];
  log.add(Rule::kFeaturesMissing, offset_of(parts, &pattern), label(parts, "pattern", pattern.name),
          "it has no record for the pose loop, and no parameter set found as many features as it "
          "wants matches");
}

}  // namespace

void check_patterns(FaultLog& log, const BundleParts& parts) {
  for (std::uint32_t i = 0; i < parts.parameter_sets.size(); ++i) {
    check_parameter_set(log, parts, parts.parameter_sets[i]);
  }
  for (std::uint32_t i = 0; i < parts.patterns.size(); ++i) check_findable(log, parts, i);
  for (const SectionEntry& entry : parts.sections) {
    const auto type = static_cast<SectionType>(entry.type);
    if (type == SectionType::kTrackerRecord) {
      check_loop_record(log, parts, parts.patterns[entry.owner], entry);
    }
    if (type != SectionType::kMappedFeatures && type != SectionType::kFeatureYml) continue;
    const PatternRecord& pattern = parts.patterns[entry.owner];
    const std::uint32_t set = find_parameter_set(parts.parameter_sets, entry.variant);
    const std::string where = label(parts, "pattern", pattern.name) + ", " +
                              label(parts, "parameter set", parts.parameter_sets[set].name);
    if (type == SectionType::kMappedFeatures) {
      check_twin(log, parts, parts.parameter_sets[set], entry, where);
    } else {
      check_text(log, parts, entry, where);
    }
  }
}

}  // namespace modar
