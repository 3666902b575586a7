// What a process that a signal ends would leave behind: files under construction and folders that
// hold them.
#pragma once

#include <string>

namespace modar {

/// While one exists, a signal that ends the process removes the file or the empty folder first.
class Leftover {
 public:
  Leftover() = default;
  explicit Leftover(const std::string& path);
  Leftover(Leftover&& other) noexcept;
  Leftover& operator=(Leftover&& other) noexcept;
  Leftover(const Leftover&) = delete;
  Leftover& operator=(const Leftover&) = delete;
  ~Leftover() { forget(); }
  /// It stays: it has been put in its place, or removed.
  void forget();

 private:
  int slot_ = -1;
};

/// Removes what exists. Async-signal-safe.
void remove_leftovers();

/// SIGINT, SIGTERM and SIGHUP call it before they end the process, unless they are ignored.
void remove_leftovers_at_signals();

}  // namespace modar
