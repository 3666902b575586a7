// cpp-httplib, behind a gate that every request passes.
#include "bake/extensions/studio/server.hpp"

#include <fcntl.h>
#include <poll.h>
#include <sys/random.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <filesystem>
#include <mutex>
#include <set>
#include <thread>

#include <httplib.h>

#include "bake/extensions/studio/connections.hpp"
#include "bake/extensions/studio/path_guard.hpp"
#include "formats/base/atomic_file.hpp"
#include "modar/mapped_file.hpp"

namespace modar {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMostPathBytes = 2048;      // of an address
constexpr std::size_t kMostPostBytes = 4u << 20;  // of a JSON body; edits are a few hundred bytes
constexpr int kMostListeners = 8;                 // pages that are open at once
constexpr int kMostBodies = 8;                    // that come at once; a page sends one
constexpr int kSilentSeconds = 10;                // until a connection that sends nothing is closed
constexpr std::chrono::seconds kBeat(5);          // so often a listener that left is noticed

/// Letters of an address, 5 bits each: 130 bits, which nobody guesses.
Result<std::string> make_secret() {
  constexpr const char* kLetters = "abcdefghijklmnopqrstuvwxyz234567";
  std::array<unsigned char, 26> bytes{};
  if (::getrandom(bytes.data(), bytes.size(), 0) != static_cast<ssize_t>(bytes.size())) {
    return fail(ExitCode::kInternal, "studio.secret", "", "the system gives no random numbers",
                "try again");
  }
  std::string secret;
  for (const unsigned char byte : bytes) secret += kLetters[byte & 31U];
  return secret;
}

/// Takes the same time for every text of that length.
bool same_text(std::string_view a, std::string_view b) {
  if (a.size() != b.size()) return false;
  unsigned difference = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    difference |= static_cast<unsigned>(static_cast<unsigned char>(a[i])) ^
                  static_cast<unsigned>(static_cast<unsigned char>(b[i]));
  }
  return difference == 0;
}

/// A connection whose request has begun to come.
class ReplayedStream : public httplib::Stream {
 public:
  ReplayedStream(int socket, std::string bytes) : socket_(socket), bytes_(std::move(bytes)) {}
  ReplayedStream(const ReplayedStream&) = delete;
  ReplayedStream& operator=(const ReplayedStream&) = delete;
  ~ReplayedStream() override {
    ::shutdown(socket_, SHUT_RDWR);
    ::close(socket_);
  }
  bool is_readable() const override { return at_ < bytes_.size() || is_ready(POLLIN); }
  bool is_writable() const override { return is_ready(POLLOUT); }
  ssize_t read(char* to, std::size_t size) override {
    if (at_ == bytes_.size()) return is_ready(POLLIN) ? ::recv(socket_, to, size, 0) : -1;
    const std::size_t count = bytes_.copy(to, size, at_);
    at_ += count;
    return static_cast<ssize_t>(count);
  }
  ssize_t write(const char* from, std::size_t size) override {
    return is_ready(POLLOUT) ? ::send(socket_, from, size, MSG_NOSIGNAL) : -1;
  }
  void get_remote_ip_and_port(std::string& ip, int& port) const override { no_one(ip, port); }
  void get_local_ip_and_port(std::string& ip, int& port) const override { no_one(ip, port); }
  socket_t socket() const override { return socket_; }

 private:
  static void no_one(std::string& ip, int& port) {
    ip = "127.0.0.1";
    port = 0;
  }
  [[nodiscard]] bool is_ready(short what) const {
    pollfd one{socket_, what, 0};
    return ::poll(&one, 1, 1000 * kSilentSeconds) > 0;
  }
  int socket_;
  std::string bytes_;
  std::size_t at_ = 0;
};

/// httplib's server accepts connections and answers requests; what comes between is ours.
class PatientServer : public httplib::Server {
 public:
  PatientServer() {
    new_task_queue = [this] { return new AtOnce(connections_); };
  }

 private:
  /// Of httplib's tasks, each is a socket that is given to process_and_close_socket() below.
  struct AtOnce : httplib::TaskQueue {
    explicit AtOnce(Connections& connections) : all(connections) {}
    void enqueue(std::function<void()> task) override { task(); }
    void shutdown() override { all.end(); }
    Connections& all;
  };
  bool process_and_close_socket(socket_t socket) override {
    connections_.add(socket);
    return true;
  }

  Connections connections_{[this](int socket, std::string begun) {
    ReplayedStream stream(socket, std::move(begun));
    bool closed = false;
    process_request(stream, true, closed, nullptr);
  }};
};

