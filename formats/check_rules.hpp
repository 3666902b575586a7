// The rules on payloads, split by subject. Internal to formats/.
#pragma once

#include "formats/bundle_view.hpp"
#include "formats/rules.hpp"

namespace modar {

/// Hashes of sections, zero padding between them and inside them, unknown and textual sections.
/// Needs sections that lie inside the file, nothing more.
void check_section_bytes(FaultLog& log, const BundleParts& parts);

}  // namespace modar
