#include "bake/commands/ship_json.hpp"

#include "bake/json.hpp"

namespace modar {
namespace {

/// Of PieceForm, whose first is 1.
constexpr const char* kFormNames[] = {"stored",       "zstd",  "zstd-etc1",      "mesh",
                                      "derived-text", "level", "tracker-record", "coded"};

}  // namespace

std::string publish_json(const PublishReport& report) {
  Json forms = Json::array();
  for (const auto& [form, totals] : report.forms) {
    forms.push_back({{"form", kFormNames[static_cast<std::size_t>(form) - 1]},
                     {"pieces", totals.pieces},
                     {"raw_bytes", totals.raw_bytes},
                     {"stored_bytes", totals.stored_bytes}});
  }
  const Json changes = Json::list(report.changes, [&](const BundleChange& change) -> Json {
    return {{"change", to_string(change.kind)}, {"name", change.name}};
  });
  const Json json = {{"release", Json::parse(release_text(report.release))},
                     {"added_bytes", report.added_bytes},
                     {"changes", changes},
                     {"forms", forms}};
  return json.dump();
}

std::string list_json(const std::vector<ListedRelease>& releases) {
  const Json list = Json::list(releases, [&](const ListedRelease& listed) -> Json {
    return {{"release", Json::parse(release_text(listed.release))},
            {"published", time_text(listed.published)},
            {"current", listed.current}};
  });
  return Json({{"releases", list}}).dump();
}

std::string prune_json(std::uint64_t freed_bytes, const std::vector<std::uint64_t>& releases) {
  return Json({{"freed_bytes", freed_bytes}, {"releases", Json::list(releases)}}).dump();
}

std::string verify_json(const VerifyReport& report) {
  const Json damaged = Json::list(report.damaged, [&](const DamagedObject& object) -> Json {
    return {{"path", object.path}, {"bundle", object.bundle}, {"cause", object.cause}};
  });
  return Json({{"version", report.release.version},
               {"epoch", report.release.epoch},
               {"expires", time_text(report.release.expires)},
               {"key", to_hex(report.key.id)},
               {"bundles", report.release.bundles.size()},
               {"objects", report.objects},
               {"bytes", report.bytes},
               {"damaged", damaged}})
      .dump();
}

std::string plan_json(const UpdatePlan& plan, const Link& link, const std::string& device,
                      double minutes) {
  const Json json = {{"link", link.name},
                     {"link_source", link.source},
                     {"device", device},
                     {"full_bytes", plan.full_bytes},
                     {"update_bytes", plan.update_bytes},
                     {"update_pieces", plan.update_pieces},
                     {"transfer_seconds", plan.transfer_s},
                     {"install_seconds", plan.install_s},
                     {"geometry_bytes", plan.geometry_bytes},
                     {"geometry_instructions_per_byte", kGeometryInstructions},
                     {"other_bytes", plan.other_bytes},
                     {"other_instructions_per_byte", kOtherInstructions},
                     {"minutes", minutes},
                     {"storage_bytes", plan.storage_bytes}};
  return json.dump();
}

}  // namespace modar
