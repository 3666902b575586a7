#include "bake/ship/http/http_reader.hpp"

#include <charconv>
#include <memory>
#include <utility>

#include <httplib.h>

namespace modar {
namespace {

constexpr int kConnectSeconds = 15;  // as modar-fetch waits
constexpr int kSilentSeconds = 30;
constexpr int kTries = 3;  // of a file whose connection breaks

/// "https://user:secret@host:8443/ar/" in its parts.
struct WebAddress {
  std::string origin;  ///< "https://host:8443"
  std::string user;
  std::string password;
  std::string path;  ///< "/ar", without a slash at its end
};

std::optional<WebAddress> split_address(const std::string& text) {
  WebAddress address;
  const std::size_t scheme = text.find("://") + 3;
  const std::size_t slash = std::min(text.find('/', scheme), text.size());
  std::string host = text.substr(scheme, slash - scheme);
  if (const std::size_t at = host.rfind('@'); at != std::string::npos) {
    const std::string login = host.substr(0, at);
    const std::size_t colon = std::min(login.find(':'), login.size());
    address.user = httplib::detail::decode_url(login.substr(0, colon), false);
    address.password =
        httplib::detail::decode_url(login.substr(std::min(colon + 1, login.size())), false);
    host.erase(0, at + 1);
  }
  const std::size_t bracket = host.find(']');  // of an IPv6 address
  const std::size_t colon = host.find(':', bracket == std::string::npos ? 0 : bracket);
  if (colon != std::string::npos) {
    unsigned port = 0;
    const char* end = host.data() + host.size();
    const auto parsed = std::from_chars(host.data() + colon + 1, end, port);
    if (parsed.ec != std::errc() || parsed.ptr != end || port == 0 || port > 65535) return {};
  }
  if (host.empty() || colon == 0) return std::nullopt;
  address.origin = text.substr(0, scheme) + host;
  address.path = text.substr(slash);
  while (address.path.ends_with('/')) address.path.pop_back();
  return address;
}

class WebReader {
 public:
  explicit WebReader(WebAddress address)
      : address_(std::move(address)), client_(std::make_shared<httplib::Client>(address_.origin)) {
    client_->set_keep_alive(true);
    client_->set_connection_timeout(kConnectSeconds);
    client_->set_read_timeout(kSilentSeconds);
    if (!address_.user.empty()) client_->set_basic_auth(address_.user, address_.password);
  }

  Result<std::optional<std::string>> operator()(const std::string& path, std::size_t limit) {
    const std::string asked = address_.path + "/" + path;
    for (int tries = 1;; ++tries) {
      std::string body;
      const auto answer = client_->Get(asked, [&](const char* bytes, std::size_t size) {
        body.append(bytes, size);
        return body.size() <= limit;
      });
      if (body.size() > limit) return std::optional<std::string>(std::move(body));
      if (!answer && tries < kTries) continue;
      if (!answer) {
        return fail(ExitCode::kIo, "http.connection", address_.origin + asked,
                    httplib::to_string(answer.error()), "check the address and the network");
      }
      if (answer->status == 404 || answer->status == 410) return std::optional<std::string>();
      if (answer->status == 200) return std::optional<std::string>(std::move(body));
      return fail(ExitCode::kIo, "http.answer", address_.origin + asked,
                  "the server responded with " + std::to_string(answer->status),
                  "give the address at which devices find the files");
    }
  }

 private:
  WebAddress address_;
  std::shared_ptr<httplib::Client> client_;  // a std::function wants to copy what it holds
};

}  // namespace

bool is_web_address(const std::string& text) {
  return text.starts_with("http://") || text.starts_with("https://");
}

Result<std::function<Result<std::optional<std::string>>(const std::string& path, std::size_t)>>
web_reader(const std::string& address) {
  const auto parts = split_address(address);
  if (!parts) {
    return fail(ExitCode::kUsage, "http.url", "the address", "it names no host, or no port",
                "write it as https://museum.example/ar");
  }
  return WebReader(*parts);
}

}  // namespace modar
