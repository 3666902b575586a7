// Text files of numbers: truths of videos, camera paths, annotations.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "formats/base/error.hpp"

namespace modar {

/// A line of numbers, and its place in the file.
struct NumberLine {
  std::size_t number = 0;
  std::vector<double> values;
};

/// Lines of numbers separated by blanks or commas. Empty lines, those that begin with '#', and a
/// first line that begins with a letter (a table's head) are left out. code: of errors. Errors: kIo
/// and kInvalidInput, with the file's line.
Result<std::vector<NumberLine>> read_numbers(const std::string& path, const char* code);

}  // namespace modar
