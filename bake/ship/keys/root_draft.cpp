#include "bake/ship/keys/root_draft.hpp"

#include <filesystem>
#include <utility>
#include <vector>

#include "bake/ship/verify_release.hpp"
#include "formats/base/atomic_file.hpp"

namespace modar {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMostDraftBytes = 4096;  // what devices read of such a document

std::string describe(const RootMetadata& word, const PublicKey& key) {
  return "epoch " + std::to_string(word.epoch) + ": key " + to_hex(key.id) +
         " signs releases, behind link " + std::to_string(word.links) + " of the chain of keys";
}

std::string describe(const RootRotation& link) {
  std::string text = "link " + std::to_string(link.serial) +
                     " of the chain of root keys: " + std::to_string(link.roots.threshold) +
                     " of " + std::to_string(link.roots.keys.size()) + " must agree from now on:";
  for (const PublicKey& key : link.roots.keys) text += " " + to_hex(key.id);
  return text;
}

/// Files next to a file, whatever folder the paths name.
SignatureReader beside(const std::string& file) {
  const fs::path path(file);
  const std::string folder = path.has_parent_path() ? path.parent_path().string() : ".";
  return [read = read_release_folder(folder)](const std::string& asked) {
    return read(fs::path(asked).filename().string(), kMostDraftBytes);
  };
}

tl::unexpected<Error> stale(const std::string& file, const std::string& cause) {
  return fail(ExitCode::kUsage, "ship.draft", file, cause, "write a new draft, and have it signed");
}

}  // namespace

Result<RootDraft> draft_root_metadata(const ReleaseFolder& folder, const PublicKey& next) {
  MODAR_ASSIGN(RootMetadata word, folder.root_metadata());
  ++word.epoch;
  word.links = folder.key_rotations();
  word.key = public_key_line(next);
  return RootDraft{"root.json", root_metadata_text(word), describe(word, next)};
}

RootDraft draft_root_rotation(const ReleaseFolder& folder, const RootSet& roots) {
  const RootRotation link{folder.root_rotations() + 1, roots};
  return {root_rotation_path(link.serial), root_rotation_text(link), describe(link)};
}

Result<RootDraft> read_root_draft(const std::string& file) {
  MODAR_ASSIGN(const auto text, beside(file)(file));
  if (!text) {
    return fail(ExitCode::kIo, "io.open", file, "there is no such file", "check the path");
  }
  if (const auto word = parse_root_metadata(*text)) {
    MODAR_ASSIGN(const auto key, parse_public_key(word->key));
    return RootDraft{"root.json", *text, describe(*word, key)};
  }
  if (const auto link = parse_root_rotation(*text)) {
    return RootDraft{root_rotation_path(link->serial), *text, describe(*link)};
  }
  return fail(ExitCode::kInvalidInput, "ship.draft", file,
              "it names neither a signing key nor new root keys",
              "give the file that `modar ship root --draft` wrote");
}

Result<void> write_root_draft(const std::string& file, const RootDraft& draft) {
  return write_file(file, std::string_view(draft.text));
}

Result<std::string> sign_root_draft(const std::string& file, const SecretKey& key) {
  MODAR_ASSIGN(const auto draft, read_root_draft(file));
  const std::string path = signature_path(file, key.public_key);
  const std::string signature = sign(key, draft.text, "modar " + draft.path);
  MODAR_TRY(write_file(path, std::string_view(signature)));
  return path;
}

Result<RootDraft> accept_root_draft(const ReleaseFolder& folder, const std::string& file,
                                    const RootSet& trust) {
  MODAR_ASSIGN(auto draft, read_root_draft(file));
  const SignatureReader read = beside(file);
  MODAR_ASSIGN(const RootSet roots, folder.roots(trust));
  MODAR_TRY(verify_root_signatures(file, draft.text, roots, read));
  std::vector<PublicKey> signers = roots.keys;
  if (draft.path == "root.json") {
    MODAR_ASSIGN(const auto word, parse_root_metadata(draft.text));
    MODAR_ASSIGN(const auto before, folder.root_metadata());
    if (word.epoch != before.epoch + 1 || word.links != folder.key_rotations()) {
      return stale(file, "the folder has come to epoch " + std::to_string(before.epoch) +
                             " and link " + std::to_string(folder.key_rotations()) + " since");
    }
  } else {
    MODAR_ASSIGN(const auto link, parse_root_rotation(draft.text));
    if (link.serial != folder.root_rotations() + 1) {
      return stale(file, "the folder has come to link " + std::to_string(folder.root_rotations()) +
                             " of the root keys since");
    }
    MODAR_TRY(verify_root_signatures(file, draft.text, link.roots, read));
    signers.insert(signers.end(), link.roots.keys.begin(), link.roots.keys.end());
  }
  std::vector<std::pair<PublicKey, std::string>> signatures;
  for (const PublicKey& key : signers) {
    MODAR_ASSIGN(auto text, read(signature_path(file, key)));
    const auto signature = parse_signature(text.value_or(""));
    if (signature && verify_signature(draft.text, *signature, key)) {
      signatures.emplace_back(key, std::move(*text));
    }
  }
  MODAR_TRY(folder.add_signed(draft.path, draft.text, signatures));
  return draft;
}

}  // namespace modar
