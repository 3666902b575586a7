// `modar check`: is this bundle good? Verdict first, then one line an issue.
#include "bake/commands/check_command.hpp"

#include <algorithm>
#include <cinttypes>
#include <cstdio>
#include <string>

#include "bake/check/content/content_check.hpp"
#include "bake/check/device/device_file.hpp"
#include "bake/check/verdict.hpp"
#include "bake/io/input.hpp"
#include "bake/io/terminal.hpp"
#include "formats/base/ranges.hpp"
#include "formats/bundle_view.hpp"
#include "modar/device_profile.hpp"
#include "modar/mapped_file.hpp"

namespace modar {
namespace {

/// " (byte 19600)" of the file's faults; what a device lacks is not at a place in it.
std::string place_of(const Issue& issue) {
  const auto kinds = workstation_issue_kinds();
  const bool of_file = ranges::none_of(kinds, [&](const auto& k) { return &k == issue.kind; });
  return of_file ? " (byte " + std::to_string(issue.offset) + ")" : "";
}

void print_issues(const std::string& path, const Verdict& verdict) {
  std::printf("%s: %s\n", path.c_str(), verdict.good() ? "good" : "BAD");
  for (const WeighedIssue& weighed : verdict.issues()) {
    const Issue& issue = weighed.issue;
    std::printf("%s %s %s%s: %s%s%s; %s\n", severity_name(weighed.severity), issue.kind->id,
                issue.where.c_str(), place_of(issue).c_str(), issue.kind->message,
                issue.detail.empty() ? "" : ": ", issue.detail.c_str(), issue.kind->cure);
  }
  for (const auto& [id, count] : verdict.left_out()) {
    std::printf("... and %zu more of %s\n", count, id.c_str());
  }
}

void print_all_kinds() {
  std::fputs(issues_markdown().c_str(), stdout);
  std::fputs(issue_rows(workstation_issue_kinds()).c_str(), stdout);
}

Result<void> weigh(const CheckCommand& command, Verdict& verdict) {
  for (const std::string& text : command.severities) {
    if (auto done = verdict.override_severity(text); !done) return done;
  }
  if (command.warnings_as_errors) verdict.set_warnings_as_errors();
  return {};
}

void print_looks(const std::vector<ModelLook>& looks) {
  for (const ModelLook& look : looks) {
    if (!look.judged) {
      std::printf("model '%s': translucent, not compared\n", look.name.c_str());
      continue;
    }
    std::printf("model '%s': SSIM %.4f, worst %.4f; colour off by %.2f, worst %.2f; see %s\n",
                look.name.c_str(), look.ssim_mean, look.ssim_worst, look.delta_e_mean,
                look.delta_e_worst, look.picture.c_str());
    for (const ClipLook& clip : look.clips) {
      std::printf("  clip '%s': SSIM %.4f, worst %.4f at %.2f s; colour off by %.2f, worst %.2f\n",
                  clip.name.c_str(), clip.ssim_mean, clip.ssim_worst, clip.worst_s,
                  clip.delta_e_mean, clip.delta_e_worst);
    }
    for (const LevelLook& level : look.levels) {
      std::printf(
          "  level %u, from %.0f pixels down: differs by %.1f of 255 in the mean (%.1f at most in "
          "99 %% of its pixels), %" PRIu64 " of %" PRIu64 " triangles\n",
          level.level, level.side_px, level.difference_mean, level.difference, level.triangles,
          level.finest_triangles);
    }
  }
}

void print_ranges(const std::vector<PatternRange>& ranges) {
  for (const PatternRange& range : ranges) {
    if (range.tilt_deg < 0) {
      std::printf("pattern '%s': not found (%s), not even from the front at its picture's size\n",
                  range.name.c_str(), range.method.c_str());
      continue;
    }
    std::printf(
        "pattern '%s': found (%s) at %.2g to %.2g times its picture's area, tilted up to "
        "%.0f degrees; off by %.2f pixels, %.2f degrees, %.2f %% of the distance\n",
        range.name.c_str(), range.method.c_str(), range.area_low, range.area_high, range.tilt_deg,
        range.corner_px, range.rotation_deg, range.translation_percent);
  }
}

void print_fit(const SourceFit& fit) {
  for (const ModelFit& model : fit.models) {
    if (model.same_bytes) {
      std::printf("model '%s': a second bake gave the same bytes; an error of %.3g is stated\n",
                  model.name.c_str(), model.stated_error);
      continue;
    }
    std::printf(
        "model '%s': a second bake gave different bytes; it is up to %.3g from the bundle, the "
        "bundle up to %.3g from it; %.3g is stated\n",
        model.name.c_str(), model.source_to_bundle, model.bundle_to_source, model.stated_error);
  }
  for (const std::string& asset : fit.same) {
    std::printf("%s: a second bake gave the same bytes\n", asset.c_str());
  }
}

}  // namespace

int run_check(const CheckCommand& command) {
  if (command.list_issues) {
    print_all_kinds();
    return static_cast<int>(ExitCode::kOk);
  }
  Verdict verdict;
  if (auto weighed = weigh(command, verdict); !weighed) return print_error(weighed.error());
  DeviceFile from_file;
  const Result<const DeviceProfile*> device = choose_device(command.device, from_file);
  if (!device) return print_error(device.error());
  Result<MappedFile> file = MappedFile::open(command.bundle);
  if (!file) return print_error(file.error());
  if (const auto is = require_kind(FileKind::kBundle, command.bundle); !is) {
    return print_error(is.error());
  }

  const IssueSink sink = [&verdict](const Issue& issue) { verdict.add(issue); };
  const bool sound = check_all(file->bytes(), *device, command.jobs, sink);
  CheckExtras extras;
  if (*device != nullptr) extras.device = (*device)->name;
  if (sound && !command.sources.empty()) {
    const Result<BundleView> bundle = BundleView::open(file->bytes());
    if (auto done = check_against_sources(*bundle, command, sink, extras); !done) {
      return print_error(done.error());
    }
  }

  if (const auto same = file->intact(); !same) return print_error(same.error());

  if (command.sarif) {
    std::fputs(check_sarif(verdict, command.bundle, command.tool_version).c_str(), stdout);
  } else if (command.json) {
    std::fputs(check_json(verdict, extras).c_str(), stdout);
  } else {
    print_issues(command.bundle, verdict);
    if (extras.source) print_fit(*extras.source);
    print_looks(extras.looks);
    print_ranges(extras.poses);
  }
  if (verdict.good()) return static_cast<int>(ExitCode::kOk);
  // A bundle of a newer version is not bad: only this program cannot read it.
  const Result<BundleView> opened = BundleView::open(file->bytes());
  const bool newer = !opened && opened.error().exit == ExitCode::kUnsupported;
  return static_cast<int>(newer ? ExitCode::kUnsupported : ExitCode::kInvalidInput);
}

}  // namespace modar
