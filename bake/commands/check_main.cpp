// The program `modar`. It checks bundles itself, linked with little, so that a check starts at once
// and stays small; for all else it becomes modar-workshop, which has all of the workstation's
// libraries.
#include <unistd.h>

#include <cstring>
#include <filesystem>
#include <string>
#include <system_error>
#include <vector>

#include "bake/commands/check_command.hpp"
#include "bake/terminal.hpp"

namespace {

namespace fs = std::filesystem;

/// The workshop lies beside the folder of programs, in the build tree as where it is installed.
int become_workshop(char** argv) {
  std::error_code error;
  const fs::path self = fs::read_symlink("/proc/self/exe", error);
  const fs::path workshop = self.parent_path().parent_path() / MODAR_WORKSHOP;
  execv(workshop.c_str(), argv);
  return modar::print_error({modar::ExitCode::kIo, "modar.workshop", workshop.string(),
                             std::strerror(errno), "build or install ModAR again"});
}

int run(int argc, char** argv) {
  if (argc > 1 && std::strcmp(argv[1], "check") == 0) {
    const std::vector<std::string> words(argv + 2, argv + argc);
    if (!modar::needs_sources(words)) return modar::run_check_line(words, nullptr);
  }
  return become_workshop(argv);
}

}  // namespace

int main(int argc, char** argv) {
  return modar::guarded([&] { return run(argc, argv); });
}
