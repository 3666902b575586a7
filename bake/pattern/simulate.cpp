// Bands of views through the loop, and the range that follows from them.
#include "bake/pattern/simulate.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <mutex>

#include "bake/pattern/pattern_image.hpp"
#include "bake/pattern/pose_subject.hpp"

namespace modar {
namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr double kWorks = 0.9;  // share of right frames

/// Ratio of the pattern's area in the frame to its picture's, seen from the front.
double area_at(double widths, const GrayImage& picture, const Camera& camera) {
  return camera.fx * camera.fy / (widths * widths * picture.width * picture.width);
}

/// From where everything but the distance is tried: half of the frame's height, or the picture's
/// own size where that is less.
double easy_distance(const GrayImage& picture, const Camera& camera) {
  const double side = std::min(std::sqrt(1.0 * picture.width * picture.height),
                               0.5 * std::min(camera.width, camera.height));
  return std::sqrt(camera.fx * camera.fy * picture.height / picture.width) / side;
}

class Bands {
 public:
  Bands(const GrayImage& picture, const Camera& camera)
      : picture_(picture), camera_(camera), easy_(easy_distance(picture, camera)) {
    for (int k = -5; k <= 11; ++k) {  // three steps an octave
      const double widths = 2 * std::exp2(k / 3.0);
      add("distance", "widths", widths, easy(widths));
    }
    for (int tilt = 0; tilt <= 80; tilt += 5) add("tilt", "degrees", tilt, tilted(tilt));
    for (int roll = 0; roll < 360; roll += 45) {
      TrialSetting setting = easy(easy_);
      setting.band.roll_low = setting.band.roll_high = roll;
      add("rotation", "degrees", roll, setting);
    }
    for (const double length : {0.0, 2.0, 4.0, 6.0, 8.0, 12.0, 16.0, 24.0}) {
      TrialSetting setting = easy(easy_);
      setting.motion_px = length;
      add("blur", "pixels", length, setting);
    }
    for (const double gain : {0.06, 0.12, 0.25, 0.5, 1.0, 1.5, 2.0, 3.0}) {
      TrialSetting setting = easy(easy_);
      setting.light = SceneLight{};
      setting.light->gain = gain;
      add("light", "times", gain, setting);
    }
    for (const double noise : {0.0, 3.0, 6.0, 12.0, 18.0, 24.0, 36.0}) {
      TrialSetting setting = easy(easy_);
      setting.light = SceneLight{};
      setting.light->noise = noise;
      add("noise", "grey values", noise, setting);
    }
    for (int percent = 0; percent <= 80; percent += 10) {
      TrialSetting setting = easy(easy_);
      setting.band.covered_low = setting.band.covered_high = percent / 100.0;
      add("occlusion", "percent", percent, setting);
    }
  }

  std::vector<SimulatedBand> bands;
  std::vector<TrialSetting> settings;  ///< of all values of all bands

 private:
  [[nodiscard]] TrialSetting easy(double widths) const {
    TrialSetting setting;
    setting.band.area_low = setting.band.area_high = area_at(widths, picture_, camera_);
    setting.band.tilt_high = 15;
    return setting;
  }
  [[nodiscard]] TrialSetting tilted(double degrees) const {
    TrialSetting setting = easy(easy_);
    // The distance stays, so that the area shrinks with the tilt.
    setting.band.area_low *= std::cos(degrees * kPi / 180);
    setting.band.area_high = setting.band.area_low;
    setting.band.tilt_low = setting.band.tilt_high = degrees;
    return setting;
  }
  void add(const char* name, const char* unit, double value, TrialSetting setting) {
    if (bands.empty() || bands.back().name != name) bands.push_back({name, unit, {}});
    setting.band.name = name;
    bands.back().values.push_back({value, {}});
    settings.push_back(std::move(setting));
  }

