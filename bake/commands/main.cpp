// The program `modar`.
#include <string>

#include "bake/commands/cli.hpp"
#include "bake/commands/commands.hpp"
#include "bake/io/terminal.hpp"
#include "formats/base/leftover.hpp"
#include "modar/features.hpp"
#include "modar/mapped_file.hpp"

int modar::run_modar(int argc, char** argv) {
  modar::guard_mapped_files();
  modar::remove_leftovers_at_signals();
  modar::use_baseline_instructions();
  const int code = modar::guarded([&] {
    modar::CommandLine program("Bake models and pictures for augmented reality on old phones",
                               std::string("modar ") + MODAR_VERSION);
    program.group("Commands to start with");
#ifdef MODAR_HAS_STUDIO
    modar::add_studio(program);
#endif
    modar::add_pattern(program);
    modar::add_bake(program);
    modar::add_check(program);
#ifdef MODAR_HAS_PAGE
    modar::add_report(program);
#endif
#ifdef MODAR_HAS_WEB
    modar::add_web(program);
#endif
    modar::add_init(program);
    program.group("Look closer", modar::Shown::kInFull);
    modar::add_inspect(program);
    modar::add_calibrate(program);
#ifdef MODAR_HAS_ADOPT
    modar::add_adopt(program);
#endif
    program.group("Build servers and releases", modar::Shown::kInFull);
    modar::add_ship(program);
    modar::add_plan(program);
    modar::add_cache(program);
    program.group("Help", modar::Shown::kInFull);
    modar::add_document(program);
    program.add_help();
    program.footer(
        "\n`modar help all` lists every command. `modar COMMAND --help` shows a command's usual\n"
        "options and an example, `modar COMMAND --help-all` all of its options.\n");
    return program.parse_and_run(argc, argv);
  });
  return modar::finish_output(code);
}

int main(int argc, char** argv) {
  return modar::run_modar(argc, argv);
}
