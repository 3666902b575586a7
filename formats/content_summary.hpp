// The statement of a bundle: its records once more, as JSON lines that any text editor shows, and
// sums of its payloads. It follows from the other sections (bundle.md, Statement), so that the
// checker can hold the two against each other as it holds feature texts against their twins.
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

/// One line, without its end, and what it tells of: a record of the table, or nullptr.
using StatementSink =
    std::function<void(std::string_view line, const char* subject, std::uint32_t index)>;

/// A pattern's features under one parameter set.
struct FeatureFact {
  std::uint32_t pattern = 0;
  std::uint32_t set_id = 0;
  std::uint32_t count = 0;
  std::uint64_t text_bytes = 0;  ///< of its OpenCV YML, 0: there is none
};

/// The first line and the records of all tables. minor: of the header.
void state_records(const BundleParts& parts, std::uint16_t minor, const StatementSink& sink);

/// "{"features":...}".
std::string feature_line(const FeatureFact& fact);

/// Size and sums of a pattern's loop record.
std::string loop_line(std::uint32_t pattern, std::span<const std::byte> record);

/// Sums of a level's vertices and indices; vertices are left out where the level uses few of them,
/// so that the time taken follows the indices.
std::string level_line(const BundleParts& parts, std::uint32_t level, std::uint32_t stride);

/// Sums of the blocks of a texture's level. data: of that texture.
std::string texture_level_line(const BundleParts& parts, std::uint32_t level,
                               std::span<const std::byte> data);

/// The whole statement of a content that is about to be written.
std::string statement_of(const BundleContent& content);

}  // namespace modar
