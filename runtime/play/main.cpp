// modar-play: maps a bundle and plays it over a video, pictures or a camera: puts source, vision
// and player together.
#include <algorithm>
#include <cstdio>
#include <optional>
#include <span>

#include "formats/base/file_kind.hpp"
#include "formats/bundle_view.hpp"
#include "formats/check.hpp"
#include "frame_sink.hpp"
#include "gyroscope.hpp"
#include "modar/camera_file.hpp"
#include "modar/mapped_file.hpp"
#include "options.hpp"
#include "pipeline.hpp"
#include "play.hpp"
#include "player.hpp"
#include "raw_source.hpp"
#include "recording.hpp"
#include "vision.hpp"

namespace modar {

Result<void> print_line(const std::string& line) {
  const bool written = std::fwrite(line.data(), 1, line.size(), stdout) == line.size() &&
                       std::fputc('\n', stdout) != EOF && std::fflush(stdout) == 0;
  if (written) return {};
  return fail(ExitCode::kIo, "out.write", "standard output", "it takes no more text",
              "free space, or fix the pipe");
}

namespace {

/// What the command line and, of a replay, the recording ask for.
struct Plan {
  std::string input;
  std::string method;
  std::string parameters;
  std::optional<Camera> camera;
  std::optional<GoldenCheck> golden;
};

Result<Plan> make_plan(const PlayOptions& options, const BundleView& bundle) {
  Plan plan{options.input, options.method, options.parameters, std::nullopt, std::nullopt};
  if (!options.golden.empty()) {
    MODAR_ASSIGN(Recording recording, read_recording(options.golden));
    const RecordingHead& head = recording.head;
    if (head.bundle_hash != bundle.header().hash && !options.quiet) {
      std::fprintf(stderr, "modar-play: the recording was made with another bundle\n");
    }
    plan.input = options.golden + "/frames";
    if (plan.method.empty() && plan.parameters.empty()) plan.method = head.method;
    if (plan.parameters.empty()) plan.parameters = head.parameters;
    if (head.camera.width > 0) plan.camera = head.camera;
    plan.golden.emplace(std::move(recording), options.tolerance);
  }
  if (!options.camera_file.empty()) {
    MODAR_ASSIGN(Camera camera, read_camera_file(options.camera_file));
    plan.camera = camera;
  }
  return plan;
}

/// Recordings and replays look at the gray of the recorded picture, not at the camera's own.
TrackStep with_gray_of_rgb(TrackStep track) {
  return [track = std::move(track)](Job& job) {
    make_rgb(job.frame);
    gray_from_rgb(job.frame);
    return track(job);
  };
}

/// Plays the bundle's scenes over the frames of --input or --golden; answers the exit code.
Result<int> play_video(const PlayOptions& asked, const BundleView& bundle, const MappedFile& file) {
  // In a window, a pattern can be captured.
  if (bundle.patterns().empty() && !asked.window && !asked.live) {
    return fail(ExitCode::kInvalidInput, "play.no-pattern", asked.bundle,
                "it has no pattern that a camera could find",
                "bake it with --pattern, or look at its models with --turntable 24 --out FOLDER");
  }
  MODAR_ASSIGN(Plan plan, make_plan(asked, bundle));
  PlayOptions options = asked;
  options.method = choose_method(bundle, plan.method, plan.parameters);
  if (options.method == "paper" && !options.quiet) {
    std::fprintf(
        stderr,
        "modar-play: the ModAR paper's method is included for comparison: it reports patterns "
        "in frames that show none as well\n");
  }
  MODAR_ASSIGN(const std::uint32_t set,
               choose_parameter_set(bundle, options.method, plan.parameters));
  if (options.extended && options.method != "ours") {
    return fail(ExitCode::kUsage, "usage.conflict", "--extended",
                "the ModAR paper's method knows the pattern alone",
                "leave --method and --parameters out, and bake the pattern with this modar");
  }
  std::vector<glm::dvec3> turns;
  if (!options.gyro.empty()) {
    MODAR_ASSIGN(turns, read_gyroscope(options.gyro));
  }
  MODAR_ASSIGN(auto source, open_frame_source(plan.input));
  SourceInfo info = source->info();
  if (plan.golden) info.stills = plan.golden->head().stills;
  // Only where frames may be dropped may a result depend on time.
  const bool newest = info.live || options.realtime;
  SpotSlot spot;
  LiveSlot live;
  MODAR_ASSIGN(TrackStep track,
               open_vision(bundle, {options.method == "ours", set, plan.camera, &spot,
                                    options.live ? &live : nullptr, newest, options.extended,
                                    options.copies, std::move(turns), info.stills}));

  Player player(options, bundle);
  const std::string name(bundle.name(parameter_set(bundle, set).name));
  MODAR_TRY(player.open(
      {info, set, name, plan.camera.value_or(Camera{}), &spot, options.live ? &live : nullptr}));
  if (!options.record.empty() || plan.golden) track = with_gray_of_rgb(std::move(track));
  if (plan.golden) player.compare(std::move(*plan.golden));

  PipelineOptions how;
  how.paced = options.realtime && !info.live;
  if (newest) how.delivery = Delivery::kNewest;
  how.idle = [&player] { return player.idle(); };
  catch_interrupts();
  // With --live, a bundle that is written to is opened again.
  const auto intact = [&] { return options.live ? Result<void>() : file.intact(); };
  const auto show = [&](Job& job) -> Result<bool> {
    MODAR_TRY(intact());
    return player.show(job);
  };
  Result<PipelineCounts> counts = run_pipeline(*source, track, show, how);
  MODAR_TRY(intact());
  if (!counts) return tl::unexpected(std::move(counts.error()));
  return player.finish(*counts);
}

/// Why a file is not read as a bundle: `error`, or that it begins as another kind of file does.
Error unread(Error error, const std::string& path, std::span<const std::byte> bytes) {
  const FileSignature* const found = find_signature(
      {reinterpret_cast<const char*>(bytes.data()), std::min<std::size_t>(bytes.size(), 16)});
  if (found != nullptr && found->kind != FileKind::kBundle) {
    error = {ExitCode::kUsage, "bundle.kind", path,
             wrong_kind(found->kind, found->format, "bundle"), "bake it first, with `modar bake`"};
  }
  if (error.where != path) error.where = path + (error.where.empty() ? "" : ":" + error.where);
  return error;
}

Result<int> run(const PlayOptions& options) {
  MODAR_TRY(check_outputs(options));
  MODAR_ASSIGN(MappedFile file, MappedFile::open(options.bundle));
  Result<BundleView> bundle = open_bundle(file);
  if (bundle && options.verify) {
    if (auto whole = verify_sections(*bundle); !whole) bundle = tl::unexpected(whole.error());
  }
  if (!bundle) return tl::unexpected(unread(bundle.error(), options.bundle, file.bytes()));
  if (options.turntable == 0) return play_video(options, *bundle, file);
  MODAR_TRY(play_turntable(options, *bundle, file));
  return 0;
}

int report(const Error& error) {
  std::fprintf(stderr, "modar-play: %s\n", to_line(error).c_str());
  return static_cast<int>(error.exit);
}

int start(int argc, char** argv) {
  const Result<PlayOptions> options =
      parse_options({argv + 1, argc > 0 ? static_cast<std::size_t>(argc - 1) : 0});
  if (!options) return report(options.error());
  if (options->help || options->help_all || options->version) {
    const std::string text =
        options->version ? "modar-play " MODAR_VERSION "\n" : help_text(options->help_all);
    const Result<void> printed = print_line(text.substr(0, text.size() - 1));
    return printed ? 0 : report(printed.error());
  }
  const NewFolders folders(*options);
  const Result<int> done = run(*options);
  if (!done || *done != 0) folders.remove_empty();
  return done ? *done : report(done.error());
}

}  // namespace
}  // namespace modar

int main(int argc, char** argv) {
  modar::guard_mapped_files();
  return modar::start(argc, argv);
}
