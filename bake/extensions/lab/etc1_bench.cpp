// Measures the encoder that bakes: the same function, one thread, processor time.
#include "bake/extensions/lab/etc1_bench.hpp"
#include "bake/image/difference.hpp"

#include <algorithm>
#include <utility>

#include "bake/extensions/lab/etc1_reference.hpp"
#include "bake/process/thread_clock.hpp"
#include "bake/texture/etc1/etc1_encoder.hpp"

namespace modar {
namespace {

struct EncoderFigures {
  double db = 0;
  double mpix_s = 0;
};

RgbaImage centre_crop(const RgbaImage& image, std::uint32_t crop) {
  const std::uint32_t width = crop == 0 ? image.width : std::min(crop, image.width);
  const std::uint32_t height = crop == 0 ? image.height : std::min(crop, image.height);
  RgbaImage out{std::max(4U, width / 4 * 4), std::max(4U, height / 4 * 4), {}};
  out.pixels.resize(std::size_t{out.width} * out.height * 4);
  const std::uint32_t left = (image.width - width) / 2 / 4 * 4;
  const std::uint32_t top = (image.height - height) / 2 / 4 * 4;
  for (std::uint32_t y = 0; y < out.height; ++y) {
    for (std::uint32_t x = 0; x < out.width; ++x) {
      const std::size_t from_x = std::min(left + x, image.width - 1);
      const std::size_t from_y = std::min(top + y, image.height - 1);
      std::copy_n(&image.pixels[(from_y * image.width + from_x) * 4], 4,
                  &out.pixels[(std::size_t{y} * out.width + x) * 4]);
    }
  }
  return out;
}

/// Runs until 0.3 s have passed or ten runs are done, at least twice; the fastest counts.
template <class Encode>
EncoderFigures measure(const std::vector<RgbaImage>& images, const Encode& encode) {
  EncoderFigures figures;
  double pixels = 0;
  for (const RgbaImage& image : images) pixels += double{1} * image.width * image.height;
  double fastest = 0;
  double spent = 0;
  for (int run = 0; run < 10 && (run < 2 || spent < 0.3); ++run) {
    double seconds = 0;
    double db = 0;
    for (const RgbaImage& image : images) {
      const double start = thread_seconds();
      const std::vector<std::byte> blocks = encode(image);
      seconds += thread_seconds() - start;
      db += psnr_db(image,
                    decode_texture(TextureFormat::kEtc1Rgb, blocks, image.width, image.height));
    }
    figures.db = db / static_cast<double>(images.size());
    fastest = run == 0 ? seconds : std::min(fastest, seconds);
    spent += seconds;
  }
  figures.mpix_s = pixels / std::max(fastest, 1e-9) * 1e-6;
  return figures;
}

void add_row(std::vector<Etc1BenchRow>& rows, std::string measure, double ours, double reference) {
  rows.push_back({std::move(measure), ours, reference, reference > 0 ? ours / reference : 0});
}

}  // namespace

Result<std::vector<Etc1BenchRow>> bench_etc1(const std::vector<std::string>& files,
                                             std::uint32_t crop) {
  if (files.empty()) {
    return fail(ExitCode::kUsage, "bench.no-images", "", "there is no image to encode",
                "name image files");
  }
  if (crop % 4 != 0) {
    return fail(ExitCode::kUsage, "bench.crop", std::to_string(crop),
                "the crop is not a multiple of 4", "ETC1 blocks have 4x4 pixels");
  }
  std::vector<RgbaImage> images;
  for (const std::string& file : files) {
    const Result<RgbaImage> image = read_image(file);
    if (!image) return tl::unexpected(image.error());
    images.push_back(centre_crop(*image, crop));
  }
  EncoderFigures reference;
  if (kHasEtc1Reference) reference = measure(images, encode_etc1_reference);
  std::vector<Etc1BenchRow> rows;
  const std::pair<const char*, TextureEffort> efforts[] = {{"fast", TextureEffort::kFast},
                                                           {"good", TextureEffort::kGood},
                                                           {"best", TextureEffort::kBest}};
  for (const auto& [name, effort] : efforts) {
    const EncodeOptions options = {.effort = effort};
    const EncoderFigures ours =
        measure(images, [&options](const RgbaImage& image) { return encode_etc1(image, options); });
    add_row(rows, std::string(name) + "_db", ours.db, reference.db);
    add_row(rows, std::string(name) + "_mpix_s", ours.mpix_s, reference.mpix_s);
  }
  return rows;
}

}  // namespace modar
