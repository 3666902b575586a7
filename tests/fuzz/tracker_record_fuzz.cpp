// libFuzzer target: frames of any size, stride and content, and records of any bytes, run through
// our pose loop without touching memory of others.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <vector>

#include "formats/bundle_writer.hpp"
#include "formats/pattern_shape.hpp"
#include "formats/tracker_record.hpp"
#include "modar/pose_loop.hpp"

namespace {

using namespace modar;

/// Two frames in sequence, cut from the input's bytes, of the size and stride that it asks for.
void run(const std::vector<std::byte>& bundle, std::span<const std::uint8_t> data) {
  const auto view = BundleView::open(bundle);
  if (!view) {
    std::fprintf(stderr, "%s\n", to_line(view.error()).c_str());
    std::abort();
  }
  const int width = 1 + data[0] % 160;
  const int height = 1 + data[1] % 120;
  const int stride = width + data[2] % 8;
  Camera camera = default_camera(width, height);
  camera.distortion[0] = (data[3] % 16 - 8) * 0.05;
  auto loop = PoseLoop::create(*view, camera);
  if (!loop) {
    if (loop.error().code.empty()) std::abort();
    return;
  }
  // Exactly as many bytes as a frame has: the sanitizer watches the ends.
  const auto size = static_cast<std::size_t>(stride * (height - 1) + width);
  std::vector<std::uint8_t> pixels(size);
  const auto rest = data.subspan(4);
  for (std::size_t i = 0; i < size && !rest.empty(); ++i) pixels[i] = rest[i % rest.size()];
  for (int i = 0; i < 2; ++i) {
    if (!(*loop)->step({pixels.data(), width, height, stride})) std::abort();
  }
}

/// A shape by the last bytes of the input: none, round, or two faces.
std::vector<std::byte> shape_of(std::span<const std::uint8_t> last) {
  PatternShapeHeader header{};
  header.kind = last[0] % 3;
  std::vector<std::byte> bytes(sizeof header);
  if (header.kind == 1) {
    header.half_arc = 0.01 + 0.012 * last[1];
    header.slope = (last[2] - 128) / 140.0;
  } else if (header.kind == 2) {
    header.face_count = 2;
    ShapeFaceRecord faces[2] = {{{0, 0, 64, 30}, {}, {1, 0, 0}, {0, -1, 0}, 0},
                                {{1, 30, 63, 34}, {}, {0, 0, -1}, {0, 1e-9f, 0}, 0}};
    for (std::size_t i = 0; i < 3; ++i) {
      faces[0].corner[i] = static_cast<float>(last[3 + i]) - 128.0f;
      faces[1].corner[i] = static_cast<float>(last[4 + i]) * 1e30f;
    }
    const auto all = std::as_bytes(std::span(faces));
    bytes.insert(bytes.end(), all.begin(), all.end());
  }
  std::memcpy(bytes.data(), &header, sizeof header);
  PatternSurface surface;
  if (view_pattern_shape(bytes, 64, 64, surface) != nullptr) bytes.clear();
  return bytes;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size < 8) return 0;
  const std::span<const std::uint8_t> all(data, size);
  BundleContent content;
  PatternRecord pattern{};
  pattern.name = content.intern("fuzz");
  pattern.width = pattern.height = 64;
  pattern.half_width = pattern.half_height = 1.0f;
  pattern.score = -1;
  content.patterns.push_back(pattern);
  content.features.emplace_back();
  ExtraSection section;
  section.type = static_cast<std::uint32_t>(SectionType::kTrackerRecord);
  section.owner = 0;
  // The seeds are loop records: the frame is drawn from the same bytes.
  section.bytes.assign(std::as_bytes(all).begin(), std::as_bytes(all).end());
  content.extra.push_back(std::move(section));
  ExtraSection shape;
  shape.type = static_cast<std::uint32_t>(SectionType::kPatternShape);
  shape.owner = 0;
  shape.bytes = shape_of(all.last(8));
  if (!shape.bytes.empty()) content.extra.push_back(std::move(shape));
  std::vector<std::byte> bytes;
  const auto written = write_bundle(content, [&bytes](std::span<const std::byte> part) {
    bytes.insert(bytes.end(), part.begin(), part.end());
    return true;
  });
  if (!written) return 0;
  // Sizes come from the end: a record's start is its header.
  run(bytes, all.last(std::min<std::size_t>(size, 4096)));
  return 0;
}
