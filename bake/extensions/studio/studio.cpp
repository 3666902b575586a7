// The studio from its start to its end.
#include "bake/extensions/studio/studio.hpp"

#include <fcntl.h>
#include <pthread.h>
#include <signal.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <thread>

#include "bake/extensions/studio/server.hpp"
#include "bake/extensions/studio/session.hpp"
#include "bake/extensions/studio/watcher.hpp"
#include "bake/extensions/web/site.hpp"
#include "bake/io/output.hpp"
#include "bake/process/process.hpp"
#include "formats/base/atomic_file.hpp"
#include "formats/base/folder_lock.hpp"

namespace modar {
namespace {

namespace fs = std::filesystem;

/// While one exists, SIGINT and SIGTERM call `ended` in place of ending the process.
class Signals {
 public:
  explicit Signals(std::function<void()> ended) {
    ::sigemptyset(&signals_);
    ::sigaddset(&signals_, SIGINT);
    ::sigaddset(&signals_, SIGTERM);
    ::sigaddset(&signals_, SIGHUP);
    ::pthread_sigmask(SIG_BLOCK, &signals_, &before_);
    thread_ = std::thread([this, ended = std::move(ended)] {
      int signal = 0;
      if (::sigwait(&signals_, &signal) == 0 && !over_) ended();
    });
  }
  Signals(const Signals&) = delete;
  Signals& operator=(const Signals&) = delete;
  ~Signals() {
    over_ = true;
    ::pthread_kill(thread_.native_handle(), SIGTERM);
    thread_.join();
    ::pthread_sigmask(SIG_SETMASK, &before_, nullptr);
  }

 private:
  sigset_t signals_{};
  sigset_t before_{};
  std::atomic<bool> over_{false};
  std::thread thread_;
};

/// A file that only its owner may read: where the studio answers, for one that is started later.
Result<void> write_private(const std::string& path, const std::string& text) {
  ::unlink(path.c_str());
  const int descriptor =
      ::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0600);
  const bool written = descriptor >= 0 && ::write(descriptor, text.data(), text.size()) ==
                                              static_cast<ssize_t>(text.size());
  if (descriptor >= 0) ::close(descriptor);
  if (written) return {};
  return fail(ExitCode::kIo, "io.write", path, std::strerror(errno), cure_of_writing(errno));
}

/// Whoever starts a studio again wants its page.
Result<void> show_other(const Session& session, const Error& busy,
                        const std::function<void(const StudioAddress&)>& ready) {
  std::string address;
  std::ifstream(session.own + "/address") >> address;
  if (busy.code != "studio.locked" || address.empty()) return tl::unexpected(busy);
  MODAR_ASSIGN(const std::string opening, ask_opening(address));
  ready({address, opening, true});
  return {};
}

}  // namespace

Result<void> run_studio(const StudioOptions& options,
                        const std::function<void(const StudioAddress&)>& ready) {
  MODAR_ASSIGN(const std::string page, find_studio_page());
  MODAR_ASSIGN(const std::string folder, make_project_folder(options.folder));
  Session session(folder, options.tool_version);
  const auto lock = FolderLock::take(session.own + "/lock", {ExitCode::kIo, "studio.locked", folder,
                                                             "another studio has this folder open",
                                                             "use its page, or end it first"});
  if (!lock) return show_other(session, lock.error(), ready);
  clear_leftovers(session);
  const auto engine = find_page();
  std::atomic<bool> ended{false};
  std::atomic<StudioServer*> running{nullptr};
  const Signals signals([&running, &ended] {
    ended = true;
    if (StudioServer* server = running) server->stop();
  });
  MODAR_ASSIGN(
      const auto server,
      StudioServer::open(
          {options.port, page, engine ? *engine : "", session.own},
          [&session](const Call& call) { return answer_call(session, call); }, session.events));
  running = server.get();
  session.quit = [&session, &server] {
    session.events.publish("quit", Json::object());
    std::thread([&server] { server->stop(); }).detach();
  };
  MODAR_TRY(write_private(session.own + "/address", server->address()));
  {
    const Watcher watcher(folder, [&session](bool files) { report_project(session, files); });
    ready({server->address(), server->opening_address()});
    if (ended) server->stop();
    server->serve();
  }
  session.jobs.end();
  session.phone_server.end();
  std::error_code ignored;
  fs::remove(session.own + "/address", ignored);
  return {};
}

}  // namespace modar
