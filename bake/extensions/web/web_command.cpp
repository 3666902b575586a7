// `modar web`: a page for browsers from bundles, and a server to try it on a phone.
#include <cstdio>
#include <memory>

#include "bake/commands/commands.hpp"
#include "bake/extensions/web/serve.hpp"
#include "bake/extensions/web/site.hpp"
#include "bake/io/terminal.hpp"
#include "bake/json.hpp"
#include "bake/ship/http/http_reader.hpp"
#include "bake/ship/verify_release.hpp"
#include "formats/base/utf8.hpp"
#include "modar/mapped_file.hpp"

namespace modar {
namespace {

struct WebCommand {
  SiteOptions options;
  bool serve = false;
  std::string bind = "0.0.0.0";
  int port = 8443;
  bool quiet = false;
  bool json = false;
};

void print_addresses(const WebCommand& command, const std::vector<std::string>& urls) {
  for (const std::string& url : urls) std::printf("%s\n", url.c_str());
  std::fflush(stdout);
  if (command.quiet) return;
  std::fprintf(stderr,
               "%s\nThe phone has to be in the same network. Its browser warns about the "
               "certificate, which this command made: continue anyway. Ctrl-C ends the server.\n",
               qr_code(urls.front()).c_str());
}

/// The newest release at an address as the page sees it: of the folder that is written, or the web.
Result<Release> release_at(const SiteOptions& options) {
  MODAR_ASSIGN(const RootSet trusted, trusted_keys(options));
  if (!is_web_address(options.release)) {
    return newest_release(read_release_folder(options.output + "/" + options.release), trusted);
  }
  MODAR_ASSIGN(const auto read, web_reader(options.release));
  return newest_release(read, trusted);
}

/// Visitors' browsers believe no release before the newest one of today.
void note_release(WebCommand& command) {
  if (command.options.release.empty() || command.options.trusted_key.empty()) return;
  const auto release = release_at(command.options);
  if (release) {
    command.options.release_epoch = release->epoch;
    command.options.release_version = release->version;
  } else if (!command.quiet) {
    std::fprintf(stderr,
                 "warning: no release is read (%s): first visitors' browsers accept any release, "
                 "even old ones, until the page is made again\n",
                 printable(release.error().cause).c_str());
  }
}

Result<ExitCode> run_web(WebCommand& command) {
  note_release(command);
  MODAR_ASSIGN(const Site site, write_site(command.options));
  if (!command.quiet) {
    for (const std::string& warning : site.warnings) {
      std::fprintf(stderr, "warning: %s\n", printable(warning).c_str());
    }
  }
  if (command.json) {
    const Json json = {
        {"folder", command.options.output},      {"page_bytes", site.page_bytes},
        {"bundle_bytes", site.bundle_bytes},     {"packed_bytes", site.packed_bytes},
        {"ranged_bytes", site.ranged_bytes},     {"trimmed_bytes", site.trimmed_bytes},
        {"warnings", Json::list(site.warnings)}, {"files", Json::list(site.files)}};
    std::fputs(json.dump().c_str(), stdout);
  } else if (!command.quiet) {
    std::fprintf(stderr, "wrote %s: %zu files, page and engines %s, bundles %s\n",
                 command.options.output.c_str(), site.files.size(),
                 human_bytes(site.page_bytes).c_str(), human_bytes(site.bundle_bytes).c_str());
    if (site.packed_bytes != site.ranged_bytes) {
      std::fprintf(stderr, "first visits load the bundles packed: %s\n",
                   human_bytes(site.packed_bytes - site.ranged_bytes).c_str());
    }
    if (site.ranged_bytes != 0) {
      std::fprintf(
          stderr,
          "visits download the visible parts of large bundles, by ranges: of %s, if the host has "
          "ranges\n",
          human_bytes(site.ranged_bytes).c_str());
    }
    if (site.trimmed_bytes != 0) {
      std::fprintf(stderr, "left out: keypoints of the ModAR paper's method, %s\n",
                   human_bytes(site.trimmed_bytes).c_str());
    }
  }
  if (!command.serve) return ExitCode::kOk;
  MODAR_TRY(serve_site({command.options.output, command.bind, command.port},
                       [&](const auto& urls) { print_addresses(command, urls); }));
  return ExitCode::kOk;
}

}  // namespace

void add_web(CommandLine& program) {
  CommandLine& line = program.command("web", "Make a web page that plays bundles, offline too");
  const auto command = std::make_shared<WebCommand>();
  SiteOptions& options = command->options;
  line.option("bundles", &options.bundles, "Bundles that the page plays",
              {.type = "BUNDLE...", .required = true});
  line.option("-o,--output", &options.output, "Folder to write, for any web server",
              {.type = "DIR", .required = true});
  line.flag("--serve", command->serve, "Serve it over HTTPS, and print a QR code of the address");
  line.option("--title", &options.title, "Title of the page (default: the first bundle's name)",
              {.type = "TEXT"});
  line.option("--languages", &options.languages,
              "Languages of the page, the first one as default: de,en",
              {.type = "LANGUAGE", .separator = ','});
  line.option("--texts", &options.texts, "Names and texts of the patterns in these languages",
              {.type = "JSON"});
  line.option("--words", &options.words,
              "Folder of more languages: LANGUAGE.json, like words/en.json of the page",
              {.type = "DIR"});
  line.flag("--room", options.room,
            "Add USDZ and GLB files, which iPhones and Android phones show in the visitor's room");
  line.flag("--baker", options.baker,
            "Visitors may open models of their own: adds the baker, 4 MB that they load then");
  line.option("--link", &options.links, "Link at the foot of the cover: 'Imprint=https://...'",
              {.type = "TEXT=URL"});
  line.option("--statement", &options.statement,
              "Add an accessibility statement of this publisher, see below", {.type = "JSON"});
  line.option(
      "--release", &options.release,
      "Address of a folder of `modar ship publish`, from which the page updates its bundles",
      {.type = "URL"});
  line.option("--trust", &options.trusted_key, "Public key of those releases: K.pub",
              {.type = "FILE"});
  line.group("Files and server", Shown::kInFull);
  line.option("--page", &options.page,
              "Files of the page (default: those installed or built with modar)", {.type = "DIR"});
  line.flag(
      "--live", options.live,
      "Open pages reload themselves when the folder is written again: to try what you change");
  line.flag("--force", options.force, "Write into a folder that contains other files");
  line.option(
      "--bind", &command->bind,
      "Address that the server listens on: 127.0.0.1 for this machine only, 0.0.0.0 for all",
      {.type = "ADDRESS", .shows_default = true});
  line.option("--port", &command->port, "Port of the server; 0: any free port",
              {.shows_default = true, .least = 0, .most = 65535});
  line.flag("--quiet", command->quiet, "Print errors and addresses only");
  line.flag("--json", command->json, "Print the written files as JSON");
  line.footer(example(
      "  modar web vase.modar -o site --title 'The red vase' --languages de,en --texts texts.json\n"
      "  modar web vase.modar -o site --serve\n"
      "  modar web vase.modar -o site --release release --trust museum.key.pub\n"
      "\n"
      "texts.json: {\"cover\": {\"en\": {\"name\": \"The cover\", \"text\": \"Printed in "
      "1890.\", \"alt\": \"A red vase\"}}}\n"
      "statement.json: {\"publisher\": \"Museum of X\", \"date\": \"2026-11-26\", \"feedback\": "
      "\"mailto:access@museum.org\", \"enforcement\": \"https://...\"}\n"));
  line.run([command] { return run_web(*command); });
}

}  // namespace modar
