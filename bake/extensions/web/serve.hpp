// A site opened on this machine, for phones in the same network.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "formats/base/error.hpp"

namespace modar {

struct ServeOptions {
  std::string folder;
  std::string bind = "0.0.0.0";  ///< an IPv4 address of this machine; 0.0.0.0: all of them
  int port = 8443;               ///< 0: any that is free
};

/// Serves the folder by HTTPS until the process is ended: browsers give the camera to nothing less.
/// The certificate is made on the spot and signed by nobody, so that browsers ask once.
/// Serves regular files in the folder alone, not what links lead to elsewhere; connections are
/// bounded in number and in time (connection_relay.hpp), and answers have security headers.
/// ready: called with the addresses, the first for other devices, once they answer.
/// Errors: kIo "web.port"; kUsage "web.bind".
Result<void> serve_site(const ServeOptions& options,
                        const std::function<void(const std::vector<std::string>&)>& ready);

/// The text as a QR code of block letters, two modules a letter; empty where it is too long.
std::string qr_code(const std::string& text);
/// The same as an SVG picture, dark on light, with the margin that readers want.
std::string qr_svg(const std::string& text);

}  // namespace modar
