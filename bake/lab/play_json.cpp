// Reads the player's lines with nlohmann/json; nothing it holds leaves this file.
#include "bake/lab/play_json.hpp"

#include <sstream>

#include <nlohmann/json.hpp>

namespace modar {
namespace {

using nlohmann::json;

const json* find(const json& object, const char* pointer, json::value_t type) {
  const json::json_pointer place(pointer);
  if (!object.contains(place)) return nullptr;
  const json& value = object[place];
  const bool fits = type == json::value_t::number_float ? value.is_number() : value.type() == type;
  return fits ? &value : nullptr;
}

bool read_frame(const json& line, PlayedRun& run) {
  constexpr auto kNumber = json::value_t::number_float;
  const json* frame = find(line, "/frame", json::value_t::number_unsigned);
  const json* time = find(line, "/time_s", kNumber);
  const json* track = find(line, "/ms/track", kNumber);
  const json* latency = find(line, "/ms/latency", kNumber);
  const json* visible = find(line, "/visible", json::value_t::array);
  const json* state = find(line, "/state", json::value_t::string);
  if (frame == nullptr || time == nullptr || track == nullptr || latency == nullptr ||
      visible == nullptr || state == nullptr) {
    return false;
  }
  run.frames.push_back({frame->get<std::uint64_t>(), time->get<double>(), track->get<double>(),
                        latency->get<double>(), !visible->empty(), *state != "hidden"});
  return true;
}

bool read_summary(const json& line, PlayedRun& run) {
  const json* dropped = find(line, "/summary/dropped", json::value_t::number_unsigned);
  const json* late = find(line, "/summary/late", json::value_t::number_unsigned);
  if (dropped == nullptr || late == nullptr) return false;
  run.dropped = dropped->get<std::uint64_t>();
  run.late = late->get<std::uint64_t>();
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
    const json document = json::parse(line, nullptr, false);
    const bool summary = document.is_object() && document.contains("summary");
    const bool good = !ended && document.is_object() &&
                      (summary ? read_summary(document, run) : read_frame(document, run));
    if (!good) break;
    ended = summary;
  }
  if (ended && text.eof()) return run;
  return fail(ExitCode::kInvalidInput, "bench.play", "line " + std::to_string(number),
              "the player printed no such line as json.md promises, or no summary",
              "take modar and modar-play from one build");
}

}  // namespace modar
