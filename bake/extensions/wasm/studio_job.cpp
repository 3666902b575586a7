// Jobs of a studio without processes: `modar` itself, called in the instance that runs the job.
#include "bake/extensions/wasm/studio_job.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>

#include "bake/commands/cli.hpp"
#include "bake/extensions/studio/exports.hpp"
#include "bake/extensions/studio/jobs.hpp"
#include "bake/extensions/studio/move_file.hpp"

/// Of module.js: starts a worker that runs the request again, as this job.
extern "C" void modar_studio_start(unsigned job, const char* kind);
/// Of module.js: ends it, where it still runs.
extern "C" void modar_studio_end();

namespace modar {

unsigned this_job = 0;
std::function<void(int, const std::string&)> job_line;

ProcessResult Job::run(const std::vector<std::string>& words, const std::string& folder,
                       const std::function<void(const std::string&)>& told,
                       const std::function<void(const std::string&)>&) {
  ProcessResult ran;
  if (words.empty() || words[0] != own_program() || ::chdir(folder.c_str()) != 0) return ran;
  job_line = [&](int stream, const std::string& line) {
    (stream == 1 ? ran.output : ran.errors) += line + "\n";
    if (stream == 2 && told) told(line);
  };
  std::vector<char*> arguments;
  for (const std::string& word : words) arguments.push_back(const_cast<char*>(word.c_str()));
  arguments.push_back(nullptr);
  ran.exit = run_modar(static_cast<int>(words.size()), arguments.data());
  std::fflush(stdout);
  std::fflush(stderr);
  job_line = nullptr;
  return ran;
}

void Job::cancel() {}

Result<std::uint64_t> Jobs::start(const std::string& kind, std::function<void(Job&)> work) {
  if (running_) {
    return fail(ExitCode::kUsage, "studio.busy", "", "something is being made already",
                "wait for it, or cancel it");
  }
  running_ = true;
  last_ = this_job != 0 ? this_job : last_ + 1;
  if (this_job == 0) {
    modar_studio_start(static_cast<unsigned>(last_), kind.c_str());
    return last_;
  }
  job_ = std::make_unique<Job>(last_, kind);
  work(*job_);
  running_ = false;
  return last_;
}

bool Jobs::cancel() {
  if (!running_) return false;
  running_ = false;
  modar_studio_end();
  return true;
}

bool Jobs::busy() {
  return running_;
}

void Jobs::end() {
  cancel();
}

bool move_to_free(const std::string& from, const std::string& to) {
  if (::access(to.c_str(), F_OK) == 0) {
    errno = EEXIST;
    return false;
  }
  return ::rename(from.c_str(), to.c_str()) == 0;
}

}  // namespace modar
