// The door of this room: a bundle as one HTML file that a person reads, on paper and on a phone
// too.
#pragma once

#include <string>

#include "bake/report.hpp"
#include "formats/base/error.hpp"
#include "formats/bundle_view.hpp"

namespace modar {

struct ReportOptions {
  std::string title;             ///< of the page: the file's name
  std::string texture_pictures;  ///< folder of `modar bake --texture-pictures`; empty: none
  std::string bake_json;         ///< what `modar bake --json` printed; empty: no timings
  bool range = false;            ///< simulate each pattern's working range: seconds each
  unsigned jobs = 1;
  std::string tool_version;
};

/// The page: everything within it, no script, nothing fetched. Scenes and models are drawn by the
/// device's renderer; where there is no OpenGL ES, the page says so instead. Errors: those of
/// encoding pictures and, with `range`, of simulate().
Result<std::string> report_page(const BundleView& bundle, const ReportOptions& options,
                                const ProgressCallback& progress);

}  // namespace modar
