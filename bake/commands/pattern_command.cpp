// `modar pattern`: what its commands do, one after the other.
#include <cstdio>

#include "bake/bundle/bundle_builder.hpp"
#include "bake/commands/commands.hpp"
#include "bake/commands/json_output.hpp"
#include "bake/commands/pattern_json.hpp"
#include "bake/output_folder.hpp"
#include "bake/pattern/pattern_picture.hpp"
#include "bake/terminal.hpp"
#include "modar/camera_file.hpp"

namespace modar {

int run_rectify(const RectifyCommand& command) {
  Result<RgbaImage> photo = read_image(command.photo);
  if (!photo) return print_error(photo.error());
  Result<RgbaImage> image = rectify(*photo, command.options);
  if (!image) {
    Error error = image.error();
    if (error.where.empty()) error.where = command.photo;
    return print_error(error);
  }
  if (auto wrote = write_pattern_png(*image, command.options.width_mm, command.output); !wrote) {
    return print_error(wrote.error());
  }
  std::fprintf(stderr, "wrote %s, %u x %u pixels\n", command.output.c_str(), image->width,
               image->height);
  if (command.json) {
    std::fputs(
        rectify_json(command.output, image->width, image->height, command.options.width_mm).c_str(),
        stdout);
  }
  return static_cast<int>(ExitCode::kOk);
}

int run_score(const ScoreCommand& command) {
  if (!command.overlay_folder.empty()) {
    if (auto made = make_output_folder(command.overlay_folder); !made) {
      return print_error(made.error());
    }
  }
  std::vector<NamedScore> scores;
  for (const std::string& path : command.patterns) {
    bool shrunk = false;
    const auto picture = load_pattern(path, shrunk);
    if (!picture) return print_error(picture.error());
    TrackerRecordOptions loop;
    loop.jobs = command.jobs;
    auto score = bake_tracker_record(picture->view(), loop).and_then([&](const auto& record) {
      return score_pattern(picture->view(), record, command.jobs);
    });
    if (!score) {
      score.error().where = path;
      return print_error(score.error());
    }
    if (!command.overlay_folder.empty()) {
      const std::string out = command.overlay_folder + "/" + file_stem(path) + ".png";
      if (auto wrote = write_png(score_overlay(picture->view(), *score), out); !wrote) {
        return print_error(wrote.error());
      }
    }
    scores.push_back({file_stem(path), std::move(*score)});
  }
  if (command.json) {
    std::fputs(scores_json(scores).c_str(), stdout);
    return static_cast<int>(ExitCode::kOk);
  }
  for (const NamedScore& one : scores) {
    std::printf("%s: %d of 100 (version %u)\n", one.name.c_str(), one.score.score, kScoreVersion);
    for (const ScoreCause& cause : one.score.causes) {
      std::printf("  %-10s %3d%s%s\n", cause.id, cause.value, *cause.advice != 0 ? "  " : "",
                  cause.advice);
    }
  }
  return static_cast<int>(ExitCode::kOk);
}

namespace {

void print_simulation(const Simulation& simulation) {
  std::printf("%s: %s\n", simulation.name.c_str(), range_sentence(simulation).c_str());
  std::printf("  %-10s %10s %-11s %8s %8s %10s %10s\n", "band", "value", "", "found %", "right %",
              "error px", "jitter px");
  for (const SimulatedBand& band : simulation.bands) {
    for (const SimulatedValue& value : band.values) {
      const PoseBenchRow& row = value.outcome.row;
      std::printf("  %-10s %10.3g %-11s %8.1f %8.1f %10.3f %10.3f\n", band.name.c_str(),
                  value.value, band.unit.c_str(), 100.0 * row.recognised / row.frames,
                  100.0 * row.right / row.frames, row.error_px, row.jitter_px);
    }
  }
}

void print_confusion(const Confusion& confusion) {
  const std::size_t count = confusion.names.size();
  std::printf("%-24s %14s %14s  %s\n", "shown", "recognised", "in photos", "taken for");
  for (std::size_t shown = 0; shown < count; ++shown) {
    std::printf("%-24s %7d of %3d %7d of %3d  ", confusion.names[shown].c_str(),
                confusion.recognised[shown * count + shown], confusion.views,
                confusion.in_photos[shown], confusion.photo_views);
    for (std::size_t asked = 0; asked < count; ++asked) {
      const int times = confusion.recognised[shown * count + asked];
      if (asked != shown && times > 0) {
        std::printf("%s (%d) ", confusion.names[asked].c_str(), times);
      }
    }
    std::printf("\n");
  }
  std::printf("false recognitions: %d, each asked for alone; %d with all in one bundle\n",
              confusion.false_recognitions(), confusion.together);
}

/// Options that are files, read.
Result<void> complete(SimulateCommand& command) {
  if (!command.camera_file.empty()) {
    const auto camera = read_camera_file(command.camera_file);
    if (!camera) return tl::unexpected(camera.error());
    command.options.camera = *camera;
  }
  if (!command.backgrounds.empty()) {
    auto photos = pictures_of(command.backgrounds);
    if (!photos) return tl::unexpected(photos.error());
    command.options.backgrounds = std::move(*photos);
  }
  return {};
}

}  // namespace

int run_confusion(ConfusionCommand& command) {
  if (!command.photos.empty()) {
    auto photos = pictures_of(command.photos);
    if (!photos) return print_error(photos.error());
    command.options.photos = std::move(*photos);
  }
  const auto patterns = read_patterns(command.inputs, command.options.jobs);
  if (!patterns) return print_error(patterns.error());
  ProgressBar bar(command.quiet);
  const auto confusion =
      measure_confusion(*patterns, command.options,
                        [&](const std::string& what, double done) { bar.show(what, done); });
  bar.clear();
  if (!confusion) return print_error(confusion.error());
  if (command.json) {
    std::fputs(confusion_json(*confusion).c_str(), stdout);
  } else {
    print_confusion(*confusion);
  }
  return static_cast<int>(confusion->false_recognitions() == 0 ? ExitCode::kOk
                                                               : ExitCode::kInvalidInput);
}

int run_simulate(SimulateCommand& command) {
  if (auto done = complete(command); !done) return print_error(done.error());
  if (!command.picture_folder.empty()) {
    if (auto made = make_output_folder(command.picture_folder); !made) {
      return print_error(made.error());
    }
  }
  ProgressBar bar(command.quiet);
  std::vector<Simulation> simulations;
  for (const std::string& path : command.patterns) {
    auto simulation = simulate(path, command.options, [&](const std::string&, double done) {
      bar.show(file_stem(path), done);
    });
    bar.clear();
    if (!simulation) return print_error(simulation.error());
    if (!command.picture_folder.empty()) {
      const std::string out = command.picture_folder + "/" + simulation->name + ".png";
      if (auto wrote = write_png(simulation_picture(*simulation), out); !wrote) {
        return print_error(wrote.error());
      }
    }
    if (!command.json) print_simulation(*simulation);
    simulations.push_back(std::move(*simulation));
  }
  if (command.json) std::fputs(simulations_json(simulations).c_str(), stdout);
  return static_cast<int>(ExitCode::kOk);
}

}  // namespace modar
