// Finds the files that OBJ and MTL name, however they were written down.
#pragma once

#include <string>
#include <string_view>

namespace modar {

/// The existing regular file that `name` means, looked up in `folder` (absolute names as they are,
/// too); empty where there is none. Tried in this order: as written; without quotes and escapes,
/// backslashes as slashes; with any case; the bare file name in `folder`, with any case.
std::string find_named_file(std::string_view name, const std::string& folder);

/// The file of a texture statement of an MTL: options before and after the name are set aside.
/// statement: all after the keyword. name: the part that was taken for the name, found or not.
/// transformed: the options scale, shift or disturb the uv.
std::string find_map_file(std::string_view statement, const std::string& folder, std::string& name,
                          bool& transformed);

}  // namespace modar
