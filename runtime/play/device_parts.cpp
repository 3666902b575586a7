// The build of the device: what needs OpenCV or SDL2 answers that it is not there; pictures leave
// as PPM.
#include <cstdio>

#include "formats/base/atomic_file.hpp"
#include "frame_sink.hpp"
#include "frame_source.hpp"
#include "modar/camera_file.hpp"
#include "modar/camera_yml.hpp"
#include "overlay.hpp"
#include "raw_source.hpp"
#include "recording.hpp"
#include "scene_media.hpp"
#include "screen.hpp"
#include "taps.hpp"
#include "vision.hpp"

namespace modar {
namespace {

tl::unexpected<Error> left_out(const char* code, const std::string& where, const char* what) {
  return fail(ExitCode::kUnsupported, code, where,
              std::string("this build of the device leaves out ") + what,
              "use the player of the preset release");
}

/// bytes_in: 3 for R, G, B, 4 where alpha follows and is left out.
Result<void> write_ppm(const std::string& path, std::span<const std::uint8_t> pixels, int width,
                       int height, std::size_t bytes_in) {
  char head[64];
  const int length = std::snprintf(head, sizeof head, "P6\n%d %d\n255\n", width, height);
  std::string bytes(head, static_cast<std::size_t>(length));
  bytes.reserve(bytes.size() + pixels.size());
  for (std::size_t i = 0; i + bytes_in <= pixels.size(); i += bytes_in) {
    for (std::size_t c = 0; c < 3; ++c) bytes.push_back(static_cast<char>(pixels[i + c]));
  }
  return write_file(path, std::string_view(bytes));
}

/// frame_000000.ppm and so on.
class PpmFolder final : public FrameSink {
 public:
  explicit PpmFolder(std::string folder) : folder_(std::move(folder)) {}

  Result<void> picture(const RgbaView& image, const FrameReport& report) override {
    char name[40];
    std::snprintf(name, sizeof name, "/frame_%06llu.ppm",
                  static_cast<unsigned long long>(report.frame));
    return write_ppm(folder_ + name, image.pixels, image.width, image.height, 4);
  }

  Result<void> finish(std::string_view /*summary*/) override { return {}; }

 private:
  std::string folder_;
};

}  // namespace

std::optional<SceneEvent> tap_at(const BundleView& /*bundle*/, const Camera& /*camera*/,
                                 glm::dvec2 /*pixel*/, std::span<const DrawItem> /*items*/) {
  return std::nullopt;  // there is no window to click into
}

std::unique_ptr<SceneMedia> open_scene_media(const BundleView& /*bundle*/,
                                             const SceneMediaSetup& /*setup*/) {
  return nullptr;
}

Result<std::unique_ptr<FrameSource>> open_frame_source(const std::string& input) {
  if (is_raw_input(input)) return open_raw_source(input);
  return left_out("input.unsupported", input, "videos, pictures and cameras");
}

Result<std::unique_ptr<FrameSink>> open_frame_sink(const std::string& out, double /*fps*/) {
  if (out.ends_with(".mp4")) return left_out("out.unsupported", out, "movies");
  MODAR_TRY(make_folder(out));
  remove_frames(out);
  return std::make_unique<PpmFolder>(out);
}

Result<std::unique_ptr<FrameSink>> open_report(const std::string& folder, double /*fps*/,
                                               const ReportTitle& /*title*/,
                                               std::span<const std::string> /*pattern_names*/) {
  return left_out("out.unsupported", folder, "reports");
}

Result<Recording> read_recording(const std::string& folder) {
  return left_out("golden.unsupported", folder, "comparisons with recordings");
}

GoldenCheck::GoldenCheck(Recording recording, double tolerance)
    : recording_(std::move(recording)), tolerance_(tolerance) {}
void GoldenCheck::add(const FrameReport& /*report*/,
                      std::span<const std::string> /*pattern_names*/) {}
std::string GoldenCheck::line() const {
  return {};
}

Result<void> write_frame_picture(const std::string& path, const RgbImage& image) {
  const auto size = static_cast<std::size_t>(image.stride * image.height);
  return write_ppm(path + ".ppm", {image.pixels, size}, image.width, image.height, 3);
}

Result<void> draw_text_bar(const Canvas& /*canvas*/, const std::string& /*text*/) {
  return left_out("display.unsupported", "--osd", "the on-screen display");
}

Result<std::shared_ptr<const SpotPattern>> make_spot_pattern(
    const RgbImage& /*frame*/, const std::array<glm::dvec2, 4>& /*clicked*/,
    const ParameterSetRecord& /*parameters*/) {
  return left_out("spot.unsupported", "", "patterns made on the spot");
}

Result<Camera> read_camera_file(const std::string& path) {
  return read_camera_yml(path);
}

Result<TrackStep> open_vision(const BundleView& bundle, const VisionOptions& options) {
  if (options.ours) return our_vision(bundle, options);
  return left_out("method.unsupported", "--method paper", "the ModAR paper's method");
}

struct Window::State {};
Window::Window(std::unique_ptr<State> state) : state_(std::move(state)) {}
Window::~Window() = default;
Result<std::unique_ptr<Window>> Window::open(const std::string& /*title*/) {
  return left_out("window.unsupported", "--window", "the window");
}
void Window::fit(int /*width*/, int /*height*/) {}
std::span<const UserAct> Window::acts(std::chrono::milliseconds /*limit*/) {
  return {};
}
int Window::width() const {
  return 0;
}
int Window::height() const {
  return 0;
}
bool Window::take_loss() {
  return false;
}
void Window::set_title(const std::string& /*title*/) {}
Result<void> Window::renew() {
  return left_out("window.unsupported", "--window", "the window");
}
void Window::swap() {}

}  // namespace modar
