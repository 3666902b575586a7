// The --json documents of `modar pattern`.
#include "bake/commands/pattern_json.hpp"

#include <nlohmann/json.hpp>

namespace modar {
namespace {

using Json = nlohmann::ordered_json;

/// Foreign bytes that are no UTF-8 are replaced, never thrown at.
std::string dump(const Json& json) {
  return json.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
}

Json value_json(const SimulatedValue& value) {
  const PoseBenchRow& row = value.outcome.row;
  return {{"value", value.value},
          {"frames", row.frames},
          {"recognised_pct", 100.0 * row.recognised / row.frames},
          {"right_pct", 100.0 * row.right / row.frames},
          {"error_px", row.error_px},
          {"jitter_px", row.jitter_px}};
}

}  // namespace

std::string scores_json(const std::vector<NamedScore>& scores) {
  Json out = Json::array();
  for (const NamedScore& one : scores) {
    Json causes = Json::array();
    for (const ScoreCause& cause : one.score.causes) {
      causes.push_back({{"id", cause.id}, {"value", cause.value}, {"advice", cause.advice}});
    }
    out.push_back({{"name", one.name},
                   {"score", one.score.score},
                   {"version", kScoreVersion},
                   {"causes", causes}});
  }
  return dump(out);
}

std::string confusion_json(const Confusion& confusion) {
  const std::size_t count = confusion.names.size();
  Json patterns = Json::array();
  for (std::size_t shown = 0; shown < count; ++shown) {
    Json taken_for = Json::object();
    for (std::size_t asked = 0; asked < count; ++asked) {
      const int times = confusion.recognised[shown * count + asked];
      if (asked != shown && times > 0) taken_for[confusion.names[asked]] = times;
    }
    patterns.push_back({{"name", confusion.names[shown]},
                        {"recognised", confusion.recognised[shown * count + shown]},
                        {"taken_for", taken_for},
                        {"in_photos", confusion.in_photos[shown]}});
  }
  return dump({{"views", confusion.views},
               {"photo_views", confusion.photo_views},
               {"false_recognitions", confusion.false_recognitions()},
               {"false_together", confusion.together},
               {"patterns", patterns}});
}

std::string simulations_json(const std::vector<Simulation>& simulations) {
  Json out = Json::array();
  for (const Simulation& simulation : simulations) {
    Json bands = Json::array();
    for (const SimulatedBand& band : simulation.bands) {
      Json values = Json::array();
      for (const SimulatedValue& value : band.values) values.push_back(value_json(value));
      bands.push_back({{"name", band.name}, {"unit", band.unit}, {"values", values}});
    }
    const double width = simulation.width_mm;
    out.push_back({{"name", simulation.name},
                   {"width_mm", width},
                   {"nearest_widths", simulation.range.nearest},
                   {"farthest_widths", simulation.range.farthest},
                   {"nearest_mm", width > 0 ? Json(simulation.range.nearest * width) : Json()},
                   {"farthest_mm", width > 0 ? Json(simulation.range.farthest * width) : Json()},
                   {"tilt_deg", simulation.range.tilt_deg},
                   {"sentence", range_sentence(simulation)},
                   {"bands", bands}});
  }
  return dump(out);
}

std::string calibration_json(const Calibration& calibration) {
  const Camera& camera = calibration.camera;
  return dump({{"width", camera.width},
               {"height", camera.height},
               {"fx", camera.fx},
               {"fy", camera.fy},
               {"cx", camera.cx},
               {"cy", camera.cy},
               {"distortion", camera.distortion},
               {"focal_spread", calibration.focal_spread},
               {"principal_point", calibration.principal_point_assumed ? "assumed" : "measured"},
               {"rms_px", calibration.rms_px},
               {"views", calibration.views},
               {"frames", calibration.frames}});
}

}  // namespace modar
