#include "bake/extensions/web/connection_relay.hpp"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <cstdint>
#include <cstring>
#include <map>
#include <mutex>
#include <thread>

namespace modar {
namespace {

sockaddr_in address_of(std::uint32_t host, int port) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  address.sin_addr.s_addr = host;
  return address;
}

/// Who is connected, by address.
class ConnectionLimiter {
 public:
  bool enter(std::uint32_t host) {
    const std::lock_guard lock(mutex_);
    if (all_ >= kMostConnections || by_host_[host] >= kMostOfOneAddress) return false;
    ++all_;
    ++by_host_[host];
    return true;
  }
  void leave(std::uint32_t host) {
    const std::lock_guard lock(mutex_);
    --all_;
    if (--by_host_[host] == 0) by_host_.erase(host);
  }

 private:
  std::mutex mutex_;
  int all_ = 0;
  std::map<std::uint32_t, int> by_host_;
};

bool send_all(int to, const char* bytes, std::size_t size,
              std::chrono::steady_clock::time_point end) {
  while (size != 0) {
    pollfd ready{to, POLLOUT, 0};
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(
        end - std::chrono::steady_clock::now());
    if (left.count() <= 0 || ::poll(&ready, 1, static_cast<int>(left.count())) <= 0) return false;
    const ssize_t sent = ::send(to, bytes, size, MSG_NOSIGNAL | MSG_DONTWAIT);
    if (sent < 0 && (errno == EINTR || errno == EAGAIN)) continue;
    if (sent <= 0) return false;
    bytes += sent;
    size -= static_cast<std::size_t>(sent);
  }
  return true;
}

/// Carries bytes both ways until one end closes or nothing much has moved for a while.
void carry(int client, int server) {
  using Clock = std::chrono::steady_clock;
  std::array<char, 65536> block{};
  const auto window = std::chrono::seconds(kWithinSeconds);
  auto end = Clock::now() + window;
  std::size_t moved = 0;
  for (;;) {
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(end - Clock::now());
    std::array<pollfd, 2> ready{{{client, POLLIN, 0}, {server, POLLIN, 0}}};
    if (left.count() <= 0) return;
    if (::poll(ready.data(), ready.size(), static_cast<int>(left.count())) < 0 && errno != EINTR) {
      return;
    }
    for (std::size_t i = 0; i < ready.size(); ++i) {
      if (ready[i].revents == 0) continue;
      const ssize_t got = ::recv(ready[i].fd, block.data(), block.size(), MSG_DONTWAIT);
      if (got < 0 && (errno == EINTR || errno == EAGAIN)) continue;
      if (got <= 0) return;
      moved += static_cast<std::size_t>(got);
      if (!send_all(ready[1 - i].fd, block.data(), static_cast<std::size_t>(got), end)) return;
    }
    if (moved < kLeastBytes) continue;
    moved = 0;
    end = Clock::now() + window;
  }
}

void serve_guest(int client, int to_port) {
  const int server = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  const sockaddr_in address = address_of(htonl(INADDR_LOOPBACK), to_port);
  if (server >= 0 &&
      ::connect(server, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0) {
    carry(client, server);
  }
  if (server >= 0) ::close(server);
}

}  // namespace

Result<Listener> listen_on(const std::string& bind, int port) {
  in_addr host{};
  if (::inet_pton(AF_INET, bind.c_str(), &host) != 1) {
    return fail(ExitCode::kUsage, "web.bind", "--bind " + bind, "it is not an IPv4 address",
                "write it as 127.0.0.1, or 0.0.0.0 for all of this machine");
  }
  Listener listener{::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0), port};
  sockaddr_in address = address_of(host.s_addr, port);
  const int on = 1;
  ::setsockopt(listener.socket, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
  socklen_t size = sizeof address;
  if (listener.socket < 0 ||
      ::bind(listener.socket, reinterpret_cast<const sockaddr*>(&address), size) != 0 ||
      ::listen(listener.socket, kMostConnections) != 0 ||
      ::getsockname(listener.socket, reinterpret_cast<sockaddr*>(&address), &size) != 0) {
    const std::string cause = std::strerror(errno);
    if (listener.socket >= 0) ::close(listener.socket);
    return fail(ExitCode::kIo, "web.port", bind + ":" + std::to_string(port), cause,
                "name another address or port: --bind, --port");
  }
  listener.port = ntohs(address.sin_port);
  return listener;
}

void relay_connections(const Listener& from, int to_port) {
  ConnectionLimiter limiter;
  for (;;) {
    sockaddr_in address{};
    socklen_t size = sizeof address;
    const int client =
        ::accept4(from.socket, reinterpret_cast<sockaddr*>(&address), &size, SOCK_CLOEXEC);
    if (client < 0) {
      if (errno == EMFILE || errno == ENFILE || errno == ENOBUFS || errno == ENOMEM) {
        std::this_thread::sleep_for(std::chrono::milliseconds(100));
      }
      continue;
    }
    const std::uint32_t host = address.sin_addr.s_addr;
    if (!limiter.enter(host)) {
      ::close(client);
      continue;
    }
    std::thread([client, host, to_port, &limiter] {
      serve_guest(client, to_port);
      ::close(client);
      limiter.leave(host);
    }).detach();
  }
}

}  // namespace modar
