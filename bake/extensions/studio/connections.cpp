#include "bake/extensions/studio/connections.hpp"

#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdint>
#include <cstdlib>

#include "formats/base/utf8.hpp"

namespace modar {
namespace {

constexpr std::size_t kThreads = 24;          // 8 listeners, 8 bodies, and a page's other requests
constexpr std::size_t kMostWaiting = 128;     // connections that no thread has; a browser opens 6
constexpr std::size_t kMostHead = 32u << 10;  // bytes of a request's head; browsers send 1 KB
constexpr std::chrono::seconds kRequestTime(10);  // for a whole head; a page's comes at once

/// How many bytes of a request are waited for; 0: unknown, since its head has not come in full.
std::size_t wanted_of(const std::string& begun) {
  const std::size_t end = begun.find("\r\n\r\n");
  if (end == std::string::npos) return 0;
  const std::string head = ascii_lower(begun.substr(0, end));
  const std::size_t at = head.find("\r\ncontent-length:");
  const std::size_t body =
      at == std::string::npos ? 0 : std::strtoull(head.c_str() + at + 17, nullptr, 10);
  return end + 4 + (body <= kSmallBody ? body : 0);
}

}  // namespace

Connections::Connections(Serve serve)
    : serve_(std::move(serve)), wake_(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {
  reader_ = std::thread([this] { read_all(); });
  for (std::size_t i = 0; i < kThreads; ++i) threads_.emplace_back([this] { work(); });
}

void Connections::add(int socket) {
  const std::lock_guard lock(mutex_);
  added_.push_back(socket);
  ::eventfd_write(wake_, 1);
}

void Connections::end() {
  {
    const std::lock_guard lock(mutex_);
    if (ended_) return;
    ended_ = true;
    ::eventfd_write(wake_, 1);
  }
  ready_changed_.notify_all();
  reader_.join();
  for (std::thread& thread : threads_) thread.join();
  for (const Waiting& one : waiting_) ::close(one.socket);
  for (const Waiting& one : ready_) ::close(one.socket);
  for (const int socket : added_) ::close(socket);
  ::close(wake_);
}

bool Connections::read_more(Waiting& one) {
  std::array<char, 16384> part{};
  const ssize_t got = ::recv(one.socket, part.data(), part.size(), MSG_DONTWAIT);
  if (got < 0 && (errno == EAGAIN || errno == EINTR)) return true;
  if (got > 0) one.begun.append(part.data(), static_cast<std::size_t>(got));
  const std::size_t wanted = wanted_of(one.begun);
  if (got > 0 && (wanted == 0 ? one.begun.size() < kMostHead : one.begun.size() < wanted)) {
    return true;
  }
  if (wanted == 0) {
    ::close(one.socket);
  } else {
    hand_over(one);
  }
  return false;
}

void Connections::hand_over(Waiting& one) {
  const std::lock_guard lock(mutex_);
  if (ready_.size() == kMostWaiting) {
    ::close(one.socket);
    return;
  }
  ready_.push_back(std::move(one));
  ready_changed_.notify_one();
}

void Connections::read_all() {
  std::vector<pollfd> sockets;
  for (;;) {
    sockets.assign(1, {wake_, POLLIN, 0});
    for (const Waiting& one : waiting_) sockets.push_back({one.socket, POLLIN, 0});
    const auto left = waiting_.empty() ? kRequestTime : waiting_.front().until - Clock::now();
    const auto wait = std::chrono::ceil<std::chrono::milliseconds>(left).count();
    ::poll(sockets.data(), sockets.size(), static_cast<int>(std::max<std::int64_t>(wait, 0)));
    const auto now = Clock::now();
    std::size_t i = 1;
    for (auto one = waiting_.begin(); one != waiting_.end(); ++i) {
      bool stays = sockets[i].revents == 0 || read_more(*one);
      if (stays && one->until <= now) {
        ::close(one->socket);
        stays = false;
      }
      one = stays ? std::next(one) : waiting_.erase(one);
    }
    eventfd_t ignored = 0;
    ::eventfd_read(wake_, &ignored);
    const std::lock_guard lock(mutex_);
    if (ended_) return;
    for (const int socket : added_) waiting_.push_back({socket, now + kRequestTime, {}});
    added_.clear();
    for (; waiting_.size() > kMostWaiting; waiting_.pop_front()) ::close(waiting_.front().socket);
  }
}

void Connections::work() {
  for (;;) {
    std::unique_lock lock(mutex_);
    ready_changed_.wait(lock, [&] { return ended_ || !ready_.empty(); });
    if (ended_) return;
    Waiting one = std::move(ready_.front());
    ready_.pop_front();
    lock.unlock();
    serve_(one.socket, std::move(one.begun));
  }
}

}  // namespace modar
