// Web addresses that people are shown before they open them: the result of the read must be at its
// end.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>
#include <utility>

#include "formats/base/utf8.hpp"

namespace modar {

/// The code point of a character of utf8_character().
inline std::uint32_t utf8_value(std::string_view character) {
  constexpr std::uint32_t kFirst[] = {0x7F, 0x1F, 0x0F, 0x07};  // bits of a first byte, by size
  std::uint32_t value = static_cast<unsigned char>(character[0]) & kFirst[character.size() - 1];
  for (const char c : character.substr(1)) {
    value = value << 6 | (static_cast<unsigned char>(c) & 0x3Fu);
  }
  return value;
}

/// Code points that show nothing, or that change the order in which others are shown: controls,
/// blanks, Unicode's default ignorable characters and its bidirectional controls.
inline constexpr std::array<std::pair<std::uint32_t, std::uint32_t>, 22> kUnseen = {
    {{0x00, 0x20},       {0x7F, 0xA0},      {0xAD, 0xAD},     {0x34F, 0x34F},   {0x61C, 0x61C},
     {0x115F, 0x1160},   {0x1680, 0x1680},  {0x17B4, 0x17B5}, {0x180B, 0x180F}, {0x2000, 0x200F},
     {0x2028, 0x202F},   {0x205F, 0x206F},  {0x2800, 0x2800}, {0x3000, 0x3000}, {0x3164, 0x3164},
     {0xFE00, 0xFE0F},   {0xFEFF, 0xFEFF},  {0xFFA0, 0xFFA0}, {0xFFF0, 0xFFFB}, {0x1BCA0, 0x1BCA3},
     {0x1D173, 0x1D17A}, {0xE0000, 0xE0FFF}}};

/// Why an address may lead elsewhere than its reader thinks, or nullptr. Of http and https the host
/// is looked at, too.
inline const char* address_fault(std::string_view address) {
  for (std::string_view rest = address; !rest.empty();) {
    const std::size_t size = utf8_character(rest);
    const std::uint32_t point = size == 0 ? 0 : utf8_value(rest.substr(0, size));
    for (const auto& [first, last] : kUnseen) {
      if (point >= first && point <= last) return "it has a blank or an invisible character";
    }
    rest.remove_prefix(size);
  }
  if (address.find_first_of("\"<>\\^`{|}") != std::string_view::npos) {
    return "it has a character that addresses cannot have";
  }
  const std::size_t scheme = address.find("://");
  if (scheme == std::string_view::npos) return nullptr;
  const std::string_view host =
      address.substr(scheme + 3, address.find_first_of("/?#", scheme + 3) - scheme - 3);
  if (host.empty()) return "it has no host";
  if (host.find('@') != std::string_view::npos) return "it has a user name in front of its host";
  return nullptr;
}

}  // namespace modar
