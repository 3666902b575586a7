// Runs all rules over a bundle, from its outside in.
#include "formats/check.hpp"

#include "formats/check_rules.hpp"
#include "formats/validate.hpp"

namespace modar {
namespace {

/// Everything but sections as bytes.
void check_contents(FaultLog& log, BundleParts& parts, BufferHashes& hashes) {
  const std::uint64_t damaged = log.errors();
  if (!validate_tables(log, parts)) return;
  validate_models(log, parts);
  validate_assets(log, parts);
  // Payloads are read through records, so these have to be clean; a wrong hash does no harm.
  if (log.errors() != damaged) return;
  check_model_records(log, parts);
  StatementCheck statement(log, parts);
  statement.records();
  check_geometry(log, parts, hashes, statement);
  check_textures(log, parts, statement);
  statement.finish();
  check_patterns(log, parts);
}

}  // namespace

bool check_bundle(std::span<const std::byte> bytes, const IssueSink& sink,
                  const CheckOptions& options) {
  FaultLog log(sink);
  BundleParts parts;
  if (!validate_sections(bytes, log, parts)) return false;
  check_section_bytes(log, parts, options);
  const auto section = [&parts](SectionType type) {
    return find_section(parts.sections, type, kNone, 0);
  };
  BufferHashes hashes{{log, parts, options, section(SectionType::kVertices)},
                      {log, parts, options, section(SectionType::kIndices)}};
  check_contents(log, parts, hashes);
  hashes.vertices.finish();
  hashes.indices.finish();
  return log.clean();
}

std::string first_error(std::span<const std::byte> bytes) {
  std::string error;
  check_bundle(bytes, [&error](const Issue& issue) {
    if (issue.kind->severity != Severity::kError || !error.empty()) return;
    error = std::string(issue.kind->id) + " " + issue.where;
  });
  return error;
}

}  // namespace modar
