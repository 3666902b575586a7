// Cuts a text into blocks of whole statements, parses them on several threads, joins them in order.
#pragma once

#include <string>

#include "bake/import/obj/byte_source.hpp"
#include "bake/import/obj/obj_assembler.hpp"
#include "formats/error.hpp"

namespace modar {

/// Parses all of `source` into `assembler`. totals: nullptr in the fast pass; in the careful one
/// the counts of the whole file, and jobs is taken as 1. label: the file's name in errors. Errors:
/// kIo "io.read"; kInvalidInput "obj.too-large".
Result<void> read_obj_blocks(const ByteSource& source, const std::string& label, unsigned jobs,
                             const ObjCounts* totals, ObjAssembler& assembler);

}  // namespace modar
