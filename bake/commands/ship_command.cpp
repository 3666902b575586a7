#include "bake/commands/ship_command.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <termios.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <ctime>
#include <fstream>
#include <iterator>

#include "bake/commands/ship_json.hpp"
#include "bake/io/input.hpp"
#include "bake/io/output.hpp"
#include "bake/io/terminal.hpp"
#include "bake/ship/http/http_reader.hpp"
#include "bake/ship/keys/keys.hpp"
#include "bake/ship/keys/root_draft.hpp"
#include "bake/ship/release_folder.hpp"
#include "formats/base/atomic_file.hpp"
#include "modar/device_profile.hpp"
#include "modar/release.hpp"

namespace modar {
namespace {

constexpr std::int64_t kDay = 86400;

Result<std::string> read_text(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) {
    return fail(ExitCode::kIo, "io.open", path, std::strerror(errno), "check the path");
  }
  return std::string(std::istreambuf_iterator<char>(file), {});
}

/// A file of public keys, as `parse` reads its text.
template <class Keys>
Result<Keys> read_public(const std::string& path, Result<Keys> (*parse)(std::string_view)) {
  MODAR_ASSIGN(const auto text, read_text(path));
  auto keys = parse(text);
  return keys ? std::move(keys) : in_file(path, keys.error());
}

std::string first_line(const std::string& text) {
  const std::string line = text.substr(0, text.find('\n'));
  return line.ends_with('\r') ? line.substr(0, line.size() - 1) : line;
}

/// Asks on the terminal, without an echo.
Result<std::string> ask_pass_phrase() {
  if (::isatty(STDIN_FILENO) == 0) {
    return fail(ExitCode::kUsage, "key.pass-phrase", "", "the secret key is encrypted",
                "give its pass phrase with --pass-phrase-file");
  }
  std::fputs("Pass phrase: ", stderr);
  termios shown{};
  ::tcgetattr(STDIN_FILENO, &shown);
  termios hidden = shown;
  hidden.c_lflag &= ~static_cast<tcflag_t>(ECHO);
  ::tcsetattr(STDIN_FILENO, TCSAFLUSH, &hidden);
  std::string line;
  for (int c = std::getchar(); c != EOF && c != '\n'; c = std::getchar()) {
    line += static_cast<char>(c);
  }
  ::tcsetattr(STDIN_FILENO, TCSAFLUSH, &shown);
  std::fputc('\n', stderr);
  return line;
}

Result<SecretKey> load_key(const std::string& path, const std::string& pass_phrase_file) {
  MODAR_ASSIGN(const auto text, read_text(path));
  std::string pass_phrase;
  if (!pass_phrase_file.empty()) {
    MODAR_ASSIGN(const auto file, read_text(pass_phrase_file));
    pass_phrase = first_line(file);
  } else if (needs_pass_phrase(text)) {
    const auto asked = ask_pass_phrase();
    if (!asked) return asked.map([](const std::string&) { return SecretKey(); });
    pass_phrase = *asked;
  }
  auto key = parse_secret_key(text, pass_phrase);
  if (!key) {
    key.error().where = path;
  } else {
    warn_of_readers(path);
  }
  return key;
}

/// A file that only its owner may read. Errors: kIo.
Result<void> write_secret(const std::string& path, const std::string& text) {
  const mode_t mask = ::umask(0077);
  auto written = write_file(path, std::string_view(text));
  ::umask(mask);
  if (written && ::chmod(path.c_str(), S_IRUSR | S_IWUSR) != 0) {
    // FAT and the like have no modes: who may mount the disk may read the key.
    if (errno != ENOSYS && errno != EPERM && errno != EOPNOTSUPP) {
      return fail(ExitCode::kIo, "io.write", path, std::strerror(errno), "check its owner");
    }
    warn_of_readers(path);
  }
  return written;
}

/// "NAME=ace2,mali400" into the request. Errors: kUsage "ship.for".
Result<void> take_devices(const std::string& text, PublishRequest& request) {
  const std::size_t equals = text.find('=');
  const std::string name = text.substr(0, equals);
  std::string rest = equals == std::string::npos ? "" : text.substr(equals + 1);
  if (rest == "all") {
    request.devices[name] = {};
    return {};
  }
  while (!rest.empty()) {
    const std::size_t comma = std::min(rest.find(','), rest.size());
    const std::string device = rest.substr(0, comma);
    if (find_device_profile(device) == nullptr) {
      return fail(ExitCode::kUsage, "ship.for", device, "there is no such device profile",
                  "choose from " + device_profile_names());
    }
    request.devices[name].push_back(device);
    rest.erase(0, comma + 1);
  }
  if (request.devices[name].empty()) {
    return fail(ExitCode::kUsage, "ship.for", text, "it names no device",
                "write it as --for vase=ace2,mali400, or vase=all");
  }
  return {};
}

std::string expiry_text(std::int64_t expires) {
  if (expires == kNever) return "does not expire";
  return (expires <= std::time(nullptr) ? "expired " : "valid until ") + time_text(expires);
}

/// What `ship rotate` and `ship root` work on.
struct KeyChange {
  SecretKey key;   ///< signs the change
  PublicKey next;  ///< signs releases from now on
  ReleaseFolder folder;
};

Result<KeyChange> open_key_change(const RotateCommand& command) {
  MODAR_ASSIGN(auto key, load_key(command.key_file, command.pass_phrase_file));
  MODAR_ASSIGN(const auto next, read_public(command.next_key, parse_public_key));
  MODAR_ASSIGN(auto folder, ReleaseFolder::open(command.folder));
  return KeyChange{std::move(key), next, std::move(folder)};
}

}  // namespace

