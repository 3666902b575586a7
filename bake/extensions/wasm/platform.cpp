// What `modar` asks of the system, through Node: memory and processes. What Node lacks says so.
#include <cstdlib>
#include <new>

#include "bake/extensions/web/serve.hpp"
#include "bake/json.hpp"
#include "bake/memory/array.hpp"
#include "bake/memory/memory_limit.hpp"
#include "bake/process/process.hpp"
#include "bake/project/interrupts.hpp"
#include "bake/ship/http/http_reader.hpp"
#include "bake/video/video.hpp"

// Of node.js. words, variables: pointers with a null one behind them; no variables: ours. Answers
// the exit code, or -1 where the program could not be started.
extern "C" int modar_node_run(const void* words, const void* variables, const char* output);
/// To be freed by the caller.
extern "C" char* modar_node_folder();
/// {"folder", "bind", "port"}. Answers {"urls", "code"}, or {"error"}, to be freed by the caller.
extern "C" char* modar_node_serve_site(const char* options);
/// Until the process is ended.
extern "C" void modar_node_wait();

namespace modar {
namespace {

std::vector<const char*> pointers(const std::vector<std::string>& words) {
  std::vector<const char*> list;
  for (const std::string& word : words) list.push_back(word.c_str());
  list.push_back(nullptr);
  return list;
}

constexpr const char* kNative = "Debian's packages of ModAR can";

}  // namespace

// ---- memory: one heap, whose pages cannot be remapped ----

void detail::out_of_memory() {
  throw std::bad_alloc();
}

void* detail::resize_block(void* block, std::size_t, std::size_t size) {
  void* const result = std::realloc(block, size);
  if (result == nullptr && size != 0) out_of_memory();
  return result;
}

void detail::touch_pages(void*, std::size_t, std::size_t, std::size_t) {}

void detail::free_block(void* block, std::size_t) {
  std::free(block);
}

struct MemoryLimit::Watch {};

MemoryLimit::~MemoryLimit() = default;

Result<std::unique_ptr<MemoryLimit>> MemoryLimit::start(const std::string&, std::uint64_t) {
  return fail(ExitCode::kUnsupported, "memory.node", "--memory",
              "under Node, memory is 4 GB at most and cannot move to files",
              std::string("leave it out and, for a large model, bake with --tier; ") + kNative);
}

// ---- processes ----

ProcessOutcome run_measured(const ProcessRequest& request) {
  ProcessOutcome outcome;
  outcome.exit = modar_node_run(pointers(request.words).data(),
                                pointers(request.environment).data(), request.output.c_str());
  return outcome;
}

std::string program_folder() {
  const std::unique_ptr<char, decltype(&std::free)> text(modar_node_folder(), std::free);
  return text.get();
}

/// Node ends the program on a signal by itself.
struct Interrupts::Watch {
  std::mutex writing;
};

Interrupts::Interrupts() : watch_(std::make_unique<Watch>()) {}

Interrupts::~Interrupts() = default;

std::unique_lock<std::mutex> Interrupts::writing() {
  return std::unique_lock(watch_->writing);
}

// ---- the server ----

namespace {

std::string served_code;  ///< of the first address

}  // namespace

Result<void> serve_site(const ServeOptions& options,
                        const std::function<void(const std::vector<std::string>&)>& ready) {
  const Json asked = {{"folder", options.folder}, {"bind", options.bind}, {"port", options.port}};
  const std::unique_ptr<char, decltype(&std::free)> answer(
      modar_node_serve_site(asked.dump().c_str()), std::free);
  const Json told = Json::parse(answer.get());
  if (const auto error = told.find("error")) {
    return fail(ExitCode::kIo, "web.port", options.bind + ":" + std::to_string(options.port),
                error->text().value_or(""), "name another address or port: --bind, --port");
  }
  served_code = told.find("code").value_or("").text().value_or("");
  std::vector<std::string> urls;
  const Json list = told.find("urls").value_or(Json::array());
  for (std::size_t i = 0; i < list.size(); ++i) urls.push_back(list.at(i)->text().value_or(""));
  ready(urls);
  modar_node_wait();
  return {};
}

std::string qr_code(const std::string&) {
  return served_code;
}

// ---- missing ----

bool is_web_address(const std::string& text) {
  return text.starts_with("http://") || text.starts_with("https://");
}

Result<std::function<Result<std::optional<std::string>>(const std::string& path, std::size_t)>>
web_reader(const std::string& address) {
  return fail(ExitCode::kUnsupported, "http.node", address, "under Node, modar reads folders alone",
              std::string("download it and name its folder; ") + kNative);
}

Result<Video> Video::open(const std::string& path) {
  return fail(ExitCode::kUnsupported, "video.node", path,
              "under Node, modar reads the frames of no video",
              std::string("hand it pictures of the frames; ") + kNative);
}

std::optional<GrayImage> Video::next() {
  return std::nullopt;
}

std::string qr_svg(const std::string&) {
  return {};
}

}  // namespace modar
