// Moves uvs as material files say of their maps: scales, offsets and UDIM tiles.
#include "bake/import/obj/map_places.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>

#include <glm/common.hpp>

#include "formats/base/ranges.hpp"

namespace modar {
namespace {

constexpr std::string_view kTileMark = "<UDIM>";
/// A row of tiles (u), and rows: numbers are 1001 + u + 10 v.
constexpr int kTileColumns = 10;
constexpr int kTileRows = 10;

/// The text with the mark for the number of a tile.
std::string tile_name(std::string_view text, int number) {
  std::string name(text);
  if (const std::size_t at = name.rfind(kTileMark); at != std::string::npos) {
    name.replace(at, kTileMark.size(), std::to_string(number));
  }
  return name;
}

/// Lets corners have uvs of their own; false without uvs.
bool own_uvs(SourceModel& model) {
  if (model.uvs.empty() || model.corner_uvs.kind == IndexPlane::Kind::kAbsent) return false;
  if (model.corner_uvs.kind == IndexPlane::Kind::kSame) {
    model.corner_uvs.own = model.corner_positions;
    model.corner_uvs.kind = IndexPlane::Kind::kOwn;
  }
  return true;
}

/// New uvs, each once.
class MovedUvs {
 public:
  explicit MovedUvs(SourceModel& model) : model_(model) {}

  /// key: of the scale and offset.
  void move_face(std::size_t face, std::uint32_t key, const MapPlace& place) {
    const std::size_t first = model_.face_first(face);
    for (std::size_t c = first; c < first + model_.face_size(face); ++c) {
      std::uint32_t& uv = model_.corner_uvs.own[c];
      if (uv == kNoIndex) continue;
      const auto [found, added] = moved_.try_emplace({key, uv}, 0);
      if (added) {
        found->second = static_cast<std::uint32_t>(model_.uvs.size());
        model_.uvs.push_back(model_.uvs[uv] * place.scale + place.offset);
      }
      uv = found->second;
    }
  }

 private:
  SourceModel& model_;
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> moved_;
};

/// The tile that the middle of a face is in, as u + 10 v; 0 for faces without uvs, -1 beyond all.
int tile_of(const SourceModel& model, std::size_t face) {
  glm::dvec2 sum(0.0);
  const std::size_t first = model.face_first(face);
  for (std::size_t c = first; c < first + model.face_size(face); ++c) {
    const std::uint32_t uv = model.corner_uvs.own[c];
    if (uv == kNoIndex) return 0;
    sum += model.uvs[uv];
  }
  const glm::dvec2 tile = glm::floor(sum / static_cast<double>(model.face_size(face)));
  const bool known = tile.x >= 0 && tile.y >= 0 && tile.x < kTileColumns && tile.y < kTileRows;
  return known ? static_cast<int>(tile.x + kTileColumns * tile.y) : -1;
}

}  // namespace

std::string find_tiles(std::string_view name, const ModelFolder& folder) {
  if (name.rfind(kTileMark) == std::string_view::npos) return {};
  for (int tile = 0; tile < kTileColumns * kTileRows; ++tile) {
    const std::string number = std::to_string(1001 + tile);
    std::string path = find_named_file(tile_name(name, 1001 + tile), folder);
    const std::size_t at = path.rfind(number);
    if (at != std::string::npos) return path.replace(at, number.size(), kTileMark);
  }
  return {};
}

void place_maps(SourceModel& model) {
  const auto moved = [](const SourceMaterial& m) { return m.place != MapPlace(); };
  if (ranges::none_of(model.materials, moved) || !own_uvs(model)) return;
  MovedUvs uvs(model);
  RunCursor materials(model.material_runs);
  for (std::size_t f = 0; f < model.face_count(); ++f) {
    const std::uint32_t number = materials.at(f);
    const MapPlace& place = model.materials[number].place;
    if (place != MapPlace()) uvs.move_face(f, number, place);
  }
}

void place_tiles(const ModelFolder& folder, const std::string& label, SourceModel& model) {
  const std::vector<SourceMaterial> named = model.materials;
  const auto tiled = [](const SourceMaterial& m) {
    return m.diffuse_map.find(kTileMark) != std::string::npos;
  };
  if (ranges::none_of(named, tiled)) return;
  const bool has_uvs = own_uvs(model);
  MovedUvs uvs(model);
  std::map<std::pair<std::uint32_t, int>, std::uint32_t> made;  // by material and tile
  std::map<std::string, std::uint64_t> missing;                 // faces, by path
  std::vector<FaceRun> runs;
  RunCursor materials(model.material_runs);
  for (std::size_t f = 0; f < model.face_count(); ++f) {
    std::uint32_t number = materials.at(f);
    if (tiled(named[number])) {
      const SourceMaterial& material = named[number];
      const int tile = has_uvs ? tile_of(model, f) : 0;
      const std::string path = tile_name(material.diffuse_map, 1001 + tile);
      const bool there = tile >= 0 && folder.has(path);
      const auto [found, added] = made.try_emplace({number, tile}, number);
      if (added && tiled(model.materials[number])) {
        model.materials[number].diffuse_map = there ? path : "";
      } else if (added) {
        found->second = static_cast<std::uint32_t>(model.materials.size());
        model.materials.push_back(material);
        model.materials.back().diffuse_map = there ? path : "";
      }
      number = found->second;
      if (!there) ++missing[tile < 0 ? "beyond 1001 to 1100" : path];
      const glm::dvec2 corner(tile % kTileColumns, tile / kTileColumns);
      if (tile > 0) uvs.move_face(f, static_cast<std::uint32_t>(tile), {glm::dvec2(1), -corner});
    }
    if (runs.empty() || runs.back().value != number) runs.push_back({f, number});
  }
  for (SourceMaterial& m : model.materials) {
    if (tiled(m)) m.diffuse_map.clear();  // no face shows it
  }
  model.material_runs = std::move(runs);
  for (const auto& [path, faces] : missing) {
    model.files.push_back(path);
    model.diagnostics.push_back(not_read(
        "mtl.missing-map", label, 0,
        "tile '" + path.substr(path.rfind('/') + 1) + "' of " + std::to_string(faces) + " faces",
        path, folder, "put it next to the other tiles"));
  }
}

}  // namespace modar
