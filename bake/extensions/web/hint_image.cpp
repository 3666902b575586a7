#include "bake/extensions/web/hint_image.hpp"

#include <algorithm>
#include <string>

#include "bake/image/image.hpp"
#include "formats/tracker_record.hpp"

namespace modar {
namespace {

RgbaImage gray_picture(const TrackerRecordView& record) {
  RgbaImage image{record.header.width, record.header.height, {}};
  const std::size_t pixels = std::size_t{image.width} * image.height;
  image.pixels.resize(4 * pixels);
  for (std::size_t i = 0; i < pixels; ++i) {
    std::fill_n(image.pixels.begin() + static_cast<std::ptrdiff_t>(4 * i), 3, record.pixels[i]);
    image.pixels[4 * i + 3] = 255;
  }
  return image;
}

}  // namespace

Result<Hint> hint_of(const BundleView& bundle, std::uint32_t pattern) {
  TrackerRecordView record;
  const auto bytes = bundle.section(SectionType::kTrackerRecord, pattern);
  if (bytes.empty() || view_tracker_record(bytes, record)) {
    const std::string name(bundle.name(bundle.patterns()[pattern].name));
    return fail(ExitCode::kInvalidInput, "web.pattern", "pattern '" + name + "'",
                "it has no tracker record", "bake the bundle with this version of modar");
  }
  Hint hint{{}, record.header.width, record.header.height};
  const auto picture = bundle.section(SectionType::kPatternPicture, pattern);
  hint.file.assign(picture.begin(), picture.end());
  if (picture.empty()) {
    MODAR_ASSIGN(hint.file, encode_preview(gray_picture(record), hint.width, hint.height));
  }
  return hint;
}

}  // namespace modar
