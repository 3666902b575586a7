// modar-fetch: installs releases on the device.
#include <unistd.h>

#include <cinttypes>
#include <cstdio>

#include <rapidjson/prettywriter.h>

#include "fetch_options.hpp"
#include "files.hpp"

#ifndef MODAR_VERSION
#error "CMake defines MODAR_VERSION"
#endif

namespace modar::fetch {
namespace {

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

using Writer = rapidjson::PrettyWriter<rapidjson::StringBuffer>;

void write_bundles(Writer& json, const std::vector<std::string>& bundles) {
  json.Key("bundles");
  json.StartArray();
  for (const std::string& bundle : bundles) json.String(bundle.c_str());
  json.EndArray();
}

void print_json(const FetchReport& report) {
  rapidjson::StringBuffer buffer;
  Writer json(buffer);
  json.StartObject();
  const auto put = [&](const char* key, std::uint64_t value) {
    json.Key(key);
    json.Uint64(value);
  };
  put("version", report.version);
  json.Key("changed");
  json.Bool(report.changed);
  write_bundles(json, report.bundles);
  put("downloaded_bytes", report.downloaded_bytes);
  put("downloaded_pieces", report.downloaded_pieces);
  put("reused_bytes", report.reused_bytes);
  put("reused_pieces", report.reused_pieces);
  put("retries", report.retries);
  put("corrupt_pieces", report.corrupt_pieces);
  json.EndObject();
  std::puts(buffer.GetString());
}

int run_verify(const CommandLine& line) {
  const auto report = verify_store(line.options.store);
  if (!report) return answer(report.error());
  if (line.json) {
    rapidjson::StringBuffer buffer;
    Writer json(buffer);
    json.StartObject();
    json.Key("version");
    json.Uint64(report->version);
    json.Key("fell_back");
    json.Bool(report->fell_back);
    write_bundles(json, report->bundles);
    json.EndObject();
    std::puts(buffer.GetString());
  } else if (!line.quiet) {
    std::fprintf(stderr, "release %" PRIu64 " is good%s\n", report->version,
                 report->fell_back ? "; the one after it was damaged and is no longer used" : "");
    for (const std::string& bundle : report->bundles) std::puts(bundle.c_str());
  }
  return 0;
}

int run_fetch(CommandLine& line) {
  const auto key = read_small_file(line.trust_file, kMaxKeyBytes);
  if (!key) {
    return answer({ExitCode::kIo, "io.open", line.trust_file, "it cannot be read",
                   "give the publisher's public key with --trust"});
  }
  line.options.trusted_key = *key;
  const bool bar = !line.quiet && !line.json && ::isatty(STDERR_FILENO) != 0;
  if (bar) line.options.progress = show_progress;
  const auto report = fetch_release(line.options);
  if (bar) std::fputs("\r\033[K", stderr);
  if (!report) return answer(report.error());
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
  auto line = parse_command_line(argc, argv);
  if (!line) return answer(line.error());
  if (line->help || line->version) {
    std::fputs(line->help ? help_text() : "modar-fetch " MODAR_VERSION "\n", stdout);
    return 0;
  }
  return line->verify ? run_verify(*line) : run_fetch(*line);
}
