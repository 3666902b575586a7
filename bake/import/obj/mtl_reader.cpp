// Materials of an OBJ: paths as exporters write them, MTL text, and which material is which.
#include "bake/import/obj/mtl_reader.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <iterator>
#include <map>
#include <optional>
#include <system_error>
#include <vector>

#include <fast_float/fast_float.h>

#include "bake/image/image.hpp"
#include "bake/image/resample.hpp"
#include "bake/import/name_form.hpp"
#include "bake/import/obj/map_places.hpp"
#include "bake/import/obj/number_parser.hpp"
#include "bake/import/read_model.hpp"
#include "bake/import/reflection.hpp"
#include "bake/import/texture_by_name.hpp"
#include "bake/io/input.hpp"
#include "bake/process/process.hpp"
#include "formats/base/colour.hpp"
#include "formats/base/path.hpp"
#include "formats/base/ranges.hpp"
#include "formats/base/utf8.hpp"

namespace modar {
namespace {

// Names of files as exporters write them, to paths that exist.

namespace fs = std::filesystem;

/// The entry of `folder` named `name` in any spelling, see name_form(): the exact match if there is
/// one, else the first in byte order, so that the result does not depend on the file system's
/// order.
fs::path entry_of(const fs::path& folder, const std::string& name) {
  std::error_code error;
  if (name == "." || name == "..") return folder / name;
  if (fs::exists(folder / name, error) && !error) return folder / name;
  std::string best;
  const std::string wanted = name_form(name);
  fs::directory_iterator it(folder.empty() ? fs::path(".") : folder, error);
  for (; !error && it != fs::directory_iterator(); it.increment(error)) {
    const std::string entry = it->path().filename().string();
    if (name_form(entry) == wanted && (best.empty() || entry < best)) best = entry;
  }
  return best.empty() ? fs::path() : folder / best;
}

/// A relative path, each part matched in any case.
fs::path any_case(const fs::path& folder, const fs::path& relative) {
  fs::path at = folder;
  for (const fs::path& part : relative) {
    if (part.empty()) continue;
    at = entry_of(at, part.string());
    if (at.empty()) return {};
  }
  return at;
}

/// Where a file may be that is not where it was: from the longest tail of its path to its name
/// alone, in the model's folder; then in folders where programs put textures.
std::vector<fs::path> near_places(const fs::path& written) {
  std::vector<fs::path> parts;
  for (const fs::path& part : written.lexically_normal().relative_path()) {
    if (part.empty() || part == "." || part == ".." || part.string().ends_with(':')) continue;
    parts.push_back(part);
  }
  std::vector<fs::path> places;
  if (parts.empty()) return places;
  constexpr std::size_t kMostParts = 8;
  for (std::size_t i = parts.size() - std::min(parts.size(), kMostParts); i < parts.size(); ++i) {
    fs::path& tail = places.emplace_back();
    for (std::size_t k = i; k < parts.size(); ++k) tail /= parts[k];
  }
  for (const char* folder : {"textures", "../textures"}) places.push_back(folder / parts.back());
  return places;
}

std::string_view trimmed(std::string_view text) {
  const auto blank = [](char c) { return c == ' ' || c == '\t' || c == '\r'; };
  while (!text.empty() && blank(text.front())) text.remove_prefix(1);
  while (!text.empty() && blank(text.back())) text.remove_suffix(1);
  return text;
}

/// Removes quotes, unescapes blanks, turns backslashes into slashes.
std::string cleaned(std::string_view name) {
  name = trimmed(name);
  if (name.size() >= 2 && (name.front() == '"' || name.front() == '\'') &&
      name.back() == name.front()) {
    name = trimmed(name.substr(1, name.size() - 2));
  }
  std::string clean;
  for (std::size_t i = 0; i < name.size(); ++i) {
    if (name[i] != '\\') {
      clean += name[i];
    } else if (i + 1 < name.size() && name[i + 1] == ' ') {
      continue;
    } else if (clean.empty() || clean.back() != '/') {
      clean += '/';
    }
  }
  return clean;
}

/// The number that a word states, or `other`.
double number_of(std::string_view word, double other) {
  if (word.starts_with('+')) word.remove_prefix(1);
  double value = 0;
  const auto result = fast_float::from_chars(word.data(), word.data() + word.size(), value);
  const bool whole = result.ec == std::errc() && result.ptr == word.data() + word.size();
  return whole && std::isfinite(value) ? value : other;
}

bool is_number(std::string_view word) {
  return !std::isnan(number_of(word, std::nan("")));
}

/// Removes the first word of `text` and returns it.
std::string_view parse_word(std::string_view& text) {
  text = trimmed(text);
  const std::size_t end = std::min(text.find_first_of(" \t"), text.size());
  const std::string_view word = text.substr(0, end);
  text = trimmed(text.substr(end));
  return word;
}

/// Skips the options of the MTL specification with their arguments.
std::string_view without_options(std::string_view text, bool& transformed, MapPlace* place) {
  while (true) {
    text = trimmed(text);
    std::string_view rest = text;
    const std::string_view option = parse_word(rest);
    if (option.size() < 2 || option.front() != '-') return text;
    const std::string_view name = option.substr(1);
    if (name == "o" || name == "s" || name == "t") {
      const double neutral = name == "s" ? 1.0 : 0.0;
      for (int i = 0; i < 3; ++i) {
        std::string_view after = rest;
        const std::string_view word = parse_word(after);
        if (!is_number(word) || after.empty()) break;
        const double value = number_of(word, neutral);
        if (place != nullptr && name != "t") {
          if (i < 2) (name == "s" ? place->scale : place->offset)[i] = value;
        } else {
          transformed = transformed || value != neutral;
        }
        rest = after;
      }
    } else if (name == "mm") {
      for (const double neutral : {0.0, 1.0}) {
        const bool usual = number_of(parse_word(rest), neutral) == neutral;
        transformed = transformed || !usual;
      }
    } else if (name == "blendu" || name == "blendv" || name == "clamp" || name == "cc" ||
               name == "imfchan" || name == "texres" || name == "bm" || name == "boost" ||
               name == "type") {
      parse_word(rest);
    } else {
      return text;
    }
    text = rest;
  }
}

}  // namespace

std::string find_named_file(std::string_view name, const ModelFolder& folder) {
  const fs::path base(folder.path);
  const fs::path raw(trimmed(name));
  if (raw.empty() || raw.string().find('\0') != std::string::npos) return {};
  if (folder.has((base / raw).string())) return (base / raw).string();
  const fs::path clean(cleaned(name));
  if (clean.empty()) return {};
  if (folder.has((base / clean).string())) return (base / clean).lexically_normal().string();
  const std::string decoded = percent_decoded(clean.string());
  for (const fs::path& written : {clean, fs::path(decoded)}) {
    if (written.string().find('\0') != std::string::npos) continue;
    if (!written.is_absolute()) {
      const std::string found = any_case(base, written.lexically_normal()).string();
      if (folder.has(found)) return found;
    }
    for (const fs::path& place : near_places(written)) {
      const std::string found = any_case(base, place).lexically_normal().string();
      if (!found.empty() && folder.has(found)) return found;
    }
  }
  return {};
}

void note_place(const std::string& name, const std::string& path, const ModelFolder& folder,
                const std::string& label, std::uint64_t line,
                std::vector<Diagnostic>& diagnostics) {
  const fs::path base = fs::path(folder.path).lexically_normal();
  const fs::path found = fs::path(path).lexically_normal();
  const fs::path wanted = (base / percent_decoded(cleaned(name))).lexically_normal();
  const std::string stated = name_form((base / cleaned(name)).lexically_normal().string());
  if (ranges::any_of(std::array{name_form(wanted.string()), stated}, [&](const std::string& known) {
        return known == name_form(found.string());
      })) {
    return;
  }
  const fs::path relative = found.lexically_relative(base);
  diagnostics.push_back({"model.found-elsewhere", DiagnosticSeverity::kInfo, label, line,
                         "'" + short_name(name) + "' is read from '" + relative.string() + "'",
                         ""});
}

std::string find_map_file(std::string_view statement, const ModelFolder& folder, std::string& name,
                          bool& transformed, MapPlace* place) {
  transformed = false;
  std::string_view rest = without_options(statement, transformed, place);
  name = std::string(rest);
  if (std::string found = find_named_file(rest, folder); !found.empty()) return found;
  // Options after the name, then unknown options before it.
  const std::size_t option = rest.find(" -");
  if (option != std::string_view::npos && option > 0) {
    const std::string_view head = rest.substr(0, option);
    if (std::string found = find_named_file(head, folder); !found.empty()) {
      name = std::string(head);
      return found;
    }
  }
  if (rest.empty() || rest.front() != '-') return {};
  for (int words = 0; words < 32 && !rest.empty(); ++words) {
    parse_word(rest);
    if (std::string found = find_named_file(rest, folder); !found.empty()) {
      name = std::string(rest);
      return found;
    }
  }
  return {};
}
namespace {

// MTL text to materials.

/// One statement with its continued lines joined; advances `at` to the next.
std::string parse_statement(std::string_view text, std::size_t& at, std::uint64_t& line) {
  std::string statement;
  while (at < text.size()) {
    const char c = text[at++];
    if (c == '\n' || c == '\r') {
      if (c == '\r' && at < text.size() && text[at] == '\n') ++at;
      ++line;
      const bool comment = !statement.empty() && statement.front() == '#';
      if (statement.empty() || statement.back() != '\\' || comment) break;
      statement.back() = ' ';
    } else if (!statement.empty() || !is_blank(c)) {
      statement += c;
    }
  }
  while (!statement.empty() && is_blank(statement.back())) statement.pop_back();
  return statement;
}

/// Up to three finite numbers at the front of `text`.
int parse_numbers(std::string_view text, std::array<float, 3>& values) {
  std::string padded(text);
  padded.append(kTextPadding, '\0');
  const char* p = padded.data();
  const char* const end = p + text.size();
  int count = 0;
  while (count < 3) {
    while (p < end && is_blank(*p)) ++p;
    if (p >= end) break;
    double value = 0;
    NumberKind kind = NumberKind::kNone;
    p = parse_real(p, end, value, kind);
    if (kind != NumberKind::kFinite) break;
    values[static_cast<std::size_t>(count++)] = static_cast<float>(std::clamp(value, -1e6, 1e6));
  }
  return count;
}

/// A colour of three numbers, or of one for all three.
void parse_colour(std::string_view text, glm::vec3& colour) {
  std::array<float, 3> v{};
  const int n = parse_numbers(text, v);
  if (n == 3) colour = {v[0], v[1], v[2]};
  if (n == 1) colour = glm::vec3(v[0]);
}

struct MtlContext {
  const ModelFolder& folder;
  const std::string& label;
  std::vector<Diagnostic>& diagnostics;
  std::vector<std::string>* missing = nullptr;
  std::uint64_t line = 1;
};

void parse_map(std::string_view text, MtlContext& context, std::string& path,
               MapPlace* place = nullptr) {
  std::string name;
  bool transformed = false;
  path = find_map_file(text, context.folder, name, transformed, place);
  if (path.empty() && place != nullptr) path = find_tiles(name, context.folder);
  if (path.empty()) {
    if (context.missing != nullptr) {
      context.missing->push_back((fs::path(context.folder.path) / name).string());
    }
    context.diagnostics.push_back(
        not_read("mtl.missing-map", context.label, context.line, "texture '" + name + "'", name,
                 context.folder, "put the image next to the MTL file, or correct its name"));
    return;
  }
  note_place(name, path, context.folder, context.label, context.line, context.diagnostics);
  if (transformed) {
    context.diagnostics.push_back(
        {"mtl.map-transform", DiagnosticSeverity::kWarning, context.label, context.line,
         "options that disturb the texture or scale its values (-t, -mm) are ignored",
         "apply them in the modelling program"});
  }
}

/// Opacity from `d` or 1 - `Tr`. Exporters disagree on Tr, and none of them means an invisible
/// part.
void parse_opacity(float opacity, MtlContext& context, SourceMaterial& material) {
  if (opacity <= 0.0f) {
    context.diagnostics.push_back(
        {"mtl.invisible", DiagnosticSeverity::kInfo, context.label, context.line,
         "material '" + material.name + "' would be completely transparent",
         "it is taken as opaque; remove its d or Tr line"});
    opacity = 1.0f;
  }
  material.opacity = std::min(opacity, 1.0f);
}

/// Whether Ka says nothing: exporters write 0, 0.2 or 1 of their own accord. As in the renderer.
bool is_gray(const glm::vec3& ka) {
  const auto [least, most] = std::minmax({ka.r, ka.g, ka.b});
  return most - least <= 0.05f * most;
}

/// A picture with the brightness of another, or that one's alpha if it has some, as its alpha.
/// colour: empty: white.
Result<RgbaImage> with_opacity(const std::string& colour, const std::string& opacity) {
  MODAR_ASSIGN(RgbaImage mask, read_texture(opacity, Colours::kStored));
  bool opaque = true;
  for (std::size_t i = 3; i < mask.pixels.size(); i += 4) opaque = opaque && mask.pixels[i] == 255;
  RgbaImage picture = {mask.width, mask.height, std::vector<std::uint8_t>(mask.pixels.size(), 255)};
  if (!colour.empty()) {
    MODAR_ASSIGN(picture, read_texture(colour));
    mask = resize(mask, picture.width, picture.height, {kWrapRepeat, 1});
  }
  for (std::size_t i = 0; i < picture.pixels.size(); i += 4) {
    const std::uint8_t* m = &mask.pixels[i];
    const int alpha = opaque ? (m[0] + m[1] + m[2]) / 3 : m[3];
    picture.pixels[i + 3] = static_cast<std::uint8_t>(picture.pixels[i + 3] * alpha / 255);
  }
  return picture;
}

struct KeptMaps {
  TemporaryFolder folder;
};

/// What a material's statements say together. Pr and Pm are the roughness and metalness that
/// Blender and others write; without them, what has a highlight reflects as all dielectrics do, or
/// as much as Ks says where the illumination model has reflection (illum 3 and 5).
struct MtlStatements {
  bool has_d = false;
  bool has_kd = false;
  bool physical = false;
  float roughness = 1.0f;
  float metalness = 0.0f;
  float illum = 2.0f;
  std::string ambient_map;
  std::string emission_map;
  MapPlace other_place;  // of these two

