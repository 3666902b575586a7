#include "bake/ship/verify_release.hpp"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <set>
#include <span>

#include "modar/piece.hpp"

namespace modar {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMostKeyBytes = 4096;  // of a signature, a link, the root metadata
constexpr std::uint32_t kMostLinks = 1000;   // as modar-fetch follows

tl::unexpected<Error> absent(const std::string& path) {
  return fail(kExitMixed, "ship.absent", path, "there is no such file",
              "publish the release again");
}

struct SignedText {
  std::string text;
  Signature signature;
};

/// A document with its signature; nothing where there is no such document.
Result<std::optional<SignedText>> read_signed(const ReleaseReader& read, const std::string& path,
                                              std::size_t limit) {
  MODAR_ASSIGN(auto text, read(path, limit));
  if (!text) return std::optional<SignedText>();
  MODAR_ASSIGN(const auto signature, read(path + ".minisig", kMostKeyBytes));
  if (!signature) return absent(path + ".minisig");
  MODAR_ASSIGN(const auto parsed, parse_signature(*signature));
  return std::optional<SignedText>({std::move(*text), parsed});
}

/// Where the root metadata leads to from the trusted key, and the chain of keys from there.
struct Trust {
  PublicKey key;
  std::uint64_t epoch = 0;
  std::uint32_t links = 0;
};

Result<void> follow_root_metadata(const ReleaseReader& read, const RootSet& roots, Trust& trust) {
  const std::string path = "root.json";
  MODAR_ASSIGN(const auto text, read(path, kMostKeyBytes));
  if (!text && trust.key != PublicKey()) return {};
  if (!text) return absent(path);
  if (roots.keys.size() == 1) {
    MODAR_ASSIGN(const auto document, read_signed(read, path, kMostKeyBytes));
    MODAR_TRY(verify_signature(*text, document->signature, roots.keys.front()));
  } else {
    MODAR_TRY(verify_root_signatures(path, *text, roots, [&read](const std::string& signature) {
      return read(signature, kMostKeyBytes);
    }));
  }
  MODAR_ASSIGN(const auto word, parse_root_metadata(*text));
  MODAR_ASSIGN(trust.key, parse_public_key(word.key));
  trust.epoch = word.epoch;
  trust.links = word.links;
  return {};
}

Result<void> follow_links(const ReleaseReader& read, Trust& trust) {
  while (trust.links < kMostLinks) {
    const std::string path = "keys/" + std::to_string(trust.links + 1) + ".json";
    MODAR_ASSIGN(const auto document, read_signed(read, path, kMostKeyBytes));
    if (!document) return {};
    ++trust.links;
    if (document->signature.key_id != trust.key.id) continue;
    MODAR_TRY(verify_signature(document->text, document->signature, trust.key));
    MODAR_ASSIGN(const auto link, parse_key_rotation(document->text));
    if (link.serial != trust.links) {
      return fail(kExitMixed, "ship.chain", path, "it is a different link of the chain",
                  "publish the chain of keys again");
    }
    MODAR_ASSIGN(trust.key, parse_public_key(link.key));
  }
  return {};
}

/// The newest release, signed by the key that devices follow.
Result<Release> read_newest(const ReleaseReader& read, const Trust& trust) {
  MODAR_ASSIGN(const auto latest, read("latest", 32));
  if (!latest) return absent("latest");
  MODAR_ASSIGN(const auto version, parse_latest(*latest));
  const std::string path = "releases/" + std::to_string(version) + ".json";
  MODAR_ASSIGN(const auto document, read_signed(read, path, kMaxReleaseBytes));
  if (!document) return absent(path);
  MODAR_TRY(verify_signature(document->text, document->signature, trust.key));
  MODAR_ASSIGN(auto release, parse_release(document->text));
  if (release.version == version && release.epoch == trust.epoch) return release;
  return fail(kExitMixed, "ship.mixed", path,
              "it is release " + std::to_string(release.version) + " of epoch " +
                  std::to_string(release.epoch) + ", not " + std::to_string(version) +
                  " of epoch " + std::to_string(trust.epoch),
              "publish the release again");
}

/// A release that asks for it has a freshness, signed and of its number.
Result<void> check_fresh(const ReleaseReader& read, const Release& release, const Trust& trust) {
  if (release.fresh_days == 0) return {};
  const std::string path = freshness_path(release.version);
  MODAR_ASSIGN(const auto document, read_signed(read, path, kMostKeyBytes));
  if (!document) return absent(path);
  MODAR_TRY(verify_signature(document->text, document->signature, trust.key));
  MODAR_ASSIGN(const auto fresh, parse_freshness(document->text));
  if (fresh.version == release.version && fresh.epoch == release.epoch) return {};
  return fail(kExitMixed, "ship.mixed", path, "it refers to another release",
              "sign it again: `modar ship refresh`");
}

class ObjectVerifier {
 public:
  ObjectVerifier(const ReleaseReader& read, VerifyReport& report,
                 const std::function<void(double)>& progress)
      : read_(read), report_(report), progress_(progress) {
    for (const ReleaseBundle& bundle : report.release.bundles) expected_ += bundle.pieces + 1.0;
  }

