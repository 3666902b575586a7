// Keys of the JSON files are those of the tools that 8th Wall published for projects of one's own.
#include "bake/pattern/target_file.hpp"

#include <filesystem>

#include "bake/json.hpp"
#include "modar/mapped_file.hpp"

namespace modar {
namespace {

namespace fs = std::filesystem;

tl::unexpected<Error> no_target(const std::string& path, const std::string& cause) {
  return fail(ExitCode::kInvalidInput, "target.json", path, cause,
              R"(write {"name": "poster", "type": "PLANAR", "imagePath": "poster.png"})");
}

Result<Json> read_target(const std::string& path) {
  MODAR_ASSIGN(const MappedFile file, MappedFile::open(path));
  Json json =
      Json::parse({reinterpret_cast<const char*>(file.bytes().data()), file.bytes().size()});
  const auto type = json.find("type");
  if (!type || !type->text()) return no_target(path, "it is no image target of 8th Wall");
  if (*type->text() != "PLANAR") {
    return fail(ExitCode::kUnsupported, "target.curved", path,
                "its picture is on a curved thing (" + *type->text() + ")",
                "only flat pictures are tracked: choose another for this place");
  }
  return json;
}

/// A turn by 90 degrees against the clock, which takes back that of 8th Wall's tools.
GrayPicture turned_back(const GrayPicture& picture) {
  GrayPicture out{picture.height, picture.width, {}};
  out.pixels.reserve(picture.pixels.size());
  for (int y = 0; y < out.height; ++y) {
    for (int x = 0; x < out.width; ++x) {
      const int at = x * picture.width + picture.width - 1 - y;
      out.pixels.push_back(picture.pixels[static_cast<std::size_t>(at)]);
    }
  }
  return out;
}

}  // namespace

bool is_target_file(std::string_view path) {
  return path.ends_with(".json");
}

Result<std::string> target_picture(const std::string& path) {
  MODAR_ASSIGN(const Json json, read_target(path));
  std::string named;
  for (const char* key : {"resources/croppedImage", "resources/luminanceImage", "imagePath"}) {
    const auto value = json.find(key);
    if (!value || !value->text()) continue;
    // imagePath is an address on the web: the file itself lies beside the target.
    for (const fs::path& name : {fs::path(*value->text()), fs::path(*value->text()).filename()}) {
      const fs::path picture = fs::path(path).parent_path() / name;
      std::error_code failed;
      if (fs::is_regular_file(picture, failed)) return picture.string();
    }
    named += (named.empty() ? "" : ", ") + *value->text();
  }
  if (named.empty()) return no_target(path, "it names no picture");
  return fail(ExitCode::kIo, "target.picture", path, "none of its pictures is there: " + named,
              "copy them beside it, or name the picture itself with --pattern");
}

Result<GrayPicture> load_target(const std::string& path) {
  MODAR_ASSIGN(const std::string file, target_picture(path));
  MODAR_ASSIGN(GrayPicture picture, load_gray(file));
  MODAR_ASSIGN(const Json json, read_target(path));
  for (const char* key : {"properties/isRotated", "xrMetadata/isRotated"}) {
    const auto turned = json.find(key);
    if (turned && turned->dump().starts_with("true")) return turned_back(picture);
  }
  return picture;
}

}  // namespace modar
