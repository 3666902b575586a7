// MTL text to materials.
#include <algorithm>
#include <array>
#include <optional>

#include "bake/import/obj/ascii.hpp"
#include "bake/import/obj/map_path.hpp"
#include "bake/import/obj/number_parser.hpp"
#include "bake/import/obj/obj_reader.hpp"

namespace modar {
namespace {

/// One statement, its continued lines joined, and where the next begins.
std::string take_statement(std::string_view text, std::size_t& at, std::uint64_t& line) {
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
int take_numbers(std::string_view text, std::array<float, 3>& values) {
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
    p = take_real(p, end, value, kind);
    if (kind != NumberKind::kFinite) break;
    values[static_cast<std::size_t>(count++)] = static_cast<float>(std::clamp(value, -1e6, 1e6));
  }
  return count;
}

/// A colour of three numbers, or of one that stands for all three.
void take_colour(std::string_view text, glm::vec3& colour) {
  std::array<float, 3> v{};
  const int n = take_numbers(text, v);
  if (n == 3) colour = {v[0], v[1], v[2]};
  if (n == 1) colour = glm::vec3(v[0]);
}

struct MtlContext {
  const std::string& folder;
  const std::string& label;
  std::vector<Diagnostic>& findings;
  std::uint64_t line = 1;
};

void take_map(std::string_view text, MtlContext& context, std::string& path) {
  std::string name;
  bool transformed = false;
  path = find_map_file(text, context.folder, name, transformed);
  if (path.empty()) {
    context.findings.push_back({"mtl.missing-map", DiagnosticSeverity::kWarning, context.label,
                                context.line, "texture '" + name + "' was not found",
                                "put the image beside the MTL file, or correct its name"});
  } else if (transformed) {
    context.findings.push_back({"mtl.map-transform", DiagnosticSeverity::kWarning, context.label,
                                context.line, "options that shift or scale the texture are ignored",
                                "apply them to the vt lines in the modelling program"});
  }
}

/// Opacity of `d` or 1 - `Tr`. Exporters disagree on Tr, and none means a part that cannot be seen.
void take_opacity(float opacity, MtlContext& context, SourceMaterial& material) {
  if (opacity <= 0.0f) {
    context.findings.push_back({"mtl.invisible", DiagnosticSeverity::kInfo, context.label,
                                context.line,
                                "material '" + material.name + "' would be wholly transparent",
                                "it is taken as opaque; remove its d or Tr line"});
    opacity = 1.0f;
  }
  material.opacity = std::min(opacity, 1.0f);
}

void take_property(std::string_view key, std::string_view text, MtlContext& context, bool& has_d,
                   SourceMaterial& material) {
  std::array<float, 3> v{};
  if (key == "ka") take_colour(text, material.ambient);
  if (key == "kd") take_colour(text, material.diffuse);
  if (key == "ks") take_colour(text, material.specular);
  if (key == "ke") take_colour(text, material.emission);
  if (key == "ns" && take_numbers(text, v) > 0) material.shininess = std::max(v[0], 0.0f);
  if (key == "d") {
    if (text.starts_with("-halo")) text.remove_prefix(5);
    if (take_numbers(text, v) > 0) {
      take_opacity(v[0], context, material);
      has_d = true;
    }
  }
  // d says the same without doubt, so it wins wherever it stands.
  if (key == "tr" && !has_d && take_numbers(text, v) > 0) {
    take_opacity(1.0f - v[0], context, material);
  }
  if (key == "map_kd") take_map(text, context, material.diffuse_map);
  if (key == "map_d") take_map(text, context, material.alpha_map);
}

}  // namespace

std::vector<SourceMaterial> parse_mtl(std::string_view text, const std::string& folder,
                                      const std::string& label, std::vector<Diagnostic>& findings) {
  std::vector<SourceMaterial> materials;
  MtlContext context{folder, label, findings};
  if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);
  bool has_d = false;
  std::size_t at = 0;
  std::uint64_t next_line = 1;
  while (at < text.size()) {
    context.line = next_line;
    const std::string statement = take_statement(text, at, next_line);
    const std::size_t key_end = std::min(statement.find_first_of(" \t"), statement.size());
    std::string key = statement.substr(0, key_end);
    for (char& c : key) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
    std::string_view value = std::string_view(statement).substr(key_end);
    while (!value.empty() && is_blank(value.front())) value.remove_prefix(1);
    if (key == "newmtl") {
      materials.emplace_back();
      materials.back().name = std::string(value);
      has_d = false;
    } else if (!materials.empty()) {
      take_property(key, value, context, has_d, materials.back());
    }
  }
  return materials;
}

}  // namespace modar
