// Waits until a file can be read or another thread says stop.
#pragma once

#include <chrono>

namespace modar {

class Wake {
 public:
  Wake();
  Wake(const Wake&) = delete;
  Wake& operator=(const Wake&) = delete;
  ~Wake();

  /// From any thread: each wait() answers kStopped from now on.
  void stop();

  enum class Event { kReadable, kStopped, kTimeout };
  /// descriptor: a file, pipe or device. Without a limit it waits for ever.
  [[nodiscard]] Event wait(int descriptor,
                           std::chrono::milliseconds limit = std::chrono::milliseconds(-1)) const;
  /// Only the stop: kStopped or kTimeout.
  [[nodiscard]] Event wait_for_stop(std::chrono::milliseconds limit) const;

 private:
  int event_ = -1;
};

}  // namespace modar
