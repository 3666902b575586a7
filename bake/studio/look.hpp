// What a bundle weighs, whether it is good, and what devices say of it.
#pragma once

#include <map>
#include <string>

#include "bake/studio/call.hpp"

namespace modar {

struct Session;

/// The verbs of the same names.
Answer get_check(Session& session, const Call& call);
Answer get_sizes(Session& session);
Answer get_devices(Session& session);

/// What the last bake made of each asset, by its name: of models {"triangles", "size", "up"}, of
/// patterns {"grade", "score", "range_cm"}. Empty before.
struct BakedFacts {
  std::map<std::string, Json> models;
  std::map<std::string, Json> patterns;
};
BakedFacts baked_facts(const std::string& bundle);

}  // namespace modar
