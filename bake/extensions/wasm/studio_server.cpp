// `modar studio` under Node, which has the server: studio.js.
#include <cstdlib>
#include <memory>

#include "bake/extensions/studio/session.hpp"
#include "bake/extensions/studio/studio.hpp"
#include "bake/extensions/wasm/studio_job.hpp"
#include "bake/extensions/web/site.hpp"

// Of node.js; texts are JSON, and those that are answered are freed by the caller.
/// The request of the job that this process runs; null where it runs none.
extern "C" char* modar_node_job();
extern "C" void modar_node_run_job(const char* folder, const char* request);
/// {"folder", "own", "page", "engine", "port"}. Answers {"page", "opening", "elsewhere"}, or
/// {"error"}.
extern "C" char* modar_node_open_studio(const char* options);
/// Answers requests until the page ends it.
extern "C" void modar_node_serve_studio();
extern "C" void studio_open(const char* folder, unsigned job);

namespace modar {
namespace {

using Text = std::unique_ptr<char, decltype(&std::free)>;

}  // namespace

Result<void> run_studio(const StudioOptions& options,
                        const std::function<void(const StudioAddress&)>& ready) {
  MODAR_ASSIGN(const std::string page, find_studio_page());
  MODAR_ASSIGN(const std::string folder, make_project_folder(options.folder));
  const Text job(modar_node_job(), std::free);
  if (job != nullptr) {
    modar_node_run_job(folder.c_str(), job.get());
    return {};
  }
  const auto engine = find_page();
  const Json asked = {{"folder", folder},
                      {"own", folder + "/" + kStudioFolder},
                      {"page", page},
                      {"engine", engine ? *engine : ""},
                      {"port", options.port}};
  const Text answer(modar_node_open_studio(asked.dump().c_str()), std::free);
  const Json told = Json::parse(answer.get());
  const auto text = [&told](const char* key) {
    return told.find(key).value_or("").text().value_or("");
  };
  if (const std::string error = text("error"); !error.empty()) {
    return fail(ExitCode::kIo, "studio.port", "port " + std::to_string(options.port), error,
                "name another one: --port");
  }
  const bool elsewhere = told.find("elsewhere").has_value();
  if (!elsewhere) {
    clear_leftovers(Session(folder, options.tool_version));
    studio_open(folder.c_str(), 0);
  }
  ready({text("page"), text("opening"), elsewhere});
  if (!elsewhere) modar_node_serve_studio();
  return {};
}

}  // namespace modar