  /// Exporters write a map of ambient or emitted light alone where they mean the colour, and a gray
  /// Kd next to a map that their programs do not multiply: Maya 0, Meshroom 0.6, Blender 0.8.
  void finish(MtlContext& context, SourceMaterial& m) const {
    const auto note = [&](const char* id, const char* what, const char* cure) {
      context.diagnostics.push_back({id, DiagnosticSeverity::kInfo, context.label, 0,
                                     "material '" + m.name + "' " + what, cure});
    };
    if (!emission_map.empty() && !m.diffuse_map.empty()) {
      note("mtl.emission-map", "has a map of emitted light, which is left out", "");
    }
    for (const std::string& map : {ambient_map, emission_map}) {
      if (!m.diffuse_map.empty() || map.empty()) continue;
      m.diffuse_map = map;
      m.place = other_place;
    }
    const glm::vec3 kd = m.diffuse;
    const bool gray = std::max({kd.r, kd.g, kd.b}) - std::min({kd.r, kd.g, kd.b}) <= 0.01f;
    if ((gray || !has_kd) && !m.diffuse_map.empty()) {
      m.whitened = has_kd && kd != glm::vec3(1.0f);
      m.diffuse = glm::vec3(1.0f);
    }
    if (is_gray(m.ambient)) m.ambient = m.diffuse;
    if (m.diffuse_map == emission_map && !emission_map.empty()) m.emission = glm::vec3(0.0f);
    const auto light = [](const glm::vec3& stored) {
      glm::dvec3 linear(0.0);
      for (int i = 0; i < 3; ++i) linear[i] = linear_of_srgb(static_cast<double>(stored[i]));
      return linear;
    };
    const glm::dvec3 base = light(m.diffuse);
    if (physical) {
      set_reflection(static_cast<double>(roughness), static_cast<double>(metalness), base,
                     !m.diffuse_map.empty(), m);
    } else if (m.specular != glm::vec3(0.0f) && m.shininess > 0) {
      const glm::dvec3 shine = light(m.specular);
      const double most = std::clamp(1 - luminance(base.r, base.g, base.b), 0.0, 1.0);
      const bool reflects = illum == 3.0f || illum == 5.0f;
      m.reflectance =
          static_cast<float>(reflects ? std::clamp(luminance(shine.r, shine.g, shine.b), 0.0, most)
                                      : kDielectricReflectance);
    }
    if (!m.alpha_map.empty() && m.alpha_map != m.diffuse_map) add_opacity(context, m);
  }

