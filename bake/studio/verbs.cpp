// Which handler answers which request.
#include "bake/studio/session.hpp"

namespace modar {

Answer answer_call(Session& session, const Call& call) {
  const std::string verb = call.method + " " + call.path;
  if (verb == "GET api/project") return answer_or_error(project_view(session));
  if (verb == "POST api/quit") {
    session.quit();
    return answer_of(Json::object());
  }
  return answer_of(unknown_verb(call));
}

}  // namespace modar
