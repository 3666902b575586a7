// The program `modar-lab`: what measures ModAR, apart from what people use.
#include <string>

#include "bake/extensions/lab/commands.hpp"
#include "bake/io/terminal.hpp"
#include "modar/mapped_file.hpp"

int main(int argc, char** argv) {
  modar::guard_mapped_files();
  const int code = modar::guarded([&] {
    modar::CommandLine program("Measure ModAR next to references, and test its checker",
                               std::string("modar-lab ") + MODAR_VERSION);
    modar::add_bench(program);
    modar::add_mutate(program);
    program.add_help();
    return program.parse_and_run(argc, argv);
  });
  return modar::finish_output(code);
}
