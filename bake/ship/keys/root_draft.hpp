// What several holders of root keys sign, each at home: a document in a file that they pass on,
// with a separate signature file next to it for each.
#pragma once

#include <string>

#include "bake/ship/keys/keys.hpp"
#include "bake/ship/release_folder.hpp"
#include "modar/release.hpp"

namespace modar {

/// The meaning of a draft, for the person who signs it.
struct RootDraft {
  std::string path;     ///< where it goes in the release folder: "root.json", "roots/S.json"
  std::string text;     ///< of the document
  std::string meaning;  ///< a sentence
};

/// That `next` signs releases from now on. Errors: those of ReleaseFolder::root_metadata().
Result<RootDraft> draft_root_metadata(const ReleaseFolder& folder, const PublicKey& next);
/// That these root keys follow those before.
RootDraft draft_root_rotation(const ReleaseFolder& folder, const RootSet& roots);
/// Errors: kIo "io.open"; kInvalidInput "ship.draft" where the file is neither.
Result<RootDraft> read_root_draft(const std::string& file);

/// Writes a draft to a file. Errors: kIo.
Result<void> write_root_draft(const std::string& file, const RootDraft& draft);
/// Signs the file; answers where the signature is: signature_path(). minisign -Sm writes one as
/// good. Errors: those of read_root_draft(); kIo.
Result<std::string> sign_root_draft(const std::string& file, const SecretKey& key);

/// Puts a draft into the release folder as devices read it, with the signatures next to it.
/// trust: the root keys that devices were given; those that count follow from the folder's chain.
/// Errors: those of read_root_draft(); kExitWrongKey "signature.too-few"; kUsage "ship.draft" where
/// the folder has changed since it was written.
Result<RootDraft> accept_root_draft(const ReleaseFolder& folder, const std::string& file,
                                    const RootSet& trust);

}  // namespace modar
