// Captions: what is heard, as text with times. The part of WebVTT (W3C) that bundles have, which
// browsers read as it is.
#pragma once

#include <cstddef>
#include <optional>
#include <string_view>

namespace modar {

/// Of one language of one node. An hour of speech, 9,000 words in 900 cues, takes 85,000 bytes.
inline constexpr std::size_t kMostCaptionBytes = std::size_t{1} << 18;

/// Where captions break their grammar, and how.
struct CaptionFault {
  std::size_t line = 0;  ///< counted from 1
  const char* cause = "";
};

/// Holds a text against *Captions* of bundle.md. Nothing: it keeps the rules. Allocates nothing.
std::optional<CaptionFault> check_captions(std::string_view text);

}  // namespace modar
