// libFuzzer target: a model of any structure is baked into a good bundle, or refused with a coded
// error.
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <fstream>
#include <string>

#include "bake/bundle/bundle_builder.hpp"
#include "formats/check.hpp"
#include "tests/fuzz/input_file.hpp"
#include "tests/fuzz/made_model.hpp"
#include "tests/fuzz/need.hpp"

namespace {

using namespace modar;
using test::need;

/// Triangles of all parts together.
constexpr std::uint32_t kMostMade = 50'000;

/// Bytes of the input in order, zeros after its end.
struct Bytes {
  const std::uint8_t* data;
  std::size_t size;
  bool empty() const { return size == 0; }
  std::uint32_t next(std::uint32_t below) {
    if (size == 0) return 0;
    --size;
    return *data++ % below;
  }
};

test::Part part_of(Bytes& bytes) {
  test::Part part;
  part.structure =
      static_cast<test::Structure>(bytes.next(static_cast<std::uint32_t>(test::Structure::kCount)));
  part.seams =
      static_cast<test::Seams>(bytes.next(static_cast<std::uint32_t>(test::Seams::kCount)));
  part.triangles = 1 + bytes.next(16) + 64 * bytes.next(256);
  const std::uint32_t look = bytes.next(256);
  part.materials = look % 4 == 0 ? 1 : look % 4 == 1 ? 4 : look % 4 == 2 ? 200 : part.triangles;
  constexpr double kScales[] = {1, 1e-3, 1e3, 1e-30, 1e30, 1e-300, 1e300, 1e-9};
  part.scale = kScales[look / 4 % 8];
  constexpr double kAway[] = {0, 1, 1e6, 1e12};
  part.away = kAway[look / 32 % 4];
  return part;
}

void write(const std::string& path, const std::string& bytes) {
  std::ofstream(path, std::ios::binary)
      .write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static test::InputFile folder("made.mtl");
  Bytes bytes{data, size};
  const std::uint32_t format = bytes.next(4);
  const std::uint32_t options = bytes.next(256);
  const std::uint32_t instances = 1 + bytes.next(256) * bytes.next(8);
  test::ModelMaker maker;
  while (!bytes.empty()) {
    const test::Part part = part_of(bytes);
    if ((maker.model.faces.size() + part.triangles) * (format == 3 ? instances : 1) > kMostMade)
      break;
    maker.add(part);
  }
  const std::string mtl = test::mtl_of(4);
  folder.write(reinterpret_cast<const std::uint8_t*>(mtl.data()), mtl.size());
  write(folder.folder() + "/picture.bmp", test::bmp());
  constexpr const char* kNames[] = {"/made.obj", "/made.ply", "/made.stl", "/made.glb"};
  const std::string path = folder.folder() + kNames[format];
  write(path, format == 0   ? test::obj_of(maker.model)
              : format == 1 ? test::ply_of(maker.model)
              : format == 2 ? test::stl_of(maker.model)
                            : test::glb_of(maker.model, instances, options % 2 == 0 ? 0 : 1));
  BakeRequest request;
  request.models = {path};
  request.topology = (options & 2) != 0;
  request.most_triangles = (options & 4) != 0 ? 300 : 0;
  if ((options & 8) != 0) request.positions = PositionKind::kInt16;
  if ((options & 16) != 0) request.max_error = {MaxError::Unit::kPercent, 1e-4};
  request.occlusion = (options & 32) == 0;
  if ((options & 64) != 0) request.atlas = AtlasMode::kAlways;
  Report report;
  const Result<BundleContent> content = build_bundle(request, report);
  if (!content) {
    test::need_told(content.error());
    return 0;
  }
  const Result<std::vector<std::byte>> bundle = encode_bundle(*content);
  need(bundle.has_value() && first_error(*bundle).empty());
  return 0;
}
