// The studio without a server of its own: a page's worker, or Node's server, hands requests over,
// and takes answers and events. A job runs in a second instance of the program: in a worker of its
// own with a copy of the files, or in a process.
#include <emscripten/emscripten.h>

#include <cstdint>
#include <memory>
#include <string>

#include "bake/extensions/studio/archive.hpp"
#include "bake/extensions/studio/folder_state.hpp"
#include "bake/extensions/studio/phone.hpp"
#include "bake/extensions/studio/session.hpp"
#include "bake/extensions/wasm/studio_job.hpp"
#include "bake/io/output.hpp"

/// Of node.js: ends the server.
extern "C" void modar_studio_quit();

namespace modar {
namespace {

struct Studio {
  explicit Studio(const std::string& folder) : session(folder, MODAR_VERSION) {
    session.quit = [this] {
      session.events.publish("quit", Json::object());
      modar_studio_quit();
    };
  }
  Session session;
  Answer answer;
  std::string text;  ///< that was returned last
  FolderState files;
};

std::unique_ptr<Studio> studio;

const char* returned(const Json& json) {
  studio->text = json.dump();
  return studio->text.c_str();
}

}  // namespace

// ---- what a studio of this kind does not have ----

Result<Answer> post_phone(Session&) {
  return fail(
      ExitCode::kUnsupported, "studio.phone", "", "this studio cannot serve the result to a phone",
      "`modar web BUNDLE -o FOLDER --serve` in a terminal does; or download the page as a ZIP "
      "file and put it on a web server");
}

Result<Answer> end_phone(Session&) {
  return answer_of(Json::object());
}

void refresh_phone(Session&) {}

}  // namespace modar

// ---- of studio-worker.js and studio.js ----

/// job: 0 for the instance that answers the page; else the number of the job that this one runs.
extern "C" EMSCRIPTEN_KEEPALIVE void studio_open(const char* folder, unsigned job) {
  modar::this_job = job;
  modar::studio = std::make_unique<modar::Studio>(folder);
  // Without it nothing can be kept, which the first upload reports.
  static_cast<void>(modar::make_output_folder(modar::studio->session.own));
}

/// Publishes that another editor has changed the project's files since the last call, if so.
extern "C" EMSCRIPTEN_KEEPALIVE void studio_look() {
  modar::Studio& studio = *modar::studio;
  const modar::FolderState now = modar::folder_state(studio.session.folder);
  const bool known = studio.files.all != modar::FolderState().all;
  if (known && now.all != studio.files.all) {
    modar::report_project(studio.session, now.sources != studio.files.sources);
  }
  studio.files = now;
}

/// The files of a project that was exported, into its folder. Answers null, or the error.
extern "C" EMSCRIPTEN_KEEPALIVE const char* studio_unpack(const char* archive, const char* folder) {
  const auto names = modar::unpack_zip(archive, folder);
  return modar::returned(names ? modar::Json() : modar::json_of(names.error()));
}

/// request: {"method", "path", "query": {name: value}, "body", "upload"}, as in Call. Answers
/// {"status", "type", "headers", "file", "at", "size"}: the body's place in memory, until the next
/// call, or the path of a file.
extern "C" EMSCRIPTEN_KEEPALIVE const char* studio_call(const char* request) {
  using namespace modar;
  const Json json = Json::parse(request);
  Call call;
  call.method = json.text_at("method");
  call.path = json.text_at("path");
  call.body = json.text_at("body");
  call.upload = json.text_at("upload");
  const Json query = json.find("query").value_or(Json::object());
  for (const std::string& name : query.keys()) {
    call.query.emplace(name, query.text_at(name));
  }
  studio->answer = answer_call(studio->session, call);
  const Answer& answer = studio->answer;
  Json headers = Json::object();
  for (const auto& [name, value] : answer.headers) headers.set(name, value);
  return returned({{"status", answer.status},
                   {"type", answer.type},
                   {"headers", std::move(headers)},
                   {"file", answer.file},
                   {"at", reinterpret_cast<std::uintptr_t>(answer.body.data())},
                   {"size", answer.body.size()}});
}

/// The events after that number: [{"number", "name", "data"}]. data: JSON as text.
extern "C" EMSCRIPTEN_KEEPALIVE const char* studio_events(unsigned after) {
  using namespace modar;
  Json list = Json::array();
  for (const Event& event : studio->session.events.wait(after, std::chrono::milliseconds(0))) {
    list.push_back({{"number", event.number}, {"name", event.name}, {"data", event.data}});
  }
  return returned(list);
}

/// An event of the instance that runs a job, for the page.
extern "C" EMSCRIPTEN_KEEPALIVE void studio_publish(const char* name, const char* data) {
  modar::studio->session.events.publish(name, modar::Json::parse(data));
}

/// Of the instance that runs a job: what the project had when its bake began; "null": none has.
extern "C" EMSCRIPTEN_KEEPALIVE const char* studio_scenes() {
  return modar::returned(modar::studio->session.baked_scenes);
}

/// The same, in the page's instance.
extern "C" EMSCRIPTEN_KEEPALIVE void studio_set_scenes(const char* scenes) {
  const modar::Json list = modar::Json::parse(scenes);
  if (!list.is_null()) modar::studio->session.baked_scenes = list;
}

/// The job of the page's instance is over.
extern "C" EMSCRIPTEN_KEEPALIVE void studio_job_ended() {
  modar::studio->session.jobs.cancel();
}

/// A line that the program has printed, on stdout (1) or stderr (2).
extern "C" EMSCRIPTEN_KEEPALIVE void studio_line(int stream, const char* line) {
  if (modar::job_line) modar::job_line(stream, line);
}
