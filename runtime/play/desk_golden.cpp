// Reads recordings with RapidJSON, configured not to throw, and compares with them.
#include <algorithm>
#include <cmath>

#define RAPIDJSON_NOMEMBERITERATORCLASS
#include <rapidjson/document.h>

#include <glm/geometric.hpp>

#include "formats/json_writer.hpp"
#include "modar/mapped_file.hpp"
#include "recording.hpp"

namespace modar {
namespace {

using Value = rapidjson::Value;

const Value* member(const Value& object, const char* key) {
  if (!object.IsObject()) return nullptr;
  const auto found = object.FindMember(key);
  return found == object.MemberEnd() ? nullptr : &found->value;
}

bool read_text(const Value& object, const char* key, std::string& text) {
  const Value* value = member(object, key);
  if (value == nullptr || !value->IsString()) return false;
  text.assign(value->GetString(), value->GetStringLength());
  return true;
}

bool read_numbers(const Value* value, std::span<double> numbers) {
  if (value == nullptr || !value->IsArray() || value->Size() != numbers.size()) return false;
  for (rapidjson::SizeType i = 0; i < value->Size(); ++i) {
    if (!(*value)[i].IsNumber()) return false;
    numbers[i] = (*value)[i].GetDouble();
  }
  return true;
}

bool read_head(const Value& line, RecordingHead& head) {
  const Value* object = member(line, "recording");
  if (object == nullptr) return false;
  const Value* version = member(*object, "version");
  const Value* fps = member(*object, "fps");
  std::string hash;
  std::array<double, 11> c{};
  const bool good =
      version != nullptr && version->IsInt() && version->GetInt() == 1 && fps != nullptr &&
      fps->IsNumber() && read_text(*object, "method", head.method) &&
      read_text(*object, "parameters", head.parameters) &&
      read_text(*object, "bundle_hash", hash) && read_numbers(member(*object, "camera"), c);
  if (!good || !(c[0] >= 0 && c[0] <= 65536 && c[1] >= 0 && c[1] <= 65536)) return false;
  head.fps = fps->GetDouble();
  const Value* stills = member(*object, "stills");
  head.stills = stills != nullptr && stills->IsBool() && stills->GetBool();
  head.bundle_hash = std::strtoull(hash.c_str(), nullptr, 10);
  head.camera.width = static_cast<int>(c[0]);
  head.camera.height = static_cast<int>(c[1]);
  head.camera.fx = c[2];
  head.camera.fy = c[3];
  head.camera.cx = c[4];
  head.camera.cy = c[5];
  std::copy(c.begin() + 6, c.end(), head.camera.distortion.begin());
  return true;
}

bool read_seen(const Value& value, RecordedFrame::SeenPattern& seen) {
  const Value* corners = member(value, "corners");
  if (!read_text(value, "pattern", seen.pattern) || corners == nullptr || !corners->IsArray() ||
      corners->Size() != seen.corners.size()) {
    return false;
  }
  for (rapidjson::SizeType i = 0; i < corners->Size(); ++i) {
    std::array<double, 2> xy{};
    if (!read_numbers(&(*corners)[i], xy)) return false;
    seen.corners[i] = {xy[0], xy[1]};
  }
  return true;
}

bool read_frame(const Value& line, RecordedFrame& frame) {
  const Value* number = member(line, "frame");
  const Value* visible = member(line, "visible");
  if (number == nullptr || !number->IsUint64() || visible == nullptr || !visible->IsArray() ||
      !read_text(line, "state", frame.state)) {
    return false;
  }
  frame.frame = number->GetUint64();
  frame.visible.resize(visible->Size());
  for (rapidjson::SizeType i = 0; i < visible->Size(); ++i) {
    if (!read_seen((*visible)[i], frame.visible[i])) return false;
  }
  return true;
}

}  // namespace

Result<Recording> read_recording(const std::string& folder) {
  const std::string path = folder + "/poses.jsonl";
  MODAR_ASSIGN(const MappedFile file, MappedFile::open(path));
  const auto* first = reinterpret_cast<const char*>(file.bytes().data());
  const std::string_view text(first, file.bytes().size());
  Recording recording;
  std::size_t number = 0;
  for (std::size_t at = 0; at < text.size(); ++number) {
    const std::size_t end = std::min(text.find('\n', at), text.size());
    rapidjson::Document line;
    line.Parse<rapidjson::kParseFullPrecisionFlag | rapidjson::kParseIterativeFlag>(
        text.data() + at, end - at);
    bool good = !line.HasParseError();
    if (good && number == 0) good = read_head(line, recording.head);
    if (good && number > 0) good = read_frame(line, recording.frames.emplace_back());
    if (!good) {
      return fail(ExitCode::kInvalidInput, "golden.damaged",
                  path + ":" + std::to_string(number + 1), "the line is not what --record writes",
                  "record it again");
    }
    at = end + 1;
  }
  return recording;
}

GoldenCheck::GoldenCheck(Recording recording, double tolerance)
    : recording_(std::move(recording)), tolerance_(tolerance) {}

void GoldenCheck::add(const FrameReport& report, std::span<const std::string> pattern_names) {
  std::string what = "a frame that was not recorded";
  if (next_ < recording_.frames.size()) {
    what = difference(recording_.frames[next_++], report, pattern_names);
  }
  if (what.empty()) return;
  if (different_++ > 0) return;
  first_frame_ = report.frame;
  first_what_ = what;
}

std::string GoldenCheck::difference(const RecordedFrame& wanted, const FrameReport& report,
                                    std::span<const std::string> pattern_names) {
  if (wanted.frame != report.frame) return "another number";
  if (wanted.visible.size() != report.visible.size()) {
    return std::to_string(report.visible.size()) + " patterns seen, recorded " +
           std::to_string(wanted.visible.size());
  }
  for (std::size_t i = 0; i < wanted.visible.size(); ++i) {
    const Detection& seen = report.visible[i];
    const bool known = seen.pattern < pattern_names.size();
    if (!known || pattern_names[seen.pattern] != wanted.visible[i].pattern)
      return "another pattern";
    double mean = 0;
    for (std::size_t c = 0; c < seen.corners.size(); ++c) {
      mean += glm::distance(seen.corners[c], wanted.visible[i].corners[c]) / 4;
    }
    worst_px_ = std::max(worst_px_, mean);
    if (!(mean <= tolerance_)) return "corners moved";
  }
  if (wanted.state != to_string(report.state)) {
    return std::string(to_string(report.state)) + ", recorded " + wanted.state;
  }
  return "";
}

std::string GoldenCheck::line() const {
  JsonWriter writer;
  const auto first = [&] {
    writer.put("frame", first_frame_);
    writer.put("what", first_what_);
  };
  writer.object([&] {
    writer.object("golden", [&] {
      writer.put("frames", recording_.frames.size());
      writer.put("compared", next_);
      writer.put("different", different_);
      writer.put("tolerance_px", tolerance_);
      writer.put("worst_px", worst_px_);
      if (different_ > 0) writer.object("first", first);
    });
  });
  return writer.str();
}

}  // namespace modar
