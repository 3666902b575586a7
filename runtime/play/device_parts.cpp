// The build of the device: what needs OpenCV or SDL2 answers that it is not there; pictures leave
// as PPM.
#include <sys/stat.h>

#include <cstdio>

#include "camera_file.hpp"
#include "formats/atomic_file.hpp"
#include "frame_sink.hpp"
#include "frame_source.hpp"
#include "vision.hpp"
#include "window.hpp"

namespace modar {
namespace {

tl::unexpected<Error> left_out(const char* code, const std::string& where, const char* what) {
  return fail(ExitCode::kUnsupported, code, where,
              std::string("this build of the device leaves out ") + what,
              "use the player of the preset release");
}

/// frame_000000.ppm and so on.
class PpmFolder final : public FrameSink {
 public:
  explicit PpmFolder(std::string folder) : folder_(std::move(folder)) {}

  Result<void> picture(const RgbaImage& image, const FrameReport& report) override {
    char head[64];
    const int length =
        std::snprintf(head, sizeof head, "P6\n%d %d\n255\n", image.width, image.height);
    bytes_.assign(head, static_cast<std::size_t>(length));
    for (std::size_t i = 0; i + 3 < image.pixels.size(); i += 4) {
      for (std::size_t c = 0; c < 3; ++c) bytes_.push_back(static_cast<char>(image.pixels[i + c]));
    }
    char name[40];
    std::snprintf(name, sizeof name, "/frame_%06llu.ppm",
                  static_cast<unsigned long long>(report.frame));
    return write_file(folder_ + name, std::string_view(bytes_));
  }

  Result<void> finish(std::string_view /*summary*/) override { return {}; }

 private:
  std::string folder_;
  std::string bytes_;
};

}  // namespace

Result<std::unique_ptr<FrameSource>> open_frame_source(const std::string& input) {
  return left_out("input.unsupported", input, "videos, pictures and cameras");
}

Result<std::unique_ptr<FrameSink>> open_frame_sink(const std::string& out, double /*fps*/) {
  if (out.ends_with(".mp4")) return left_out("out.unsupported", out, "movies");
  if (auto made = make_folder(out); !made) return tl::unexpected(made.error());
  return std::make_unique<PpmFolder>(out);
}

Result<std::unique_ptr<FrameSink>> open_report(const std::string& folder, double /*fps*/,
                                               const ReportTitle& /*title*/,
                                               std::span<const std::string> /*pattern_names*/) {
  return left_out("out.unsupported", folder, "reports");
}

Result<Camera> read_camera_file(const std::string& path) {
  return left_out("camera.unsupported", path, "camera files");
}

Result<TrackStep> open_vision(const BundleView& /*bundle*/, const VisionOptions& /*options*/) {
  return left_out("method.unsupported", "--method paper", "the article's method");
}

struct Window::State {};
Window::Window(std::unique_ptr<State> state) : state_(std::move(state)) {}
Window::~Window() = default;
Result<std::unique_ptr<Window>> Window::open(const std::string& /*title*/) {
  return left_out("window.unsupported", "--window", "the window");
}
void Window::fit(int /*width*/, int /*height*/) {}
bool Window::poll() {
  return false;
}
int Window::width() const {
  return 0;
}
int Window::height() const {
  return 0;
}
void Window::swap() {}

}  // namespace modar
