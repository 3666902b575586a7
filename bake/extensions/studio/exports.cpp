#include "bake/extensions/studio/exports.hpp"

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <set>

#include "bake/extensions/studio/archive.hpp"
#include "bake/extensions/studio/edits.hpp"
#include "bake/extensions/studio/path_guard.hpp"
#include "bake/extensions/studio/phone.hpp"
#include "bake/extensions/studio/report_view.hpp"
#include "bake/extensions/studio/session.hpp"
#include "bake/process/process.hpp"
#include "formats/base/atomic_file.hpp"
#include "formats/base/path.hpp"

namespace modar {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

constexpr double kEstimateAfter = 3;  // seconds: before, an estimate is meaningless

/// {"stage", "done"} of `modar bake --progress-json` as the page reads it.
void publish_progress(Session& session, const Job& job, const std::string& line,
                      const Clock::time_point& start) {
  if (!line.starts_with('{')) return;
  const Json told = Json::parse(line);
  const double done = told.number_at("done");
  const double elapsed = std::chrono::duration<double>(Clock::now() - start).count();
  const bool guess = elapsed > kEstimateAfter && done > 0.02;
  session.events.publish("progress",
                         {{"job", job.number},
                          {"kind", job.kind},
                          {"stage", told.find("stage").value_or("")},
                          {"done", done},
                          {"eta_s", guess ? Json(elapsed * (1 - done) / done) : Json()}});
}

/// "modar: error: where: cause; cure [code]", the last such line that a command printed.
Error error_in(const std::string& errors, const std::string& what) {
  Error error{ExitCode::kInternal, "modar.bug", "", what + " failed",
              "run it in a terminal to see more"};
  const std::string_view mark = "modar: error: ";
  const std::size_t at = errors.rfind(mark);
  if (at == std::string::npos) return error;
  std::string line = errors.substr(at + mark.size(), errors.find('\n', at) - at - mark.size());
  if (const std::size_t code = line.rfind(" ["); code != std::string::npos && line.ends_with(']')) {
    error.code = line.substr(code + 2, line.size() - code - 3);
    line.erase(code);
  }
  error.cure.clear();
  if (const std::size_t cure = line.rfind("; "); cure != std::string::npos) {
    error.cure = line.substr(cure + 2);
    line.erase(cure);
  }
  error.cause = line;
  return error;
}

void publish_failure(Session& session, const Job& job, const Error& error, Json errors) {
  Json told = json_of(error);
  told.set("job", job.number);
  told.set("kind", job.kind);
  told.set("errors", std::move(errors));
  session.events.publish("failed", told);
}

/// True where the job was cancelled, and notifies the pages.
bool told_cancelled(Session& session, const Job& job) {
  if (!job.cancelled()) return false;
  session.events.publish("cancelled", {{"job", job.number}, {"kind", job.kind}});
  return true;
}

/// The errors of `modar bake --json` as the page reads them.
Json errors_of(const Json& outcome) {
  Json errors = Json::array();
  for (const Json& one : outcome["errors"].elements()) {
    errors.push_back(json_of(Error{ExitCode::kOk, one.text_at("code"), one.text_at("where"),
                                   one.text_at("cause"), one.text_at("cure")}));
  }
  return errors;
}

/// One picture and its scenes, as a project of its own: its text, and the scenes of the view.
struct ShownPart {
  std::string text;  ///< empty where the project has no more than that
  Json scenes = Json::array();
};

ShownPart shown_part(Session& session, const Json& scenes, const std::string& shown) {
  ShownPart part;
  std::string pattern;
  std::set<std::string> models;
  for (const Json& scene : scenes.elements()) {
    const std::string one = scene.text_at("pattern");
    if (pattern.empty() || one == shown) pattern = one;
  }
  for (const Json& scene : scenes.elements()) {
    if (scene.text_at("pattern") != pattern) continue;
    models.insert(scene.text_at("model"));
    part.scenes.push_back(scene);
  }
  const auto state = session.text.read();
  if (!state || part.scenes.size() == 0) return part;
  const Project project = read_draft(state->text, session.file).project;
  Json edits = Json::array();
  const auto leave_out = [&](const char* table, const ProjectAsset& asset) {
    edits.push_back({{"op", "delete"}, {"table", table}, {"name", asset.name}});
  };
  for (const ProjectAsset& model : project.models) {
    if (models.count(model.name) == 0) leave_out("model", model);
  }
  for (const ProjectAsset& other : project.patterns) {
    if (other.name != pattern) leave_out("pattern", other);
  }
  if (edits.size() != 0) part.text = edited_text(state->text, session.file, edits).value_or("");
  return part;
}

/// Where nothing is baked yet, bakes the visible scene before the rest, which then finds it in the
/// cache. The bundle is whole, and stale until the rest is in it.
void bake_shown(Session& session, Job& job, const ShownPart& part) {
  const std::string file = session.folder + "/" + kShownProject;
  if (part.text.empty() || baked_bundle(session) || !write_file(file, part.text)) return;
  const ProcessResult ran =
      job.run({own_program(), "bake", "--project", file, "--json"}, session.folder, {});
  std::error_code error;
  fs::remove(file, error);
  if (ran.exit != 0) return;
  {
    const std::lock_guard lock(session.mutex);
    session.baked_scenes = part.scenes;
  }
  session.events.publish("shown", {{"job", job.number}});
}

/// A bake as `modar bake` in the folder does it, in a process of its own: it may be ended at any
/// time, and takes nothing of the server's memory with it.
void bake(Session& session, Job& job, Json scenes, const std::string& shown) {
  const auto start = Clock::now();
  bake_shown(session, job, shown_part(session, scenes, shown));
  const ProcessResult ran =
      job.run({own_program(), "bake", "--json", "--progress-json"}, session.folder,
              [&](const std::string& line) { publish_progress(session, job, line, start); });
  if (told_cancelled(session, job)) return;
  const Json outcome = Json::parse(ran.output);
  Json errors = errors_of(outcome);
  if (ran.exit != 0) {
    Error error = error_in(ran.errors, "the bake");
    return publish_failure(session, job, error, std::move(errors));
  }
  {
    const std::lock_guard lock(session.mutex);
    session.baked_scenes = std::move(scenes);
  }
  const Json first = outcome["bundles"][0];
  keep_findings(session, outcome.find("findings").value_or(Json::array()));
  const std::chrono::duration<double> seconds = Clock::now() - start;
  session.events.publish("baked", {{"job", job.number},
                                   {"bytes", first.find("bytes").value_or(0)},
                                   {"seconds", seconds.count()},
                                   {"bundle", "api/bundle?v=" + std::to_string(job.number)},
                                   {"assets", outcome.find("assets").value_or(Json::array())},
                                   {"findings", outcome.find("findings").value_or(Json::array())},
                                   {"errors", std::move(errors)}});
  refresh_phone(session);
}

/// What a kind of export runs, and what it leaves.
struct Export {
  std::vector<std::vector<std::string>> commands;
  std::string path;  ///< file or folder, relative to the project's
};

std::string stem_of(const std::string& bundle) {
  return file_stem(bundle);
}

std::vector<std::string> web_command(const std::string& bundle, const std::string& folder,
                                     const Json& body) {
  std::vector<std::string> words = {own_program(), "web", bundle, "-o", folder, "--quiet"};
  const std::string title = body.text_at("title");
  if (!title.empty()) words.insert(words.end(), {"--title", title});
  std::string list;
  for (const Json& language : body["languages"].elements()) {
    list += (list.empty() ? "" : ",") + language.text().value_or("");
  }
  if (!list.empty()) words.insert(words.end(), {"--languages", list});
  return words;
}

/// The app's script, installed or next to the build.
std::string app_script() {
  const fs::path programs = program_folder();
  std::error_code error;
  for (const fs::path& script :
       {programs / "../share/modar/apk/scripts/apk.sh", programs / "../../../scripts/apk.sh"}) {
    if (fs::exists(script, error)) return script.lexically_normal().string();
  }
  return {};
}

Result<Export> export_of(Session& session, const std::string& kind, const Json& body) {
  MODAR_ASSIGN(const std::string bundle, baked_bundle(session));
  const std::string out = fs::path(bundle).parent_path().string();
  const std::string name = stem_of(bundle);
  Export made;
  if (kind == "page" || kind == "zip") {
    made.path = out + "/" + name + "-page";
    made.commands = {web_command(bundle, made.path, body)};
  } else if (kind == "project") {
    made.path = out + "/" + name + "-project";
  } else if (kind == "release") {
    // A key is a person's: it is where a backup finds it, and only its owner may read it.
    const std::string key = "keys/" + name + ".key";
    std::error_code error;
    if (!fs::exists(path_in(session, key), error)) {
      MODAR_TRY(place_inside(session.folder, key));
      made.commands.push_back({own_program(), "ship", "keygen", "--out", key});
    }
    made.path = out + "/" + name + "-release";
    made.commands.push_back(
        {own_program(), "ship", "publish", bundle, "--to", made.path, "--key", key, "--quiet"});
  } else if (kind == "apk") {
    MODAR_TRY(can_make_app());
    made.path = out + "/" + name + ".apk";
    made.commands = {{app_script(), bundle, "--out", made.path}};
    const std::string title = body.text_at("title");
    if (!title.empty()) made.commands[0].insert(made.commands[0].end(), {"--title", title});
  } else {
    return fail(ExitCode::kUsage, "studio.request", kind, "there is no such export",
                "reload the page");
  }
  return made;
}

/// What follows "apt-get install " in the words of a script.
Json packages_in(const std::string& errors) {
  constexpr std::string_view kMark = "apt-get install ";
  Json packages = Json::array();
  const std::size_t at = errors.find(kMark);
  if (at == std::string::npos) return packages;
  std::string list = errors.substr(at + kMark.size(), errors.find('\n', at) - at - kMark.size());
  for (std::size_t end = 0; !list.empty(); list.erase(0, std::min(end + 1, list.size()))) {
    end = std::min(list.find(' '), list.size());
    if (end > 0) packages.push_back(list.substr(0, end));
  }
  return packages;
}

void publish_command_failure(Session& session, const Job& job, const ProcessResult& ran) {
  const Json packages = packages_in(ran.errors);
  if (packages.size() == 0) {
    return publish_failure(session, job, error_in(ran.errors, "the export"), Json::array());
  }
  std::string names;
  for (const Json& package : packages.elements()) names += " " + *package.text();
  Json told =
      json_of(Error{ExitCode::kUnsupported, "studio.package", job.kind,
                    "this machine lacks programs that this needs", "sudo apt-get install" + names});
  told.set("job", job.number);
  told.set("kind", job.kind);
  told.set("package", packages);
  session.events.publish("failed", told);
}

/// What the project is made of, without keys, bundles and names that begin with a dot.
Result<void> copy_sources(const Session& session, const std::string& out, const std::string& to) {
  std::error_code error;
  fs::remove_all(to, error);
  fs::recursive_directory_iterator it(session.folder, error);
  for (; !error && it != fs::recursive_directory_iterator(); it.increment(error)) {
    const std::string name = it->path().lexically_relative(session.folder).string();
    if (it->path().filename().string().starts_with('.') || name == out || name == "keys") {
      it.disable_recursion_pending();
    } else if (it->is_regular_file(error)) {
      fs::create_directories(fs::path(to + "/" + name).parent_path(), error);
      if (!fs::copy_file(it->path(), to + "/" + name, error)) break;
    }
  }
  if (!error) return {};
  return fail(ExitCode::kIo, "io.write", to, error.message(), cure_of_writing(error.value()));
}

void run_export(Session& session, Job& job, const Export& made) {
  for (const auto& command : made.commands) {
    const ProcessResult ran = job.run(command, session.folder, {});
    if (told_cancelled(session, job)) return;
    if (ran.exit != 0) return publish_command_failure(session, job, ran);
  }
  std::string path = made.path;
  Json url;
  if (job.kind == "zip" || job.kind == "project") {
    path += ".zip";
    const bool whole_project = job.kind == "project";
    const std::string folder =
        whole_project ? session.own + "/sources" : path_in(session, made.path);
    const std::string out = fs::path(path).parent_path().string();
    const auto packed =
        (whole_project ? copy_sources(session, out, folder) : Result<void>()).and_then([&] {
          return pack_zip(folder, path_in(session, path));
        });
    std::error_code ignored;
    if (whole_project) fs::remove_all(folder, ignored);
    if (!packed) return publish_failure(session, job, packed.error(), Json::array());
  }
  if (job.kind == "zip" || job.kind == "project" || job.kind == "apk") url = "api/export/" + path;
  session.events.publish("exported",
                         {{"job", job.number}, {"kind", job.kind}, {"path", path}, {"url", url}});
}

Result<Answer> started(const Result<std::uint64_t>& job) {
  MODAR_TRY(job);
  return answer_of(Json{{"job", *job}}, 202);
}

}  // namespace

