#include "bake/import/ply/ply_header.hpp"

#include <algorithm>
#include <charconv>
#include <optional>

#include "bake/import/text_words.hpp"

namespace modar {
namespace {

constexpr std::size_t kMostHeaderBytes = 1 << 20;
constexpr std::size_t kMostProperties = 256;  ///< of an element; elements the same

std::optional<PlyType> type_of(std::string_view name) {
  constexpr std::pair<std::string_view, PlyType> kNames[] = {
      {"char", PlyType::kI8},     {"int8", PlyType::kI8},     {"uchar", PlyType::kU8},
      {"uint8", PlyType::kU8},    {"short", PlyType::kI16},   {"int16", PlyType::kI16},
      {"ushort", PlyType::kU16},  {"uint16", PlyType::kU16},  {"int", PlyType::kI32},
      {"int32", PlyType::kI32},   {"uint", PlyType::kU32},    {"uint32", PlyType::kU32},
      {"float", PlyType::kF32},   {"float32", PlyType::kF32}, {"double", PlyType::kF64},
      {"float64", PlyType::kF64},
  };
  for (const auto& [known, type] : kNames) {
    if (name == known) return type;
  }
  return std::nullopt;
}

class HeaderParser {
 public:
  explicit HeaderParser(const std::string& label) : label_(label) {}

  Result<PlyHeader> run(std::string_view bytes) {
    const std::string_view all = bytes.substr(0, kMostHeaderBytes);
    bool ended = false;
    while (!ended && header_.bytes < all.size()) {
      const std::size_t end = all.find_first_of("\r\n", header_.bytes);
      if (end == std::string_view::npos) break;
      if (header_.lines == 0) two_bytes_ = all.substr(end).starts_with("\r\n");
      std::string_view line = all.substr(header_.bytes, end - header_.bytes);
      header_.bytes = end + (two_bytes_ && all[end] == '\r' ? 2 : 1);
      ++header_.lines;
      std::string_view copy = line;
      ended = next_word(copy) == "end_header";
      if (!ended) MODAR_TRY(parse_line(line));
    }
    if (ended && stated_format_) return std::move(header_);
    return error(header_.lines == 0 ? "this is not a PLY file"
                                    : "the header has no end or no format");
  }

 private:
  [[nodiscard]] tl::unexpected<Error> error(const std::string& cause) const {
    return fail(ExitCode::kInvalidInput, "ply.header",
                label_ + ":" + std::to_string(std::max<std::uint64_t>(header_.lines, 1)), cause,
                "export the model again as PLY, OBJ or glTF");
  }

  Result<void> parse_line(std::string_view line) {
    const std::string_view word = next_word(line);
    if (header_.lines == 1) {
      if (word == "ply") return {};
      return error("the file does not begin with 'ply'");
    }
    if (word == "format") return parse_format(next_word(line));
    if (word == "element") return parse_element(line);
    if (word == "property") return parse_property(line);
    if (word == "comment" && next_word(line) == "TextureFile") {
      while (line.starts_with(' ')) line.remove_prefix(1);
      while (line.ends_with('\r') || line.ends_with(' ')) line.remove_suffix(1);
      header_.textures.emplace_back(line);
      return {};
    }
    return {};  // comments, and lines that programs write though no PLY has them
  }

  Result<void> parse_format(std::string_view name) {
    stated_format_ = true;
    if (name == "ascii")
      header_.encoding = PlyHeader::Encoding::kText;
    else if (name == "binary_little_endian")
      header_.encoding = PlyHeader::Encoding::kLittle;
    else if (name == "binary_big_endian")
      header_.encoding = PlyHeader::Encoding::kBig;
    else
      return error("unknown format '" + std::string(name.substr(0, 32)) + "'");
    return {};
  }

  Result<void> parse_element(std::string_view line) {
    PlyElement element;
    element.name = std::string(next_word(line));
    const std::string_view count = next_word(line);
    const auto [end, bad] =
        std::from_chars(count.data(), count.data() + count.size(), element.count);
    if (element.name.empty() || bad != std::errc() || end != count.data() + count.size() ||
        header_.elements.size() >= kMostProperties) {
      return error("an element needs a name and a count");
    }
    header_.elements.push_back(std::move(element));
    return {};
  }

  Result<void> parse_property(std::string_view line) {
    PlyProperty property;
    std::string_view type = next_word(line);
    if (type == "list") {
      property.list = true;
      const auto count = type_of(next_word(line));
      if (!count || *count == PlyType::kF32 || *count == PlyType::kF64) {
        return error("the count of a list has no integer type");
      }
      property.count_type = *count;
      type = next_word(line);
    }
    const auto known = type_of(type);
    property.name = std::string(next_word(line));
    if (!known || property.name.empty() || header_.elements.empty() ||
        header_.elements.back().properties.size() >= kMostProperties) {
      return error("a property needs an element before it, a type and a name");
    }
    property.type = *known;
    header_.elements.back().properties.push_back(std::move(property));
    return {};
  }

  const std::string& label_;
  PlyHeader header_;
  bool stated_format_ = false;
  bool two_bytes_ = false;  // end a line
};

}  // namespace

Result<PlyHeader> parse_ply_header(std::string_view bytes, const std::string& label) {
  return HeaderParser(label).run(bytes);
}

}  // namespace modar
