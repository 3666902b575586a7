// The content summary of a bundle: its records once more as JSON lines that any text editor shows,
// and checksums of its payloads. It is derived from the other sections (bundle.md, Content
// summary), so the checker can compare it with them.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "formats/bundle_view.hpp"
#include "formats/bundle_writer.hpp"

namespace modar {

/// One line without its line feed, and the table and record that it describes.
using SummarySink =
    std::function<void(std::string_view line, const char* subject, std::uint32_t index)>;

/// A pattern's features under one parameter set.
struct FeatureFact {
  std::uint32_t pattern = 0;
  std::uint32_t set_id = 0;
  std::uint32_t count = 0;
  std::uint64_t text_bytes = 0;  ///< of its OpenCV YML, 0: there is none
};

/// The first line and the records of all tables. minor: of the header.
void summarise_records(const BundleParts& parts, std::uint16_t minor, const SummarySink& sink);

/// "{"features":...}".
std::string feature_line(const FeatureFact& fact);

/// Size and checksums of a pattern's tracker record.
std::string tracker_record_line(std::uint32_t pattern, std::span<const std::byte> record);

/// Checksums of a level's vertices and indices; without vertices if it has more of them than
/// indices, so that the time taken follows the indices.
std::string level_line(const BundleParts& parts, std::uint32_t level, std::uint32_t stride);

/// Checksums of the blocks of a texture's level. data: of that texture.
std::string texture_level_line(const BundleParts& parts, std::uint32_t level,
                               std::span<const std::byte> data);

/// The whole summary of a content that is about to be written.
std::string content_summary_of(const BundleContent& content);

}  // namespace modar
