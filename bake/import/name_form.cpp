#include "bake/import/name_form.hpp"

#include <array>
#include <cstdint>
#include <string_view>

#include "formats/base/utf8.hpp"

namespace modar {
namespace {

/// The letters of Latin-1 and Latin Extended-A with a mark, each followed by its letter without.
struct MarkedLetters {
  std::string_view mark;  // as macOS writes it, behind the letter
  std::string_view pairs;
};
constexpr MarkedLetters kMarked[] = {{"\u0300", "ÀAÈEÌIÒOÙUàaèeìiòoùu"},
                                     {"\u0301", "ÁAÉEÍIÓOÚUÝYáaéeíióoúuýyĆCćcĹLĺlŃNńnŔRŕrŚSśsŹZźz"},
                                     {"\u0302", "ÂAÊEÎIÔOÛUâaêeîiôoûuĈCĉcĜGĝgĤHĥhĴJĵjŜSŝsŴWŵwŶYŷy"},
                                     {"\u0303", "ÃAÑNÕOãañnõoĨIĩiŨUũu"},
                                     {"\u0304", "ĀAāaĒEēeĪIīiŌOōoŪUūu"},
                                     {"\u0306", "ĂAăaĔEĕeĞGğgĬIĭiŎOŏoŬUŭu"},
                                     {"\u0307", "ĊCċcĖEėeĠGġgİIŻZżz"},
                                     {"\u0308", "ÄAËEÏIÖOÜUäaëeïiöoüuÿyŸY"},
                                     {"\u030A", "ÅAåaŮUůu"},
                                     {"\u030B", "ŐOőoŰUűu"},
                                     {"\u030C", "ČCčcĎDďdĚEěeĽLľlŇNňnŘRřrŠSšsŤTťtŽZžz"},
                                     {"\u0327", "ÇCçcĢGģgĶKķkĻLļlŅNņnŖRŗrŞSşsŢTţt"},
                                     {"\u0328", "ĄAąaĘEęeĮIįiŲUųu"}};

/// Marks of the last letter of `text` and the mark that follows, as one character; false: none.
bool join_mark(std::string& text, std::string_view mark) {
  for (const MarkedLetters& row : kMarked) {
    if (row.mark != mark || text.empty()) continue;
    for (std::size_t i = 0; i + 2 < row.pairs.size(); i += 3) {
      if (row.pairs[i + 2] != text.back()) continue;
      text.pop_back();
      text += row.pairs.substr(i, 2);
      return true;
    }
  }
  return false;
}

/// What cp1252 has at 0x80 to 0x9F; the rest is as in Unicode.
constexpr std::array<std::uint16_t, 32> kCp1252 = {
    0x20AC, 0x81,   0x201A, 0x0192, 0x201E, 0x2026, 0x2020, 0x2021, 0x02C6, 0x2030, 0x0160,
    0x2039, 0x0152, 0x8D,   0x017D, 0x8F,   0x90,   0x2018, 0x2019, 0x201C, 0x201D, 0x2022,
    0x2013, 0x2014, 0x02DC, 0x2122, 0x0161, 0x203A, 0x0153, 0x9D,   0x017E, 0x0178};

std::string utf8_of_cp1252(const std::string& name) {
  std::string text;
  for (const char c : name) {
    const auto byte = static_cast<unsigned char>(c);
    append_utf8(text, byte >= 0x80 && byte < 0xA0 ? kCp1252[byte - 0x80u] : byte);
  }
  return text;
}

}  // namespace

std::string name_form(const std::string& name) {
  const std::string text = is_utf8(name) ? name : utf8_of_cp1252(name);
  std::string form;
  std::string_view rest = text;
  while (!rest.empty()) {
    std::size_t size = utf8_character(rest);
    if (size == 0) size = 1;
    if (size != 2 || !join_mark(form, rest.substr(0, size))) form += rest.substr(0, size);
    rest.remove_prefix(size);
  }
  return ascii_lower(form);
}

std::string short_name(const std::string& name) {
  constexpr std::size_t kMost = 60;
  if (name.size() <= kMost) return name;
  std::size_t end = kMost - 3;
  while (end > 0 && utf8_continues(name[end])) --end;
  return name.substr(0, end) + "...";
}

std::string percent_decoded(const std::string& uri) {
  const auto digit = [](char c) {
    if (c >= '0' && c <= '9') return c - '0';
    if (c >= 'a' && c <= 'f') return c - 'a' + 10;
    return c >= 'A' && c <= 'F' ? c - 'A' + 10 : -1;
  };
  std::string decoded;
  for (std::size_t i = 0; i < uri.size(); ++i) {
    const int high = uri[i] == '%' && i + 2 < uri.size() ? digit(uri[i + 1]) : -1;
    const int low = high >= 0 ? digit(uri[i + 2]) : -1;
    if (low < 0) {
      decoded += uri[i];
      continue;
    }
    decoded += static_cast<char>(16 * high + low);
    i += 2;
  }
  return decoded;
}

}  // namespace modar
