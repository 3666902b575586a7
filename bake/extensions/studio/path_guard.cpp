#include "bake/extensions/studio/path_guard.hpp"

#include <filesystem>

#include "bake/io/input.hpp"
#include "bake/io/output.hpp"
#include "formats/base/utf8.hpp"

namespace modar {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kLongestName = 1000;  // bytes; systems take 4096 with the folder's own
constexpr std::size_t kLongestPart = 200;  // bytes; systems take 255, and we append "-2" and ".tmp"

tl::unexpected<Error> bad_name(std::string_view name, const char* cause) {
  return fail(ExitCode::kUsage, "studio.name", printable(name), cause,
              "rename the file, and drop it again");
}

}  // namespace

Result<void> check_name(std::string_view name) {
  if (name.empty() || name.size() > kLongestName) return bad_name(name, "the name is too long");
  if (!is_utf8(name) || name.find('\\') != std::string_view::npos) {
    return bad_name(name, "the name has characters that file names cannot have");
  }
  for (std::size_t begin = 0; begin <= name.size();) {
    const std::size_t end = std::min(name.find('/', begin), name.size());
    const std::string_view part = name.substr(begin, end - begin);
    if (part.empty() || part.starts_with('.')) {
      return bad_name(name, "the name leads to hidden or other folders");
    }
    if (part.size() > kLongestPart) return bad_name(name, "the name is too long");
    begin = end + 1;
  }
  return {};
}

Result<std::string> file_inside(const std::string& folder, std::string_view name) {
  MODAR_TRY(check_name(name));
  const fs::path path = fs::path(folder) / name;
  std::error_code error;
  if (fs::is_regular_file(path, error) && is_inside(folder, path)) return path.string();
  return fail(ExitCode::kUsage, "studio.unknown", std::string(name),
              "there is no such file in the project's folder", "reload the page");
}

Result<std::string> place_inside(const std::string& folder, std::string_view name) {
  MODAR_TRY(check_name(name));
  const fs::path path = fs::path(folder) / name;
  if (!is_inside(folder, path.parent_path() / "x")) {
    return bad_name(name, "a link on the way leads out of the project's folder");
  }
  MODAR_TRY(make_output_folder(path.parent_path().string()));
  return path.string();
}

}  // namespace modar
