// One of our stages, or one peer, alone in a process, so that its peak of memory is its own. `modar
// bench model` starts it; prints lines of a name and a number.
#include <sys/mman.h>
#include <sys/resource.h>

#include <chrono>
#include <cstdio>
#include <cstring>
#include <string>
#include <vector>

#include "bake/extensions/lab/big_obj.hpp"
#include "bake/extensions/lab/probe_peers.hpp"
#include "bake/import/read_model.hpp"
#include "bake/mesh/lod/mesh_levels.hpp"
#include "bake/mesh/repair/repair.hpp"
#include "bake/mesh/weld/weld.hpp"
#include "formats/transport/chunk_order.hpp"

namespace modar {
namespace {

using Clock = std::chrono::steady_clock;

void print(const char* name, double value) {
  std::printf("%s %.17g\n", name, value);
}

double cpu_seconds() {
  rusage usage{};
  ::getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_utime.tv_sec + usage.ru_stime.tv_sec) +
         1e-6 * static_cast<double>(usage.ru_utime.tv_usec + usage.ru_stime.tv_usec);
}

/// Prints CPU and wall seconds between its making and its end.
class Stopwatch {
 public:
  ~Stopwatch() {
    print("cpu_s", cpu_seconds() - cpu_);
    print("wall_s", std::chrono::duration<double>(Clock::now() - wall_).count());
  }

