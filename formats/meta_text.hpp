// The grammar of a bundle's meta text: JSON (RFC 8259), and the members that readers look at.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>

namespace modar {

/// How the meta text of a preview (trim.hpp) begins, and that of no other bundle.
inline constexpr std::string_view kPreviewMeta = R"({"stage": "show")";

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

/// A text of the member `texts`, or of `nodes`.
struct MetaText {
  enum class Kind : std::uint8_t {
    kText,
    kAlt,      ///< description for screen readers
    kTitle,    ///< of a node
    kCaptions  ///< of a node: captions, as a WebVTT file; see captions.hpp
  };
  std::string pattern;
  std::string node;  ///< of the member `nodes`
  Kind kind = Kind::kText;
  std::string language;
  std::string words;
};

/// Hands out the texts of a meta text that keeps the rules, in its order; of another one, those
/// before the fault.
void visit_meta_texts(std::string_view text, const std::function<void(const MetaText&)>& visit);
/// The same of the member `nodes`.
void visit_node_texts(std::string_view text, const std::function<void(const MetaText&)>& visit);

}  // namespace modar
