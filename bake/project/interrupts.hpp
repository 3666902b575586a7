// Ctrl-C without half-written files.
#pragma once

#include <memory>
#include <mutex>

namespace modar {

/// While one exists, SIGINT and SIGTERM end the process as ever (128 + signal), but not while a
/// lock of writing() is held. Threads that are started meanwhile leave both signals to it.
class Interrupts {
 public:
  Interrupts();
  Interrupts(const Interrupts&) = delete;
  Interrupts& operator=(const Interrupts&) = delete;
  ~Interrupts();
  /// Held from the creation of a file to its rename.
  [[nodiscard]] std::unique_lock<std::mutex> writing();

 private:
  struct Watch;
  std::unique_ptr<Watch> watch_;
};

}  // namespace modar
