// `modar ship` with keys: making, trusting and replacing them.
#include "bake/commands/ship_keys.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <termios.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <iterator>
#include <memory>
#include <vector>

#include "bake/io/input.hpp"
#include "bake/io/output.hpp"
#include "bake/io/terminal.hpp"
#include "bake/ship/keys/root_draft.hpp"
#include "bake/ship/release_folder.hpp"
#include "formats/base/atomic_file.hpp"

namespace modar {

namespace {

Result<std::string> read_text(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) {
    return fail(ExitCode::kIo, "io.open", path, std::strerror(errno), "check the path");
  }
  return std::string(std::istreambuf_iterator<char>(file), {});
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

/// A file of public keys, as `parse` reads its text.
template <class Keys>
Result<Keys> read_public(const std::string& path, Result<Keys> (*parse)(std::string_view)) {
  MODAR_ASSIGN(const auto text, read_text(path));
  auto keys = parse(text);
  return keys ? std::move(keys) : in_file(path, keys.error());
}

}  // namespace

Result<SecretKey> load_key(const KeyFiles& files) {
  MODAR_ASSIGN(const auto text, read_text(files.key));
  std::string pass_phrase;
  if (!files.pass_phrase.empty()) {
    MODAR_ASSIGN(const auto file, read_text(files.pass_phrase));
    pass_phrase = first_line(file);
  } else if (needs_pass_phrase(text)) {
    MODAR_ASSIGN(pass_phrase, ask_pass_phrase());
  }
  auto key = parse_secret_key(text, pass_phrase);
  if (!key) {
    key.error().where = files.key;
  } else {
    warn_of_readers(files.key);
  }
  return key;
}

Result<RootSet> read_trust(const std::string& path) {
  return read_public(path, parse_root_set);
}

std::string ship_example(const std::string& text) {
  return example(text, ", 15 another publisher is at work on the folder");
}

void add_folder(CommandLine& line, std::string& folder) {
  line.option("--to", &folder, "Folder that devices fetch from", {.type = "DIR", .required = true});
}

void add_key_options(CommandLine& line, KeyFiles& files) {
  line.option("--key", &files.key, "Secret key", {.type = "K", .required = true});
  line.option("--pass-phrase-file", &files.pass_phrase,
              "File whose first line is the pass phrase (default: ask for it)", {.type = "FILE"});
}

namespace {

struct KeygenCommand {
  std::string out;
  std::string pass_phrase_file;
  bool force = false;
};

Result<ExitCode> run_keygen(const KeygenCommand& command) {
  const std::string public_file = command.out + ".pub";
  if (!command.force &&
      (::access(command.out.c_str(), F_OK) == 0 || ::access(public_file.c_str(), F_OK) == 0)) {
    return fail(ExitCode::kUsage, "key.exists", command.out, "the key already exists",
                "choose another name, or overwrite it with --force");
  }
  std::string pass_phrase;
  if (!command.pass_phrase_file.empty()) {
    for (const std::string& file : {command.out, public_file}) {
      MODAR_TRY(keep_inputs(file, {command.pass_phrase_file}));
    }
    MODAR_ASSIGN(const auto text, read_text(command.pass_phrase_file));
    pass_phrase = first_line(text);
  }
  MODAR_ASSIGN(const auto key, make_key());
  MODAR_ASSIGN(const auto text, secret_key_text(key, pass_phrase));
  MODAR_TRY(write_secret(command.out, text));
  MODAR_TRY(write_file(public_file, std::string_view(public_key_text(key.public_key))));
  std::printf("%s\n%s\n", command.out.c_str(), public_file.c_str());
  return ExitCode::kOk;
}

struct RotateCommand {
  std::string folder;
  KeyFiles key;
  std::string next_key;  ///< file of the public key that follows
};

struct RootCommand : RotateCommand {
  std::string draft;  ///< file for several to sign; empty: signed and published at once
  std::vector<std::string>
      roots;               ///< public keys of the set that follows; empty: next_key is named
  unsigned threshold = 1;  ///< of these
};

/// What `ship rotate` and `ship root` work on.
struct KeyChange {
  SecretKey key;   ///< signs the change
  PublicKey next;  ///< signs releases from now on
  ReleaseFolder folder;
};

Result<KeyChange> open_key_change(const RotateCommand& command) {
  MODAR_ASSIGN(auto key, load_key(command.key));
  MODAR_ASSIGN(const auto next, read_public(command.next_key, parse_public_key));
  MODAR_ASSIGN(auto folder, ReleaseFolder::open(command.folder));
  return KeyChange{std::move(key), next, std::move(folder)};
}

Result<ExitCode> run_rotate(const RotateCommand& command) {
  MODAR_ASSIGN(const auto change, open_key_change(command));
  const auto& [key, next, folder] = change;
  MODAR_TRY(folder.check_signer(key.public_key));
  MODAR_TRY(folder.add_key(next, key));
  std::fprintf(stderr, "link %u of the chain: devices move to key %s\n", folder.key_rotations(),
               to_hex(next.id).c_str());
  return ExitCode::kOk;
}

Result<RootSet> read_root_keys(const std::vector<std::string>& files, unsigned threshold) {
  std::vector<PublicKey> keys;
  for (const std::string& file : files) {
    MODAR_ASSIGN(const auto key, read_public(file, parse_public_key));
    keys.push_back(key);
  }
  return make_root_set(std::move(keys), threshold);
}

/// Writes the document to sign, and the first signature.
Result<ExitCode> run_draft(const RootCommand& command) {
  MODAR_ASSIGN(const auto key, load_key(command.key));
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
  std::printf("%s\n%s\n", command.draft.c_str(), signature.c_str());
  return ExitCode::kOk;
}

/// Says that the newest release is of an earlier epoch than the root metadata, which devices
/// refuse.
Result<ExitCode> note_stale_release(const ReleaseFolder& folder) {
  MODAR_ASSIGN(const auto word, folder.root_metadata());
  MODAR_ASSIGN(const auto newest, folder.newest());
  if (newest && newest->epoch < word.epoch) {
    std::fprintf(stderr,
                 "release %llu is of an earlier epoch, so devices refuse it: publish its bundles "
                 "again with the key that signs now\n",
                 static_cast<unsigned long long>(newest->version));
  }
  return ExitCode::kOk;
}

/// Signs who signs: the next key at once, or a draft of it, or of the root keys that follow.
Result<ExitCode> run_root(const RootCommand& command) {
  if (command.next_key.empty() && command.roots.empty()) {
    return fail(ExitCode::kUsage, "ship.root", "ship root", "no key is named",
                "name the one that signs with --next NEW.pub");
  }
  if (!command.draft.empty()) return run_draft(command);
  MODAR_ASSIGN(const auto change, open_key_change(command));
  const auto& [key, next, folder] = change;
  MODAR_ASSIGN(const auto word, folder.add_root_metadata(next, key));
  std::fprintf(stderr, "epoch %llu: key %s signs; publish the next release with it\n",
               static_cast<unsigned long long>(word.epoch), to_hex(next.id).c_str());
  return note_stale_release(folder);
}

struct TrustCommand {
  std::vector<std::string> keys;
  unsigned threshold = 1;
  std::string out;
};

Result<ExitCode> run_trust(const TrustCommand& command) {
  MODAR_ASSIGN(const auto roots, read_root_keys(command.keys, command.threshold));
  MODAR_TRY(keep_inputs(command.out, command.keys));
  const std::string text = "untrusted comment: root keys of modar, " +
                           std::to_string(roots.threshold) + " of " +
                           std::to_string(roots.keys.size()) + "\n" + root_set_line(roots) + "\n";
  MODAR_TRY(write_file(command.out, std::string_view(text)));
  std::printf("%s\n", command.out.c_str());
  return ExitCode::kOk;
}

struct SignCommand {
  std::string draft;
  KeyFiles key;
};

Result<ExitCode> run_sign(const SignCommand& command) {
  MODAR_ASSIGN(const auto key, load_key(command.key));
  MODAR_ASSIGN(const auto draft, read_root_draft(command.draft));
  MODAR_ASSIGN(const auto signature, sign_root_draft(command.draft, key));
  std::fprintf(stderr, "%s\n", draft.meaning.c_str());
  std::printf("%s\n", signature.c_str());
  return ExitCode::kOk;
}

struct AcceptCommand {
  std::string draft;
  std::string folder;
  std::string trust;  ///< file of the root keys that devices were given
};

Result<ExitCode> run_accept(const AcceptCommand& command) {
  MODAR_ASSIGN(const auto trust, read_trust(command.trust));
  MODAR_ASSIGN(const auto folder, ReleaseFolder::open(command.folder));
  MODAR_ASSIGN(const auto draft, accept_root_draft(folder, command.draft, trust));
  std::fprintf(stderr, "%s: %s\n", draft.path.c_str(), draft.meaning.c_str());
  return note_stale_release(folder);
}

}  // namespace

void add_keygen(CommandLine& ship) {
  CommandLine& line = ship.command("keygen", "Make a new pair of keys, in minisign's format");
  const auto keygen = std::make_shared<KeygenCommand>();
  line.option("-o,--out", &keygen->out, "Secret key to write; the public key goes to K.pub",
              {.type = "K", .required = true});
  line.option("--pass-phrase-file", &keygen->pass_phrase_file,
              "Encrypt the secret key with the file's first line", {.type = "FILE"});
  line.flag("--force", keygen->force, "Overwrite an existing key");
  line.footer(ship_example("  modar ship keygen --out museum.key\n"));
  line.run([keygen] { return run_keygen(*keygen); });
}

void add_rotate(CommandLine& ship) {
  CommandLine& line = ship.command("rotate", "Move devices from the old key to a new one");
  const auto rotate = std::make_shared<RotateCommand>();
  add_folder(line, rotate->folder);
  add_key_options(line, rotate->key);
  line.option("--next", &rotate->next_key, "New public key; then publish with its secret key",
              {.type = "NEW.pub", .required = true});
  line.footer(
      ship_example("  modar ship rotate --to /var/www/ar --key old.key --next new.key.pub\n"));
  line.run([rotate] { return run_rotate(*rotate); });
}

void add_root(CommandLine& ship) {
  CommandLine& line =
      ship.command("root", "Name the signing key, with the root key that devices trust");
  const auto root = std::make_shared<RootCommand>();
  add_folder(line, root->folder);
  add_key_options(line, root->key);
  line.option("--next", &root->next_key, "Public key that signs from now on", {.type = "NEW.pub"});
  line.option("--draft", &root->draft,
              "With several root keys: write and sign this draft, which the others sign "
              "(`modar ship sign`) before `modar ship accept`",
              {.type = "FILE"});
  line.option("--roots", &root->roots,
              "Public root keys that replace the present ones, instead of a signing key",
              {.type = "K.pub", .needs = "--draft", .excludes = "--next"});
  line.option("--threshold", &root->threshold, "How many of --roots must agree",
              {.least = 1, .most = 16, .needs = "--roots"});
  line.footer(
      ship_example("  modar ship root --to /var/www/ar --key root.key --next museum.key.pub\n"
                   "  modar ship root --to /var/www/ar --key a.key --next museum.key.pub --draft "
                   "new.json\n") +
      "Keep the root key offline. If a signing key was stolen, name a new one: devices drop the\n"
      "stolen key and what it signed since, and release numbers start again.\n");
  line.run([root] { return run_root(*root); });
}

void add_trust(CommandLine& ship) {
  CommandLine& line =
      ship.command("trust", "Combine several root keys, of which K of N must agree, in one file");
  const auto trust = std::make_shared<TrustCommand>();
  line.option("keys", &trust->keys, "Public keys", {.type = "K.pub...", .required = true});
  line.option("--threshold", &trust->threshold, "How many of them must agree",
              {.required = true, .least = 1, .most = 16});
  line.option("-o,--out", &trust->out,
              "File to write, for `modar-fetch --trust` and wherever K.pub is accepted",
              {.type = "FILE", .required = true});
  line.footer(ship_example(
      "  modar ship trust a.key.pub b.key.pub c.key.pub --threshold 2 --out museum.trust\n"));
  line.run([trust] { return run_trust(*trust); });
}

void add_sign(CommandLine& ship) {
  CommandLine& line =
      ship.command("sign", "Sign a draft of `modar ship root`, on your own machine");
  const auto sign = std::make_shared<SignCommand>();
  line.option("draft", &sign->draft, "Draft to sign; its contents are printed",
              {.type = "FILE", .required = true});
  add_key_options(line, sign->key);
  line.footer(
      ship_example("  modar ship sign new.json --key b.key\n") +
      "The signature is written next to the draft. `minisign -Sm` also works: rename its file.\n");
  line.run([sign] { return run_sign(*sign); });
}

void add_accept(CommandLine& ship) {
  CommandLine& line = ship.command("accept", "Publish a draft that enough root keys have signed");
  const auto accept = std::make_shared<AcceptCommand>();
  line.option("draft", &accept->draft, "Draft, with its signatures in the same folder",
              {.type = "FILE", .required = true});
  add_folder(line, accept->folder);
  line.option("--trust", &accept->trust, "Root keys that devices trust",
              {.type = "FILE", .required = true});
  line.footer(
      example("  modar ship accept new.json --to /var/www/ar --trust museum.trust\n",
              ", 10 too few root keys signed it, 15 another publisher is at work on the folder"));
  line.run([accept] { return run_accept(*accept); });
}

}  // namespace modar