const httplib::Headers kSafeHeaders = {
    {"Content-Security-Policy",
     "default-src 'self'; script-src 'self' 'wasm-unsafe-eval'; style-src 'self'; img-src 'self' "
     "blob: data:; media-src 'self' blob:; worker-src 'self' blob:; connect-src 'self' blob: "
     "data:; frame-src 'self'; object-src 'none'; base-uri 'none'; form-action 'none'; "
     "frame-ancestors 'self'"},
    {"X-Content-Type-Options", "nosniff"},
    {"Referrer-Policy", "no-referrer"},
    {"Cross-Origin-Opener-Policy", "same-origin"},
    {"Cross-Origin-Resource-Policy", "same-origin"},
    {"Permissions-Policy", "camera=(self), microphone=(), geolocation=()"},
    {"Cache-Control", "no-store"}};

std::string type_of(const std::string& path) {
  static const std::map<std::string, std::string> kTypes = {
      {".html", "text/html; charset=utf-8"},
      {".css", "text/css; charset=utf-8"},
      {".js", "text/javascript"},
      {".mjs", "text/javascript"},
      {".json", "application/json"},
      {".svg", "image/svg+xml"},
      {".png", "image/png"},
      {".jpg", "image/jpeg"},
      {".jpeg", "image/jpeg"},
      {".webp", "image/webp"},
      {".wasm", "application/wasm"},
      {".woff2", "font/woff2"},
      {".mp4", "video/mp4"},
      {".webm", "video/webm"},
      {".zip", "application/zip"},
      {".webmanifest", "application/manifest+json"}};
  const auto found = kTypes.find(fs::path(path).extension().string());
  return found == kTypes.end() ? "application/octet-stream" : found->second;
}

void send(const Answer& answer, httplib::Response& response) {
  response.status = answer.status;
  for (const auto& [name, value] : answer.headers) response.set_header(name.c_str(), value);
  if (answer.file.empty()) {
    response.set_content(answer.body, answer.type.c_str());
    return;
  }
  auto file = MappedFile::open(answer.file);
  if (!file) return send(answer_of(file.error()), response);
  const auto held = std::make_shared<MappedFile>(std::move(*file));
  response.set_content_provider(
      held->bytes().size(), answer.type.c_str(),
      [held](std::size_t offset, std::size_t length, httplib::DataSink& sink) {
        const auto* bytes = reinterpret_cast<const char*>(held->bytes().data());
        return sink.write(bytes + offset, std::min<std::size_t>(length, 1u << 16)) &&
               held->intact().has_value();
      });
}

/// A file that is removed unless it is taken.
class Incoming {
 public:
  explicit Incoming(const std::string& folder) : path_(folder + "/incoming-XXXXXX") {
    descriptor_ = ::mkostemp(path_.data(), O_CLOEXEC);
  }
  Incoming(const Incoming&) = delete;
  Incoming& operator=(const Incoming&) = delete;
  ~Incoming() {
    if (descriptor_ < 0) return;
    ::close(descriptor_);
    ::unlink(path_.c_str());
  }
  [[nodiscard]] bool open() const { return descriptor_ >= 0; }
  [[nodiscard]] const std::string& path() const { return path_; }
  /// Errors: kUsage "studio.too-large", kIo "io.write".
  Result<void> add(const char* data, std::size_t size) {
    bytes_ += size;
    if (bytes_ > kMostUploadBytes) {
      return fail(ExitCode::kUsage, "studio.too-large", "", "the file is larger than 2 GiB",
                  "make it smaller, or copy it into the project's folder yourself");
    }
    while (size > 0) {
      const ssize_t written = ::write(descriptor_, data, size);
      if (written < 0 && errno == EINTR) continue;
      if (written < 0) {
        return fail(ExitCode::kIo, "io.write", "",
                    std::string("cannot write: ") + std::strerror(errno), cure_of_writing(errno));
      }
      data += written;
      size -= static_cast<std::size_t>(written);
    }
    return {};
  }

 private:
  std::string path_;
  int descriptor_ = -1;
  std::uint64_t bytes_ = 0;
};

}  // namespace

struct StudioServer::Parts {
  ServerOptions options;
  Handler handler;
  Events* events = nullptr;
  PatientServer server;
  std::string secret;
  std::string host;  // "127.0.0.1:PORT"
  std::atomic<int> listeners{0};
  std::atomic<int> bodies{0};  ///< that are being read
  std::atomic<bool> stopped{false};
  std::atomic<bool> serving{false};  ///< serve() has begun
  std::atomic<bool> over{false};     ///< and has ended
  std::mutex mutex;
  std::set<std::string> openings;  // unused ones

  /// Whether the request comes from our page, or opens it.
  [[nodiscard]] bool is_ours(const httplib::Request& request) const {
    if (request.get_header_value_count("Host") != 1 || request.get_header_value("Host") != host) {
      return false;
    }
    if (request.has_header("Origin") && request.get_header_value("Origin") != "http://" + host) {
      return false;
    }
    const std::string site = request.get_header_value("Sec-Fetch-Site");
    return site.empty() || site == "same-origin" || site == "none";
  }

