// Captions: speech and sound as text with times. The part of WebVTT (W3C) that bundles have, which
// browsers read unchanged.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

namespace modar {

/// Bytes of one language of one node, more than an hour of speech.
inline constexpr std::size_t kMostCaptionBytes = std::size_t{1} << 18;

/// Where captions break their grammar, and how.
struct CaptionFault {
  std::size_t line = 0;  ///< counted from 1
  const char* cause = "";
};

/// Holds a text against *Captions* of bundle.md. Nothing: it keeps the rules. Allocates nothing.
std::optional<CaptionFault> check_captions(std::string_view text);

/// The cues at a time of a text that keeps the rules: the lines of each cue of then, without
/// markup; empty between cues.
std::string words_at(std::string_view captions, double seconds);
/// All that is heard, a line a cue, without times and markup.
std::string transcript(std::string_view captions);

}  // namespace modar
