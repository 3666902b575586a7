// `modar pattern confusion`: does the device take one pattern of a project for another, or see one
// where there is none?
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "bake/lab/pose_bench.hpp"
#include "formats/error.hpp"

namespace modar {

/// A pattern as the device has it.
struct NamedPattern {
  std::string name;
  GrayPicture picture;
  std::vector<std::byte> bundle;  ///< holds its loop record alone
};

/// The patterns of bundles (*.modar, out of their loop records) and of pictures, in that order of
/// files. Errors: those of opening and of baking; kInvalidInput "confusion.record" (a bundle whose
/// patterns have no sound loop record).
Result<std::vector<NamedPattern>> read_patterns(const std::vector<std::string>& paths,
                                                unsigned jobs);

struct ConfusionOptions {
  std::vector<std::string> photos;  ///< image files without any pattern; may be empty
  int views = 4;                    ///< of each pattern, and of each photo
  int width = 1280;                 ///< of the frames, pixels
  int height = 720;
  std::uint64_t seed = 1;
  unsigned jobs = 1;  ///< threads; what comes out does not depend on it
};

struct Confusion {
  std::vector<std::string> names;
  int views = 0;
  /// How many views of pattern `shown` the pattern `asked` was recognised in, where the device knew
  /// of no other: [shown * names.size() + asked].
  std::vector<int> recognised;
  int photo_views = 0;
  std::vector<int> in_photos;  ///< recognitions in views of photos, a pattern
  /// Recognitions of a pattern that was not there, in all the views, by a device that knows all of
  /// them: of patterns that claim one place it believes the one that the frame shows.
  int together = 0;
  /// Recognitions of a pattern that was not there, where each was asked for alone.
  [[nodiscard]] int false_recognitions() const;
};

/// Asks the device's loop for each pattern in views of every other and in crops of photos: easy
/// views, where a likeness shows. Errors: those of reading photos and of the loop.
Result<Confusion> measure_confusion(const std::vector<NamedPattern>& patterns,
                                    const ConfusionOptions& options,
                                    const ProgressCallback& progress);

}  // namespace modar
