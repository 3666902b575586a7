#include "bake/project/interrupts.hpp"

#include <pthread.h>
#include <signal.h>
#include <unistd.h>

#include <atomic>
#include <cstdio>
#include <thread>

#include "formats/base/leftover.hpp"

namespace modar {

struct Interrupts::Watch {
  std::mutex writing;
  std::atomic<bool> stop{false};
  sigset_t signals{};
  sigset_t before{};
  std::thread thread;

  void wait() {
    int signal = 0;
    if (::sigwait(&signals, &signal) != 0 || stop) return;
    const std::lock_guard lock(writing);
    std::fputs("\nmodar: interrupted; finished parts stay in the cache\n", stderr);
    remove_leftovers();
    ::_exit(128 + signal);
  }
};

Interrupts::Interrupts() : watch_(std::make_unique<Watch>()) {
  ::sigemptyset(&watch_->signals);
  ::sigaddset(&watch_->signals, SIGINT);
  ::sigaddset(&watch_->signals, SIGTERM);
  ::pthread_sigmask(SIG_BLOCK, &watch_->signals, &watch_->before);
  watch_->thread = std::thread([watch = watch_.get()] { watch->wait(); });
}

Interrupts::~Interrupts() {
  watch_->stop = true;
  ::pthread_kill(watch_->thread.native_handle(), SIGTERM);
  watch_->thread.join();
  ::pthread_sigmask(SIG_SETMASK, &watch_->before, nullptr);
}

std::unique_lock<std::mutex> Interrupts::writing() {
  return std::unique_lock(watch_->writing);
}

}  // namespace modar