namespace {

Result<RootSet> read_root_keys(const std::vector<std::string>& files, unsigned threshold) {
  std::vector<PublicKey> keys;
  for (const std::string& file : files) {
    MODAR_ASSIGN(const auto key, read_public(file, parse_public_key));
    keys.push_back(key);
  }
  return make_root_set(std::move(keys), threshold);
}

/// Writes the document to sign, and the first signature.
Result<std::string> write_draft(const RootCommand& command) {
  MODAR_ASSIGN(const auto key, load_key(command.key_file, command.pass_phrase_file));
  MODAR_ASSIGN(const auto folder, ReleaseFolder::open(command.folder));
  RootDraft draft;
  if (!command.roots.empty()) {
    MODAR_ASSIGN(const auto roots, read_root_keys(command.roots, command.threshold));
    draft = draft_root_rotation(folder, roots);
  } else {
    MODAR_ASSIGN(const auto next, read_public(command.next_key, parse_public_key));
    MODAR_ASSIGN(draft, draft_root_metadata(folder, next));
  }
  MODAR_TRY(write_root_draft(command.draft, draft));
  MODAR_ASSIGN(const auto signature, sign_root_draft(command.draft, key));
  std::fprintf(stderr, "%s\n", draft.meaning.c_str());
  return signature;
}

int run_draft(const RootCommand& command) {
  const auto signature = write_draft(command);
  if (!signature) return print_error(signature.error());
  std::printf("%s\n%s\n", command.draft.c_str(), signature->c_str());
  return static_cast<int>(ExitCode::kOk);
}

/// Says that the newest release is of an earlier epoch than the root metadata, which devices
/// refuse. Answers the exit code.
int note_stale_release(const ReleaseFolder& folder) {
  const auto word = folder.root_metadata();
  if (!word) return print_error(word.error());
  const auto newest = folder.newest();
  if (!newest) return print_error(newest.error());
  if (*newest && (*newest)->epoch < word->epoch) {
    std::fprintf(stderr,
                 "release %llu is of an earlier epoch, so devices refuse it: publish its bundles "
                 "again with the key that signs now\n",
                 static_cast<unsigned long long>((*newest)->version));
  }
  return static_cast<int>(ExitCode::kOk);
}

}  // namespace

