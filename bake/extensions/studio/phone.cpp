#include "bake/extensions/studio/phone.hpp"

#include <chrono>
#include <condition_variable>
#include <memory>

#include "bake/extensions/studio/exports.hpp"
#include "bake/extensions/studio/session.hpp"
#include "bake/extensions/web/serve.hpp"

namespace modar {
namespace {

constexpr std::chrono::seconds kStarts(30);  // the page's files are copied first

std::string site_of(const Session& session) {
  return session.own + "/site";
}

/// What the server's process says before it serves, for the request that waits for it.
struct Start {
  std::mutex mutex;
  std::condition_variable changed;
  std::string url;
  bool ended = false;
};

void serve(Session& session, Job& job, const std::string& bundle,
           const std::shared_ptr<Start>& start) {
  job.run({own_program(), "web", bundle, "-o", site_of(session), "--live", "--quiet", "--serve",
           "--port", "0"},
          session.folder, {}, [&](const std::string& line) {
            const std::lock_guard lock(start->mutex);
            if (start->url.empty()) start->url = line;
            start->changed.notify_all();
          });
  {
    const std::lock_guard lock(session.mutex);
    session.phone = Json();
  }
  const std::lock_guard lock(start->mutex);
  start->ended = true;
  start->changed.notify_all();
}

}  // namespace

Result<Answer> post_phone(Session& session) {
  {
    const std::lock_guard lock(session.mutex);
    if (!session.phone.is_null()) return answer_of(session.phone);
  }
  MODAR_ASSIGN(const std::string bundle, baked_bundle(session));
  const auto start = std::make_shared<Start>();
  MODAR_TRY(session.phone_server.start(
      "phone", [&session, bundle, start](Job& job) { serve(session, job, bundle, start); }));
  std::unique_lock lock(start->mutex);
  start->changed.wait_for(lock, kStarts, [&] { return start->ended || !start->url.empty(); });
  if (start->url.empty()) {
    lock.unlock();
    session.phone_server.cancel();
    return fail(ExitCode::kUnsupported, "web.page", "", "the page for phones cannot be served",
                "`modar web` in a terminal says why");
  }
  const Json phone = {{"url", start->url}, {"qr_svg", qr_svg(start->url)}};
  const std::lock_guard session_lock(session.mutex);
  session.phone = phone;
  session.events.publish("phone", {{"url", start->url}});
  return answer_of(phone);
}

Result<Answer> end_phone(Session& session) {
  session.phone_server.end();
  return answer_of(Json::object());
}

void refresh_phone(Session& session) {
  {
    const std::lock_guard lock(session.mutex);
    if (session.phone.is_null()) return;
  }
  const auto bundle = baked_bundle(session);
  if (!bundle) return;
  Job writing(0, "phone");
  writing.run({own_program(), "web", *bundle, "-o", site_of(session), "--live", "--quiet"},
              session.folder, {});
}

}  // namespace modar