 private:
  double cpu_ = cpu_seconds();
  Clock::time_point wall_ = Clock::now();
};

template <class T>
double bytes_of(const Array<T>& values) {
  return static_cast<double>(values.size() * sizeof(T));
}

int complain(const Error& error) {
  std::fprintf(stderr, "%s\n", to_line(error).c_str());
  return static_cast<int>(error.exit);
}

Result<SourceModel> read_timed(const std::string& path, unsigned jobs) {
  const Stopwatch watch;
  return read_obj(path, {jobs});
}

int probe_read(const std::string& path, unsigned jobs) {
  const Result<SourceModel> model = read_timed(path, jobs);
  if (!model) return complain(model.error());
  print("faces", static_cast<double>(model->face_count()));
  print("array_bytes", bytes_of(model->positions) + bytes_of(model->uvs) +
                           bytes_of(model->normals) + bytes_of(model->colours) +
                           bytes_of(model->corner_positions) + bytes_of(model->corner_uvs.own) +
                           bytes_of(model->corner_normals.own) + bytes_of(model->first_corner));
  return 0;
}

Result<TriMesh> read_and_weld(const std::string& path, unsigned jobs) {
  MODAR_ASSIGN(SourceModel model, read_obj(path, {jobs}));
  Report report;
  return weld(std::move(model), report, {jobs});
}

int probe_topology(const std::string& path, unsigned jobs) {
  const Result<TriMesh> mesh = read_and_weld(path, jobs);
  if (!mesh) return complain(mesh.error());
  Report report;
  const Stopwatch watch;
  measure_topology(*mesh, 0, report);
  return 0;
}

/// Repairs a model; writes the triangles by their positions where a file is named.
int probe_repair(const std::string& path, unsigned repair, const std::string& output) {
  Result<SourceModel> model = read_model(path, {1, true, ""});
  if (!model) return complain(model.error());
  Report report;
  if (repair != 0) {
    const Stopwatch watch;
    const MeshDefects repaired = repair_model(*model, repair == 2, report);
    for (std::size_t i = 0; i < kDefects; ++i) {
      print(kDefectNames[i], static_cast<double>(repaired.counts[i].count));
      print("  area", repaired.counts[i].area);
    }
  }
  const Result<TriMesh> mesh = weld(std::move(*model), report, {1});
  if (!mesh) return complain(mesh.error());
  {
    const Stopwatch watch;
    const MeshDefects left = count_defects(*mesh, repair != 0, {}, report);
    for (std::size_t i = 0; i < kDefects; ++i) {
      print(kDefectNames[i], static_cast<double>(left.counts[i].count));
      print("  area", left.counts[i].area);
    }
  }
  if (output.empty()) return 0;
  std::FILE* const file = std::fopen(output.c_str(), "w");
  if (file == nullptr) return 1;
  std::vector<glm::dvec3> positions;
  for (std::uint32_t v = 0; v < mesh->positions.size(); ++v) {
    const std::uint32_t p = mesh->source_position(v);
    if (p >= positions.size()) positions.resize(p + std::size_t{1});
    positions[p] = mesh->placement.center + mesh->placement.scale * mesh->positions[v];
  }
  for (const glm::dvec3& p : positions) std::fprintf(file, "v %.17g %.17g %.17g\n", p.x, p.y, p.z);
  for (const auto& t : mesh->triangles) {
    std::fprintf(file, "f %u %u %u\n", mesh->source_position(t[0]) + 1,
                 mesh->source_position(t[1]) + 1, mesh->source_position(t[2]) + 1);
  }
  std::fclose(file);
  return 0;
}

Result<ChunkedMesh> read_and_chunk(const std::string& path, unsigned jobs) {
  MODAR_ASSIGN(TriMesh mesh, read_and_weld(path, jobs));
  Report report;
  return chunk(std::move(mesh), {}, report);
}

int probe_levels(const std::string& path, unsigned jobs) {
  Result<ChunkedMesh> mesh = read_and_chunk(path, jobs);
  if (!mesh) return complain(mesh.error());
  Report report;
  LevelOptions options;
  options.jobs = jobs;
  const Stopwatch watch;
  const auto made = make_levels(*mesh, options, report);
  return made ? 0 : complain(made.error());
}

/// meshoptimizer's vertex cache and fetch order on the same chunks, compared with ours.
int probe_order(const std::string& path, bool ours) {
  constexpr std::uint32_t kStride = 16;
  const Result<ChunkedMesh> mesh = read_and_chunk(path, 1);
  if (!mesh) return complain(mesh.error());
  std::uint64_t misses = 0;
  std::uint64_t triangles = 0;
  double cpu = 0;
  ChunkOrderer orderer;
  for (const Chunk& chunk : mesh->chunks) {
    std::vector<std::byte> vertices(chunk.vertices.size() * kStride);
    for (std::size_t v = 0; v < chunk.vertices.size(); ++v) {
      std::memcpy(vertices.data() + v * kStride, &mesh->mesh.positions[chunk.vertices[v]], kStride);
    }
    std::vector<std::uint16_t> indices = chunk.indices;
    const double begin = cpu_seconds();
    if (ours) {
      orderer.order(vertices, kStride, indices);
    } else {
      order_with_meshopt(vertices, kStride, indices);
    }
    cpu += cpu_seconds() - begin;
    misses += count_cache_misses(indices, 16);
    triangles += indices.size() / 3;
  }
  print("cpu_s", cpu);
  print("misses_per_triangle", static_cast<double>(misses) / static_cast<double>(triangles));
  return 0;
}

int probe_peer(std::uint64_t (*parse)(const std::string&), const std::string& path) {
  std::uint64_t faces = 0;
  {
    const Stopwatch watch;
    faces = parse(path);
  }
  print("faces", static_cast<double>(faces));
  return faces != 0 ? 0 : 1;
}

/// What the system alone takes to hand out memory of this size.
int probe_pages(std::size_t bytes) {
  const Stopwatch watch;
  Array<char> memory(bytes);
  for (std::size_t i = 0; i < bytes; i += 4096) memory[i] = 1;
  return 0;
}

int run(const std::string& what, const std::string& path, const std::string& number,
        const std::string& output) {
  const auto jobs = static_cast<unsigned>(std::stoull(number));
  if (what == "read") return probe_read(path, jobs);
  if (what == "topology") return probe_topology(path, jobs);
  if (what == "repair") return probe_repair(path, jobs, output);
  if (what == "levels") return probe_levels(path, jobs);
  if (what == "order") return probe_order(path, true);
  if (what == "meshopt") return probe_order(path, false);
  if (what == "tinyobj") return probe_peer(parse_with_tinyobj, path);
  if (what == "assimp") return probe_peer(parse_with_assimp, path);
  if (what == "pages") return probe_pages(std::stoull(number));
  if (what != "make") return 1;
  const auto made = make_big_obj(path, std::stoull(number), output);
  if (!made) return complain(made.error());
  print("triangles", static_cast<double>(*made));
  return 0;
}

}  // namespace
}  // namespace modar

int main(int count, char** arguments) {
  if (count < 4) {
    std::fprintf(stderr,
                 "usage: modar-model-probe read|topology|levels|order|meshopt|tinyobj|assimp|pages "
                 "FILE NUMBER\n       modar-model-probe make SCAN TRIANGLES OUT.obj\n");
    return 1;
  }
  return modar::run(arguments[1], arguments[2], arguments[3], count > 4 ? arguments[4] : "");
}
