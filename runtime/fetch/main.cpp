// modar-fetch: installs releases on the device.
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cinttypes>
#include <cstdio>
#include <ctime>
#include <span>

#include "formats/base/atomic_file.hpp"
#include "formats/base/file_kind.hpp"
#include "formats/json_writer.hpp"
#include "modar/fetch.hpp"
#include "modar/mapped_file.hpp"
#include "modar/release.hpp"
#include "runtime/platform/command_line.hpp"
#include "store.hpp"

#ifndef MODAR_VERSION
#error "CMake defines MODAR_VERSION"
#endif

namespace modar::fetch {
namespace {

constexpr const char* kHelp = R"(modar-fetch: installs the newest release of bundles on this device

Usage:
  modar-fetch URL --store DIR --trust K.pub [OPTION]...
  modar-fetch --store DIR --verify

URL is http(s)://HOST/PATH or a folder (a USB stick) that `modar ship publish` filled. The installed
bundles are DIR/NAME.modar. If a fetch is interrupted, the release in use stays intact, and the next run
resumes the download. A new bundle can be shown early: its coarse models come first, as the bundle
DIR/pieces/NAME.first, which is named when it is there and removed when the release is installed.
DIR must be on a file system that supports file locks; if it has no symbolic links (FAT, /sdcard), the
bundles are DIR/slots/*/NAME.modar, and these paths are printed.

  --store DIR       folder for installed releases; created if it is missing
  --trust K.pub     the publisher's public key, from `modar ship keygen`
  --device NAME     install bundles for this device profile only
  --bundle NAME     install this bundle only; repeatable
  --parallel N      simultaneous downloads, 1 to 32 (default: 4)
  --limit-rate N    bytes per second at most, such as 16k or 1M
  --attempts N      give up after this many attempts in a row without any data (default: 8)
  --cacert FILE     certificate authorities for HTTPS, PEM (default: those of CURL_CA_BUNDLE,
                    SSL_CERT_FILE and SSL_CERT_DIR, else the system's). Proxies as for curl:
                    https_proxy, no_proxy
  --status FILE     write the result as JSON, also after a failure, for monitoring
  --verify          check the installed release; fall back to the one before if it is damaged
  --json            print the result as JSON
  --quiet           no progress or summary
  --help, --version

Example:
  modar-fetch http://museum.example/ar --store /sdcard/modar --trust museum.pub

Exit codes: 0 ok, 1 wrong usage, 2 a file cannot be read or written, 3 invalid input, 4 internal error,
5 nothing for this device or this version; 10 not signed by the trusted key, 11 older than the installed
release, 12 expired, 13 the server's files belong to different releases, 14 not enough free space,
15 another fetch is running, 16 the network failed (run it again), 17 the new bundle is invalid.
)";

// --- Command line ---

struct CommandLine {
  FetchOptions options;
  std::string trust_file;
  std::string status_file;  ///< empty: none
  bool verify = false;      ///< only check the installed release
  bool json = false;
  bool quiet = false;
  bool help = false;
  bool version = false;
};

struct Option {
  CommandOption syntax;
  bool (*set)(CommandLine&, std::string_view);
};

bool set_parallel(CommandLine& line, std::string_view value) {
  line.options.parallel = static_cast<unsigned>(parse_count(value, 32));
  return line.options.parallel != 0;
}

/// "2000", "16k", "1M": bytes.
bool set_rate(CommandLine& line, std::string_view value) {
  std::uint64_t unit = 1;
  if (value.ends_with('k') || value.ends_with('K')) unit = 1000;
  if (value.ends_with('M')) unit = 1000000;
  if (unit != 1) value.remove_suffix(1);
  line.options.bytes_per_second = unit * parse_count(value, 1000000000u);
  return line.options.bytes_per_second != 0;
}

bool set_attempts(CommandLine& line, std::string_view value) {
  line.options.attempts = static_cast<unsigned>(parse_count(value, 1000));
  return line.options.attempts != 0;
}

template <bool CommandLine::*Member>
bool set_switch(CommandLine& line, std::string_view) {
  return line.*Member = true;
}

template <std::string FetchOptions::*Member>
bool set_text(CommandLine& line, std::string_view value) {
  line.options.*Member = value;
  return true;
}

bool set_status(CommandLine& line, std::string_view value) {
  line.status_file = value;
  return true;
}

bool set_trust(CommandLine& line, std::string_view value) {
  line.trust_file = value;
  return true;
}

bool add_bundle(CommandLine& line, std::string_view value) {
  line.options.bundles.emplace_back(value);
  return true;
}

constexpr std::array<Option, 14> kOptions = {{
    {{"store", "a folder"}, set_text<&FetchOptions::store>},
    {{"trust", "a file"}, set_trust},
    {{"device", "a name"}, set_text<&FetchOptions::device>},
    {{"bundle", "a name"}, add_bundle},
    {{"parallel", "a number from 1 to 32"}, set_parallel},
    {{"limit-rate", "a number of bytes like 2000, 16k or 1M"}, set_rate},
    {{"attempts", "a number from 1 to 1000"}, set_attempts},
    {{"cacert", "a file"}, set_text<&FetchOptions::authorities>},
    {{"status", "a file"}, set_status},
    {{"verify"}, set_switch<&CommandLine::verify>},
    {{"json"}, set_switch<&CommandLine::json>},
    {{"quiet"}, set_switch<&CommandLine::quiet>},
    {{"help"}, set_switch<&CommandLine::help>},
    {{"version"}, set_switch<&CommandLine::version>},
}};

tl::unexpected<Error> usage(const char* code, std::string where, std::string cause) {
  return fail(ExitCode::kUsage, code, std::move(where), std::move(cause), "see modar-fetch --help");
}

/// Errors: kUsage "cli.*".
Result<CommandLine> read_command_line(std::span<const char* const> arguments) {
  std::vector<CommandOption> syntax;
  for (const Option& option : kOptions) syntax.push_back(option.syntax);
  CommandLine line;
  MODAR_ASSIGN(const auto urls,
               parse_command_line(arguments, {"cli", "see modar-fetch --help", syntax},
                                  [&](std::size_t index, std::string_view value) {
                                    return kOptions[index].set(line, value);
                                  }));
  if (line.help || line.version) return line;
  if (urls.size() > 1) return usage("cli.url", urls[1], "only one URL is allowed");
  if (!urls.empty()) line.options.url = urls.front();
  if (line.options.store.empty()) return usage("cli.store", "--store", "it is missing");
  if (line.verify) return line;
  if (line.options.url.empty()) return usage("cli.url", "URL", "it is missing");
  if (line.trust_file.empty()) return usage("cli.trust", "--trust", "it is missing");
  return line;
}

// --- Program ---

constexpr std::size_t kMaxKeyBytes = 4096;

int answer(const Error& error) {
  std::fprintf(stderr, "modar-fetch: %s\n", to_line(error).c_str());
  return static_cast<int>(error.exit);
}

void show_progress(const FetchProgress& progress) {
  const double total = std::max(1.0, static_cast<double>(progress.bytes_total));
  const double part = static_cast<double>(progress.bytes_done) / total;
  std::fprintf(stderr, "\r\033[K%3.0f %%  %.1f of %.1f kB", 100 * part,
               static_cast<double>(progress.bytes_done) / 1000, total / 1000);
  if (progress.seconds_left >= 0) std::fprintf(stderr, "  %.0f s left", progress.seconds_left);
  std::fflush(stderr);
}

/// Short waits pass unsaid, and several files that wait for the same server are one line.
class WaitPrinter {
 public:
  void operator()(const FetchWait& wait) {
    constexpr double kWorthSaying = 1;  // seconds
    if (wait.seconds < kWorthSaying || (wait.cause == cause_ && wait.attempt <= attempt_)) return;
    cause_ = wait.cause;
    attempt_ = wait.attempt;
    const char* clear = ::isatty(STDERR_FILENO) != 0 ? "\r\033[K" : "";
    std::fprintf(stderr, "%smodar-fetch: %s: %s; attempt %u of %u in %.0f s\n", clear,
                 wait.address.c_str(), wait.cause.c_str(), wait.attempt, wait.attempts,
                 wait.seconds);
  }

 private:
  std::string cause_;
  unsigned attempt_ = 0;
};

void write_paths(JsonWriter& json, const char* key, const std::vector<std::string>& bundles) {
  json.array(key, [&] {
    for (const std::string& bundle : bundles) json.add(bundle);
  });
}

void print_json(const FetchReport& report) {
  JsonWriter json(4);
  json.object([&] {
    json.put("epoch", report.epoch);
    json.put("version", report.version);
    json.put("expires", time_text(report.expires));
    json.put("changed", report.changed);
    write_paths(json, "bundles", report.bundles);
    json.put("downloaded_bytes", report.downloaded_bytes);
    json.put("downloaded_pieces", report.downloaded_pieces);
    json.put("reused_bytes", report.reused_bytes);
    json.put("reused_pieces", report.reused_pieces);
    json.put("retries", report.retries);
    json.put("corrupt_pieces", report.corrupt_pieces);
  });
  std::puts(json.str().c_str());
}

/// What the operator of many devices collects. The keys are a contract (formats/shipping.md).
struct Status {
  const Error* error = nullptr;
  std::string result = "ok";  ///< unless there is an error
  std::uint64_t version = 0;  ///< of the release in use
  bool changed = false;
  std::vector<std::string> bundles;
};

void write_status(const CommandLine& line, const Status& status) {
  if (line.status_file.empty()) return;
  const Error* error = status.error;
  JsonWriter json(4);
  json.object([&] {
    json.put("program", "modar-fetch " MODAR_VERSION);
    json.put("time", time_text(std::time(nullptr)));
    json.put("action", line.verify ? "verify" : "fetch");
    json.put("result", error == nullptr ? status.result : error->code);
    json.put("exit_code", error == nullptr ? 0 : static_cast<int>(error->exit));
    json.put("message", error == nullptr ? "" : to_line(*error));
    json.put("version", status.version);
    json.put("changed", status.changed);
    write_paths(json, "bundles", status.bundles);
    write_paths(json, "first", previews(line.options.store));
  });
  const std::string text = json.str() + "\n";
  if (auto written = write_file(line.status_file, std::string_view(text)); !written) {
    answer(written.error());
  }
}

/// The release in use during the fetch, or after it failed.
Status installed_status(const CommandLine& line) {
  Status status;
  if (auto installed = installed_release(line.options.store)) {
    status.version = installed->version;
    status.bundles = std::move(installed->bundles);
  }
  return status;
}

/// The rest of the release is yet to come.
void report_first(const CommandLine& line, const std::string& path) {
  Status status = installed_status(line);
  status.result = "first";
  write_status(line, status);
  if (line.quiet) return;
  std::fprintf(stderr, "%smodar-fetch: %s can be shown; the rest follows\n",
               ::isatty(STDERR_FILENO) != 0 ? "\r\033[K" : "", path.c_str());
}

/// Only a status of an earlier run is written over.
Result<void> keep_no_status(const std::string& path) {
  constexpr std::size_t kMaxStatusBytes = 1u << 20;
  struct stat info {};
  if (path.empty() || ::stat(path.c_str(), &info) != 0 || !S_ISREG(info.st_mode)) return {};
  const auto text = read_small_file(path, kMaxStatusBytes);
  const auto first_value = [&text] { return text->substr(0, text->find(',')); };
  if (text && (text->empty() || (text->starts_with('{') &&
                                 first_value().find("\"modar-fetch ") != std::string::npos))) {
    return {};
  }
  return fail(ExitCode::kUsage, "out.foreign", path,
              "the output would overwrite a file that is not a status of modar-fetch",
              "name another output");
}

int fail_with_status(const CommandLine& line, const Error& error) {
  Status status = installed_status(line);  // the installed release stays in use
  status.error = &error;
  write_status(line, status);
  return answer(error);
}

int run_verify(const CommandLine& line) {
  const auto report = verify_store(line.options.store);
  if (!report) return fail_with_status(line, report.error());
  write_status(line, {nullptr, "ok", report->version, report->fell_back, report->bundles});
  if (line.json) {
    JsonWriter json(4);
    json.object([&] {
      json.put("version", report->version);
      json.put("fell_back", report->fell_back);
      write_paths(json, "bundles", report->bundles);
    });
    std::puts(json.str().c_str());
  } else if (!line.quiet) {
    std::fprintf(stderr, "release %" PRIu64 " is good%s\n", report->version,
                 report->fell_back ? "; the one after it was damaged and is no longer used" : "");
    for (const std::string& bundle : report->bundles) std::puts(bundle.c_str());
  }
  return 0;
}

/// The text of a file with the keys of --trust.
Result<std::string> read_trust(const std::string& path) {
  MODAR_ASSIGN(const MappedFile file, MappedFile::open(path));
  const std::string_view bytes(reinterpret_cast<const char*>(file.bytes().data()),
                               std::min(file.bytes().size(), kMaxKeyBytes));
  if (const FileSignature* const found = find_signature(bytes)) {
    return fail(ExitCode::kInvalidInput, "key.public", path,
                wrong_kind(found->kind, found->format, "key"),
                "give the publisher's public key, the file K.pub of `modar ship keygen`");
  }
  if (auto trusted = parse_root_set(bytes); !trusted) {
    trusted.error().where = path;
    return tl::unexpected(trusted.error());
  }
  return std::string(bytes);
}

int run_fetch(CommandLine& line) {
  const auto key = read_trust(line.trust_file);
  if (!key) return answer(key.error());
  line.options.trusted_key = *key;
  const bool bar = !line.quiet && !line.json && ::isatty(STDERR_FILENO) != 0;
  if (bar) line.options.progress = show_progress;
  if (!line.quiet) line.options.waiting = WaitPrinter();
  line.options.first = [&line](const std::string& path) { report_first(line, path); };
  const auto report = fetch_release(line.options);
  if (bar) std::fputs("\r\033[K", stderr);
  if (!report) return fail_with_status(line, report.error());
  write_status(line, {nullptr, "ok", report->version, report->changed, report->bundles});
  for (const std::string& path : report->blocked) {
    std::fprintf(
        stderr, "modar-fetch: %s was not written by modar-fetch and is kept; see the paths below\n",
        path.c_str());
  }
  if (line.json) {
    print_json(*report);
  } else if (!line.quiet) {
    std::fprintf(stderr, "release %" PRIu64 " %s: %.1f kB downloaded, %.1f kB reused\n",
                 report->version, report->changed ? "is installed" : "was installed already",
                 static_cast<double>(report->downloaded_bytes) / 1000,
                 static_cast<double>(report->reused_bytes) / 1000);
    for (const std::string& bundle : report->bundles) std::puts(bundle.c_str());
  }
  return 0;
}

}  // namespace
}  // namespace modar::fetch

int main(int argc, char** argv) {
  using namespace modar;
  using namespace modar::fetch;
  guard_mapped_files();
  auto line = read_command_line(std::span(argv, static_cast<std::size_t>(argc)).subspan(1));
  if (!line) return answer(line.error());
  if (line->help || line->version) {
    std::fputs(line->help ? kHelp : "modar-fetch " MODAR_VERSION "\n", stdout);
    return 0;
  }
  if (auto kept = keep_no_status(line->status_file); !kept) return answer(kept.error());
  const int code = line->verify ? run_verify(*line) : run_fetch(*line);
  if (std::fflush(stdout) == 0 && std::ferror(stdout) == 0) return code;
  const int told = answer({ExitCode::kIo, "io.stdout", "standard output",
                           "the result could not be printed", "free space at its destination"});
  return code == 0 ? told : code;
}
