#include "bake/extensions/studio/jobs.hpp"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>

extern char** environ;

namespace modar {
namespace {

constexpr std::size_t kMostOutput = 64u << 20;
constexpr std::size_t kMostErrors = 64u << 10;

/// A pipe from a child.
class Pipe {
 public:
  Pipe() {
    if (::pipe2(ends_.data(), O_CLOEXEC) != 0) ends_ = {-1, -1};
  }
  Pipe(const Pipe&) = delete;
  Pipe& operator=(const Pipe&) = delete;
  ~Pipe() {
    close_writer();
    if (ends_[0] >= 0) ::close(ends_[0]);
  }
  [[nodiscard]] int reader() const { return ends_[0]; }
  [[nodiscard]] int writer() const { return ends_[1]; }
  void close_writer() {
    if (ends_[1] >= 0) ::close(ends_[1]);
    ends_[1] = -1;
  }
  /// False at its end.
  bool read(std::string& text) {
    std::array<char, 1 << 16> buffer{};
    const ssize_t got = ::read(ends_[0], buffer.data(), buffer.size());
    if (got > 0) text.append(buffer.data(), static_cast<std::size_t>(got));
    return got > 0 || (got < 0 && errno == EINTR);
  }

 private:
  std::array<int, 2> ends_{-1, -1};
};

/// 0 where it could not be started. The child has a group of its own, so that what it starts ends
/// with it, and the signals that the server blocks.
pid_t start_child(const std::vector<std::string>& words, const std::string& folder,
                  const Pipe& output, const Pipe& errors) {
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_adddup2(&actions, output.writer(), STDOUT_FILENO);
  posix_spawn_file_actions_adddup2(&actions, errors.writer(), STDERR_FILENO);
  posix_spawn_file_actions_addchdir_np(&actions, folder.c_str());
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  sigset_t none;
  ::sigemptyset(&none);
  sigset_t usual;
  ::sigemptyset(&usual);
  for (const int signal : {SIGPIPE, SIGINT, SIGTERM, SIGHUP}) ::sigaddset(&usual, signal);
  posix_spawnattr_setsigmask(&attributes, &none);
  posix_spawnattr_setsigdefault(&attributes, &usual);
  posix_spawnattr_setflags(&attributes,
                           POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF | POSIX_SPAWN_SETPGROUP);
  std::vector<char*> arguments;
  for (const std::string& word : words) arguments.push_back(const_cast<char*>(word.c_str()));
  arguments.push_back(nullptr);
  pid_t child = 0;
  const int failed =
      ::posix_spawnp(&child, arguments[0], &actions, &attributes, arguments.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  posix_spawnattr_destroy(&attributes);
  return failed == 0 ? child : 0;
}

/// Hands whole lines over and leaves the rest.
void report_lines(std::string& text, std::string& kept,
                  const std::function<void(const std::string&)>& told) {
  for (std::size_t end = text.find('\n'); end != std::string::npos; end = text.find('\n')) {
    const std::string line = text.substr(0, end);
    text.erase(0, end + 1);
    if (told) told(line);
    kept += line + "\n";
    if (kept.size() > 2 * kMostErrors) kept.erase(0, kept.size() - kMostErrors);
  }
}

void read_both(Pipe& output, Pipe& errors, ProcessResult& ran,
               const std::function<void(const std::string&)>& told,
               const std::function<void(const std::string&)>& printed) {
  std::string lines;
  std::string ignored;
  std::array<pollfd, 2> both = {pollfd{output.reader(), POLLIN, 0},
                                pollfd{errors.reader(), POLLIN, 0}};
  while (both[0].fd >= 0 || both[1].fd >= 0) {
    if (::poll(both.data(), both.size(), -1) < 0 && errno != EINTR) return;
    if (both[0].fd >= 0 && both[0].revents != 0) {
      if (!output.read(ran.output)) both[0].fd = -1;
      if (printed) report_lines(ran.output, ignored, printed);
      if (ran.output.size() > kMostOutput) ran.output.resize(kMostOutput);
    }
    if (both[1].fd >= 0 && both[1].revents != 0) {
      if (!errors.read(lines)) both[1].fd = -1;
      report_lines(lines, ran.errors, told);
    }
  }
  ran.errors += lines;
}

}  // namespace

ProcessResult Job::run(const std::vector<std::string>& words, const std::string& folder,
                       const std::function<void(const std::string&)>& told,
                       const std::function<void(const std::string&)>& printed) {
  ProcessResult ran;
  Pipe output;
  Pipe errors;
  {
    const std::lock_guard lock(mutex_);
    if (cancelled_) return ran;
    process_ = start_child(words, folder, output, errors);
    if (process_ == 0) return ran;
  }
  output.close_writer();
  errors.close_writer();
  read_both(output, errors, ran, told, printed);
  int status = 0;
  // Not reaped while cancel() may signal it.
  siginfo_t ended{};
  while (::waitid(P_PID, static_cast<id_t>(process_), &ended, WEXITED | WNOWAIT) != 0 &&
         errno == EINTR) {
  }
  const std::lock_guard lock(mutex_);
  ::waitpid(process_, &status, 0);
  process_ = 0;
  if (WIFEXITED(status)) ran.exit = WEXITSTATUS(status);
  return ran;
}

void Job::cancel() {
  const std::lock_guard lock(mutex_);
  cancelled_ = true;
  if (process_ > 0) ::kill(-process_, SIGTERM);
}

Result<std::uint64_t> Jobs::start(const std::string& kind, std::function<void(Job&)> work) {
  const std::lock_guard lock(mutex_);
  if (running_) {
    return fail(ExitCode::kUsage, "studio.busy", "", "something is being made already",
                "wait for it, or cancel it");
  }
  if (thread_.joinable()) thread_.join();
  job_ = std::make_unique<Job>(++last_, kind);
  running_ = true;
  thread_ = std::thread([this, work = std::move(work)] {
    work(*job_);
    running_ = false;
  });
  return last_;
}

bool Jobs::cancel() {
  const std::lock_guard lock(mutex_);
  if (!running_) return false;
  job_->cancel();
  return true;
}

bool Jobs::busy() {
  return running_;
}

void Jobs::end() {
  cancel();
  const std::lock_guard lock(mutex_);
  if (thread_.joinable()) thread_.join();
}

}  // namespace modar
