// Normals of a mesh that has flat facets only, and no word on which edges are sharp.
#pragma once

#include "bake/import/source_model.hpp"

namespace modar {

/// Fills the model's normals and corner_normals: a corner gets the mean, weighted by area, of the
/// facets around its position that are within kCrease of its own. model: triangles only.
void add_facet_normals(SourceModel& model);

}  // namespace modar
