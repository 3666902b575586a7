#include "formats/captions.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <utility>

namespace modar {
namespace {

constexpr std::string_view kArrow = "-->";

/// The lines of a text, without their ends.
class Lines {
 public:
  explicit Lines(std::string_view text) : text_(text) {}

  [[nodiscard]] std::size_t number() const { return number_; }
  [[nodiscard]] bool at_end() const { return text_.empty(); }

  std::string_view next() {
    const std::size_t end = text_.find('\n');
    const std::string_view line = text_.substr(0, end);
    text_.remove_prefix(end == std::string_view::npos ? text_.size() : end + 1);
    ++number_;
    return line;
  }

 private:
  std::string_view text_;
  std::size_t number_ = 0;
};

/// `digits` decimal digits from the front of the text; -1 where they are not there.
std::int64_t parse_number(std::string_view& text, std::size_t digits) {
  if (text.size() < digits) return -1;
  std::int64_t number = 0;
  for (std::size_t i = 0; i < digits; ++i) {
    if (text[i] < '0' || text[i] > '9') return -1;
    number = 10 * number + (text[i] - '0');
  }
  text.remove_prefix(digits);
  return number;
}

bool take(std::string_view& text, std::string_view part) {
  if (!text.starts_with(part)) return false;
  text.remove_prefix(part.size());
  return true;
}

/// [HH:]MM:SS.mmm in milliseconds; -1: none exists.
std::int64_t parse_time(std::string_view& text) {
  const bool hours = text.size() > 5 && text[2] == ':' && text[5] == ':';
  const std::int64_t hour = hours ? parse_number(text, 2) : 0;
  if (hour < 0 || (hours && !take(text, ":"))) return -1;
  const std::int64_t minute = parse_number(text, 2);
  if (minute < 0 || minute > 59 || !take(text, ":")) return -1;
  const std::int64_t second = parse_number(text, 2);
  if (second < 0 || second > 59 || !take(text, ".")) return -1;
  const std::int64_t rest = parse_number(text, 3);
  return rest < 0 ? -1 : ((hour * 60 + minute) * 60 + second) * 1000 + rest;
}

/// A line with the times of a cue, which begins no earlier than the one before.
const char* check_times(std::string_view line, std::int64_t& last) {
  const std::int64_t begin = parse_time(line);
  if (begin < 0 || !take(line, " ") || !take(line, kArrow) || !take(line, " ")) {
    return "it is not a line of times like 00:01.500 --> 00:04.000";
  }
  const std::int64_t end = parse_time(line);
  if (end < 0 || !(line.empty() || line[0] == ' ')) return "its second time is not a time";
  if (end <= begin) return "its end is not after its beginning";
  if (begin < last) return "it begins before the cue above";
  last = begin;
  return nullptr;
}

/// Appends a line without its tags, <i> for one, and with the characters that WebVTT escapes.
void add_plain(std::string_view line, std::string& text) {
  constexpr std::array<std::pair<std::string_view, std::string_view>, 6> kEscapes = {
      {{"&amp;", "&"},
       {"&lt;", "<"},
       {"&gt;", ">"},
       {"&nbsp;", " "},
       {"&lrm;", ""},
       {"&rlm;", ""}}};
  while (!line.empty()) {
    const std::size_t tag_end = line[0] == '<' ? line.find('>') : std::string_view::npos;
    if (tag_end != std::string_view::npos) {
      line.remove_prefix(tag_end + 1);
      continue;
    }
    bool escaped = false;
    for (const auto& [escape, meaning] : kEscapes) {
      if (escaped || !take(line, escape)) continue;
      text += meaning;
      escaped = true;
    }
    if (escaped) continue;
    text += line[0];
    line.remove_prefix(1);
  }
}

/// Concatenates the text of all cues accepted by the predicate (start_ms, end_ms).
template <class Wanted>
std::string words_of(std::string_view captions, char between_lines, const Wanted& wanted) {
  Lines lines(captions);
  lines.next();
  std::string words;
  while (!lines.at_end()) {
    lines.next();
    if (lines.at_end()) break;
    std::string_view times = lines.next();
    const std::int64_t begin = parse_time(times);
    times.remove_prefix(std::min(times.size(), kArrow.size() + 2));
    const bool shown = wanted(begin, parse_time(times));
    char before = '\n';
    while (!lines.at_end()) {
      Lines ahead = lines;
      const std::string_view line = ahead.next();
      if (line.empty()) break;
      lines = ahead;
      if (!shown) continue;
      if (!words.empty()) words += before;
      before = between_lines;
      add_plain(line, words);
    }
  }
  return words;
}

}  // namespace

std::string words_at(std::string_view captions, double seconds) {
  const auto now = static_cast<std::int64_t>(seconds * 1000.0 + 0.5);
  return words_of(captions, '\n', [now](std::int64_t begin, std::int64_t end) {
    return begin <= now && now < end;
  });
}

std::string transcript(std::string_view captions) {
  return words_of(captions, ' ', [](std::int64_t, std::int64_t) { return true; });
}

std::optional<CaptionFault> check_captions(std::string_view text) {
  if (text.size() > kMostCaptionBytes) return CaptionFault{1, "there are more than 262144 bytes"};
  Lines lines(text);
  const auto fault = [&lines](const char* cause) { return CaptionFault{lines.number(), cause}; };
  if (lines.next() != "WEBVTT") return fault("it does not begin with WEBVTT");
  if (lines.at_end()) return fault("there are no cues");
  std::int64_t last = 0;
  while (!lines.at_end()) {
    if (!lines.next().empty()) return fault("an empty line is missing before a cue");
    if (lines.at_end()) break;
    if (const char* cause = check_times(lines.next(), last)) return fault(cause);
    bool words = false;
    while (!lines.at_end()) {
      Lines ahead = lines;
      const std::string_view line = ahead.next();
      if (line.empty()) break;
      lines = ahead;
      words = true;
      if (line.find(kArrow) != std::string_view::npos) return fault("its text has an arrow");
      if (line.find('\r') != std::string_view::npos) return fault("its line ends with a return");
    }
    if (!words) return fault("a cue has no text");
  }
  return std::nullopt;
}

}  // namespace modar
