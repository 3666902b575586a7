#include "bake/extensions/lab/number_lines.hpp"

#include <algorithm>
#include <fstream>
#include <sstream>

namespace modar {
namespace {

bool is_head(const std::string& line) {
  const char first = line[0];
  return (first >= 'a' && first <= 'z') || (first >= 'A' && first <= 'Z');
}

}  // namespace

Result<std::vector<NumberLine>> read_numbers(const std::string& path, const char* code) {
  std::ifstream file(path);
  if (!file) return fail(ExitCode::kIo, code, path, "the file cannot be read", "check its path");
  std::vector<NumberLine> lines;
  std::string line;
  for (std::size_t number = 1; std::getline(file, line); ++number) {
    if (line.empty() || line[0] == '#' || (number == 1 && is_head(line))) continue;
    std::replace(line.begin(), line.end(), ',', ' ');
    std::istringstream words(line);
    words.imbue(std::locale::classic());
    NumberLine out{number, {}};
    for (double value = 0; words >> value;) out.values.push_back(value);
    if (!words.eof()) {
      return fail(ExitCode::kInvalidInput, code, path + ":" + std::to_string(number),
                  "this is not a number", "write numbers separated by blanks or commas");
    }
    if (!out.values.empty()) lines.push_back(std::move(out));
  }
  return lines;
}

}  // namespace modar
