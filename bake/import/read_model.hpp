// Picks the reader of a model file by its extension.
#pragma once

#include <string>

#include "bake/import/source_model.hpp"
#include "formats/error.hpp"

namespace modar {

/// Errors: those of the reader; kUnsupported "model.format" that lists what can be read.
Result<SourceModel> read_model(const std::string& path, unsigned jobs);

}  // namespace modar
