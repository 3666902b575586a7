// Parses the command line with getopt_long: a device links no library for it.
#include "fetch_options.hpp"

#include <getopt.h>

#include <array>
#include <charconv>
#include <cmath>

namespace modar::fetch {
namespace {

enum Option : int { kStore = 256, kTrust, kDevice, kBundle, kParallel, kRate, kAttempts, kVerify };

constexpr std::array<option, 13> kOptions = {{{"store", required_argument, nullptr, kStore},
                                              {"trust", required_argument, nullptr, kTrust},
                                              {"device", required_argument, nullptr, kDevice},
                                              {"bundle", required_argument, nullptr, kBundle},
                                              {"parallel", required_argument, nullptr, kParallel},
                                              {"limit-rate", required_argument, nullptr, kRate},
                                              {"attempts", required_argument, nullptr, kAttempts},
                                              {"verify", no_argument, nullptr, kVerify},
                                              {"json", no_argument, nullptr, 'j'},
                                              {"quiet", no_argument, nullptr, 'q'},
                                              {"help", no_argument, nullptr, 'h'},
                                              {"version", no_argument, nullptr, 'v'},
                                              {nullptr, 0, nullptr, 0}}};

tl::unexpected<Error> usage(const char* code, std::string where, std::string cause) {
  return fail(ExitCode::kUsage, code, std::move(where), std::move(cause), "see modar-fetch --help");
}

/// A number from 1 to `most`, 0 where the text is none.
unsigned positive(std::string_view text, unsigned most) {
  unsigned value = 0;
  const auto [last, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc() && last == text.data() + text.size() && value <= most ? value : 0;
}

/// "2000", "16k", "1M": bytes; 0 where the text is none.
std::uint64_t parse_rate(std::string_view text) {
  std::uint64_t unit = 1;
  if (text.ends_with('k') || text.ends_with('K')) unit = 1000;
  if (text.ends_with('M')) unit = 1000000;
  if (unit != 1) text.remove_suffix(1);
  return unit * positive(text, 1000000000u);
}

bool take(CommandLine& line, int option, const char* value) {
  FetchOptions& options = line.options;
  switch (option) {
    case kStore:
      options.store = value;
      return true;
    case kTrust:
      line.trust_file = value;
      return true;
    case kDevice:
      options.device = value;
      return true;
    case kBundle:
      options.bundles.emplace_back(value);
      return true;
    case kParallel:
      options.parallel = positive(value, 32);
      return options.parallel != 0;
    case kRate:
      options.bytes_per_second = parse_rate(value);
      return options.bytes_per_second != 0;
    case kAttempts:
      options.attempts = positive(value, 1000);
      return options.attempts != 0;
    case kVerify:
      line.verify = true;
      return true;
    case 'j':
      line.json = true;
      return true;
    case 'q':
      line.quiet = true;
      return true;
    case 'h':
      line.help = true;
      return true;
    default:
      line.version = true;
      return true;
  }
}

}  // namespace

Result<CommandLine> parse_command_line(int argc, char** argv) {
  CommandLine line;
  opterr = 0;
  optind = 1;
  int index = 0;
  for (int found = 0; (found = getopt_long(argc, argv, "", kOptions.data(), &index)) != -1;) {
    if (found == '?')
      return usage("cli.option", argv[optind - 1], "it is no option, or lacks its value");
    if (!take(line, found, optarg)) {
      return usage("cli.value", std::string("--") + kOptions[static_cast<std::size_t>(index)].name,
                   std::string(optarg) + " is out of its range");
    }
  }
  if (line.help || line.version) return line;
  for (int i = optind; i < argc; ++i) {
    if (!line.options.url.empty()) return usage("cli.url", argv[i], "there is one URL already");
    line.options.url = argv[i];
  }
  if (line.options.store.empty()) return usage("cli.store", "--store", "it is missing");
  if (line.verify) return line;
  if (line.options.url.empty()) return usage("cli.url", "URL", "it is missing");
  if (line.trust_file.empty()) return usage("cli.trust", "--trust", "it is missing");
  return line;
}

const char* help_text() {
  return R"(modar-fetch: installs the newest release of bundles on this device

Usage:
  modar-fetch URL --store DIR --trust K.pub [OPTION]...
  modar-fetch --store DIR --verify

URL is http(s)://HOST/PATH, or a folder (a USB stick), that `modar ship publish` filled. The installed
bundles are DIR/NAME.modar. Cut off at any moment, the release in use stays whole, and the next run
goes on with what came.

  --store DIR       where releases are installed; made where it is missing
  --trust K.pub     the publisher's public key, of `modar ship keygen`
  --device NAME     only bundles for this device profile
  --bundle NAME     only this bundle; may be given again
  --parallel N      pieces at once, 1 to 32 (4)
  --limit-rate N    bytes a second at most; 16k and 1M are understood
  --attempts N      give up after so many attempts in a row that bring nothing (8)
  --verify          read what is installed; fall back to the release before where it is damaged
  --json            print what was done as JSON
  --quiet           no progress, no summary
  --help, --version

Example:
  modar-fetch http://museum.example/ar --store /sdcard/modar --trust museum.pub

Exit codes: 0 ok, 1 wrong usage, 2 a file cannot be read or written, 3 invalid input, 4 a bug of ours,
5 nothing for this device or this version; 10 not signed by the trusted key, 11 older than what is
installed, 12 expired, 13 the server's files are not of one release, 14 not enough free space,
15 another fetch is at work, 16 the network gave up (run it again), 17 the new bundle is not good.
)";
}

}  // namespace modar::fetch