Result<void> can_make_app() {
  const auto lacks = [](const char* code, const std::string& cause, const char* cure) {
    return fail(ExitCode::kUnsupported, code, "apk", cause, cure);
  };
  if (app_script().empty()) {
    return lacks("studio.app-sources",
                 "an Android app is compiled from ModAR's sources, which are not installed with "
                 "this program",
                 "start the studio from its sources, or make the web page, which needs no app");
  }
  // Without it the script makes an APK that no phone can start.
  const char* ndk = std::getenv("ANDROID_NDK");
  if (std::error_code error; ndk == nullptr || !fs::is_directory(ndk, error)) {
    return lacks("studio.app-ndk", "Google's NDK is missing, which compiles the app for phones",
                 "unpack it, start the studio with ANDROID_NDK=FOLDER, or make the web page");
  }
  std::string missing;
  for (const char* tool : {"javac", "aapt", "aapt2", "zipalign", "apksigner", "jarsigner",
                           "keytool", "proguard", "python3", "xz"}) {
    if (!is_installed(tool)) missing += (missing.empty() ? "" : ", ") + std::string(tool);
  }
  if (missing.empty()) return {};
  return lacks("studio.app-tools", "programs are missing: '" + missing + "'",
               "sudo apt-get install aapt zipalign apksigner android-framework-res "
               "default-jdk-headless proguard-cli python3-pil xz-utils");
}

