// Materials of an OBJ: the MTL files it names, what they say, and the textures they name. Internal
// to the OBJ reader.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "bake/import/read_model.hpp"

namespace modar {

/// The file of a texture statement of an MTL: options before and after the name are ignored.
/// statement: all after the keyword. name: the part taken for the name, found or not.
/// transformed: options disturb the uv (-t), scale values (-mm) or, without `place`, scale or shift
/// it. place: receives -s and -o.
std::string find_map_file(std::string_view statement, const ModelFolder& folder, std::string& name,
                          bool& transformed, MapPlace* place = nullptr);

/// Notes where a file was found that is not where its name says. path: as find_named_file() found.
void note_place(const std::string& name, const std::string& path, const ModelFolder& folder,
                const std::string& label, std::uint64_t line, std::vector<Diagnostic>& diagnostics);

/// Gathers usemtl and mtllib statements in file order, then resolves them.
class ObjMaterials {
 public:
  ObjMaterials();
  /// Number of the material of that name (0: the default one, made for faces without a material).
  std::uint32_t use(const std::string& name, std::uint64_t line);
  void add_library(const std::string& text, std::uint64_t line);
  /// Reads the MTL files and fills in what they say of the materials in use; missing parts become a
  /// diagnostic. own_picture: as in ReadOptions. model: has its name; receives materials,
  /// diagnostics and files.
  void resolve(const ModelFolder& folder, const std::string& label, bool own_picture,
               SourceModel& model);

 private:
  struct Named {
    std::string name;
    std::uint64_t line = 0;
  };
  std::vector<Named> used_;       // [0] is the default
  std::vector<Named> libraries_;  // the text after each mtllib
};

}  // namespace modar
