// The one rule of the checker that needs OpenCV: a pattern's YML text equals its mapped twin.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "formats/check.hpp"

namespace modar {

/// Reads every kFeatureYml section with OpenCV's FileStorage and compares bit for bit. bytes: a
/// bundle that check_bundle() found good. Answers true if no finding was an error.
bool check_yml_twins(std::span<const std::byte> bytes, const IssueSink& sink);

/// The same for one pattern under one parameter set.
bool check_yml_twin(std::span<const std::byte> bytes, std::uint32_t pattern, std::uint32_t set_id,
                    const IssueSink& sink);

}  // namespace modar
