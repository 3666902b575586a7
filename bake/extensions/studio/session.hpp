// A project that is open in a studio: what its verbs share.
#pragma once

#include <functional>
#include <mutex>
#include <string>

#include "bake/extensions/studio/events.hpp"
#include "bake/extensions/studio/http_reply.hpp"
#include "bake/extensions/studio/jobs.hpp"
#include "bake/extensions/studio/pictures.hpp"
#include "bake/extensions/studio/project_text.hpp"
#include "bake/project/project.hpp"
#include "formats/base/error.hpp"

namespace modar {

/// The project of the visible scene, while that is baked before the rest.
inline constexpr const char* kShownProject = ".modar-shown.toml";
inline constexpr const char* kStudioFolder = ".modar/studio";  ///< in the project's; may be removed

struct Session {
  Session(const std::string& project_folder, std::string version)
      : folder(project_folder),
        own(project_folder + "/" + kStudioFolder),
        file(project_folder + "/" + kProjectFile),
        tool_version(std::move(version)),
        text(file) {}

  const std::string folder;        ///< canonical
  const std::string own;           ///< of what the studio itself keeps
  const std::string file;          ///< modar.toml
  const std::string tool_version;  ///< for bundles
  ProjectText text;
  Events events;
  PictureCaches pictures;
  std::mutex mutex;    ///< of what follows up to `jobs`
  Json baked_scenes;   ///< "scenes" of the view when the last bake began; null: unknown
  Json phone;          ///< its address and its code; null: none is served
  std::mutex drawing;  ///< held while models are drawn for their thumbs
  Jobs jobs;
  Jobs phone_server;
  std::function<void()> quit;  ///< ends the studio
};

/// The page installed or built with the programs. Errors: kUnsupported "studio.page".
Result<std::string> find_studio_page();

/// Makes the project's folder where it is missing, and the studio's own in it. Answers its
/// canonical path. Errors: kUsage "studio.folder"; kIo "io.folder".
Result<std::string> make_project_folder(const std::string& name);

/// Of what processes were writing when they were killed.
void clear_leftovers(const Session& session);

/// Tells all pages of a change by another editor. files: of one that a bake may read.
void report_project(Session& session, bool files);

/// The project as the page sees it: GET api/project.
Result<Json> project_view(Session& session);

/// A file of the project's folder, from its path relative to it.
inline std::string path_in(const Session& session, const std::string& file) {
  return session.folder + "/" + file;
}

/// "photo", "model", "video" or "other", by the name.
const char* file_kind(const std::string& file);

/// Answers a request; publishes what it changes.
Answer answer_call(Session& session, const Call& call);

}  // namespace modar
