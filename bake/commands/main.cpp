// The program `modar`.
#include <string>

#include "bake/commands/commands.hpp"
#include "bake/terminal.hpp"

int main(int argc, char** argv) {
  const int code = modar::guarded([&] {
    modar::CommandLine program(
        "modar: bakes models and patterns for augmented reality on old phones",
        std::string("modar ") + MODAR_VERSION);
    modar::add_bake(program);
    modar::add_pattern(program);
    modar::add_check(program);
    modar::add_inspect(program);
    modar::add_bench(program);
    modar::add_ship(program);
    modar::add_calibrate(program);
    modar::add_init(program);
    modar::add_cache(program);
    modar::add_plan(program);
    modar::add_report(program);
    modar::add_web(program);
    modar::add_document(program);
    program.footer("\n`modar COMMAND --help` shows the options and an example of each command.\n");
    return program.parse_and_run(argc, argv);
  });
  return modar::finish_output(code);
}
