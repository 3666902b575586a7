// The studio's web server: who may ask, and how much.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "bake/extensions/studio/events.hpp"
#include "bake/extensions/studio/http_reply.hpp"
#include "formats/base/error.hpp"

namespace modar {

/// Of a file that a page uploads. A photogrammetry scan of 20 million triangles as OBJ is smaller.
inline constexpr std::uint64_t kMostUploadBytes = std::uint64_t{2} << 30;

struct ServerOptions {
  int port = 0;          ///< 0: any that is free
  std::string page;      ///< folder of the page
  std::string engine;    ///< folder of the page of `modar web`; empty: it was not built
  std::string incoming;  ///< folder in which uploads are kept while they arrive
};

/// An address that leads once to the page of a studio that answers at `address`, its own page's.
/// Errors: kIo "studio.locked" where none answers.
Result<std::string> ask_opening(const std::string& address);

/// Serves on 127.0.0.1. A request is answered if its address has the secret, its Host is this
/// server's, and its Origin, where it names one, too: neither another site's page, nor one whose
/// name was made to lead here, nor another user of the machine gets further. A connection serves
/// one request; connections, sizes and waiting times are bounded.
class StudioServer {
 public:
  using Handler = std::function<Answer(const Call&)>;

  /// Errors: kIo "studio.port"; kInternal "studio.secret".
  static Result<std::unique_ptr<StudioServer>> open(const ServerOptions& options, Handler handler,
                                                    Events& events);
  ~StudioServer();

  /// "http://127.0.0.1:PORT/SECRET/".
  [[nodiscard]] std::string address() const;
  /// An address that leads to the page once.
  std::string opening_address();
  /// Answers until stop() is called.
  void serve();
  /// From another thread.
  void stop();

 private:
  struct Parts;
  explicit StudioServer(std::unique_ptr<Parts> parts);
  std::unique_ptr<Parts> parts_;
};

}  // namespace modar
