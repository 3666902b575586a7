// `modar studio`: the page from which a project is made.
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <memory>

#include "bake/commands/commands.hpp"
#include "bake/extensions/studio/studio.hpp"
#include "bake/process/process.hpp"
#include "bake/project/project.hpp"

namespace modar {
namespace {

namespace fs = std::filesystem;

struct StudioCommand {
  StudioOptions options;
  bool no_browser = false;
};

/// Where nobody named one: the current folder, but never all of a person's files.
std::string usual_folder() {
  const char* home = std::getenv("HOME");
  std::error_code error;
  const bool at_home = home != nullptr && fs::equivalent(".", home, error);
  if (!at_home || fs::exists(kProjectFile, error)) return ".";
  return std::string(home) + "/ModAR";
}

void show(const StudioCommand& command, const StudioAddress& address) {
  const bool opened =
      !command.no_browser && run_process({{"xdg-open", address.opening}, {}, {}}) == 0;
  if (!opened) {
    std::printf("%s\n", address.page.c_str());
    std::fflush(stdout);
  }
  const char* end =
      address.elsewhere ? "it was open already" : "Ctrl-C here, or Quit in the page, ends it";
  std::fprintf(stderr, "%s%s; %s\n", command.options.folder.c_str(),
               opened ? ": the studio is open in your browser"
                      : ": open the address in a browser on this machine, and show it to nobody",
               end);
}

Result<ExitCode> run(StudioCommand& command) {
  if (command.options.folder.empty()) command.options.folder = usual_folder();
  MODAR_TRY(run_studio(command.options, [&](const auto& address) { show(command, address); }));
  return ExitCode::kOk;
}

}  // namespace

void add_studio(CommandLine& program) {
  CommandLine& line =
      program.command("studio", "Make, try and ship a project in the browser, without typing");
  const auto command = std::make_shared<StudioCommand>();
  command->options.tool_version = MODAR_VERSION;
  line.option("folder", &command->options.folder,
              "Folder of the project, made if absent (default: the current one; ModAR in your home "
              "folder if that is the current one)",
              {.type = "FOLDER"});
  line.flag("--no-browser", command->no_browser, "Print the address and open no browser");
  line.option("--port", &command->options.port, "Port on 127.0.0.1; 0: any free port",
              {.shows_default = true, .least = 0, .most = 65535});
  line.footer(example("  modar studio museum\n"));
  line.run([command] { return run(*command); });
}

}  // namespace modar
