// The --json documents of the commands, and the bundle's meta text. The keys are a contract.
#pragma once

#include <string>
#include <vector>

#include "bake/report.hpp"
#include "bake/terminal.hpp"
#include "formats/bundle_view.hpp"

namespace modar {

/// `modar inspect --json`.
std::string inspect_json(const BundleView& bundle);

/// `modar bake --json`: inspect's document under "bundle", stages, findings, cost.
std::string bake_json(const BundleView& bundle, const Report& report, const ProcessCost& cost);

/// Of the first model in what bake_json() gave; not finite where there is none.
double bytes_per_triangle_of(const std::string& report);

/// `modar pattern rectify --json`.
std::string rectify_json(const std::string& path, std::uint32_t width, std::uint32_t height,
                         double width_mm);

/// A row of `modar bench NAME --json`.
struct BenchRow {
  std::string measure;
  double ours = 0;
  double reference = 0;
  double ratio = 0;
};
std::string bench_json(const std::vector<BenchRow>& rows);

}  // namespace modar
