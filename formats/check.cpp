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
  const std::uint64_t damaged = log.errors();
  if (!validate_tables(log, parts)) return false;
  validate_models(log, parts);
  validate_assets(log, parts);
  // Payloads are read through records, so these have to be clean; a wrong hash does no harm.
  if (log.errors() != damaged) return false;
  check_model_records(log, parts);
  check_geometry(log, parts);
  check_textures(log, parts);
  check_patterns(log, parts);
  return log.clean();
}

}  // namespace modar
