// Writes the JSON lines with RapidJSON: shortest digits that read back the same, in any locale.
#include "json_lines.hpp"

#include <cmath>

#define RAPIDJSON_NOMEMBERITERATORCLASS
#include <rapidjson/stringbuffer.h>
#include <rapidjson/writer.h>

namespace modar {
namespace {

using Writer = rapidjson::Writer<rapidjson::StringBuffer>;

void text(Writer& writer, std::string_view value) {
  writer.String(value.data(), static_cast<rapidjson::SizeType>(value.size()));
}

void number(Writer& writer, double value) {
  if (std::isfinite(value)) {
    writer.Double(value);
  } else {
    writer.Null();
  }
}

/// Times are worth three decimals.
void rounded(Writer& writer, double value) {
  number(writer, std::round(value * 1000.0) / 1000.0);
}

void detection(Writer& writer, const Detection& seen, std::span<const std::string> names) {
  writer.StartObject();
  writer.Key("pattern");
  text(writer, seen.pattern < names.size() ? std::string_view(names[seen.pattern]) : "");
  writer.Key("corners");
  writer.StartArray();
  for (const glm::dvec2& corner : seen.corners) {
    writer.StartArray();
    number(writer, corner.x);
    number(writer, corner.y);
    writer.EndArray();
  }
  writer.EndArray();
  writer.Key("rotation");
  writer.StartArray();
  for (int row = 0; row < 3; ++row) {
    // GLM's first index is the column.
    for (int column = 0; column < 3; ++column) number(writer, seen.pose.rotation[column][row]);
  }
  writer.EndArray();
  writer.Key("translation");
  writer.StartArray();
  for (int i = 0; i < 3; ++i) number(writer, seen.pose.translation[i]);
  writer.EndArray();
  writer.Key("inliers");
  writer.Int(seen.inliers);
  writer.Key("matches");
  writer.Int(seen.matches);
  writer.EndObject();
}

void times(Writer& writer, const StageTimes& ms) {
  writer.Key("ms");
  writer.StartObject();
  for (std::size_t i = 0; i < ms.size(); ++i) {
    writer.Key(kStageNames[i]);
    rounded(writer, ms[i]);
  }
  writer.EndObject();
}

}  // namespace

const char* to_string(Shown state) {
  switch (state) {
    case Shown::kShown:
      return "shown";
    case Shown::kHeld:
      return "held";
    case Shown::kHidden:
      break;
  }
  return "hidden";
}

std::string frame_line(const FrameReport& report, std::span<const std::string> pattern_names) {
  rapidjson::StringBuffer buffer;
  Writer writer(buffer);
  writer.StartObject();
  writer.Key("frame");
  writer.Uint64(report.frame);
  writer.Key("time_s");
  number(writer, report.time_s);
  writer.Key("visible");
  writer.StartArray();
  for (const Detection& seen : report.visible) detection(writer, seen, pattern_names);
  writer.EndArray();
  writer.Key("reason");
  writer.String(to_string(report.reason));
  writer.Key("state");
  writer.String(to_string(report.state));
  times(writer, report.ms);
  writer.EndObject();
  return {buffer.GetString(), buffer.GetSize()};
}

std::string summary_line(const RunStats& stats) {
  rapidjson::StringBuffer buffer;
  Writer writer(buffer);
  writer.StartObject();
  writer.Key("summary");
  writer.StartObject();
  writer.Key("frames");
  writer.Uint64(stats.frames());
  writer.Key("dropped");
  writer.Uint64(stats.dropped());
  writer.Key("visible");
  writer.Uint64(stats.visible());
  writer.Key("recognised_percent");
  number(writer, stats.recognised_percent());
  writer.Key("states");
  writer.StartObject();
  for (const Shown state : {Shown::kShown, Shown::kHeld, Shown::kHidden}) {
    writer.Key(to_string(state));
    writer.Uint64(stats.count(state));
  }
  writer.EndObject();
  writer.Key("reasons");
  writer.StartObject();
  for (const Reason reason : kReasons) {
    if (stats.count(reason) == 0) continue;
    writer.Key(to_string(reason));
    writer.Uint64(stats.count(reason));
  }
  writer.EndObject();
  writer.Key("late");
  writer.Uint64(stats.late());
  times(writer, stats.median_ms());
  writer.EndObject();
  writer.EndObject();
  return {buffer.GetString(), buffer.GetSize()};
}

std::string turntable_line(const TurntableReport& report) {
  rapidjson::StringBuffer buffer;
  Writer writer(buffer);
  writer.StartObject();
  writer.Key("frame");
  writer.Uint64(report.frame);
  writer.Key("model");
  text(writer, report.model);
  writer.Key("angle_deg");
  number(writer, report.angle_deg);
  writer.Key("triangles");
  writer.Uint64(report.triangles);
  writer.Key("draw_calls");
  writer.Int(report.draw_calls);
  writer.Key("ms");
  writer.StartObject();
  writer.Key("render");
  rounded(writer, report.render_ms);
  writer.EndObject();
  writer.EndObject();
  return {buffer.GetString(), buffer.GetSize()};
}

}  // namespace modar
