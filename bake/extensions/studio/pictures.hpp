// Photos and the pictures in them: corners, previews, grades.
#pragma once

#include <string>

#include "bake/extensions/studio/cache.hpp"
#include "bake/extensions/studio/http_reply.hpp"
#include "bake/pattern/pattern.hpp"
#include "formats/base/error.hpp"

namespace modar {

struct Session;

/// A photo as previews need it: small enough to be warped while a corner is dragged.
struct SmallPhoto {
  RgbaImage image;
  std::uint32_t width = 0;  ///< of the photo itself, upright
  std::uint32_t height = 0;
  double focal_px = 0;  ///< of the photo itself
};

/// A pattern with all that its grade and its rivals take.
struct GradedPattern {
  NamedPattern pattern;
  PatternScore score;
  double width_mm = 0;
};

struct PictureCaches {
  Cache<SmallPhoto> photos{std::size_t{256} << 20};
  Cache<std::string> thumbs{std::size_t{64} << 20};  ///< JPEG files
  Cache<GradedPattern> grades{std::size_t{256} << 20};
};

/// The verbs of the same names.
Result<Answer> get_thumb(Session& session, const Call& call);
Result<Answer> get_photo(Session& session, const Call& call);
Result<Answer> get_picture(Session& session, const Call& call);
Result<Answer> get_score(Session& session, const Call& call);
Result<Answer> get_rivals(Session& session, const Call& call);
Result<Answer> post_corners(Session& session, const Json& body);
Result<Answer> post_rectify(Session& session, const Json& body);

}  // namespace modar
