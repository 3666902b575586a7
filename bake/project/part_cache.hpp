// The cache of baked assets: each a bundle of one model or one pattern, by what went into it.
// Several processes and machines may share its folder: an entry appears whole, by a rename, and
// never changes. Whoever finds one damaged removes it.
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "bake/report.hpp"
#include "formats/bundle_view.hpp"
#include "formats/bundle_writer.hpp"
#include "modar/mapped_file.hpp"

namespace modar {

/// What the bake of an asset gave beside its bundle.
struct PartNotes {
  std::array<double, 3> model_sides{};
  std::vector<Diagnostic> diagnostics;
};

/// An entry that was read and whose hashes hold.
struct CachedPart {
  MappedFile file;
  BundleView bundle;  ///< of the file
  PartNotes notes;
};

class PartCache {
 public:
  /// The folder is made when something is written to it. Errors of what writes: kIo "cache.folder"
  /// and those of AtomicFile.
  explicit PartCache(const std::string& folder);

  /// The other files that the asset behind `action` named when it was baked last, relative to its
  /// own folder. Nothing: it was never baked.
  [[nodiscard]] std::optional<std::vector<std::string>> files_of(const std::string& action) const;
  [[nodiscard]] bool has(const std::string& key) const;
  /// Nothing where there is no such entry. Removes a damaged one, says so in `damaged`.
  [[nodiscard]] std::optional<CachedPart> read(const std::string& key, bool& damaged) const;
  Result<void> write_files(const std::string& action, const std::vector<std::string>& files) const;
  Result<void> write(const std::string& key, const BundleContent& content,
                     const PartNotes& notes) const;

 private:
  [[nodiscard]] std::string path(const char* kind, const std::string& key,
                                 const char* extension) const;
  /// The place of a file, whose folder is made.
  [[nodiscard]] Result<std::string> place(const char* kind, const std::string& key,
                                          const char* extension) const;

  std::string folder_;
  std::string tag_;  ///< tells backup programs to leave the folder out
};

}  // namespace modar
