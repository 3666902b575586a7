#include "bake/extensions/studio/pictures.hpp"

#include <sys/stat.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <thread>

#include "bake/extensions/studio/path_guard.hpp"
#include "bake/extensions/studio/session.hpp"
#include "bake/image/image.hpp"
#include "bake/image/resample.hpp"
#include "bake/project/project.hpp"
#include "formats/base/atomic_file.hpp"
#include "formats/base/ranges.hpp"

namespace modar {
namespace {

constexpr std::uint32_t kSmallSide = 1200;  // pixels: a preview of 360 has three of them each way
constexpr int kThumbQuality = 82;           // of JPEG; 256 pixels take 12 KB
constexpr int kPreviewQuality = 88;
constexpr std::uint32_t kLeastThumb = 16;
constexpr std::uint32_t kMostThumb = 2048;
constexpr std::size_t kNearest = 4;  // patterns that a rival is looked for among

unsigned cores() {
  return std::max(1U, std::thread::hardware_concurrency());
}

/// Changes with the file: its name, size and time.
std::string key_of(const std::string& path) {
  struct stat status {};
  if (::stat(path.c_str(), &status) != 0) return path;
  return path + "|" + std::to_string(status.st_size) + "|" + std::to_string(status.st_mtim.tv_sec) +
         "." + std::to_string(status.st_mtim.tv_nsec);
}

RgbaImage no_larger(RgbaImage image, std::uint32_t side) {
  const std::uint32_t longest = std::max(image.width, image.height);
  if (longest <= side) return image;
  const auto scaled = [&](std::uint32_t length) {
    return static_cast<std::uint32_t>(std::max(1.0, std::round(1.0 * length * side / longest)));
  };
  return resize(image, scaled(image.width), scaled(image.height), {{}, cores()});
}

std::string text_of(const std::vector<std::byte>& bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

Result<std::shared_ptr<const SmallPhoto>> small_photo(Session& session, const std::string& path) {
  const std::string key = key_of(path);
  if (auto known = session.pictures.photos.find(key)) return known;
  MODAR_ASSIGN(Photo photo, read_photo(path));
  SmallPhoto small;
  small.width = photo.image.width;
  small.height = photo.image.height;
  small.focal_px = photo.focal_px;
  small.image = no_larger(std::move(photo.image), kSmallSide);
  const std::size_t bytes = small.image.pixels.size();
  return session.pictures.photos.add(key, std::move(small), bytes);
}

Result<std::string> thumb_of(Session& session, const std::string& path, std::uint32_t side) {
  const std::string key = std::to_string(side) + "|" + key_of(path);
  if (const auto known = session.pictures.thumbs.find(key)) return *known;
  MODAR_ASSIGN(RgbaImage image, read_image(path));
  MODAR_ASSIGN(const auto jpeg, encode_jpeg(no_larger(std::move(image), side), kThumbQuality));
  return *session.pictures.thumbs.add(key, text_of(jpeg), jpeg.size());
}

Result<std::array<PixelPoint, 4>> corners_in(const Json& body) {
  std::array<PixelPoint, 4> corners{};
  const Json list = body["corners"];
  bool good = list.size() == 4;
  for (std::size_t i = 0; good && i < 4; ++i) {
    const auto x = list[i][0].number();
    const auto y = list[i][1].number();
    good = x && y;
    if (good) corners[i] = {*x, *y};
  }
  if (good) return corners;
  return fail(ExitCode::kUsage, "studio.request", "", "corners are four pairs of numbers",
              "reload the page");
}

Json corners_json(const std::array<PixelPoint, 4>& corners) {
  return Json::list(corners, [&](const PixelPoint& corner) {
    return Json::array({corner.x, corner.y});
  });
}

/// Of a photo's pixels, in those of a smaller copy.
PixelPoint scaled(const PixelPoint& point, double scale) {
  return {(point.x + 0.5) * scale - 0.5, (point.y + 0.5) * scale - 0.5};
}

Result<Rectified> preview(Session& session, const Json& body) {
  MODAR_ASSIGN(const std::string path, file_inside(session.folder, body.text_at("file")));
  MODAR_ASSIGN(const auto photo, small_photo(session, path));
  RectifyOptions options;
  MODAR_ASSIGN(options.corners, corners_in(body));
  const double scale = 1.0 * photo->image.width / photo->width;
  for (PixelPoint& corner : options.corners) corner = scaled(corner, scale);
  options.width_mm = body.number_at("width_mm");
  options.height_mm = body.number_at("height_mm");
  options.focal_px = photo->focal_px * scale;
  options.max_side = static_cast<std::uint32_t>(std::clamp(body.number_at("size"), 64.0, 720.0));
  return rectify(photo->image, options);
}

struct NamedAsset {
  ProjectAsset asset;
  std::string path;
};

Result<NamedAsset> pattern_named(Session& session, const std::string& name) {
  MODAR_ASSIGN(const ProjectText::State state, session.text.read());
  const ProjectDraft draft = read_draft(state.text, session.file);
  for (const ProjectAsset& asset : draft.project.patterns) {
    if (asset.name == name) return NamedAsset{asset, path_in(session, asset.file)};
  }
  return fail(ExitCode::kUsage, "studio.unknown", name, "there is no such picture",
              "reload the page");
}

std::string key_of(const NamedAsset& named) {
  std::string key = std::to_string(named.asset.width_mm) + "|" + named.asset.shape.text + "|" +
                    key_of(named.path);
  for (const std::string& file : files_of(named.path, named.asset.shape)) key += "|" + key_of(file);
  return key;
}

Result<std::shared_ptr<const GradedPattern>> graded(Session& session, const NamedAsset& named) {
  const std::string key = key_of(named);
  if (auto known = session.pictures.grades.find(key)) return known;
  MODAR_ASSIGN(ScoredPicture scored,
               score_file(named.path, named.asset.width_mm, named.asset.shape, cores()));
  GradedPattern out;
  out.width_mm = scored.shaped.width_mm;
  out.score = std::move(scored.score);
  out.pattern.name = named.asset.name;
  MODAR_ASSIGN(out.pattern.bundle,
               bundle_of_record(scored.shaped.picture.view(), std::move(scored.record),
                                scored.shaped.section));
  out.pattern.picture = std::move(scored.shaped.picture);
  out.pattern.shape = std::move(scored.shaped.section);
  const std::size_t bytes = out.pattern.bundle.size() + out.pattern.picture.pixels.size();
  return session.pictures.grades.add(key, std::move(out), bytes);
}

Json score_json(const GradedPattern& one) {
  const PatternScore& score = one.score;
  const Json advice = Json::list(score.causes, [&](const ScoreCause& cause) -> Json {
    return {{"id", cause.id}, {"value", cause.value}, {"text", cause.advice}};
  });
  const Json features = Json::list(score.places, [&](const ScorePlace& place) {
    return Json::array({place.x, place.y, place.held});
  });
  const double cm = one.width_mm / 10;
  Json json = {
      {"pattern", one.pattern.name},
      {"grade", std::string(1, score.grade)},
      {"score", score.score},
      {"range_widths", Json::array({score.range.nearest, score.range.farthest})},
      {"range_cm",
       cm > 0 ? Json::array({score.range.nearest * cm, score.range.farthest * cm}) : Json()},
      {"tilt_deg", score.range.tilt_deg},
      {"sentence", range_sentence(score.range, one.width_mm)},
      {"advice", std::move(advice)},
      {"width", one.pattern.picture.width},
      {"height", one.pattern.picture.height},
      {"features", std::move(features)},
      {"views", score.views}};
  return json;
}

/// How alike two pictures are at a glance: the correlation of small copies, -1 to 1.
double likeness(const GrayPicture& a, const GrayPicture& b) {
  constexpr int kSamplesAcross = 24;
  const auto sample = [](const GrayPicture& picture, int x, int y) {
    const int px = (2 * x + 1) * picture.width / (2 * kSamplesAcross);
    const int py = (2 * y + 1) * picture.height / (2 * kSamplesAcross);
    return static_cast<double>(
        picture.pixels[static_cast<std::size_t>(py) * static_cast<std::size_t>(picture.width) +
                       static_cast<std::size_t>(px)]);
  };
  std::array<double, 5> sums{};  // a, b, aa, bb, ab
  for (int y = 0; y < kSamplesAcross; ++y) {
    for (int x = 0; x < kSamplesAcross; ++x) {
      const double va = sample(a, x, y);
      const double vb = sample(b, x, y);
      sums[0] += va;
      sums[1] += vb;
      sums[2] += va * va;
      sums[3] += vb * vb;
      sums[4] += va * vb;
    }
  }
  constexpr double kCount = kSamplesAcross * kSamplesAcross;
  const double together = sums[4] - sums[0] * sums[1] / kCount;
  const double spread =
      (sums[2] - sums[0] * sums[0] / kCount) * (sums[3] - sums[1] * sums[1] / kCount);
  return spread > 0 ? together / std::sqrt(spread) : 0;
}

/// The other patterns that look most like this one at a glance.
Result<std::vector<NamedAsset>> nearest_to(Session& session, const NamedAsset& named,
                                           const GradedPattern& own) {
  MODAR_ASSIGN(const ProjectText::State state, session.text.read());
  const ProjectDraft draft = read_draft(state.text, session.file);
  std::vector<std::pair<double, NamedAsset>> others;
  for (const ProjectAsset& asset : draft.project.patterns) {
    if (asset.name == named.asset.name) continue;
    NamedAsset other{asset, path_in(session, asset.file)};
    const auto photo = small_photo(session, other.path);
    if (!photo) continue;  // its own error is reported where it is shown
    others.emplace_back(likeness(own.pattern.picture, gray_of((*photo)->image)), std::move(other));
  }
  ranges::stable_sort(others, std::greater(), &decltype(others)::value_type::first);
  std::vector<NamedAsset> nearest;
  for (std::size_t i = 0; i < std::min(kNearest, others.size()); ++i) {
    nearest.push_back(std::move(others[i].second));
  }
  return nearest;
}

Result<Json> rivals_of(Session& session, const std::string& name) {
  MODAR_ASSIGN(const NamedAsset named, pattern_named(session, name));
  MODAR_ASSIGN(const auto own, graded(session, named));
  MODAR_ASSIGN(const auto nearest, nearest_to(session, named, *own));
  Json rivals = Json::array();
  for (const NamedAsset& other : nearest) {
    const auto theirs = graded(session, other);
    if (!theirs) continue;
    ConfusionOptions options;
    options.jobs = cores();
    MODAR_ASSIGN(const Confusion confusion,
                 measure_confusion({own->pattern, (*theirs)->pattern}, options, {}));
    const int times = confusion.recognised[1] + confusion.recognised[2];
    if (times == 0) continue;
    rivals.push_back(
        {{"pattern", other.asset.name}, {"times", times}, {"views", 2 * confusion.views}});
  }
  return Json{{"pattern", name}, {"rivals", std::move(rivals)}};
}

}  // namespace

Result<Answer> get_thumb(Session& session, const Call& call) {
  MODAR_ASSIGN(const std::string file, file_inside(session.folder, call.path.substr(10)));
  const long asked = std::strtol(call.asked("size").c_str(), nullptr, 10);
  const auto side = asked <= 0 ? 256U
                               : std::clamp(static_cast<std::uint32_t>(std::min(asked, 100000L)),
                                            kLeastThumb, kMostThumb);
  MODAR_ASSIGN(std::string thumb, thumb_of(session, file, side));
  return jpeg_answer(std::move(thumb));
}

Result<Answer> get_photo(Session& session, const Call& call) {
  MODAR_ASSIGN(const NamedAsset named, pattern_named(session, call.asked("pattern")));
  MODAR_ASSIGN(const auto photo, small_photo(session, named.path));
  return answer_of(
      Json{{"width", photo->width}, {"height", photo->height}, {"focal_px", photo->focal_px}});
}

Result<Answer> get_picture(Session& session, const Call& call) {
  MODAR_ASSIGN(const NamedAsset named, pattern_named(session, call.asked("pattern")));
  MODAR_ASSIGN(RgbaImage picture,
               read_pattern_picture(named.path, named.asset.width_mm, named.asset.shape));
  MODAR_ASSIGN(const auto jpeg, encode_jpeg(no_larger(std::move(picture), 720), kPreviewQuality));
  return jpeg_answer(text_of(jpeg));
}

Result<Answer> get_score(Session& session, const Call& call) {
  MODAR_ASSIGN(const NamedAsset named, pattern_named(session, call.asked("pattern")));
  MODAR_ASSIGN(const auto one, graded(session, named));
  return answer_of(score_json(*one));
}

Result<Answer> get_rivals(Session& session, const Call& call) {
  return answer_or_error(rivals_of(session, call.asked("pattern")));
}

Result<Answer> post_corners(Session& session, const Json& body) {
  MODAR_ASSIGN(const std::string path, file_inside(session.folder, body.text_at("file")));
  MODAR_ASSIGN(const Photo photo, read_photo(path));
  MODAR_TRY(small_photo(session, path));  // the next is a preview
  const double right = photo.image.width - 0.5;
  const double bottom = photo.image.height - 0.5;
  const std::array<PixelPoint, 4> whole = {
      PixelPoint{-0.5, -0.5}, {right, -0.5}, {right, bottom}, {-0.5, bottom}};
  const auto found = find_corners(photo.image);
  const FoundPicture picture = find_picture(photo, found);
  const std::string reason = found ? found->doubt() : "not-found";
  return answer_of(
      Json{{"corners", corners_json(picture.corners.value_or(found ? found->corners : whole))},
           {"cut", picture.corners.has_value()},
           {"doubt", *picture.doubt != 0},
           {"sure", found && reason.empty()},
           {"reason", reason},
           {"width", photo.image.width},
           {"height", photo.image.height}});
}

Result<Answer> post_rectify(Session& session, const Json& body) {
  MODAR_ASSIGN(const Rectified done, preview(session, body));
  MODAR_ASSIGN(const auto jpeg, encode_jpeg(done.image, kPreviewQuality));
  Answer answer = jpeg_answer(text_of(jpeg));
  answer.headers = {{"X-Aspect", std::to_string(done.aspect.aspect)},
                    {"X-Aspect-Spread", std::to_string(done.aspect.spread)}};
  return answer;
}

}  // namespace modar
