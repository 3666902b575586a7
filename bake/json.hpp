// What all JSON of the workstation is written with.
#pragma once

#include <string>

#include <nlohmann/json_fwd.hpp>

namespace modar {

using Json = nlohmann::ordered_json;

/// JSON has no infinities: they become null.
Json json_number(double value);

/// Indented text with a line break at its end. Foreign bytes that are no UTF-8 are replaced, never
/// thrown at.
std::string json_text(const Json& json);

}  // namespace modar
