// What the pose loop sees in raw gray frames, to the last bit: scripts/foreign.sh compares what
// this prints on two kinds of processor. First as people get it who give no camera, whose focal
// length is estimated; then with a given one. Usage: pose_bits BUNDLE WIDTH HEIGHT < FRAMES
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include "formats/bundle_view.hpp"
#include "modar/pose_loop.hpp"

namespace modar {
namespace {

std::vector<std::byte> contents(const char* path) {
  std::vector<std::byte> bytes;
  std::FILE* file = std::fopen(path, "rb");
  if (file == nullptr) return bytes;
  std::byte chunk[65536];
  for (std::size_t got = 0; (got = std::fread(chunk, 1, sizeof chunk, file)) > 0;) {
    bytes.insert(bytes.end(), chunk, chunk + got);
  }
  std::fclose(file);
  return bytes;
}

void print(int frame, const TrackResult& result) {
  std::printf("%d reason %d features %d focal %a %a\n", frame, static_cast<int>(result.reason),
              result.features, result.camera.focal, result.camera.sigma);
  for (const Detection& each : result.visible) {
    std::printf(" pattern %u inliers %d matches %d", each.pattern, each.inliers, each.matches);
    for (const glm::dvec2& corner : each.corners) std::printf(" %a %a", corner.x, corner.y);
    for (int i = 0; i < 3; ++i) std::printf(" %a", each.pose.translation[i]);
    for (int i = 0; i < 9; ++i) std::printf(" %a", each.pose.rotation[i / 3][i % 3]);
    std::printf(" %a %a", each.agreeing, each.likeness);
    std::printf("\n");
  }
}

int give_up(const std::string& why) {
  std::fprintf(stderr, "pose_bits: %s\n", why.c_str());
  return 1;
}

int run(const char* path, int width, int height) {
  const std::vector<std::byte> bytes = contents(path);
  const auto bundle = BundleView::open(bytes);
  if (!bundle) return give_up(to_line(bundle.error()));
  const std::size_t size = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  std::vector<std::vector<std::uint8_t>> frames(1, std::vector<std::uint8_t>(size));
  while (std::fread(frames.back().data(), 1, size, stdin) == size) frames.emplace_back(size);
  frames.pop_back();
  for (const bool estimate : {true, false}) {
    PoseLoopOptions how;
    how.estimate_camera = estimate;
    const auto loop = PoseLoop::create(*bundle, default_camera(width, height), how);
    if (!loop) return give_up(to_line(loop.error()));
    std::printf("camera %s\n", estimate ? "estimated" : "given");
    for (std::size_t i = 0; i < frames.size(); ++i) {
      const auto result = (*loop)->step({frames[i].data(), width, height, width});
      if (!result) return give_up(to_line(result.error()));
      print(static_cast<int>(i), *result);
    }
  }
  return 0;
}

}  // namespace
}  // namespace modar

int main(int count, char** words) {
  if (count != 4) return modar::give_up("give BUNDLE WIDTH HEIGHT, and gray frames on stdin");
  return modar::run(words[1], std::atoi(words[2]), std::atoi(words[3]));
}