  GrayImage picture_;
  Camera camera_;
  double easy_;
};

bool works(const SimulatedValue& value) {
  return value.outcome.right_share() >= kWorks;
}

/// The longest run of values that work: its first and its last, or two ends.
std::pair<std::size_t, std::size_t> longest_run(const std::vector<SimulatedValue>& values) {
  std::pair<std::size_t, std::size_t> best{0, 0};
  for (std::size_t first = 0; first < values.size(); ++first) {
    std::size_t last = first;
    while (last < values.size() && works(values[last])) ++last;
    if (last - first > best.second - best.first) best = {first, last};
    first = last;
  }
  return best;
}

WorkingRange range_of(const std::vector<SimulatedBand>& bands) {
  WorkingRange range;
  for (const SimulatedBand& band : bands) {
    const auto [first, end] = longest_run(band.values);
    if (end == first) continue;
    if (band.name == "distance") {
      range.nearest = band.values[first].value;
      range.farthest = band.values[end - 1].value;
    } else if (band.name == "tilt" && first == 0) {
      range.tilt_deg = band.values[end - 1].value;
    }
  }
  return range;
}

std::string length_text(double mm) {
  char text[32];
  if (mm < 1000) {
    std::snprintf(text, sizeof text, "%.2g cm", mm / 10);
  } else {
    std::snprintf(text, sizeof text, "%.2g m", mm / 1000);
  }
  return text;
}

}  // namespace

Result<Simulation> simulate(const std::string& path, const SimulateOptions& options,
                            const ProgressCallback& progress) {
  const Camera& camera = options.camera;
  if (camera.width < 64 || camera.height < 64) {
    return fail(ExitCode::kUsage, "simulate.camera", "", "the camera file states no image size",
                "add image_width and image_height to it, or give a resolution");
  }
  PoseBenchOptions bench;
  bench.paper_set = 0;
  bench.ours = false;
  const auto subject = make_subject({path}, bench, camera, true);
  if (!subject) return tl::unexpected(subject.error());
  auto backgrounds = load_backgrounds(options.backgrounds, camera.width, camera.height);
  if (!backgrounds) return tl::unexpected(backgrounds.error());
  Random random(options.seed);
  while (options.backgrounds.empty() && backgrounds->size() < 4) {
    backgrounds->push_back(made_background(camera.width, camera.height, random));
  }
  TrialBed bed;
  bed.picture = subject->pictures[0].view();
  bed.bundle = subject->bytes;
  bed.camera = camera;
  bed.backgrounds = *backgrounds;
  bed.views = options.views;
  bed.seed = options.seed;
  bed.jobs = options.jobs;
  Bands bands(bed.picture, camera);
  std::mutex one_at_a_time;
  std::size_t done = 0;
  const auto stepped = [&] {
    const std::lock_guard lock(one_at_a_time);
    ++done;
    if (progress)
      progress("views", static_cast<double>(done) / static_cast<double>(bands.settings.size()));
  };
  auto outcomes = try_views(bed, bands.settings, stepped);
  if (!outcomes) return tl::unexpected(outcomes.error());
  Simulation simulation;
  simulation.name = std::filesystem::path(path).stem().string();
  simulation.width_mm = options.width_mm > 0 ? options.width_mm : read_width_mm(path);
  std::size_t next = 0;
  for (SimulatedBand& band : bands.bands) {
    for (SimulatedValue& value : band.values) value.outcome = std::move((*outcomes)[next++]);
  }
  simulation.bands = std::move(bands.bands);
  simulation.range = range_of(simulation.bands);
  return simulation;
}

std::string range_sentence(const Simulation& simulation) {
  const WorkingRange& range = simulation.range;
  if (range.farthest <= 0) return "this camera does not recognise it at any distance";
  char text[160];
  if (simulation.width_mm > 0) {
    const double width = simulation.width_mm;
    std::snprintf(text, sizeof text,
                  "printed %s wide, this camera recognises it from %s to %s and up to %.0f degrees",
                  length_text(width).c_str(), length_text(range.nearest * width).c_str(),
                  length_text(range.farthest * width).c_str(), range.tilt_deg);
  } else {
    std::snprintf(text, sizeof text,
                  "this camera recognises it from %.2g to %.2g times its width and up to %.0f "
                  "degrees",
                  range.nearest, range.farthest, range.tilt_deg);
  }
  return text;
}

}  // namespace modar
