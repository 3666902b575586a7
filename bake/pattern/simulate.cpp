// Runs the tracker over bands of views, derives the working range, and draws the contact sheet.
#include "bake/pattern/simulate.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <mutex>
#include <numbers>

#include <opencv2/imgproc.hpp>

#include "bake/pattern/gray_mat.hpp"
#include "bake/pattern/rectify.hpp"

namespace modar {
namespace {

using std::numbers::pi;

// Share of right frames at which a value belongs to the working range. Higher narrows the range to
// steadier tracking.
constexpr double kWorks = 0.9;
constexpr int kMadeBackgrounds = 4;  // where no photos are given

/// Ratio of the pattern's area in the frame to its picture's, seen from the front.
double area_at(double widths, const GrayImage& picture, const Camera& camera) {
  return camera.fx * camera.fy / (widths * widths * picture.width * picture.width);
}

/// The distance at which everything else is tried: there the pattern takes half of the frame's
/// height, or the picture's own size where that is less.
double easy_distance(const GrayImage& picture, const Camera& camera) {
  const double side = std::min(std::sqrt(1.0 * picture.width * picture.height),
                               0.5 * std::min(camera.width, camera.height));
  return std::sqrt(camera.fx * camera.fy * picture.height / picture.width) / side;
}

/// All values of all bands. The ranges begin where every pattern works and end where none does; the
/// steps trade resolution for time.
class Bands {
 public:
  Bands(const GrayImage& picture, const Camera& camera, bool curved)
      : picture_(picture), camera_(camera), curved_(curved), easy_(easy_distance(picture, camera)) {
    for (int k = -5; k <= 11; ++k) {  // three steps an octave
      const double widths = 2 * std::exp2(k / 3.0);
      add("distance", "widths", widths, easy(widths));
    }
    for (int tilt = 0; tilt <= 80; tilt += 5) add("tilt", "degrees", tilt, tilted(tilt));
    for (int around = 0; curved && around <= 120; around += 10) {
      TrialSetting setting = easy(easy_);
      setting.band.around_low = setting.band.around_high = around;
      add("around", "degrees", around, setting);
    }
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
    // The distance stays, so that the area shrinks with the tilt; that of curved ones is of their
    // nearest pixels.
    if (!curved_) setting.band.area_low *= std::cos(degrees * pi / 180);
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
  bool curved_;
  double easy_;
};

/// The longest run of values that work on average and at its last value: its first, and the one
/// behind its last. most_firsts: values that it may begin with, each of which works then.
std::pair<std::size_t, std::size_t> longest_run(const std::vector<SimulatedValue>& values,
                                                std::size_t most_firsts) {
  std::pair<std::size_t, std::size_t> best{0, 0};
  for (std::size_t first = 0; first < most_firsts; ++first) {
    double sum = 0;
    for (std::size_t last = first; last < values.size(); ++last) {
      const double share = values[last].outcome.right_share();
      if (last == first && most_firsts > 1 && share < kWorks) break;
      sum += share;
      const std::size_t count = last + 1 - first;
      const bool works = std::min(share, sum / static_cast<double>(count)) >= kWorks;
      if (works && count > best.second - best.first) best = {first, last + 1};
    }
  }
  return best;
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

// Layout of the contact sheet, pixels.
constexpr int kWide = 160;  // of a view
constexpr int kText = 16;   // height of a line of text
constexpr int kName = 100;  // width of the bands' names
constexpr int kGap = 4;
const cv::Scalar kWhite(255, 255, 255, 255);
const cv::Scalar kGreen(80, 220, 80, 255);
const cv::Scalar kRed(240, 80, 80, 255);
const cv::Scalar kPaper(24, 24, 28, 255);

void write(cv::Mat& sheet, const std::string& text, int x, int y, const cv::Scalar& colour) {
  cv::putText(sheet, text, {x, y}, cv::FONT_HERSHEY_SIMPLEX, 0.36, colour, 1, cv::LINE_AA);
}

void outline(cv::Mat& view, const std::array<glm::dvec2, 4>& corners, double scale,
             const cv::Scalar& colour) {
  std::vector<cv::Point> points;
  for (const glm::dvec2& corner : corners) {
    // Corners near the camera project far outside; lines are clipped at the view's border anyway.
    points.emplace_back(static_cast<int>(std::clamp(corner.x * scale, -1e4, 1e4)),
                        static_cast<int>(std::clamp(corner.y * scale, -1e4, 1e4)));
  }
  cv::polylines(view, points, true, colour, 1, cv::LINE_AA);
}

void draw_value(cv::Mat& sheet, const SimulatedValue& value, int x, int y, int height) {
  const TrialOutcome& outcome = value.outcome;
  const GrayPicture& sample = outcome.sample;
  cv::Mat view;
  cv::cvtColor(as_mat(sample.view()), view, cv::COLOR_GRAY2RGBA);
  cv::resize(view, view, cv::Size(kWide, height), 0, 0, cv::INTER_AREA);
  const double scale = static_cast<double>(kWide) / sample.width;
  outline(view, outcome.truth, scale, kWhite);
  if (outcome.sample_right) outline(view, outcome.seen, scale, kGreen);
  view.copyTo(sheet(cv::Rect(x, y, kWide, height)));
  char text[48];
  std::snprintf(text, sizeof text, "%.3g: %.0f %%", value.value, 100 * outcome.right_share());
  write(sheet, text, x + 2, y + height + kText - 4,
        outcome.right_share() >= kWorks ? kGreen : kRed);
}

}  // namespace

WorkingRange range_of(const std::vector<SimulatedBand>& bands) {
  WorkingRange range;
  for (const SimulatedBand& band : bands) {
    const bool distance = band.name == "distance";
    const auto [first, end] = longest_run(band.values, distance ? band.values.size() : 1);
    if (end == first) continue;
    const double last = band.values[end - 1].value;
    if (distance) {
      range.nearest = band.values[first].value;
      range.farthest = last;
    } else if (band.name == "tilt") {
      range.tilt_deg = last;
    } else if (band.name == "around") {
      range.around_deg = last;
    }
  }
  return range;
}

Result<Simulation> simulate(const std::string& path, const SimulateOptions& options,
                            const ProgressCallback& progress) {
  const Camera& camera = options.camera;
  if (camera.width < 64 || camera.height < 64) {
    return fail(ExitCode::kUsage, "simulate.camera", "", "the camera file states no image size",
                "add image_width and image_height to it, or give a resolution");
  }
  MODAR_ASSIGN(const ShapedPicture shaped, load_shaped(path, options.width_mm, options.shape));
  const GrayPicture& picture = shaped.picture;
  const PatternSurface surface = surface_of(shaped.section, picture.width, picture.height);
  MODAR_ASSIGN(auto record, make_tracker_record(picture.view(), {}, surface));
  MODAR_ASSIGN(const auto bundle,
               bundle_of_record(picture.view(), std::move(record), shaped.section));
  MODAR_ASSIGN(auto backgrounds,
               load_backgrounds(options.backgrounds, camera.width, camera.height));
  Random random(options.seed);
  while (options.backgrounds.empty() && backgrounds.size() < kMadeBackgrounds) {
    backgrounds.push_back(made_background(camera.width, camera.height, random));
  }
  TrialSetup setup;
  setup.picture = picture.view();
  setup.bundle = bundle;
  if (!surface.flat()) setup.surface = &surface;
  setup.camera = camera;
  setup.backgrounds = backgrounds;
  setup.views = options.views;
  setup.seed = options.seed;
  setup.jobs = options.jobs;
  Bands bands(setup.picture, camera, !surface.flat());
  std::mutex progress_mutex;
  std::size_t done = 0;
  const auto setting_done = [&] {
    const std::lock_guard lock(progress_mutex);
    ++done;
    if (progress)
      progress("views", static_cast<double>(done) / static_cast<double>(bands.settings.size()));
  };
  MODAR_ASSIGN(auto outcomes, try_views(setup, bands.settings, setting_done));
  Simulation simulation;
  simulation.name = std::filesystem::path(path).stem().string();
  simulation.width_mm = shaped.width_mm;
  simulation.curved = !surface.flat();
  std::size_t next = 0;
  for (SimulatedBand& band : bands.bands) {
    for (SimulatedValue& value : band.values) value.outcome = std::move(outcomes[next++]);
  }
  simulation.bands = std::move(bands.bands);
  simulation.range = range_of(simulation.bands);
  return simulation;
}

std::string range_sentence(const Simulation& simulation) {
  const WorkingRange& range = simulation.range;
  if (range.farthest <= 0) return "this camera does not recognise it at any distance";
  char reach[64];
  if (simulation.curved) {
    std::snprintf(reach, sizeof reach, "over %.0f degrees around it", 2 * range.around_deg);
  } else {
    std::snprintf(reach, sizeof reach,
                  range.tilt_deg > 0 ? "up to %.0f degrees" : "only without tilt", range.tilt_deg);
  }
  char text[160];
  if (simulation.width_mm > 0) {
    const double width = simulation.width_mm;
    std::snprintf(text, sizeof text,
                  "printed %s wide, this camera recognises it from %s to %s and %s",
                  length_text(width).c_str(), length_text(range.nearest * width).c_str(),
                  length_text(range.farthest * width).c_str(), reach);
  } else {
    std::snprintf(text, sizeof text,
                  "this camera recognises it from %.2g to %.2g times its width and %s",
                  range.nearest, range.farthest, reach);
  }
  return text;
}

RgbaImage simulation_picture(const Simulation& simulation) {
  std::size_t columns = 1;
  for (const SimulatedBand& band : simulation.bands) {
    columns = std::max(columns, band.values.size());
  }
  const GrayPicture& first = simulation.bands.front().values.front().outcome.sample;
  const int height = std::max(1, kWide * first.height / first.width);
  const int row = height + kText + kGap;
  RgbaImage image;
  image.width = static_cast<std::uint32_t>(kName + static_cast<int>(columns) * (kWide + kGap));
  image.height =
      static_cast<std::uint32_t>(2 * kText + static_cast<int>(simulation.bands.size()) * row);
  image.pixels.resize(std::size_t{image.width} * image.height * 4);
  cv::Mat sheet(static_cast<int>(image.height), static_cast<int>(image.width), CV_8UC4,
                image.pixels.data());
  sheet.setTo(kPaper);
  write(sheet, simulation.name + ": " + range_sentence(simulation), 6, kText + 2, kWhite);
  int y = 2 * kText;
  for (const SimulatedBand& band : simulation.bands) {
    write(sheet, band.name, 6, y + kText, kWhite);
    write(sheet, band.unit, 6, y + 2 * kText, kWhite);
    int x = kName;
    for (const SimulatedValue& value : band.values) {
      draw_value(sheet, value, x, y, height);
      x += kWide + kGap;
    }
    y += row;
  }
  return image;
}

}  // namespace modar
