// Subdivision with noise, and OBJ text.
#include "bake/extensions/lab/big_obj.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <memory>
#include <vector>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "bake/import/read_model.hpp"
#include "bake/mesh/weld/weld.hpp"

namespace modar {
namespace {

using Triangles = Array<std::array<std::uint32_t, 3>>;

constexpr double kNoise = 0.15;  ///< of an edge's length

/// A number in [-0.5,0.5] that only depends on its seed (the finaliser of MurmurHash3).
double noise(std::uint64_t seed) {
  seed = (seed ^ (seed >> 30)) * 0xBF58476D1CE4E5B9u;
  seed = (seed ^ (seed >> 27)) * 0x94D049BB133111EBu;
  return static_cast<double>((seed ^ (seed >> 31)) >> 11) * 0x1p-53 - 0.5;
}

/// The vertex in the middle of each edge, made once an edge.
class Midpoints {
 public:
  Midpoints(Array<glm::dvec3>& positions, std::size_t triangles) : positions_(positions) {
    std::size_t slots = 1024;
    while (slots < 4 * triangles) slots *= 2;
    slots_.assign(slots, Slot());
  }

  std::uint32_t at(std::uint32_t a, std::uint32_t b) {
    const std::uint64_t key = std::uint64_t{std::min(a, b)} << 32 | std::max(a, b);
    const std::size_t mask = slots_.size() - 1;
    std::size_t i = ((key * 0x9E3779B97F4A7C15u) >> 32) & mask;
    while (slots_[i].key != key && slots_[i].key != 0) i = (i + 1) & mask;
    if (slots_[i].key == 0) {
      slots_[i] = {key, static_cast<std::uint32_t>(positions_.size())};
      const glm::dvec3 p = positions_[a];
      const glm::dvec3 q = positions_[b];
      const std::uint64_t seed = 3 * positions_.size();
      positions_.push_back((p + q) * 0.5 +
                           kNoise * glm::length(p - q) *
                               glm::dvec3(noise(seed), noise(seed + 1), noise(seed + 2)));
    }
    return slots_[i].vertex;
  }

 private:
  /// key 0 is no edge: its ends differ.
  struct Slot {
    std::uint64_t key = 0;
    std::uint32_t vertex = 0;
  };
  Array<glm::dvec3>& positions_;
  Array<Slot> slots_;
};

void subdivide(Array<glm::dvec3>& positions, Triangles& triangles) {
  Midpoints midpoints(positions, triangles.size());
  Triangles finer;
  finer.reserve(4 * triangles.size());
  for (const auto& [a, b, c] : triangles) {
    const std::uint32_t ab = midpoints.at(a, b);
    const std::uint32_t bc = midpoints.at(b, c);
    const std::uint32_t ca = midpoints.at(c, a);
    finer.push_back({a, ab, ca});
    finer.push_back({ab, b, bc});
    finer.push_back({ca, bc, c});
    finer.push_back({ab, bc, ca});
  }
  triangles = std::move(finer);
}

Array<glm::dvec3> vertex_normals(const Array<glm::dvec3>& positions, const Triangles& triangles) {
  Array<glm::dvec3> normals(positions.size(), glm::dvec3(0.0));
  for (const auto& [a, b, c] : triangles) {
    const glm::dvec3 n = glm::cross(positions[b] - positions[a], positions[c] - positions[a]);
    for (const std::uint32_t v : {a, b, c}) normals[v] += n;
  }
  for (glm::dvec3& n : normals) n = glm::length(n) > 0 ? glm::normalize(n) : glm::dvec3(0, 0, 1);
  return normals;
}

/// Gathers text and hands it to a file in large pieces.
class TextFile {
 public:
  explicit TextFile(const std::string& path) : file_(std::fopen(path.c_str(), "wb")) {}

  TextFile& word(const char* text) {
    while (*text != '\0') buffer_[used_++] = *text++;
    return *this;
  }
  TextFile& number(double value) {
    return moved(std::to_chars(at(), at() + kLongest, value, std::chars_format::fixed, 6).ptr);
  }
  TextFile& number(std::uint32_t value) {
    return moved(std::to_chars(at(), at() + kLongest, value).ptr);
  }
  TextFile& vector(const char* keyword, const glm::dvec3& v) {
    return word(keyword).number(v.x).word(" ").number(v.y).word(" ").number(v.z);
  }
  void end_line() {
    buffer_[used_++] = '\n';
    if (used_ > buffer_.size() - kLongestLine) flush();
  }
  /// Answers whether all has been written.
  bool close() {
    if (file_ == nullptr) return false;
    flush();
    return std::fclose(file_.release()) == 0 && good_;
  }

 private:
  static constexpr std::size_t kLongest = 330;  ///< the longest double with six decimals
  static constexpr std::size_t kLongestLine = 4 * kLongest;
  struct FileCloser {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };

  char* at() { return buffer_.data() + used_; }
  TextFile& moved(const char* end) {
    used_ = static_cast<std::size_t>(end - buffer_.data());
    return *this;
  }
  void flush() {
    good_ =
        good_ && file_ != nullptr && std::fwrite(buffer_.data(), 1, used_, file_.get()) == used_;
    used_ = 0;
  }

  std::unique_ptr<std::FILE, FileCloser> file_;
  std::vector<char> buffer_ = std::vector<char>(std::size_t{1} << 20);
  std::size_t used_ = 0;
  bool good_ = true;
};

bool write(const Array<glm::dvec3>& positions, const Triangles& triangles,
           const std::string& path) {
  glm::dvec3 low = positions[0];
  glm::dvec3 high = low;
  for (const glm::dvec3& p : positions) {
    low = glm::min(low, p);
    high = glm::max(high, p);
  }
  const glm::dvec3 sides = high - low;
  const double side = std::max({sides.x, sides.y, 1e-12});
  TextFile out(path);
  for (const glm::dvec3& p : positions) out.vector("v ", p).end_line();
  for (const glm::dvec3& p : positions) {
    out.word("vt ").number((p.x - low.x) / side).word(" ").number((p.y - low.y) / side).end_line();
  }
  for (const glm::dvec3& n : vertex_normals(positions, triangles)) out.vector("vn ", n).end_line();
  for (const auto& t : triangles) {
    out.word("f");
    for (const std::uint32_t v : t) {
      out.word(" ").number(v + 1).word("/").number(v + 1).word("/").number(v + 1);
    }
    out.end_line();
  }
  return out.close();
}

}  // namespace

Result<std::uint64_t> make_big_obj(const std::string& scan, std::uint64_t triangles,
                                   const std::string& path) {
  MODAR_ASSIGN(SourceModel source, read_model(scan, {}));
  Report report;
  MODAR_ASSIGN(TriMesh mesh, weld(std::move(source), report));
  for (glm::dvec3& p : mesh.positions) p = mesh.placement.center + mesh.placement.scale * p;
  // Half of a step of four, on the scale of factors.
  while (2 * mesh.triangles.size() < triangles) subdivide(mesh.positions, mesh.triangles);
  if (!write(mesh.positions, mesh.triangles, path)) {
    return fail(ExitCode::kIo, "io.write", path, "the file cannot be written",
                "make room, or set TMPDIR to a folder on a larger disk");
  }
  return mesh.triangles.size();
}

}  // namespace modar
