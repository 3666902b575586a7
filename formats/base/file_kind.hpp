// What a file is by its first bytes, for the messages about files of another kind.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <string>
#include <string_view>

namespace modar {

enum class FileKind : std::uint8_t { kModel, kPicture, kBundle, kVideo, kArchive };

/// Without pointers, which a loader would have to set.
struct FileSignature {
  char bytes[8];
  std::uint8_t length;
  std::uint8_t at;  ///< byte of the file
  FileKind kind;
  char format[6];
};

/// By FileKind.
inline constexpr char kKindNouns[][8] = {"model", "picture", "bundle", "video", "zip"};

/// Of the first 16 bytes of a file; nullptr for one that does not begin with words of its own.
inline const FileSignature* find_signature(std::string_view start) {
  static constexpr FileSignature kSignatures[] = {
      {"\x89PNG\r\n", 6, 0, FileKind::kPicture, "PNG"},
      {"\xFF\xD8\xFF", 3, 0, FileKind::kPicture, "JPEG"},
      {"WEBP", 4, 8, FileKind::kPicture, "WebP"},
      {"II*\0", 4, 0, FileKind::kPicture, "TIFF"},
      {"MM\0*", 4, 0, FileKind::kPicture, "TIFF"},
      {"GIF8", 4, 0, FileKind::kPicture, "GIF"},
      {"ftyphei", 7, 4, FileKind::kPicture, "HEIC"},
      {"ftypmif", 7, 4, FileKind::kPicture, "HEIF"},
      {"ftypavi", 7, 4, FileKind::kPicture, "AVIF"},
      {"ftyp", 4, 4, FileKind::kVideo, "MP4"},
      {"AVI ", 4, 8, FileKind::kVideo, "AVI"},
      {"\x1A\x45\xDF\xA3", 4, 0, FileKind::kVideo, "WebM"},
      {"PK\3\4", 4, 0, FileKind::kArchive, "PKZIP"},
      {"glTF", 4, 0, FileKind::kModel, "glTF"},
      {"ply\n", 4, 0, FileKind::kModel, "PLY"},
      {"ply\r", 4, 0, FileKind::kModel, "PLY"},
      {"solid ", 6, 0, FileKind::kModel, "STL"},
      {"\x89MOD\r\n", 6, 0, FileKind::kBundle, "ModAR"}};
  for (const FileSignature& one : kSignatures) {
    if (start.size() > one.at && start.substr(one.at).starts_with({one.bytes, one.length})) {
      return &one;
    }
  }
  return nullptr;
}

/// "this is a picture (PNG), not a bundle"
inline std::string wrong_kind(FileKind kind, const char* format, const char* wanted) {
  char text[64];
  std::snprintf(text, sizeof text, "this is a %s (%s), not a %s",
                kKindNouns[static_cast<std::size_t>(kind)], format, wanted);
  return text;
}

}  // namespace modar