int run_trust(const TrustCommand& command) {
  const auto roots = read_root_keys(command.keys, command.threshold);
  if (!roots) return print_error(roots.error());
  if (auto kept = keep_inputs(command.out, command.keys); !kept) return print_error(kept.error());
  const std::string text = "untrusted comment: root keys of modar, " +
                           std::to_string(roots->threshold) + " of " +
                           std::to_string(roots->keys.size()) + "\n" + root_set_line(*roots) + "\n";
  auto written = write_file(command.out, std::string_view(text));
  if (!written) return print_error(written.error());
  std::printf("%s\n", command.out.c_str());
  return static_cast<int>(ExitCode::kOk);
}

int run_sign(const SignCommand& command) {
  const auto key = load_key(command.key_file, command.pass_phrase_file);
  if (!key) return print_error(key.error());
  const auto draft = read_root_draft(command.draft);
  if (!draft) return print_error(draft.error());
  const auto signature = sign_root_draft(command.draft, *key);
  if (!signature) return print_error(signature.error());
  std::fprintf(stderr, "%s\n", draft->meaning.c_str());
  std::printf("%s\n", signature->c_str());
  return static_cast<int>(ExitCode::kOk);
}

int run_accept(const AcceptCommand& command) {
  const auto trust = read_public(command.trust, parse_root_set);
  if (!trust) return print_error(trust.error());
  const auto folder = ReleaseFolder::open(command.folder);
  if (!folder) return print_error(folder.error());
  const auto draft = accept_root_draft(*folder, command.draft, *trust);
  if (!draft) return print_error(draft.error());
  std::fprintf(stderr, "%s: %s\n", draft->path.c_str(), draft->meaning.c_str());
  return note_stale_release(*folder);
}

int run_keygen(const KeygenCommand& command) {
  const std::string public_file = command.out + ".pub";
  if (!command.force &&
      (::access(command.out.c_str(), F_OK) == 0 || ::access(public_file.c_str(), F_OK) == 0)) {
    return print_error({ExitCode::kUsage, "key.exists", command.out, "the key already exists",
                        "choose another name, or overwrite it with --force"});
  }
  std::string pass_phrase;
  if (!command.pass_phrase_file.empty()) {
    for (const std::string& file : {command.out, public_file}) {
      const auto kept = keep_inputs(file, {command.pass_phrase_file});
      if (!kept) return print_error(kept.error());
    }
    const auto text = read_text(command.pass_phrase_file);
    if (!text) return print_error(text.error());
    pass_phrase = first_line(*text);
  }
  const auto key = make_key();
  if (!key) return print_error(key.error());
  const auto text = secret_key_text(*key, pass_phrase);
  if (!text) return print_error(text.error());
  auto written = write_secret(command.out, *text).and_then([&] {
    return write_file(public_file, std::string_view(public_key_text(key->public_key)));
  });
  if (!written) return print_error(written.error());
  std::printf("%s\n%s\n", command.out.c_str(), public_file.c_str());
  return static_cast<int>(ExitCode::kOk);
}

int run_publish(ShipPublishCommand& command) {
  const auto key = load_key(command.key_file, command.pass_phrase_file);
  if (!key) return print_error(key.error());
  for (const std::string& text : command.devices) {
    if (auto taken = take_devices(text, command.request); !taken) return print_error(taken.error());
  }
  command.request.expires =
      command.no_expiry ? kNever : std::time(nullptr) + kDay * command.valid_days;
  if (!command.expires.empty()) {
    const auto time = parse_time(command.expires);
    if (!time) {
      return print_error({ExitCode::kUsage, "ship.expires", "--expires " + command.expires,
                          time.error().cause, "write it as 2027-01-31T00:00:00Z"});
    }
    command.request.expires = *time;
  }
  if (command.fresh_days >= 0) {
    command.request.fresh_days = static_cast<std::uint64_t>(command.fresh_days);
  }
  ProgressBar bar(command.quiet || command.json);
  Report stages;
  stages.progress = [&](const std::string& stage, double done) { bar.show(stage, done); };
  const auto report = publish(command.request, *key, stages);
  bar.clear();
  if (!report) return print_error(report.error());
  if (command.json) {
    std::fputs(publish_json(*report).c_str(), stdout);
  } else if (!command.quiet) {
    std::fprintf(stderr, "release %llu%s: %s added to %s\n",
                 static_cast<unsigned long long>(report->release.version),
                 command.request.dry_run ? " (dry run: nothing is written)" : "",
                 human_bytes(report->added_bytes).c_str(), command.request.folder.c_str());
    std::fprintf(stderr, "  %s\n", expiry_text(report->release.expires).c_str());
    for (const BundleChange& change : report->changes) {
      std::fprintf(stderr, "  %-8s%s\n", to_string(change.kind), change.name.c_str());
    }
    for (const ReleaseBundle& bundle : report->release.bundles) {
      std::fprintf(stderr, "  %s: %s installed, %s to download in %u pieces\n", bundle.name.c_str(),
                   human_bytes(bundle.size).c_str(), human_bytes(bundle.download_size).c_str(),
                   bundle.pieces);
    }
  }
  return static_cast<int>(ExitCode::kOk);
}