  [[nodiscard]] bool has_secret(const httplib::Request& request) const {
    const std::string start = "/" + secret + "/";
    return request.path.size() >= start.size() &&
           same_text(std::string_view(request.path).substr(0, start.size()), start);
  }

  /// A new address for it.
  std::string open_once() {
    const auto word = make_secret();
    if (!word) return "http://" + host + "/" + secret + "/";
    const std::lock_guard lock(mutex);
    openings.insert(*word);
    return "http://" + host + "/open-" + *word;
  }

  /// Leads to the page, once.
  bool opens(const httplib::Request& request, httplib::Response& response) {
    const std::lock_guard lock(mutex);
    if (request.method != "GET" || !request.path.starts_with("/open-") ||
        openings.erase(request.path.substr(6)) == 0) {
      return false;
    }
    response.status = 303;
    response.set_header("Location", "/" + secret + "/");
    return true;
  }

  httplib::Server::HandlerResponse gate(const httplib::Request& request,
                                        httplib::Response& response) {
    using Handled = httplib::Server::HandlerResponse;
    const auto refuse = [&](int status) {
      response.status = status;
      response.set_content("the address is not complete: open the one that the studio has shown\n",
                           "text/plain");
      return Handled::Handled;
    };
    if (request.path.size() > kMostPathBytes) return refuse(414);
    if (!is_ours(request)) return refuse(403);
    if (opens(request, response)) return Handled::Handled;
    if (!has_secret(request)) return refuse(403);
    for (const char* known : {"GET", "HEAD", "POST", "PUT", "DELETE"}) {
      if (request.method == known) return Handled::Unhandled;
    }
    return refuse(405);
  }

  [[nodiscard]] Call call_of(const httplib::Request& request) const {
    Call call;
    call.method = request.method == "HEAD" ? "GET" : request.method;
    call.path = request.path.substr(secret.size() + 2);
    for (const auto& [name, value] : request.params) call.query.emplace(name, value);
    return call;
  }

  void get(const httplib::Request& request, httplib::Response& response) {
    const Call call = call_of(request);
    if (call.path == "api/events") return listen(request, response);
    if (call.path == "api/opening") {
      return response.set_content(open_once(), "text/plain");
    }
    if (call.path.starts_with("api/")) return send(handler(call), response);
    std::string folder = options.page;
    std::string name = call.path.empty() ? "index.html" : call.path;
    if (name.starts_with("engine/")) {
      folder = options.engine;
      name.erase(0, 7);
      if (folder.empty()) {
        return send(answer_of(Error{ExitCode::kUnsupported, "web.page", call.path,
                                    "the page's engine was not built",
                                    "cmake --preset web && cmake --build --preset web"}),
                    response);
      }
    }
    const auto file = file_inside(folder, name);
    if (!file) return send(answer_of(file.error()), response);
    Answer answer;
    answer.type = type_of(*file);
    answer.file = *file;
    send(answer, response);
  }

  void post(const httplib::Request& request, httplib::Response& response,
            const httplib::ContentReader& read) {
    Call call = call_of(request);
    // A form of another page cannot have this type.
    if (!request.get_header_value("Content-Type").starts_with("application/json")) {
      return send(answer_of(Error{ExitCode::kUsage, "studio.request", call.path,
                                  "the request is not JSON", "reload the page"}),
                  response);
    }
    bool whole = true;
    read([&](const char* data, std::size_t size) {
      whole = call.body.size() + size <= kMostPostBytes;
      if (whole) call.body.append(data, size);
      return whole;
    });
    if (!whole) {
      return send(answer_of(Error{ExitCode::kUsage, "studio.too-large", call.path,
                                  "the request is too large", "reload the page"}),
                  response);
    }
    send(handler(call), response);
  }

  void put(const httplib::Request& request, httplib::Response& response,
           const httplib::ContentReader& read) {
    Call call = call_of(request);
    Incoming file(options.incoming);
    if (!file.open()) {
      return send(answer_of(Error{ExitCode::kIo, "io.write", options.incoming,
                                  std::string("the file cannot be saved: ") + std::strerror(errno),
                                  cure_of_writing(errno)}),
                  response);
    }
    Result<void> kept;
    const bool whole = read([&](const char* data, std::size_t size) {
      kept = file.add(data, size);
      return kept.has_value();
    });
    if (!kept) return send(answer_of(kept.error()), response);
    if (!whole) return;  // httplib's own answer stands
    call.upload = file.path();
    send(handler(call), response);
  }

