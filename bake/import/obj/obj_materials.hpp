// The materials of an OBJ: the names it uses, the MTL files it names, and what they say.
#pragma once

#include <string>
#include <vector>

#include "bake/import/obj/obj_block.hpp"

namespace modar {

/// Gathers usemtl and mtllib statements in file order, then resolves them.
class ObjMaterials {
 public:
  ObjMaterials();
  /// Number of the material of that name (0: the default one, made for faces without a material).
  std::uint32_t use(const std::string& name, std::uint64_t line);
  void add_library(const std::string& text, std::uint64_t line);
  /// Reads the MTL files and fills in what they say of the materials in use; what is missing
  /// becomes a finding. path: the OBJ; folder: empty where nothing may be read.
  std::vector<SourceMaterial> resolve(const std::string& folder, const std::string& stem,
                                      const std::string& label, std::vector<Diagnostic>& findings);

 private:
  struct Named {
    std::string name;
    std::uint64_t line = 0;
  };
  std::vector<Named> used_;       // [0] is the default
  std::vector<Named> libraries_;  // the text after each mtllib
};

}  // namespace modar
