// A counting semaphore: waiters queue and are signalled, nobody spins. POSIX below, because
// std::counting_semaphore of GCC 12 can sleep for ever despite a free count (its bug 104928).
#pragma once

#include <semaphore.h>

#include <cerrno>
#include <chrono>
#include <ctime>

namespace modar {

class Semaphore {
 public:
  explicit Semaphore(unsigned count) { sem_init(&semaphore_, 0, count); }
  Semaphore(const Semaphore&) = delete;
  Semaphore& operator=(const Semaphore&) = delete;
  ~Semaphore() { sem_destroy(&semaphore_); }

  /// Waits until the count is positive, then lowers it by one.
  void acquire() {
    while (sem_wait(&semaphore_) != 0 && errno == EINTR) {
    }
  }

  /// The same for at most `limit`. Answers false where the time ran out.
  bool acquire_for(std::chrono::nanoseconds limit) {
    timespec until{};
    clock_gettime(CLOCK_REALTIME, &until);
    const long long sum = until.tv_nsec + limit.count();
    until.tv_sec += static_cast<std::time_t>(sum / kNanoseconds);
    until.tv_nsec = static_cast<long>(sum % kNanoseconds);
    while (sem_timedwait(&semaphore_, &until) != 0) {
      if (errno != EINTR) return false;
    }
    return true;
  }

  void release() { sem_post(&semaphore_); }

 private:
  static constexpr long long kNanoseconds = 1'000'000'000;
  sem_t semaphore_{};
};

}  // namespace modar
