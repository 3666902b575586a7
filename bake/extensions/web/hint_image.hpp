// The picture that a page shows of a pattern, so that visitors find the print.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "formats/base/error.hpp"
#include "formats/bundle_view.hpp"

namespace modar {

/// A WebP file: the bundle's picture of the pattern (SectionType::kPatternPicture), else the gray
/// one that the tracker looks for.
/// width, height: of the tracker's picture. Errors: kInvalidInput "web.pattern".
struct Hint {
  std::vector<std::byte> file;
  std::uint32_t width = 0;
  std::uint32_t height = 0;
};
Result<Hint> hint_of(const BundleView& bundle, std::uint32_t pattern);

}  // namespace modar
