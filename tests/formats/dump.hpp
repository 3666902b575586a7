// A bundle's decoded content as JSON, in the words of scripts/read_bundle.py.
#pragma once

#include <nlohmann/json.hpp>

#include "formats/bundle_view.hpp"

namespace modar::test {

nlohmann::json dump(const BundleView& view);

}  // namespace modar::test
