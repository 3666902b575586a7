#include "formats/base/error.hpp"

namespace modar {

std::string with_numbers(std::string_view text, std::initializer_list<std::uint64_t> numbers) {
  std::string filled;
  for (const std::uint64_t number : numbers) {
    const std::size_t mark = text.find("{}");
    filled += text.substr(0, mark);
    filled += std::to_string(number);
    text.remove_prefix(mark + 2);
  }
  return filled += text;
}

tl::unexpected<Error> fail(ExitCode exit, std::string_view code, std::string_view where,
                           std::string_view cause, std::string_view cure) {
  return tl::unexpected<Error>(
      Error{exit, std::string(code), std::string(where), std::string(cause), std::string(cure)});
}

std::string to_line(const Error& error) {
  std::string line = error.where.empty() ? std::string() : error.where + ": ";
  line += error.cause;
  if (!error.cure.empty()) line += "; " + error.cure;
  return printable(line + " [" + error.code + "]");
}

}  // namespace modar
