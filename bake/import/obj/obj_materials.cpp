// Resolves material libraries: names with blanks, several files, none at all.
#include "bake/import/obj/obj_materials.hpp"

#include <algorithm>
#include <fstream>
#include <iterator>
#include <map>

#include "bake/import/obj/map_path.hpp"
#include "bake/import/obj/obj_reader.hpp"

namespace modar {
namespace {

constexpr std::uintmax_t kMaxMtlBytes = 64u << 20;

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

std::string read_text(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  std::string text;
  char buffer[65536];
  while (in.read(buffer, sizeof buffer), in.gcount() > 0) {
    text.append(buffer, static_cast<std::size_t>(in.gcount()));
    if (text.size() > kMaxMtlBytes) return {};
  }
  return text;
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

std::vector<SourceMaterial> ObjMaterials::resolve(const std::string& folder,
                                                  const std::string& stem, const std::string& label,
                                                  std::vector<Diagnostic>& findings) {
  std::vector<SourceMaterial> materials(used_.size());
  for (std::size_t i = 0; i < used_.size(); ++i) materials[i].name = used_[i].name;
  if (folder.empty()) return materials;

  std::vector<std::string> paths;
  const auto missing = [&](const std::string& name, std::uint64_t line) {
    findings.push_back({"obj.missing-mtl", DiagnosticSeverity::kWarning, label, line,
                        "material file '" + name + "' was not found",
                        "put it beside the OBJ file, or correct the mtllib line"});
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
    if (std::string beside = find_named_file(stem + ".mtl", folder); !beside.empty()) {
      findings.push_back({"obj.mtl-beside", DiagnosticSeverity::kInfo, label, 0,
                          "'" + name_of(beside) + "' is taken for the material file",
                          "name it in an mtllib line"});
      paths.push_back(std::move(beside));
    }
  }

  std::map<std::string, SourceMaterial> defined;
  std::vector<std::string> read;
  for (const std::string& path : paths) {
    if (std::find(read.begin(), read.end(), path) != read.end()) continue;
    read.push_back(path);
    for (SourceMaterial& m : parse_mtl(read_text(path), folder_of(path), name_of(path), findings)) {
      std::string name = m.name;
      defined.try_emplace(std::move(name), std::move(m));
    }
  }
  for (std::size_t i = 1; i < used_.size(); ++i) {
    if (const auto found = defined.find(used_[i].name); found != defined.end()) {
      materials[i] = found->second;
    } else {
      findings.push_back({"obj.undefined-material", DiagnosticSeverity::kWarning, label,
                          used_[i].line, "no material file defines '" + used_[i].name + "'",
                          "it is drawn in the default grey; define it or correct its name"});
    }
  }
  return materials;
}

}  // namespace modar