 private:
  /// Merges the map of opacity into the picture of the colour.
  static void add_opacity(MtlContext& context, SourceMaterial& m) {
    const auto kept = std::make_shared<KeptMaps>();
    const std::string path = kept->folder.path() + "/" + file_stem(m.alpha_map) + ".png";
    const Result<RgbaImage> picture = with_opacity(m.diffuse_map, m.alpha_map);
    const Result<void> written =
        picture ? write_png(*picture, path) : tl::unexpected(picture.error());
    if (!written) {
      const Error& error = written.error();
      context.diagnostics.push_back(
          {"mtl.opacity-map", DiagnosticSeverity::kWarning, error.where, 0,
           "material '" + m.name + "' loses its map of opacity: " + error.cause, error.cure});
      return;
    }
    for (const std::string& map : {m.diffuse_map, m.alpha_map, m.normal.path}) {
      if (context.missing != nullptr && !map.empty()) context.missing->push_back(map);
    }
    m.diffuse_map = path;
    m.alpha_map.clear();
    m.keeper = kept;
  }
};

/// UTF-16 text with its byte order mark as UTF-8.
std::string utf8_of_utf16(std::string_view text) {
  const bool big = text.starts_with('\xFE');
  std::string utf8;
  std::uint32_t high = 0;
  for (std::size_t i = 2; i + 1 < text.size(); i += 2) {
    const auto byte = [&](std::size_t at) {
      return static_cast<std::uint32_t>(static_cast<unsigned char>(text[at]));
    };
    std::uint32_t unit = big ? byte(i) << 8u | byte(i + 1) : byte(i + 1) << 8u | byte(i);
    if (unit >= 0xD800 && unit < 0xDC00) {
      high = 0x10000 + ((unit & 0x3FFu) << 10u);
      continue;
    }
    if (unit >= 0xDC00 && unit < 0xE000) unit = high == 0 ? 0xFFFD : high + (unit & 0x3FFu);
    append_utf8(utf8, unit);
    high = 0;
  }
  return utf8;
}

/// The factor of the option -bm.
float bump_factor(std::string_view text) {
  const std::size_t at = text.find("-bm ");
  std::array<float, 3> values{};
  return at != std::string_view::npos && parse_numbers(text.substr(at + 4), values) > 0 ? values[0]
                                                                                        : 1.0f;
}

void parse_property(std::string_view key, std::string_view text, MtlContext& context,
                    MtlStatements& stated, SourceMaterial& material) {
  std::array<float, 3> v{};
  if (key == "ka") parse_colour(text, material.ambient);
  if (key == "kd") {
    parse_colour(text, material.diffuse);
    stated.has_kd = true;
  }
  if (key == "ks") parse_colour(text, material.specular);
  if (key == "ke") parse_colour(text, material.emission);
  if (key == "ns" && parse_numbers(text, v) > 0) material.shininess = std::max(v[0], 0.0f);
  if (key == "illum" && parse_numbers(text, v) > 0) stated.illum = v[0];
  if ((key == "pr" || key == "pm") && parse_numbers(text, v) > 0) {
    (key == "pr" ? stated.roughness : stated.metalness) = v[0];
    stated.physical = true;
  }
  if (key == "d") {
    if (text.starts_with("-halo")) text.remove_prefix(5);
    if (parse_numbers(text, v) > 0) {
      parse_opacity(v[0], context, material);
      stated.has_d = true;
    }
  }
  // d is unambiguous, so it wins wherever it stands.
  if (key == "tr" && !stated.has_d && parse_numbers(text, v) > 0) {
    parse_opacity(1.0f - v[0], context, material);
  }
  if (key == "map_kd") parse_map(text, context, material.diffuse_map, &material.place);
  if (key == "map_d") parse_map(text, context, material.alpha_map);
  if (key == "map_ka") parse_map(text, context, stated.ambient_map, &stated.other_place);
  if (key == "map_ke") parse_map(text, context, stated.emission_map, &stated.other_place);
  // Many name a normal map by the words for heights; `norm` is one for sure.
  const bool bump = key == "bump" || key == "map_bump";
  if (key == "norm" || key == "map_norm" || (bump && material.normal.path.empty())) {
    parse_map(text, context, material.normal.path);
    material.normal.may_be_heights = bump;
    material.normal.scale = bump_factor(text);
  }
}

}  // namespace

std::vector<SourceMaterial> parse_mtl(std::string_view text, const ModelFolder& folder,
                                      const std::string& label,
                                      std::vector<Diagnostic>& diagnostics,
                                      std::vector<std::string>* missing) {
  std::vector<SourceMaterial> materials;
  MtlContext context{folder, label, diagnostics, missing};
  if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);
  if (text.starts_with("\xFF\xFE") || text.starts_with("\xFE\xFF")) {
    return parse_mtl(utf8_of_utf16(text), folder, label, diagnostics, missing);
  }
  MtlStatements stated;
  std::size_t at = 0;
  std::uint64_t next_line = 1;
  while (at < text.size()) {
    context.line = next_line;
    const std::string statement = parse_statement(text, at, next_line);
    const std::size_t key_end = std::min(statement.find_first_of(" \t"), statement.size());
    std::string key = statement.substr(0, key_end);
    for (char& c : key) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
    std::string_view value = std::string_view(statement).substr(key_end);
    while (!value.empty() && is_blank(value.front())) value.remove_prefix(1);
    if (key == "newmtl") {
      if (!materials.empty()) stated.finish(context, materials.back());
      stated = {};
      materials.emplace_back();
      materials.back().name = std::string(value);
    } else if (!materials.empty()) {
      parse_property(key, value, context, stated, materials.back());
    }
  }
  if (!materials.empty()) stated.finish(context, materials.back());
  return materials;
}
namespace {

// Material libraries: names with blanks, several files, none at all.

constexpr std::size_t kMaxMtlBytes = 64u << 20;

/// Words of an mtllib line; "\ " is a blank inside a name.
std::vector<std::string> split_names(const std::string& text) {
  std::vector<std::string> names;
  std::string name;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const bool blank = text[i] == ' ' || text[i] == '\t';
    if (blank && !(i > 0 && text[i - 1] == '\\')) {
      if (!name.empty()) names.push_back(std::move(name));
      name.clear();
    } else {
      name += text[i];
    }
  }
  if (!name.empty()) names.push_back(std::move(name));
  return names;
}

