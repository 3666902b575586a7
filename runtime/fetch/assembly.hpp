// One bundle of a new release, from old pieces and new ones to the finished file.
#pragma once

#include <cstdint>
#include <set>
#include <string>
#include <vector>

#include "bundle_source.hpp"
#include "files.hpp"
#include "modar/release.hpp"

namespace modar::fetch {

/// A bundle that is to be put together.
struct Assembly {
  ReleaseBundle bundle;
  std::string recipe_stored;                ///< as it came, kept beside the bundle
  std::vector<std::uint64_t> recipe_bytes;  ///< unpacked, aligned
  RecipeView recipe;
  std::string file;  ///< NAME.modar in the spare slot
};

struct AssemblyCounts {
  std::uint64_t reused_bytes = 0;
  std::uint32_t reused_pieces = 0;
  std::uint32_t new_pieces = 0;
};

/// Writes the file at `assembly.file`: old pieces from `source`, the others from `pieces`/ID, and
/// holds the whole against its hash. Pieces of `source` in `damaged` come from `pieces`, too;
/// where more of them turn out damaged they are added to it, and the file is not finished.
/// Errors: kIo; kInvalidInput; kExitMixed "fetch.hash" (the pieces do not make the bundle).
Result<void> assemble(const Assembly& assembly, const PieceSource& source,
                      const std::string& pieces, AssemblyCounts& counts,
                      std::set<ObjectId>& damaged);

/// Holds a file against a bundle's signed hash and the rules of a good bundle.
/// Errors: kIo; kExitBadBundle "store.hash", "store.rules".
Result<void> verify_bundle(const std::string& file, const ReleaseBundle& bundle);

}  // namespace modar::fetch
