// What takes long and leaves files: bakes, pages, apps, releases.
#pragma once

#include <string>

#include "bake/extensions/studio/http_reply.hpp"
#include "formats/base/error.hpp"

namespace modar {

struct Session;

/// POST api/bake, POST api/export: start a job, whose events tell the rest.
Result<Answer> post_bake(Session& session, const Json& body);
Result<Answer> post_export(Session& session, const Json& body);
/// DELETE api/job.
Result<Answer> cancel_job(Session& session);

/// Path of the project's first bundle, or of that of a tier, which has been baked. Errors: kUsage
/// "studio.not-baked".
Result<std::string> baked_bundle(Session& session, const std::string& tier = {});

/// Path of the program `modar` itself.
std::string own_program();

/// Errors: kUnsupported "studio.app-sources", "studio.app-ndk", "studio.app-tools": what the
/// Android app lacks here.
Result<void> can_make_app();

}  // namespace modar
