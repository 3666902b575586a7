// What stands between a network and a server on this machine: a limited number of connections, and
// none that only waits.
#pragma once

#include <string>

#include "formats/base/error.hpp"

namespace modar {

/// Together and of one address: a browser opens 6, and a phone or two may share an address.
inline constexpr int kMostConnections = 64;
inline constexpr int kMostOfOneAddress = 16;
/// Bytes per interval below which a connection is closed. Higher cuts off phones at the edge of a
/// network.
inline constexpr std::size_t kLeastBytes = 256;
inline constexpr int kWithinSeconds = 10;

/// A socket that takes connections.
struct Listener {
  int socket = -1;
  int port = 0;
};

/// bind: an IPv4 address of this machine, 0.0.0.0 for all. port 0: any that is free.
/// Errors: kIo "web.port"; kUsage "web.bind" (no address).
Result<Listener> listen_on(const std::string& bind, int port);

/// Takes connections and carries their bytes to and from a port of this machine, until the process
/// ends. Those beyond the bounds are closed at once.
void relay_connections(const Listener& from, int to_port);

}  // namespace modar
