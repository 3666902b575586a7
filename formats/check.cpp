// Runs all rules over a bundle, from its outside in.
#include "formats/check.hpp"

#include "formats/check_rules.hpp"
#include "formats/validate.hpp"

namespace modar {

bool check_bundle(std::span<const std::byte> bytes, const IssueSink& sink) {
  FaultLog log(sink);
  BundleParts parts;
  if (!validate_sections(bytes, log, parts)) return false;
  check_section_bytes(log, parts);
  if (!validate_tables(log, parts)) return false;
  validate_models(log, parts);
  validate_assets(log, parts);
  return log.clean();
}

}  // namespace modar
