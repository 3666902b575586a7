// Connections of a server: those whose request has not come in full, and threads for those whose
// has.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <deque>
#include <functional>
#include <list>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

namespace modar {

/// Bytes of a body that has come in full when its request is answered; larger ones come meanwhile.
inline constexpr std::size_t kSmallBody = 64u << 10;

/// One thread reads the beginnings of all requests, so that a connection that sends slowly or
/// nothing takes no other thread. A request is answered once its head and a small body have come.
/// Where too many connections wait, the one that has waited longest is closed.
class Connections {
 public:
  /// Answers a request of which `begun` was read, and closes the socket.
  using Serve = std::function<void(int socket, std::string begun)>;

  explicit Connections(Serve serve);
  Connections(const Connections&) = delete;
  Connections& operator=(const Connections&) = delete;
  ~Connections() { end(); }
  /// Takes a socket over. From any thread.
  void add(int socket);
  /// Closes those that wait, and waits for those that are answered.
  void end();

 private:
  using Clock = std::chrono::steady_clock;
  struct Waiting {
    int socket = -1;
    Clock::time_point until;  ///< by then its request has come
    std::string begun;
  };
  void read_all();
  /// Whether it keeps waiting.
  bool read_more(Waiting& one);
  void hand_over(Waiting& one);
  void work();

  Serve serve_;
  std::mutex mutex_;
  std::condition_variable ready_changed_;
  std::vector<int> added_;     ///< sockets that the reading thread has not seen yet
  std::deque<Waiting> ready_;  ///< requests that no thread has taken yet
  bool ended_ = false;
  std::list<Waiting> waiting_;  ///< of the reading thread, the oldest first
  int wake_ = -1;               ///< an eventfd, which wakes the reading thread
  std::thread reader_;
  std::vector<std::thread> threads_;
};

}  // namespace modar
