// Reads the record line by line.
#include "gyroscope.hpp"

#include <algorithm>
#include <string_view>

#include "decimal.hpp"
#include "modar/mapped_file.hpp"

namespace modar {
namespace {

/// Takes the first word off the text.
std::string_view parse_word(std::string_view& text) {
  constexpr std::string_view kBlanks = " \t\r,";
  const std::size_t start = std::min(text.find_first_not_of(kBlanks), text.size());
  const std::size_t end = std::min(text.find_first_of(kBlanks, start), text.size());
  const std::string_view word = text.substr(start, end - start);
  text.remove_prefix(end);
  return word;
}

bool parse_signed(std::string_view text, double& value) {
  const bool negative = text.starts_with('-');
  if (negative) text.remove_prefix(1);
  if (!parse_decimal(text, value)) return false;
  if (negative) value = -value;
  return true;
}

}  // namespace

Result<std::vector<glm::dvec3>> read_gyroscope(const std::string& path) {
  MODAR_ASSIGN(const MappedFile file, MappedFile::open(path));
  std::string_view rest(reinterpret_cast<const char*>(file.bytes().data()), file.bytes().size());
  std::vector<glm::dvec3> turns;
  for (int number = 1; !rest.empty(); ++number) {
    const std::size_t end = std::min(rest.find('\n'), rest.size());
    std::string_view line = rest.substr(0, end);
    rest.remove_prefix(std::min(end + 1, rest.size()));
    line = line.substr(0, line.find('#'));
    glm::dvec3 turn(0.0);
    int count = 0;
    bool good = true;
    for (std::string_view word = parse_word(line); !word.empty(); word = parse_word(line)) {
      good = good && count < 3 && parse_signed(word, turn[count]);
      ++count;
    }
    if (count == 0) continue;
    if (!good || count != 3) {
      return fail(ExitCode::kInvalidInput, "gyro.line", path + ":" + std::to_string(number),
                  "this line does not hold three decimal numbers",
                  "write the rotation vector from the frame before, in radians: -0.0012 0.004 0");
    }
    turns.push_back(turn);
  }
  return turns;
}

}  // namespace modar
