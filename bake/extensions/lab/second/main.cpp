// `modar-second-reader MODEL CREASE OUT`: what `modar check --source` starts. Exit code 5: a file
// that it does not know.
#include <cstdlib>
#include <fstream>

#include "bake/extensions/lab/second/second.hpp"

int main(int count, char** words) {
  using namespace modar;
  if (count != 4) return static_cast<int>(ExitCode::kUsage);
  const auto model = second::read(words[1], std::strtod(words[2], nullptr));
  if (!model) return static_cast<int>(ExitCode::kUnsupported);
  std::ofstream(words[3], std::ios::binary) << write_second(*model);
  return 0;
}