int run_rotate(const RotateCommand& command) {
  const auto change = open_key_change(command);
  if (!change) return print_error(change.error());
  const auto& [key, next, folder] = *change;
  if (auto fine = folder.check_signer(key.public_key); !fine) return print_error(fine.error());
  if (auto added = folder.add_key(next, key); !added) return print_error(added.error());
  std::fprintf(stderr, "link %u of the chain: devices move to key %s\n", folder.key_rotations(),
               to_hex(next.id).c_str());
  return static_cast<int>(ExitCode::kOk);
}

int run_root(const RootCommand& command) {
  if (!command.draft.empty()) return run_draft(command);
  const auto change = open_key_change(command);
  if (!change) return print_error(change.error());
  const auto& [key, next, folder] = *change;
  const auto word = folder.add_root_metadata(next, key);
  if (!word) return print_error(word.error());
  std::fprintf(stderr, "epoch %llu: key %s signs; publish the next release with it\n",
               static_cast<unsigned long long>(word->epoch), to_hex(next.id).c_str());
  return note_stale_release(folder);
}

int run_refresh(const RefreshCommand& command) {
  const auto key = load_key(command.key_file, command.pass_phrase_file);
  if (!key) return print_error(key.error());
  const auto folder = ReleaseFolder::open(command.folder);
  if (!folder) return print_error(folder.error());
  if (auto fine = folder->check_signer(key->public_key); !fine) return print_error(fine.error());
  const auto newest = folder->newest();
  if (!newest) return print_error(newest.error());
  if (!*newest || (*newest)->fresh_days == 0) {
    return print_error({ExitCode::kUsage, "ship.fresh", command.folder,
                        "its newest release has no --fresh-days",
                        "publish with --fresh-days 7 first"});
  }
  if (auto signed_ = folder->add_freshness(**newest, std::time(nullptr), *key); !signed_) {
    return print_error(signed_.error());
  }
  std::fprintf(stderr, "release %llu confirmed as the newest for %llu days\n",
               static_cast<unsigned long long>((*newest)->version),
               static_cast<unsigned long long>((*newest)->fresh_days));
  return static_cast<int>(ExitCode::kOk);
}

int run_list(const ListCommand& command) {
  const auto folder = ReleaseFolder::open(command.folder);
  if (!folder) return print_error(folder.error());
  const auto newest = folder->newest();
  if (!newest) return print_error(newest.error());
  std::vector<ListedRelease> releases;
  for (const std::uint64_t version : folder->versions()) {
    auto release = folder->release(version);
    if (!release) return print_error(release.error());
    const bool current = *newest && (*newest)->version == version;
    releases.push_back({std::move(*release), folder->published(version), current});
  }
  if (command.json) {
    std::fputs(list_json(releases).c_str(), stdout);
    return static_cast<int>(ExitCode::kOk);
  }
  for (const ListedRelease& listed : releases) {
    std::printf("%s release %llu, published %s, %s\n", listed.current ? "*" : " ",
                static_cast<unsigned long long>(listed.release.version),
                time_text(listed.published).c_str(), expiry_text(listed.release.expires).c_str());
    for (const ReleaseBundle& bundle : listed.release.bundles) {
      std::printf("    %s: %s installed, %s to download\n", bundle.name.c_str(),
                  human_bytes(bundle.size).c_str(), human_bytes(bundle.download_size).c_str());
    }
  }
  return static_cast<int>(ExitCode::kOk);
}

