// Which handler answers which request.
#include <cstdlib>

#include "bake/extensions/studio/edits.hpp"
#include "bake/extensions/studio/exports.hpp"
#include "bake/extensions/studio/path_guard.hpp"
#include "bake/extensions/studio/phone.hpp"
#include "bake/extensions/studio/report_view.hpp"
#include "bake/extensions/studio/session.hpp"
#include "bake/extensions/studio/upload.hpp"
#include "bake/process/process.hpp"
#include "bake/project/project.hpp"

namespace modar {
namespace {

/// The project after a change of its text, and notifies all pages.
Result<Answer> changed(Session& session, const Result<ProjectText::State>& state) {
  MODAR_TRY(state);
  session.events.publish("project", {{"revision", state->revision}});
  return answer_or_error(project_view(session));
}

Result<Answer> edit(Session& session, const Json& body) {
  const std::string revision = body.text_at("revision");
  const Json edits = body["edits"];
  return changed(session, session.text.edit(revision, [&](const std::string& text) {
    return edited_text(text, session.file, edits);
  }));
}

/// What `modar init` writes.
Result<Answer> init(Session& session) {
  return changed(session, session.text.edit("", [&](const std::string&) -> Result<std::string> {
    MODAR_ASSIGN(InitialProject initial, initial_project(session.folder));
    return std::move(initial.text);
  }));
}

Result<Answer> send_file(const Session& session, const std::string& name) {
  MODAR_ASSIGN(const std::string file, file_inside(session.folder, name));
  Answer answer;
  answer.type = "application/octet-stream";
  answer.file = file;
  return answer;
}

Result<Answer> send_bundle(Session& session, const Call& call) {
  MODAR_ASSIGN(const std::string path, baked_bundle(session, call.asked("tier")));
  return send_file(session, path);
}

/// The folder of the result, in the desktop's own program for files.
Result<Answer> show_folder(Session& session) {
  MODAR_ASSIGN(const ProjectText::State state, session.text.read());
  const std::string folder = path_in(session, read_draft(state.text, session.file).project.out);
  // Without a desktop xdg-open may begin a browser in our terminal, and wait for it.
  const auto is_set = [](const char* name) {
    const char* value = std::getenv(name);
    return value != nullptr && *value != '\0';
  };
  const bool desktop = is_set("DISPLAY") || is_set("WAYLAND_DISPLAY");
  if (desktop && run_process({{"xdg-open", folder}, {}, {}}) == 0) return answer_of(Json::object());
  return fail(ExitCode::kUnsupported, "studio.show", "", "no file manager responds",
              "open it yourself: " + folder);
}

Result<Answer> answer_get(Session& session, const Call& call) {
  if (call.path == "api/project") return answer_or_error(project_view(session));
  if (call.path == "api/bundle") return send_bundle(session, call);
  if (call.path == "api/check") return get_check(session, call);
  if (call.path == "api/sizes") return get_sizes(session);
  if (call.path == "api/devices") return get_devices(session);
  if (call.path.starts_with("api/export/")) return send_file(session, call.path.substr(11));
  if (call.path.starts_with("api/thumb/") && !call.asked("turn").empty()) {
    return get_turntable(session, call);
  }
  if (call.path.starts_with("api/thumb/")) return get_thumb(session, call);
  if (call.path == "api/photo") return get_photo(session, call);
  if (call.path == "api/picture") return get_picture(session, call);
  if (call.path == "api/score") return get_score(session, call);
  if (call.path == "api/rivals") return get_rivals(session, call);
  if (call.path.starts_with("api/files/")) return send_file(session, call.path.substr(10));
  return answer_of(unknown_verb(call));
}

Result<Answer> answer_post(Session& session, const Call& call) {
  const Json body = Json::parse(call.body);
  if (body.is_null()) {
    return fail(ExitCode::kUsage, "studio.request", call.path, "the request is not JSON",
                "reload the page");
  }
  if (call.path == "api/edit") return edit(session, body);
  if (call.path == "api/undo") return changed(session, session.text.undo());
  if (call.path == "api/redo") return changed(session, session.text.redo());
  if (call.path == "api/init") return init(session);
  if (call.path == "api/bake") return post_bake(session, body);
  if (call.path == "api/phone") return post_phone(session);
  if (call.path == "api/export") return post_export(session, body);
  if (call.path == "api/corners") return post_corners(session, body);
  if (call.path == "api/rectify") return post_rectify(session, body);
  if (call.path == "api/show") return show_folder(session);
  if (call.path == "api/quit") {
    session.quit();
    return answer_of(Json::object());
  }
  return answer_of(unknown_verb(call));
}

Result<Answer> routed(Session& session, const Call& call) {
  if (call.method == "GET") return answer_get(session, call);
  if (call.method == "POST") return answer_post(session, call);
  if (call.method == "DELETE" && call.path == "api/job") return cancel_job(session);
  if (call.method == "DELETE" && call.path == "api/phone") return end_phone(session);
  if (call.method == "PUT" && call.path.starts_with("api/files/")) {
    return take_upload(session, call);
  }
  return answer_of(unknown_verb(call));
}

}  // namespace

Answer answer_call(Session& session, const Call& call) {
  Result<Answer> answer = routed(session, call);
  return answer ? std::move(*answer) : answer_of(answer.error());
}

}  // namespace modar
