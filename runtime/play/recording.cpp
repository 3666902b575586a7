// Writes recordings.
#include "recording.hpp"

#include "formats/base/atomic_file.hpp"
#include "formats/json_writer.hpp"
#include "frame_sink.hpp"

namespace modar {
namespace {

std::string head_line(const RecordingHead& head) {
  JsonWriter writer;
  const auto camera = [&] {
    const Camera& c = head.camera;
    writer.add(c.width);
    writer.add(c.height);
    for (const double value : {c.fx, c.fy, c.cx, c.cy}) writer.add(value);
    for (const double value : c.distortion) writer.add(value);
  };
  writer.object([&] {
    writer.object("recording", [&] {
      writer.put("version", 1);
      writer.put("method", head.method);
      writer.put("parameters", head.parameters);
      writer.put("fps", head.fps);
      writer.put("stills", head.stills);
      // A string: JSON's numbers end at 2^53 for most readers.
      writer.put("bundle_hash", std::to_string(head.bundle_hash));
      writer.array("camera", camera);
    });
  });
  return writer.str();
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

}  // namespace modar
