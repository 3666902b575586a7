// The grammar of a bundle's meta text: JSON (RFC 8259), and the members that readers look at.
#pragma once

#include <cstddef>
#include <optional>
#include <string_view>

namespace modar {

/// Arrays and objects inside each other; what `modar bake` writes needs six. Readers that call
/// themselves for each need a bound.
inline constexpr int kMaxMetaDepth = 32;

/// Where a meta text breaks its rules, and which.
struct MetaFault {
  std::size_t offset = 0;  ///< bytes from the start of the text
  const char* cause = "";
};

/// Holds a text against *Meta text* of bundle.md. Nothing: it keeps the rules. Time grows with the
/// text; allocates nothing.
std::optional<MetaFault> check_meta_text(std::string_view text);

}  // namespace modar
