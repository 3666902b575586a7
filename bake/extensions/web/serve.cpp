// HTTPS by cpp-httplib (whose package says that it has OpenSSL), a certificate by OpenSSL, the
// address as a QR code by libqrencode.
#include "bake/extensions/web/serve.hpp"

#include <arpa/inet.h>
#include <ifaddrs.h>
#include <net/if.h>
#include <netinet/in.h>

#include <array>
#include <filesystem>
#include <memory>
#include <thread>

#include <httplib.h>
#include <openssl/evp.h>
#include <openssl/x509v3.h>
#include <qrencode.h>

#include "bake/extensions/web/connection_relay.hpp"

namespace modar {
namespace {

namespace fs = std::filesystem;

/// A certificate serves one run of the command, days at most.
constexpr long kValidSeconds = 7L * 24 * 3600;

using Key = std::unique_ptr<EVP_PKEY, decltype(&EVP_PKEY_free)>;
using Certificate = std::unique_ptr<X509, decltype(&X509_free)>;

/// This machine's addresses in its networks, as IPv4 has them.
std::vector<std::string> own_addresses() {
  std::vector<std::string> found;
  ifaddrs* all = nullptr;
  if (getifaddrs(&all) != 0) return found;
  for (const ifaddrs* each = all; each != nullptr; each = each->ifa_next) {
    if (each->ifa_addr == nullptr || each->ifa_addr->sa_family != AF_INET) continue;
    if ((each->ifa_flags & IFF_LOOPBACK) != 0 || (each->ifa_flags & IFF_UP) == 0) continue;
    std::array<char, INET_ADDRSTRLEN> text{};
    const auto* address = reinterpret_cast<const sockaddr_in*>(each->ifa_addr);
    if (inet_ntop(AF_INET, &address->sin_addr, text.data(), text.size()) != nullptr) {
      found.emplace_back(text.data());
    }
  }
  freeifaddrs(all);
  return found;
}

/// Signed by its own key, for localhost and the addresses. Null where OpenSSL fails.
Certificate make_certificate(EVP_PKEY* key, const std::vector<std::string>& addresses) {
  Certificate certificate(X509_new(), X509_free);
  X509* x509 = certificate.get();
  std::string names = "DNS:localhost,IP:127.0.0.1";
  for (const std::string& address : addresses) names += ",IP:" + address;
  X509_NAME* subject = X509_get_subject_name(x509);
  const auto* common = reinterpret_cast<const unsigned char*>("ModAR on this machine");
  const bool made =
      X509_set_version(x509, 2) == 1 && ASN1_INTEGER_set(X509_get_serialNumber(x509), 1) == 1 &&
      X509_gmtime_adj(X509_getm_notBefore(x509), -3600) != nullptr &&
      X509_gmtime_adj(X509_getm_notAfter(x509), kValidSeconds) != nullptr &&
      X509_set_pubkey(x509, key) == 1 &&
      X509_NAME_add_entry_by_txt(subject, "CN", MBSTRING_ASC, common, -1, -1, 0) == 1 &&
      X509_set_issuer_name(x509, subject) == 1;
  if (!made) return {nullptr, X509_free};
  X509_EXTENSION* extension =
      X509V3_EXT_conf_nid(nullptr, nullptr, NID_subject_alt_name, names.c_str());
  const bool named = extension != nullptr && X509_add_ext(x509, extension, -1) == 1;
  X509_EXTENSION_free(extension);
  if (!named || X509_sign(x509, key, EVP_sha256()) == 0) return {nullptr, X509_free};
  return certificate;
}

/// Below the page's own policy, which index.html states: both hold.
const httplib::Headers kSafeHeaders = {{"Content-Security-Policy",
                                        "script-src 'self' 'wasm-unsafe-eval'; base-uri 'none'; "
                                        "object-src 'none'; form-action 'none'; "
                                        "frame-ancestors 'self'"},
                                       {"X-Content-Type-Options", "nosniff"},
                                       {"Referrer-Policy", "no-referrer"}};

/// Answers 404 to names without a file in the folder: links that lead out of it, hidden files.
httplib::Server::HandlerWithResponse inside_only(const std::string& folder) {
  std::error_code error;
  const fs::path root = fs::canonical(folder, error);
  return [root](const httplib::Request& request, httplib::Response& response) {
    using Handled = httplib::Server::HandlerResponse;
    std::error_code unknown;
    const std::string path =
        request.path.ends_with('/') ? request.path + "index.html" : request.path;
    const fs::path file = fs::canonical(root / fs::path(path).relative_path(), unknown);
    const fs::path below = file.lexically_relative(root);
    const bool inside = !unknown && !below.empty() && !below.string().starts_with('.');
    if (inside && fs::is_regular_file(file, unknown)) return Handled::Unhandled;
    response.status = 404;
    return Handled::Handled;
  };
}

/// The addresses of the server: those of this machine's networks, or the one that it is bound to.
std::vector<std::string> addresses_of(const ServeOptions& options) {
  if (options.bind == "0.0.0.0") return own_addresses();
  if (options.bind.starts_with("127.")) return {};
  return {options.bind};
}

using Code = std::unique_ptr<QRcode, decltype(&QRcode_free)>;

/// Null where the text is too long.
Code encode_qr(const std::string& text) {
  return {QRcode_encodeString(text.c_str(), 0, QR_ECLEVEL_L, QR_MODE_8, 1), QRcode_free};
}

tl::unexpected<Error> no_server(int port, const char* cause) {
  return fail(ExitCode::kIo, "web.port", "port " + std::to_string(port), cause,
              "name another port: --port");
}

}  // namespace

Result<void> serve_site(const ServeOptions& options,
                        const std::function<void(const std::vector<std::string>&)>& ready) {
  MODAR_ASSIGN(const Listener listener, listen_on(options.bind, options.port));
  const std::vector<std::string> addresses = addresses_of(options);
  const Key key(EVP_EC_gen("P-256"), EVP_PKEY_free);
  const Certificate certificate =
      key == nullptr ? Certificate(nullptr, X509_free) : make_certificate(key.get(), addresses);
  if (certificate == nullptr) return no_server(options.port, "OpenSSL makes no certificate");
  httplib::SSLServer server(certificate.get(), key.get());
  if (!server.is_valid() || !server.set_mount_point("/", options.folder)) {
    return no_server(options.port, "the server does not start");
  }
  server.set_file_extension_and_mimetype_mapping("js", "text/javascript");
  server.set_file_extension_and_mimetype_mapping("wasm", "application/wasm");
  server.set_file_extension_and_mimetype_mapping("usdz", "model/vnd.usdz+zip");
  server.set_file_extension_and_mimetype_mapping("glb", "model/gltf-binary");
  server.set_file_extension_and_mimetype_mapping("modar", "application/octet-stream");
  server.set_file_extension_and_mimetype_mapping("webmanifest", "application/manifest+json");
  server.set_default_headers(kSafeHeaders);
  server.set_pre_routing_handler(inside_only(options.folder));
  // A thread for each connection that the relay lets in.
  server.new_task_queue = [] { return new httplib::ThreadPool(kMostConnections); };
  server.set_payload_max_length(0);
  const int behind = server.bind_to_any_port("127.0.0.1");
  if (behind < 0) return no_server(options.port, "the server does not start");
  std::thread(relay_connections, listener, behind).detach();
  std::vector<std::string> urls;
  const std::string port = std::to_string(listener.port);
  for (const std::string& address : addresses)
    urls.push_back("https://" + address + ":" + port + "/");
  urls.push_back("https://localhost:" + port + "/");
  ready(urls);
  if (!server.listen_after_bind()) return no_server(listener.port, "the server stopped");
  return {};
}

std::string qr_svg(const std::string& text) {
  const Code code = encode_qr(text);
  if (code == nullptr) return {};
  constexpr int kMargin = 4;  // modules, as the standard asks for
  const std::string side = std::to_string(code->width + 2 * kMargin);
  std::string path;
  for (int y = 0; y < code->width; ++y) {
    for (int x = 0; x < code->width; ++x) {
      if ((code->data[y * code->width + x] & 1) == 0) continue;
      path += "M" + std::to_string(x + kMargin) + " " + std::to_string(y + kMargin) + "h1v1h-1z";
    }
  }
  return "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 " + side + " " + side +
         "\" shape-rendering=\"crispEdges\"><path fill=\"#fff\" d=\"M0 0h" + side + "v" + side +
         "H0z\"/><path fill=\"#000\" d=\"" + path + "\"/></svg>";
}

std::string qr_code(const std::string& text) {
  const Code code = encode_qr(text);
  if (code == nullptr) return {};
  constexpr int kQuiet =
      2;  // modules of light around it: cameras read 2 as well as the standard's 4
  const auto dark = [&](int x, int y) {
    if (x < 0 || y < 0 || x >= code->width || y >= code->width) return false;
    return (code->data[y * code->width + x] & 1) != 0;
  };
  // Terminals are dark as a rule: light modules are drawn, dark ones left out.
  std::string lines;
  for (int y = -kQuiet; y < code->width + kQuiet; y += 2) {
    for (int x = -kQuiet; x < code->width + kQuiet; ++x) {
      const bool upper = !dark(x, y);
      const bool lower = !dark(x, y + 1);
      lines += upper && lower ? "\u2588" : upper ? "\u2580" : lower ? "\u2584" : " ";
    }
    lines += '\n';
  }
  return lines;
}

}  // namespace modar
