// A bundle against its models as a second reader reads them, which shares no reader with the bake.
#pragma once

#include <string>

#include "bake/bundle/bundle_builder.hpp"
#include "bake/check/source/second_model.hpp"
#include "formats/bundle_view.hpp"
#include "formats/check.hpp"

namespace modar {

/// The companion program that is the second reader; part of the laboratory.
inline constexpr const char* kSecondReader = "modar-second-reader";

/// Compares a model's counts, area, volume and middle, and small pictures of it from 12 sides, in
/// its colours without highlights. Reports SOURCE_COUNTS, SOURCE_SURFACE and SOURCE_COLOUR.
Result<void> check_second(const BundleView& bundle, std::uint32_t model, SecondModel second,
                          const IssueSink& sink);

/// Reads the request's models by the program `reader`, and compares them. Reports SOURCE_READER
/// where the bake's reader alone knows a model or its colours.
Result<void> check_second(const BundleView& bundle, const BakeRequest& request,
                          const std::string& reader, const IssueSink& sink);

}  // namespace modar
