// JSON, written member by member: commas follow from the last character.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace modar {

class JsonText {
 public:
  void key(std::string_view name);
  void text(std::string_view value);
  /// The shortest digits that read back the same, in any locale; null where it is not finite.
  void number(double value);
  void count(std::uint64_t value);
  void flag(bool value);
  void open(char bracket);
  void close(char bracket);

  const std::string& str() const { return text_; }

 private:
  void comma();

  std::string text_;
};

}  // namespace modar
