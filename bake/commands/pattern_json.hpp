// The --json documents of `modar pattern` and `modar calibrate`. The keys are a contract (json.md).
#pragma once

#include <string>
#include <vector>

#include "bake/pattern/calibrate.hpp"
#include "bake/pattern/confusion.hpp"
#include "bake/pattern/score.hpp"
#include "bake/pattern/simulate.hpp"

namespace modar {

struct NamedScore {
  std::string name;
  PatternScore score;
};
/// `modar pattern score --json`.
std::string scores_json(const std::vector<NamedScore>& scores);

/// `modar pattern confusion --json`.
std::string confusion_json(const Confusion& confusion);

/// `modar pattern simulate --json`.
std::string simulations_json(const std::vector<Simulation>& simulations);

/// `modar calibrate --json`.
std::string calibration_json(const Calibration& calibration);

}  // namespace modar
