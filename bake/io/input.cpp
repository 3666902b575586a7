// A whole file, as far as its reader allows.
#include "bake/io/input.hpp"

#include <algorithm>
#include <cstdio>
#include <fstream>
#include <memory>

#include "formats/base/path.hpp"
#include "formats/base/ranges.hpp"
#include "formats/base/utf8.hpp"

namespace modar {
namespace {

struct KindWords {
  const char* code;
  const char* cure;  ///< where a model or a picture is wanted
};
/// By FileKind.
constexpr KindWords kKinds[] = {
    {"model",
     "pass it as a model, with the ending of one; patterns are PNG, JPEG, WebP, TIFF, BMP and TGA "
     "files"},
    {"image",
     "pass it as a pattern, with the ending of a picture; models are glTF, OBJ, PLY and STL files"},
    {"bundle",
     "`modar check`, `inspect`, `report` and `web` and modar-play take it; bake its sources"},
    {"video", "take a picture of it: ffmpeg -i VIDEO -frames:v 1 picture.png"},
    {"zip", "unzip it, and name its files; in a project's folder, run `modar bake`"}};

std::string ending_of(const std::string& path) {
  return ascii_lower(std::filesystem::path(path).extension().string());
}

/// An STL or OBJ file need not begin with words of its own. The size of a binary STL follows from
/// its number of triangles; of the others the name says what they are.
const char* unsigned_model(std::string_view bytes, const std::string& path) {
  constexpr std::size_t kStlHeader = 84;
  constexpr std::size_t kStlTriangle = 50;
  if (bytes.size() >= kStlHeader && (bytes.size() - kStlHeader) % kStlTriangle == 0) {
    std::size_t count = 0;
    for (std::size_t i = kStlHeader; i-- > kStlHeader - 4;) {
      count = count << 8 | static_cast<unsigned char>(bytes[i]);
    }
    if (count == (bytes.size() - kStlHeader) / kStlTriangle) return "STL";
  }
  const std::string ending = ending_of(path);
  return ending == ".stl" ? "STL" : ending == ".obj" ? "OBJ" : ending == ".gltf" ? "glTF" : nullptr;
}

}  // namespace

Result<void> require_kind(FileKind wanted, std::string_view start, const std::string& path) {
  if (start.empty()) {
    return fail(ExitCode::kInvalidInput, "io.empty", path, "the file is empty",
                "make it again, or copy it again");
  }
  const FileSignature* const found = find_signature(start);
  // Other formats, such as 3MF, are ZIP files, too.
  const bool known =
      found != nullptr && (found->kind != FileKind::kArchive || ending_of(path) == ".zip");
  const FileKind kind = known ? found->kind : FileKind::kModel;
  if (kind == wanted) return {};
  const char* format = known ? found->format : unsigned_model(start, path);
  if (format == nullptr) return {};
  const auto words_of = [](FileKind one) { return kKinds[static_cast<std::size_t>(one)]; };
  const bool bakes = wanted == FileKind::kBundle;
  const auto noun_of = [](FileKind one) { return kKindNouns[static_cast<std::size_t>(one)]; };
  return fail(ExitCode::kUsage, std::string(words_of(wanted).code) + "." + noun_of(kind), path,
              wrong_kind(kind, format, noun_of(wanted)),
              bakes ? "bake it first, as in `modar bake model.glb picture.png -o name.modar`"
                    : words_of(kind).cure);
}

Result<void> require_kind(FileKind wanted, const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) {
    if (const auto unread = read_file(path, 16); !unread) return tl::unexpected(unread.error());
  }
  std::string start(16, '\0');
  file.read(start.data(), static_cast<std::streamsize>(start.size()));
  start.resize(static_cast<std::size_t>(file.gcount()));
  return require_kind(wanted, start, path);
}

std::string shell_quoted(const std::string& word) {
  std::string out = "'";
  for (const char c : word) out += c == '\'' ? "'\\''" : std::string(1, c);
  return out + "'";
}

bool is_inside(const std::string& folder, const std::filesystem::path& path) {
  namespace fs = std::filesystem;
  std::error_code error;
  const fs::path root = fs::canonical(folder.empty() ? "." : folder, error);
  if (error) return false;
  const fs::path whole = fs::weakly_canonical(fs::absolute(path, error), error);
  const fs::path below = whole.lexically_relative(root);
  return !error && !below.empty() && *below.begin() != "..";
}

Result<std::string> read_file(const std::string& path, std::size_t most) {
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(
      is_regular_file(path) ? std::fopen(path.c_str(), "rb") : nullptr, &std::fclose);
  const auto unreadable = [&path] {
    return missing_file(
        path, {ExitCode::kIo, "io.open", path,
               path.empty() ? "the name of a file is empty" : "the file cannot be opened or read",
               "check its name and permissions"});
  };
  if (std::error_code error; !file && std::filesystem::is_directory(path, error)) {
    return fail(ExitCode::kIo, "io.open", path, "it is a folder", "name a file in it");
  }
  if (std::error_code error; !file && std::filesystem::exists(path, error) &&
                             !std::filesystem::is_regular_file(path, error)) {
    return fail(ExitCode::kIo, "io.open", path, "it is not a regular file", "name a file");
  }
  if (!file) return unreadable();
  std::string bytes;
  char part[65536];
  while (const std::size_t count = std::fread(part, 1, sizeof part, file.get())) {
    if (count > most - bytes.size()) {
      return fail(ExitCode::kInvalidInput, "io.too-large", path,
                  "the file is larger than " + std::to_string(most) + " bytes", "make it smaller");
    }
    bytes.append(part, count);
  }
  if (std::ferror(file.get()) != 0) return unreadable();
  return bytes;
}

}  // namespace modar