std::string own_program() {
  return program_folder() + "/modar";
}

Result<std::string> baked_bundle(Session& session, const std::string& tier) {
  MODAR_ASSIGN(const ProjectText::State state, session.text.read());
  const Project project = read_draft(state.text, session.file).project;
  const bool some = !project.bundles.empty() && !project.tiers.empty();
  const std::string suffix = !tier.empty()                            ? "-" + tier
                             : some && !project.tiers[0].name.empty() ? "-" + project.tiers[0].name
                                                                      : "";
  const std::string path =
      some ? project.out + "/" + project.bundles[0].name + suffix + ".modar" : std::string();
  if (some && file_inside(session.folder, path)) return path;
  return fail(ExitCode::kUsage, "studio.not-baked", "", "nothing has been baked yet",
              "add a picture and a model, and bake");
}

Result<Answer> post_bake(Session& session, const Json& body) {
  MODAR_ASSIGN(const Json view, project_view(session));
  return started(session.jobs.start(
      "bake", [&session, scenes = view["scenes"], shown = body.text_at("shown")](Job& job) {
        bake(session, job, scenes, shown);
      }));
}

Result<Answer> post_export(Session& session, const Json& body) {
  const std::string kind = body.text_at("kind");
  MODAR_ASSIGN(const Export made, export_of(session, kind, body));
  return started(
      session.jobs.start(kind, [&session, made](Job& job) { run_export(session, job, made); }));
}

Result<Answer> cancel_job(Session& session) {
  if (session.jobs.cancel()) return answer_of(Json::object());
  return fail(ExitCode::kUsage, "studio.nothing", "", "nothing is being made", "");
}

}  // namespace modar
