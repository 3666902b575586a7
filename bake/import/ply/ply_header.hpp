// The header of a PLY file: which elements follow, with which properties.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "formats/base/error.hpp"

namespace modar {

enum class PlyType : std::uint8_t { kI8, kU8, kI16, kU16, kI32, kU32, kF32, kF64 };

constexpr std::size_t ply_bytes(PlyType type) {
  constexpr std::size_t kBytes[] = {1, 1, 2, 2, 4, 4, 4, 8};
  return kBytes[static_cast<std::size_t>(type)];
}

struct PlyProperty {
  std::string name;
  PlyType type = PlyType::kF32;  ///< of a value, or of each value of a list
  bool list = false;
  PlyType count_type = PlyType::kU8;  ///< of a list
};

struct PlyElement {
  std::string name;
  std::uint64_t count = 0;
  std::vector<PlyProperty> properties;
};

struct PlyHeader {
  enum class Encoding : std::uint8_t { kText, kLittle, kBig } encoding = Encoding::kText;
  std::vector<PlyElement> elements;
  std::vector<std::string> textures;  ///< of "comment TextureFile NAME"
  std::size_t bytes = 0;              ///< of the header: where the elements begin
  std::uint64_t lines = 0;            ///< of the header
};

/// label: the file's name in errors. Errors: kInvalidInput "ply.header" with the line.
Result<PlyHeader> parse_ply_header(std::string_view bytes, const std::string& label);

}  // namespace modar
