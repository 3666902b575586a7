// One eventfd beside the file, in one poll.
#include "wake.hpp"

#include <poll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdint>

namespace modar {

Wake::Wake() : event_(eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {}

Wake::~Wake() {
  if (event_ >= 0) close(event_);
}

void Wake::stop() {
  const std::uint64_t one = 1;
  // It cannot fail but by a full counter, which is awake already.
  [[maybe_unused]] const ssize_t written = write(event_, &one, sizeof one);
}

Wake::Event Wake::wait(int descriptor, std::chrono::milliseconds limit) const {
  // Nobody reads the event: once stopped, it stays so. poll() skips negative descriptors.
  std::array<pollfd, 2> files = {{{event_, POLLIN, 0}, {descriptor, POLLIN, 0}}};
  int ready = 0;
  do {
    ready = poll(files.data(), files.size(), static_cast<int>(limit.count()));
  } while (ready < 0 && errno == EINTR);
  if (files[0].revents != 0) return Event::kStopped;
  // An end or an error is readable too: the read says which.
  return files[1].revents != 0 ? Event::kReadable : Event::kTimeout;
}

Wake::Event Wake::wait_for_stop(std::chrono::milliseconds limit) const {
  return wait(-1, limit);
}

}  // namespace modar
