#include "bake/extensions/lab/play_json.hpp"

#include <sstream>

#include "bake/json.hpp"

namespace modar {
namespace {

bool read_frame(const Json& line, PlayedRun& run) {
  const auto frame = line.find("frame");
  const auto time = line.find("time_s");
  const auto track = line.find("ms/track");
  const auto latency = line.find("ms/latency");
  const auto visible = line.find("visible");
  const auto state = line.find("state");
  if (!frame || !frame->count() || !time || !time->number() || !track || !track->number() ||
      !latency || !latency->number() || !visible || !visible->is_array() || !state ||
      !state->text()) {
    return false;
  }
  run.frames.push_back({*frame->count(), *time->number(), *track->number(), *latency->number(),
                        visible->size() > 0, *state->text() != "hidden"});
  return true;
}

bool read_summary(const Json& line, PlayedRun& run) {
  const auto dropped = line.find("summary/dropped");
  const auto late = line.find("summary/late");
  if (!dropped || !dropped->count() || !late || !late->count()) return false;
  run.dropped = *dropped->count();
  run.late = *late->count();
  return true;
}

}  // namespace

Result<PlayedRun> read_played_run(const std::string& lines) {
  PlayedRun run;
  std::istringstream text(lines);
  std::string line;
  bool ended = false;
  std::size_t number = 1;
  for (; std::getline(text, line); ++number) {
    const Json document = Json::parse(line);
    const bool summary = document.find("summary").has_value();
    const bool good = !ended && (summary ? read_summary(document, run) : read_frame(document, run));
    if (!good) break;
    ended = summary;
  }
  if (ended && text.eof()) return run;
  return fail(ExitCode::kInvalidInput, "bench.play", "line " + std::to_string(number),
              "the player printed no such line as json.md promises, or no summary",
              "take modar and modar-play from one build");
}

}  // namespace modar
