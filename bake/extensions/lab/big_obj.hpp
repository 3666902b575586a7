// Large OBJ files for measurements, made out of real scans.
#pragma once

#include <cstdint>
#include <string>

#include "formats/base/error.hpp"

namespace modar {

/// Reads a model, divides each triangle in four as often as gets it nearest to
/// `triangles` (new vertices moved by noise of 15 % of their edge, so that they are no plane's),
/// and writes v, vt, vn and f lines with six decimals. The bytes hang on scan and count alone.
/// Returns the triangles written. Errors: those of reading; kIo "io.write".
Result<std::uint64_t> make_big_obj(const std::string& scan, std::uint64_t triangles,
                                   const std::string& path);

}  // namespace modar
