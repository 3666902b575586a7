#include "bake/commands/ship_json.hpp"

#include <nlohmann/json.hpp>

namespace modar {
namespace {

using nlohmann::ordered_json;

const char* form_name(PieceForm form) {
  switch (form) {
    case PieceForm::kStored:
      return "stored";
    case PieceForm::kZstd:
      return "zstd";
    case PieceForm::kZstdHalves:
      return "zstd-etc1";
    case PieceForm::kMesh:
      return "mesh";
    case PieceForm::kFeatureText:
      return "derived-text";
    case PieceForm::kLevel:
      return "level";
  }
  return "";
}

}  // namespace

std::string publish_json(const PublishReport& report) {
  ordered_json json;
  json["release"] = ordered_json::parse(release_text(report.release));
  json["added_bytes"] = report.added_bytes;
  json["forms"] = ordered_json::array();
  for (const auto& [form, totals] : report.forms) {
    json["forms"].push_back({{"form", form_name(form)},
                             {"pieces", totals.pieces},
                             {"raw_bytes", totals.raw_bytes},
                             {"stored_bytes", totals.stored_bytes}});
  }
  return json.dump(2) + "\n";
}

std::string prune_json(std::uint64_t freed_bytes, const std::vector<std::uint64_t>& releases) {
  return ordered_json({{"freed_bytes", freed_bytes}, {"releases", releases}}).dump(2) + "\n";
}

std::string plan_json(const UpdatePlan& plan, const Link& link, const std::string& device,
                      double minutes) {
  const ordered_json json = {{"link", link.name},
                             {"link_source", link.source},
                             {"device", device},
                             {"full_bytes", plan.full_bytes},
                             {"update_bytes", plan.update_bytes},
                             {"update_pieces", plan.update_pieces},
                             {"transfer_seconds", plan.transfer_s},
                             {"install_seconds", plan.install_s},
                             {"minutes", minutes},
                             {"storage_bytes", plan.storage_bytes}};
  return json.dump(2) + "\n";
}

}  // namespace modar
