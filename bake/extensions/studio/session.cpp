#include "bake/extensions/studio/session.hpp"

#include <filesystem>

#include "bake/io/output.hpp"
#include "bake/process/process.hpp"

namespace modar {

namespace fs = std::filesystem;

Result<std::string> find_studio_page() {
  const fs::path programs = program_folder();
  for (const fs::path& folder : {programs / "../share/modar/studio", programs / "../studio"}) {
    if (fs::exists(folder / "index.html")) return folder.lexically_normal().string();
  }
  return fail(ExitCode::kUnsupported, "studio.page", programs.string(),
              "the studio's page is not next to the programs",
              "install the package again; from the source: scripts/setup.sh web, and build again");
}

Result<std::string> make_project_folder(const std::string& name) {
  MODAR_TRY(make_output_folder(name));
  std::error_code error;
  std::string folder = fs::canonical(name, error).string();
  const std::string own = folder + "/" + kStudioFolder;
  MODAR_TRY(make_output_folder(own));
  if (fs::canonical(own, error) != fs::path(own)) {
    return fail(ExitCode::kUsage, "studio.folder", own,
                "it is a link that leads out of the project's folder", "remove the link");
  }
  return folder;
}

void clear_leftovers(const Session& session) {
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(session.folder, error)) {
    const std::string name = entry.path().filename().string();
    const bool ours = name.starts_with(kShownProject) ||
                      (name.starts_with(std::string(kProjectFile) + ".") && name.ends_with(".tmp"));
    if (ours) fs::remove(entry.path(), error);
  }
  for (const auto& entry : fs::directory_iterator(session.own, error)) {
    const std::string name = entry.path().filename().string();
    const bool ours = name.starts_with("incoming-") || name.starts_with("unpacked-");
    if (ours) fs::remove_all(entry.path(), error);
  }
}

void report_project(Session& session, bool files) {
  const auto state = session.text.read();
  session.events.publish("project", {{"revision", state ? state->revision : ""}, {"files", files}});
}

}  // namespace modar
