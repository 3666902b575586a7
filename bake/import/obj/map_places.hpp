// Where maps of material files are on a surface: scales, offsets and UDIM tiles. Internal to the
// OBJ reader.
#pragma once

#include <string>
#include <string_view>

#include "bake/import/read_model.hpp"

namespace modar {

/// The path of tiled pictures, "<UDIM>" in the place of the number, if any tile from 1001 to 1100
/// exists; empty if none, or if the name has no such mark.
std::string find_tiles(std::string_view name, const ModelFolder& folder);

/// Gives the corners of materials whose maps are scaled or shifted uvs of their own.
void place_maps(SourceModel& model);

/// Gives each face of a material with find_tiles()' map the picture of the tile that its middle is
/// in, 1001 + u + 10 v, and uvs from that tile's corner. Missing tiles become diagnostics with
/// their faces, which show no picture.
void place_tiles(const ModelFolder& folder, const std::string& label, SourceModel& model);

}  // namespace modar