int run_prune(const PruneCommand& command) {
  const auto folder = ReleaseFolder::open(command.folder);
  if (!folder) return print_error(folder.error());
  const auto freed = folder->prune(command.keep);
  if (!freed) return print_error(freed.error());
  if (command.json) {
    std::fputs(prune_json(*freed, folder->versions()).c_str(), stdout);
  } else {
    std::fprintf(stderr, "%s freed\n", human_bytes(*freed).c_str());
  }
  return static_cast<int>(ExitCode::kOk);
}

int run_verify(const VerifyCommand& command) {
  const auto key = read_public(command.trust, parse_root_set);
  if (!key) return print_error(key.error());
  const auto read = is_web_address(command.place)
                        ? web_reader(command.place)
                        : Result<ReleaseReader>(read_release_folder(command.place));
  if (!read) return print_error(read.error());
  ProgressBar bar(command.json);
  const auto report = verify_release(*read, *key, [&](double done) { bar.show("verify", done); });
  bar.clear();
  if (!report) return print_error(report.error());
  if (command.json) std::fputs(verify_json(*report).c_str(), stdout);
  for (const DamagedObject& object : report->damaged) {
    std::fprintf(stderr, "%s: %s; the bundle %s needs it\n", object.path.c_str(),
                 object.cause.c_str(), object.bundle.c_str());
  }
  if (!report->damaged.empty()) {
    return print_error({ExitCode::kInvalidInput, "ship.damaged", command.place,
                        std::to_string(report->damaged.size()) + " of " +
                            std::to_string(report->objects) + " objects are damaged",
                        "remove them and publish their bundles again, or copy them again"});
  }
  if (!command.json) {
    std::fprintf(stderr, "release %llu is complete: %zu bundles, %llu objects, %s; %s\n",
                 static_cast<unsigned long long>(report->release.version),
                 report->release.bundles.size(), static_cast<unsigned long long>(report->objects),
                 human_bytes(report->bytes).c_str(), expiry_text(report->release.expires).c_str());
  }
  return static_cast<int>(ExitCode::kOk);
}

int run_plan(const PlanCommand& command) {
  const Link* link = find_link(command.link);
  if (link == nullptr) {
    return print_error({ExitCode::kUsage, "ship.link", command.link, "there is no such network",
                        "choose from 2g, 3g, 4g, wifi"});
  }
  const DeviceProfile* device =
      command.device.empty() ? nullptr : find_device_profile(command.device);
  if (!command.device.empty() && device == nullptr) {
    return print_error({ExitCode::kUsage, "ship.device", command.device,
                        "there is no such device profile",
                        "choose from " + device_profile_names()});
  }
  const auto plan = plan_update(command.old_bundle, command.new_bundle, *link, command.recipe);
  if (!plan) return print_error(plan.error());
  const double minutes = (plan->transfer_s + plan->install_s) / 60;
  if (command.json) {
    std::fputs(plan_json(*plan, *link, command.device, minutes).c_str(), stdout);
    return static_cast<int>(ExitCode::kOk);
  }
  std::printf("update: %s in %u pieces (everything: %s)\n", human_bytes(plan->update_bytes).c_str(),
              plan->update_pieces, human_bytes(plan->full_bytes).c_str());
  std::printf("%s: %.1f minutes (%.0f s on the network, %.0f s to install)\n", link->name, minutes,
              plan->transfer_s, plan->install_s);
  std::printf(
      "time to install: assumes %.0f instructions a byte of geometry (%s) and %.0f a byte of the "
      "rest "
      "(%s), as counted on x86-64, 800 million instructions a second and flash that writes 8 "
      "MB/s\n",
      kGeometryInstructions, human_bytes(plan->geometry_bytes).c_str(), kOtherInstructions,
      human_bytes(plan->other_bytes).c_str());
  std::printf("free space that it needs: %s\n", human_bytes(plan->storage_bytes).c_str());
  return static_cast<int>(ExitCode::kOk);
}

}  // namespace modar