  Result<void> add(const ReleaseBundle& bundle) {
    MODAR_ASSIGN(const auto stored, object(bundle, bundle.recipe, bundle.recipe_size));
    if (stored.empty()) return {};
    const auto raw = unpack_zstd(std::as_bytes(std::span(stored)), bundle.recipe_raw_size);
    const auto recipe = raw ? open_recipe(*raw) : Result<RecipeView>(tl::unexpected(raw.error()));
    if (!recipe || recipe->header.bundle_size != bundle.size ||
        !std::equal(bundle.hash.begin(), bundle.hash.end(), recipe->header.bundle_hash)) {
      damage(bundle, bundle.recipe, "it is the recipe of another bundle");
      return {};
    }
    for (const PieceRecord& piece : recipe->pieces) {
      if (piece.stored_size != 0) {
        MODAR_TRY(object(bundle, std::to_array(piece.id), piece.stored_size));
      }
    }
    return {};
  }

 private:
  /// An object's bytes; none where it is damaged or was read before.
  Result<std::string> object(const ReleaseBundle& bundle, const ObjectId& id, std::uint64_t size) {
    if (progress_) progress_(std::min(1.0, ++asked_ / expected_));
    const bool first = read_before_.insert(id).second;
    // Bundles of equal content share a recipe: it is read again for each.
    if (!first && id != bundle.recipe) return std::string();
    const auto bytes = read_("objects/" + object_path(id), static_cast<std::size_t>(size));
    if (!bytes) return tl::unexpected(bytes.error());
    if (first) ++report_.objects;
    if (*bytes && (*bytes)->size() == size && object_id(std::as_bytes(std::span(**bytes))) == id) {
      if (first) report_.bytes += size;
      return **bytes;
    }
    if (first) damage(bundle, id, *bytes ? "its bytes do not match its name" : "it is missing");
    return std::string();
  }

  void damage(const ReleaseBundle& bundle, const ObjectId& id, const char* cause) {
    report_.damaged.push_back({"objects/" + object_path(id), bundle.name, cause});
  }

  const ReleaseReader& read_;
  VerifyReport& report_;
  const std::function<void(double)>& progress_;
  std::set<ObjectId> read_before_;
  double asked_ = 0;
  double expected_ = 0;
};

}  // namespace

ReleaseReader read_release_folder(const std::string& folder) {
  return [folder](const std::string& path,
                  std::size_t limit) -> Result<std::optional<std::string>> {
    const fs::path file = fs::path(folder) / path;
    std::error_code error;
    // A pipe would wait for somebody to write to it.
    if (!fs::is_regular_file(file, error)) return std::optional<std::string>();
    std::ifstream stream(file, std::ios::binary);
    std::string text(std::min<std::uintmax_t>(fs::file_size(file, error), limit + 1), '\0');
    if (error || !stream.read(text.data(), static_cast<std::streamsize>(text.size()))) {
      return fail(ExitCode::kIo, "io.read", file.string(), "it cannot be read", "check the disk");
    }
    return std::optional<std::string>(std::move(text));
  };
}

Result<RootSet> follow_root_chain(const ReleaseReader& read, const RootSet& trusted) {
  RootSet roots = trusted;
  const SignatureReader signature = [&read](const std::string& path) {
    return read(path, kMostKeyBytes);
  };
  for (std::uint32_t serial = 1; serial <= kMostLinks; ++serial) {
    const std::string path = root_rotation_path(serial);
    MODAR_ASSIGN(const auto text, read(path, kMostKeyBytes));
    if (!text) break;
    MODAR_TRY(verify_root_signatures(path, *text, roots, signature));
    MODAR_ASSIGN(auto link, parse_root_rotation(*text));
    if (link.serial != serial) {
      return fail(kExitMixed, "ship.chain", path, "it is a different link of the chain",
                  "publish the chain of root keys again");
    }
    MODAR_TRY(verify_root_signatures(path, *text, link.roots, signature));
    roots = std::move(link.roots);
  }
  return roots;
}

namespace {

/// The key that signs releases now.
Result<Trust> follow_keys(const ReleaseReader& read, const RootSet& trusted) {
  MODAR_ASSIGN(const RootSet roots, follow_root_chain(read, trusted));
  // Several root keys sign no releases: which key does is said in root.json.
  Trust trust{trusted.keys.size() == 1 ? trusted.keys.front() : PublicKey()};
  MODAR_TRY(follow_root_metadata(read, roots, trust));
  MODAR_TRY(follow_links(read, trust));
  return trust;
}

}  // namespace

Result<Release> newest_release(const ReleaseReader& read, const RootSet& trusted) {
  MODAR_ASSIGN(const Trust trust, follow_keys(read, trusted));
  return read_newest(read, trust);
}

Result<VerifyReport> verify_release(const ReleaseReader& read, const RootSet& trusted,
                                    const std::function<void(double)>& progress) {
  MODAR_ASSIGN(const Trust trust, follow_keys(read, trusted));
  VerifyReport report;
  MODAR_ASSIGN(report.release, read_newest(read, trust));
  MODAR_TRY(check_fresh(read, report.release, trust));
  report.key = trust.key;
  ObjectVerifier objects(read, report, progress);
  for (const ReleaseBundle& bundle : report.release.bundles) {
    MODAR_TRY(objects.add(bundle));
  }
  return report;
}

}  // namespace modar