/// Mean of a picture's colours, sRGB, 0 to 1; nothing where it cannot be read.
std::optional<glm::vec3> mean_colour(const std::string& path) {
  const auto image = read_image(path);
  if (!image || image->pixels.empty()) return std::nullopt;
  std::array<std::uint64_t, 3> sums{};
  for (std::size_t p = 0; p < image->pixels.size(); p += 4) {
    for (std::size_t i = 0; i < 3; ++i) sums[i] += image->pixels[p + i];
  }
  const double all = 255.0 * static_cast<double>(image->pixels.size() / 4);
  return glm::vec3(static_cast<double>(sums[0]) / all, static_cast<double>(sums[1]) / all,
                   static_cast<double>(sums[2]) / all);
}

/// SketchUp writes the mean of a texture as its material's colour, and does not mean it to be
/// multiplied: the product is nearly black.
void forget_mean_colours(const std::string& label, SourceModel& model) {
  // Distance from a picture's mean below which a colour is that mean, written with few digits.
  // Higher takes chosen colours for means.
  constexpr float kNear = 2.0f / 255.0f;
  std::map<std::string, std::optional<glm::vec3>> means;
  int count = 0;
  for (SourceMaterial& m : model.materials) {
    const glm::vec3 colour = m.diffuse;
    if (m.diffuse_map.empty() || std::min({colour.r, colour.g, colour.b}) >= 1.0f) continue;
    const auto [found, added] = means.try_emplace(m.diffuse_map);
    if (added) found->second = mean_colour(m.diffuse_map);
    if (!found->second) continue;
    const glm::vec3 apart = glm::abs(*found->second - colour);
    if (std::max({apart.r, apart.g, apart.b}) > kNear) continue;
    m.diffuse = m.ambient = glm::vec3(1.0f);
    ++count;
  }
  if (count == 0) return;
  model.diagnostics.push_back({"mtl.mean-colour", DiagnosticSeverity::kInfo, label, 0,
                               std::to_string(count) +
                                   (count == 1 ? " material has" : " materials have") +
                                   " the mean of the texture as the colour (Kd), "
                                   "which is not multiplied",
                               ""});
}

