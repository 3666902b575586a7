#include "bake/commands/cli.hpp"

int main(int argc, char** argv) {
  return modar::run_modar(argc, argv);
}
