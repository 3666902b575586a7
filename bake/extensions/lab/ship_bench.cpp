#include "bake/extensions/lab/ship_bench.hpp"

#include <algorithm>
#include <cstring>
#include <filesystem>

#include <meshoptimizer.h>
#include <zstd.h>

#include "bake/process/process.hpp"
#include "bake/process/thread_clock.hpp"
#include "bake/ship/recipe_maker.hpp"
#include "modar/mapped_file.hpp"
#include "modar/piece.hpp"

namespace modar {
namespace {

std::size_t zstd_size(std::span<const std::byte> bytes) {
  std::vector<std::byte> packed(ZSTD_compressBound(bytes.size()));
  return ZSTD_compress(packed.data(), packed.size(), bytes.data(), bytes.size(), 19);
}

/// What the same geometry costs in other hands, chunk by chunk.
struct GeometryPeers {
  std::size_t raw = 0;
  std::size_t zstd = 0;
  std::size_t meshopt = 0;  ///< vertex and index codec, then zstd
};

GeometryPeers measure_peers(const BundleView& bundle, const ModelRecord& model) {
  GeometryPeers peers;
  const std::size_t stride = bundle.layouts()[model.layout].stride;
  for (std::uint32_t c = 0; c < model.chunk_count; ++c) {
    const LevelRecord& level = bundle.levels()[bundle.chunks()[model.first_chunk + c].first_level];
    std::vector<std::uint16_t> indices(level.index_count);
    std::memcpy(indices.data(), bundle.indices().data() + level.index_offset, 2 * indices.size());
    const auto [low, high] = std::minmax_element(indices.begin(), indices.end());
    const std::size_t first = *low;
    const std::size_t count = *high - first + 1;
    const auto vertices =
        bundle.vertices().subspan(level.vertex_offset + first * stride, count * stride);
    for (std::uint16_t& index : indices) index = static_cast<std::uint16_t>(index - first);
    std::vector<std::byte> both(vertices.begin(), vertices.end());
    const auto index_bytes = std::as_bytes(std::span(indices));
    both.insert(both.end(), index_bytes.begin(), index_bytes.end());
    peers.raw += both.size();
    peers.zstd += zstd_size(both);

    std::vector<unsigned char> coded(meshopt_encodeVertexBufferBound(count, stride));
    coded.resize(
        meshopt_encodeVertexBuffer(coded.data(), coded.size(), vertices.data(), count, stride));
    std::vector<unsigned char> coded_indices(meshopt_encodeIndexBufferBound(indices.size(), count));
    coded_indices.resize(meshopt_encodeIndexBuffer(coded_indices.data(), coded_indices.size(),
                                                   indices.data(), indices.size()));
    coded.insert(coded.end(), coded_indices.begin(), coded_indices.end());
    peers.meshopt += zstd_size(std::as_bytes(std::span(coded)));
  }
  return peers;
}

/// CPU seconds to decode all pieces, and what mesh objects cost.
struct DecodeCost {
  double seconds = 0;
  double mesh_seconds = 0;
  std::size_t mesh_bytes = 0;
};

DecodeCost measure_decoding(const PublishedBundle& made, std::span<const std::byte> bundle) {
  DecodeCost cost;
  const auto recipe = open_recipe(made.recipe);
  for (const PieceRecord& piece : recipe->pieces) {
    const auto stored = piece.stored_size == 0
                            ? bundle.subspan(piece.second_offset, piece.second_size)
                            : std::span<const std::byte>(made.objects.at(std::to_array(piece.id)));
    const double begin = thread_seconds();
    const bool good = decode_piece(piece, stored).has_value();
    const double spent = good ? thread_seconds() - begin : 0;
    cost.seconds += spent;
    if (static_cast<PieceForm>(piece.form) != PieceForm::kMesh) continue;
    cost.mesh_seconds += spent;
    cost.mesh_bytes += piece.stored_size;
  }
  return cost;
}

/// An unchanged bundle; anything else is a model, baked with the default options into `folder`.
Result<std::string> default_bundle(const std::string& file, const std::string& folder) {
  if (file.ends_with(".modar")) return file;
  const std::string bundle = folder + "/" + std::filesystem::path(file).stem().string() + ".modar";
  const int code = run_process(
      {{program_folder() + "/modar", "bake", "--model", file, "--quiet", "-o", bundle}, {}, ""});
  if (code == 0) return bundle;
  return fail(ExitCode::kInvalidInput, "bench.bake", file,
              "it does not bake, exit code " + std::to_string(code), "see what `modar bake` says");
}

}  // namespace

Result<std::vector<ShipBenchRow>> bench_ship(const std::vector<std::string>& files, unsigned jobs) {
  const TemporaryFolder folder;
  std::vector<ShipBenchRow> rows;
  for (const std::string& named : files) {
    MODAR_ASSIGN(const std::string path, default_bundle(named, folder.path()));
    const auto file = MappedFile::open(path);
    if (!file) return tl::unexpected(file.error());
    const auto bundle = BundleView::open(file->bytes());
    if (!bundle) return tl::unexpected(bundle.error());
    RecipeOptions options;
    options.jobs = jobs;
    const auto made = make_recipe(*bundle, options);
    if (!made) return tl::unexpected(made.error());
    const std::string name = " " + std::filesystem::path(path).stem().string();
    rows.push_back({"download_bytes/zstd" + name, static_cast<double>(made->download_size),
                    static_cast<double>(zstd_size(file->bytes()))});
    const DecodeCost cost = measure_decoding(*made, file->bytes());
    GeometryPeers peers;
    DracoPeer draco;
    for (std::uint32_t m = 0; m < bundle->models().size(); ++m) {
      const GeometryPeers part = measure_peers(*bundle, bundle->models()[m]);
      peers.raw += part.raw;
      peers.zstd += part.zstd;
      peers.meshopt += part.meshopt;
      const DracoPeer model = encode_with_draco(*bundle, m);
      draco.bytes += model.bytes;
      draco.decode_s += model.decode_s;
    }
    if (peers.raw == 0 || cost.mesh_bytes == 0) continue;
    const auto ours = static_cast<double>(cost.mesh_bytes);
    rows.push_back({"geometry_bytes/draco" + name, ours, static_cast<double>(draco.bytes)});
    rows.push_back(
        {"geometry_bytes/meshopt+zstd" + name, ours, static_cast<double>(peers.meshopt)});
    rows.push_back({"geometry_bytes/zstd" + name, ours, static_cast<double>(peers.zstd)});
    rows.push_back({"geometry_bytes/raw" + name, ours, static_cast<double>(peers.raw)});
    rows.push_back(
        {"geometry_decode_ms/draco" + name, 1e3 * cost.mesh_seconds, 1e3 * draco.decode_s});
    rows.push_back({"decode_ms/draco" + name, 1e3 * cost.seconds, 1e3 * draco.decode_s});
  }
  return rows;
}

}  // namespace modar
