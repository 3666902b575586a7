// Writes and reads poses.jsonl with RapidJSON, configured not to throw.
#include "recording.hpp"

#include <algorithm>
#include <cmath>

#define RAPIDJSON_NOMEMBERITERATORCLASS
#include <rapidjson/document.h>
#include <rapidjson/stringbuffer.h>
#include <rapidjson/writer.h>

#include <glm/geometric.hpp>

#include "formats/base/atomic_file.hpp"
#include "frame_sink.hpp"
#include "modar/mapped_file.hpp"

namespace modar {
namespace {

using Value = rapidjson::Value;
using Writer = rapidjson::Writer<rapidjson::StringBuffer>;

std::string head_line(const RecordingHead& head) {
  rapidjson::StringBuffer buffer;
  Writer writer(buffer);
  writer.StartObject();
  writer.Key("recording");
  writer.StartObject();
  writer.Key("version");
  writer.Int(1);
  writer.Key("method");
  writer.String(head.method.c_str());
  writer.Key("parameters");
  writer.String(head.parameters.c_str());
  writer.Key("fps");
  writer.Double(head.fps);
  writer.Key("stills");
  writer.Bool(head.stills);
  // A string: JSON's numbers end at 2^53 for most readers.
  writer.Key("bundle_hash");
  writer.String(std::to_string(head.bundle_hash).c_str());
  writer.Key("camera");
  writer.StartArray();
  const Camera& c = head.camera;
  for (const double value :
       {static_cast<double>(c.width), static_cast<double>(c.height), c.fx, c.fy, c.cx, c.cy,
        c.distortion[0], c.distortion[1], c.distortion[2], c.distortion[3], c.distortion[4]}) {
    writer.Double(value);
  }
  writer.EndArray();
  writer.EndObject();
  writer.EndObject();
  return {buffer.GetString(), buffer.GetSize()};
}

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

struct Recorder::State {
  std::string folder;
  AtomicFile lines;

  Result<void> write(std::string_view line) {
    MODAR_TRY(lines.write(std::as_bytes(std::span(line))));
    return lines.write(std::as_bytes(std::span("\n", 1)));
  }
};

Recorder::Recorder(std::unique_ptr<State> state) : state_(std::move(state)) {}
Recorder::~Recorder() = default;

Result<std::unique_ptr<Recorder>> Recorder::create(const std::string& folder,
                                                   const RecordingHead& head) {
  MODAR_TRY(make_folder(folder + "/frames"));
  MODAR_ASSIGN(AtomicFile lines, AtomicFile::create(folder + "/poses.jsonl"));
  auto state = std::make_unique<State>(State{folder, std::move(lines)});
  MODAR_TRY(state->write(head_line(head)));
  return std::unique_ptr<Recorder>(new Recorder(std::move(state)));
}

Result<void> Recorder::add(const Frame& frame, std::string_view json) {
  std::string number = std::to_string(frame.index);
  if (number.size() < 6) number.insert(0, 6 - number.size(), '0');
  const std::string path = state_->folder + "/frames/frame_" + number;
  MODAR_TRY(write_frame_picture(path, frame.rgb_image()));
  return state_->write(json);
}

Result<void> Recorder::finish() {
  return state_->lines.commit();
}

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
  rapidjson::StringBuffer buffer;
  Writer writer(buffer);
  writer.StartObject();
  writer.Key("golden");
  writer.StartObject();
  writer.Key("frames");
  writer.Uint64(recording_.frames.size());
  writer.Key("compared");
  writer.Uint64(next_);
  writer.Key("different");
  writer.Uint64(different_);
  writer.Key("tolerance_px");
  writer.Double(tolerance_);
  writer.Key("worst_px");
  if (std::isfinite(worst_px_)) {
    writer.Double(worst_px_);
  } else {
    writer.Null();
  }
  if (different_ > 0) {
    writer.Key("first");
    writer.StartObject();
    writer.Key("frame");
    writer.Uint64(first_frame_);
    writer.Key("what");
    writer.String(first_what_.c_str());
    writer.EndObject();
  }
  writer.EndObject();
  writer.EndObject();
  return {buffer.GetString(), buffer.GetSize()};
}

}  // namespace modar
