#include "bake/json.hpp"

#include <cmath>
#include <nlohmann/json.hpp>

namespace modar {

Json json_number(double value) {
  return std::isfinite(value) ? Json(value) : Json(nullptr);
}

std::string json_text(const Json& json) {
  return json.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
}

}  // namespace modar