  using TakeBody = void (Parts::*)(const httplib::Request&, httplib::Response&,
                                   const httplib::ContentReader&);
  /// So that bodies that come slowly leave threads for others.
  httplib::Server::HandlerWithContentReader bounded(TakeBody take) {
    return [this, take](const auto& request, auto& response, const auto& read) {
      const auto left = std::shared_ptr<void>(nullptr, [this](void*) { --bodies; });
      const std::string length = request.get_header_value("Content-Length");
      const bool small =
          !length.empty() && std::strtoull(length.c_str(), nullptr, 10) <= kSmallBody;
      if (++bodies <= kMostBodies || small) return (this->*take)(request, response, read);
      send(answer_of(Error{ExitCode::kIo, "studio.unavailable", "", "too many files are being sent",
                           "wait for them"}),
           response);
    };
  }

  void listen(const httplib::Request& request, httplib::Response& response) {
    if (++listeners > kMostListeners) {
      --listeners;
      return send(answer_of(Error{ExitCode::kIo, "studio.unavailable", "",
                                  "too many pages of this studio are open", "close some"}),
                  response);
    }
    const auto left = std::shared_ptr<void>(nullptr, [this](void*) { --listeners; });
    const std::string since = request.get_header_value("Last-Event-ID");
    std::uint64_t number =
        since.empty() ? events->last() : std::strtoull(since.c_str(), nullptr, 10);
    if (number > events->last()) number = 0;
    response.set_chunked_content_provider(
        "text/event-stream", [this, left, number](std::size_t, httplib::DataSink& sink) mutable {
          if (events->closed()) return false;
          std::string text = ":\n\n";
          for (const Event& event : events->wait(number, kBeat)) {
            text += "id: " + std::to_string(event.number) + "\nevent: " + event.name +
                    "\ndata: " + event.data + "\n\n";
            number = event.number;
          }
          return sink.write(text.data(), text.size());
        });
  }

  void route() {
    server.set_default_headers(kSafeHeaders);
    server.set_payload_max_length(kMostUploadBytes);
    server.set_tcp_nodelay(true);
    server.set_pre_routing_handler(
        [this](const auto& request, auto& response) { return gate(request, response); });
    server.Get("/.*", [this](const auto& request, auto& response) { get(request, response); });
    server.Delete("/.*", [this](const httplib::Request& request, httplib::Response& response) {
      send(handler(call_of(request)), response);
    });
    server.Post("/.*", bounded(&Parts::post));
    server.Put("/.*", bounded(&Parts::put));
    server.set_exception_handler([](const auto&, auto& response, const std::exception_ptr&) {
      send(answer_of(Error{ExitCode::kInternal, "modar.bug", "", "the request failed",
                           "internal error: please report it with what you did"}),
           response);
    });
  }
};

Result<std::string> ask_opening(const std::string& address) {
  constexpr std::string_view kScheme = "http://";
  const std::size_t path = address.find('/', kScheme.size());
  httplib::Client client(address.substr(0, path));
  client.set_connection_timeout(kSilentSeconds);
  client.set_read_timeout(kSilentSeconds);
  const auto answer = client.Get((address.substr(path) + "api/opening").c_str());
  if (answer && answer->status == 200) return answer->body;
  return fail(ExitCode::kIo, "studio.locked", "", "another studio has this folder open",
              "use its page, or end it first");
}

StudioServer::StudioServer(std::unique_ptr<Parts> parts) : parts_(std::move(parts)) {}
StudioServer::~StudioServer() = default;

Result<std::unique_ptr<StudioServer>> StudioServer::open(const ServerOptions& options,
                                                         Handler handler, Events& events) {
  auto parts = std::make_unique<Parts>();
  parts->options = options;
  parts->handler = std::move(handler);
  parts->events = &events;
  MODAR_ASSIGN(parts->secret, make_secret());
  parts->route();
  int port = options.port;
  if (port == 0) {
    port = parts->server.bind_to_any_port("127.0.0.1");
  } else if (!parts->server.bind_to_port("127.0.0.1", port)) {
    port = -1;
  }
  if (port < 0) {
    return fail(ExitCode::kIo, "studio.port", "port " + std::to_string(options.port),
                "the server does not start", "leave --port out: any free port will do");
  }
  parts->host = "127.0.0.1:" + std::to_string(port);
  return std::unique_ptr<StudioServer>(new StudioServer(std::move(parts)));
}

std::string StudioServer::address() const {
  return "http://" + parts_->host + "/" + parts_->secret + "/";
}

std::string StudioServer::opening_address() {
  return parts_->open_once();
}

void StudioServer::serve() {
  parts_->serving = true;
  if (!parts_->stopped) parts_->server.listen_after_bind();
  parts_->over = true;
}

void StudioServer::stop() {
  parts_->stopped = true;
  parts_->events->close();
  // A server that is about to listen would not hear it.
  while (parts_->serving && !parts_->over && !parts_->server.is_running()) {
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  parts_->server.stop();
}

}  // namespace modar