std::string folder_of(const std::string& path) {
  const std::size_t slash = path.rfind('/');
  return slash == std::string::npos ? std::string(".") : path.substr(0, slash + 1);
}

std::string name_of(const std::string& path) {
  return path.substr(path.rfind('/') + 1);
}

}  // namespace

ObjMaterials::ObjMaterials() {
  used_.push_back({"default", 0});
}

std::uint32_t ObjMaterials::use(const std::string& name, std::uint64_t line) {
  const auto same = [&](const Named& n) { return n.name == name; };
  // Materials are few, and the one in use is mostly among the latest.
  const auto found = std::find_if(used_.rbegin(), used_.rend() - 1, same);
  if (found != used_.rend() - 1) {
    return static_cast<std::uint32_t>(std::distance(found, used_.rend()) - 1);
  }
  used_.push_back({name, line});
  return static_cast<std::uint32_t>(used_.size() - 1);
}

void ObjMaterials::add_library(const std::string& text, std::uint64_t line) {
  libraries_.push_back({text, line});
}

void ObjMaterials::resolve(const ModelFolder& folder, const std::string& label, bool own_picture,
                           SourceModel& model) {
  std::vector<Diagnostic>& diagnostics = model.diagnostics;
  std::vector<SourceMaterial>& materials = model.materials;
  materials.resize(used_.size());
  for (std::size_t i = 0; i < used_.size(); ++i) materials[i].name = used_[i].name;
  if (folder.path.empty()) return;

  std::vector<std::string> paths;
  const auto missing = [&](const std::string& name, std::uint64_t line) {
    model.files.push_back((fs::path(folder.path) / name).string());
    diagnostics.push_back(not_read("obj.missing-mtl", label, line, "material file '" + name + "'",
                                   name, folder,
                                   "put it next to the OBJ file, or correct the mtllib line"));
  };
  for (const Named& library : libraries_) {
    if (std::string whole = find_named_file(library.name, folder); !whole.empty()) {
      paths.push_back(std::move(whole));
      continue;
    }
    for (const std::string& name : split_names(library.name)) {
      std::string path = find_named_file(name, folder);
      if (path.empty()) {
        missing(name, library.line);
      } else {
        paths.push_back(std::move(path));
      }
    }
  }
  if (paths.empty() && (used_.size() > 1 || !libraries_.empty())) {
    if (std::string beside = find_named_file(model.name + ".mtl", folder); !beside.empty()) {
      diagnostics.push_back({"obj.mtl-beside", DiagnosticSeverity::kInfo, label, 0,
                             "'" + name_of(beside) + "' is used as the material file",
                             "name it in an mtllib line"});
      paths.push_back(std::move(beside));
    } else {
      model.files.push_back((fs::path(folder.path) / (model.name + ".mtl")).string());
    }
  }

  if (paths.empty()) {
    assign_texture_by_name(folder, label, own_picture, model);
    if (!materials[0].diffuse_map.empty()) return;
  }

  std::map<std::string, SourceMaterial> defined;
  std::vector<std::string> read;
  for (const std::string& path : paths) {
    if (std::find(read.begin(), read.end(), path) != read.end()) continue;
    read.push_back(path);
    model.files.push_back(path);
    const Result<std::string> text = read_file(path, kMaxMtlBytes);
    const bool sound = text && (text->find('\0') == std::string::npos ||
                                text->starts_with("\xFF\xFE") || text->starts_with("\xFE\xFF"));
    if (!sound) {
      const Error error = text ? Error{} : text.error();
      diagnostics.push_back({"obj.unreadable-mtl", DiagnosticSeverity::kWarning, path, 0,
                             text ? "the material file is not text" : error.cause,
                             text ? "export the model again" : error.cure});
    }
    for (SourceMaterial& m : parse_mtl(sound ? *text : "", {folder_of(path), folder.within},
                                       name_of(path), diagnostics, &model.files)) {
      std::string name = m.name;
      if (used_.size() == 1 && defined.empty()) {
        materials[0] = m;
        diagnostics.push_back({"obj.no-usemtl", DiagnosticSeverity::kInfo, label, 0,
                               "no face names a material; the first one of '" + name_of(path) +
                                   "', '" + name + "', is used",
                               ""});
      }
      defined.try_emplace(std::move(name), std::move(m));
    }
  }
  for (std::size_t i = 1; i < used_.size(); ++i) {
    if (const auto found = defined.find(used_[i].name); found != defined.end()) {
      materials[i] = found->second;
    } else {
      diagnostics.push_back({"obj.undefined-material", DiagnosticSeverity::kWarning, label,
                             used_[i].line, "no material file defines '" + used_[i].name + "'",
                             "it is drawn in the default grey; define it or correct its name"});
    }
  }
  forget_mean_colours(label, model);
  place_maps(model);
  place_tiles(folder, label, model);
}

}  // namespace modar
