// What `modar check` prints for programs.
#include "bake/commands/check_json.hpp"

#include <nlohmann/json.hpp>

namespace modar {
namespace {

using Json = nlohmann::ordered_json;

Json tally_json(const MutationTally& tally) {
  return {{"tried", tally.tried},
          {"killed", tally.killed},
          {"harmless", tally.harmless},
          {"rate", tally.rate()}};
}

}  // namespace

std::string mutation_json(const MutationReport& report) {
  Json kinds = Json::object();
  for (const auto& [kind, tally] : report.by_kind) kinds[kind] = tally_json(tally);
  Json fields = Json::object();
  for (const auto& [field, tally] : report.by_field) {
    fields[field] = tally_json(tally);
    fields[field]["rate_without_statement"] = tally.rate_without_statement();
  }
  Json survivors = Json::array();
  for (const MutationSurvivor& survivor : report.survivors) {
    survivors.push_back({{"number", survivor.number},
                         {"kind", survivor.kind},
                         {"rehashed", survivor.rehashed},
                         {"field", survivor.field},
                         {"offset", survivor.offset},
                         {"before", survivor.before},
                         {"after", survivor.after}});
  }
  const Json document = {
      {"mutation",
       {{"n", report.n},
        {"rate_unhashed", report.unhashed.rate()},
        {"rate_rehashed", report.rehashed.rate()},
        {"rate_rehashed_without_statement", report.rehashed.rate_without_statement()},
        {"harmless", report.unhashed.harmless + report.rehashed.harmless},
        {"by_kind", kinds},
        {"by_field", fields},
        {"survivors", survivors}}}};
  return document.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
}

}  // namespace modar
