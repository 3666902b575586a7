// `modar pattern confusion`: whether the device takes one pattern of a project for another, or
// recognises one in photos that show none.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "bake/pattern/trial.hpp"
#include "bake/report.hpp"
#include "formats/base/error.hpp"

namespace modar {

struct ConfusionOptions {
  std::vector<std::string> photos;  ///< image files without any pattern; may be empty
  int views = 4;                    ///< of each pattern, and of each photo
  int width = 1280;                 ///< of the frames, pixels
  int height = 720;
  std::uint64_t seed = 1;
  unsigned jobs = 1;  ///< threads; the outcome does not depend on it
};

/// Two patterns, a series' prints say, of which one was recognised in views of the other.
struct AlikePair {
  std::size_t a = 0;
  std::size_t b = 0;
  /// A device that knows both tells them apart. Else they are to be kept out of each other's sight,
  /// or changed in more than a detail.
  bool told_apart = false;
  bool operator==(const AlikePair&) const = default;
};

struct Confusion {
  std::vector<std::string> names;
  int views = 0;
  /// In how many views of pattern `shown` a device that knows only pattern `asked` recognises it:
  /// [shown * names.size() + asked].
  std::vector<int> recognised;
  int photo_views = 0;
  std::vector<int> in_photos;  ///< of each pattern: recognitions in views of photos
  /// Of each pattern: recognitions in as many views of its mirror image, by a device that knows it
  /// alone.
  std::vector<int> mirrored;
  /// How often a device that knows all patterns recognises `asked` in the views of pattern `shown`:
  /// [shown * names.size() + asked]. Of patterns that claim one place it keeps the one that the
  /// frame agrees with best.
  std::vector<int> together;
  int photos_together = 0;  ///< its recognitions in views of photos
  /// The same by devices that know one pattern each; mirror images are not counted.
  [[nodiscard]] int false_recognitions() const;
  /// Recognitions of patterns that were not there by the device that knows all.
  [[nodiscard]] int false_together() const;
  [[nodiscard]] std::vector<AlikePair> alike_pairs() const;
};

/// Runs the device's tracker for each pattern on views of every other and on photos. The views are
/// easy, so that a likeness shows. Errors: those of reading photos and of the tracker.
Result<Confusion> measure_confusion(const std::vector<NamedPattern>& patterns,
                                    const ConfusionOptions& options,
                                    const ProgressCallback& progress);

}  // namespace modar
