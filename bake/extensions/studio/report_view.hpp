// What a bundle weighs, whether it is good, and what devices say of it.
#pragma once

#include <map>
#include <string>

#include "bake/extensions/studio/http_reply.hpp"
#include "bake/json.hpp"

namespace modar {

struct Session;

/// The verbs of the same names.
Result<Answer> get_check(Session& session, const Call& call);
Result<Answer> get_sizes(Session& session);
Result<Answer> get_devices(Session& session);

/// GET api/thumb/vase.obj?size=160&turn=8: views of a model all around, side by side in one
/// picture, as the device draws the last bake. 404 if none exists yet.
Result<Answer> get_turntable(Session& session, const Call& call);

/// What the last bake made of each asset, by its name: of models {"triangles", "size", "up"}, of
/// patterns {"grade", "score", "range_cm"}. Empty before.
struct BakedFacts {
  std::map<std::string, Json> models;
  std::map<std::string, Json> patterns;
};
/// Keeps what a bake has found for the bundle that it wrote: api/check tells it with the checker's.
void keep_findings(Session& session, const Json& findings);

BakedFacts baked_facts(const std::string& bundle);

}  // namespace modar
