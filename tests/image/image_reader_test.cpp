// Image files of all kinds to the right pixels, and hostile ones to errors.
#include <gtest/gtest.h>
#include <fstream>

#include <jpeglib.h>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <string_view>

#include "bake/image/decoders.hpp"
#include "bake/image/difference.hpp"
#include "bake/io/input.hpp"
#include "formats/base/atomic_file.hpp"
#include "tests/texture/texture_samples.hpp"

namespace modar {
namespace {

using Bytes = std::vector<std::byte>;

Bytes to_bytes(const std::vector<unsigned char>& in) {
  Bytes out(in.size());
  for (std::size_t i = 0; i < in.size(); ++i) out[i] = static_cast<std::byte>(in[i]);
  return out;
}

Bytes encoded(const cv::Mat& mat, const std::string& extension,
              const std::vector<int>& parameters = {}) {
  std::vector<unsigned char> bytes;
  cv::imencode(extension, mat, bytes, parameters);
  return to_bytes(bytes);
}

cv::Mat to_mat(const RgbaImage& image) {
  cv::Mat mat(static_cast<int>(image.height), static_cast<int>(image.width), CV_8UC3);
  for (int y = 0; y < mat.rows; ++y) {
    for (int x = 0; x < mat.cols; ++x) {
      const std::uint8_t* p = &image.pixels[static_cast<std::size_t>(y * mat.cols + x) * 4];
      mat.at<cv::Vec3b>(y, x) = {p[2], p[1], p[0]};
    }
  }
  return mat;
}

/// A TGA header of 18 bytes.
Bytes tga_header(unsigned type, unsigned width, unsigned height, unsigned bits, unsigned flags) {
  std::vector<unsigned char> h(18, 0);
  h[2] = static_cast<unsigned char>(type);
  h[12] = static_cast<unsigned char>(width & 255);
  h[13] = static_cast<unsigned char>(width >> 8);
  h[14] = static_cast<unsigned char>(height & 255);
  h[15] = static_cast<unsigned char>(height >> 8);
  h[16] = static_cast<unsigned char>(bits);
  h[17] = static_cast<unsigned char>(flags);
  return to_bytes(h);
}

Bytes operator+(Bytes a, std::initializer_list<unsigned> b) {
  for (const unsigned value : b) a.push_back(static_cast<std::byte>(value));
  return a;
}

void expect_code(const Bytes& bytes, const std::string& code, const std::string& what) {
  const Result<RgbaImage> image = decode_image(bytes, what);
  ASSERT_FALSE(image) << what;
  EXPECT_EQ(image.error().code, code) << what;
  EXPECT_EQ(image.error().exit, ExitCode::kInvalidInput) << what;
  EXPECT_EQ(image.error().where, what);
}

class ImageKinds : public testing::TestWithParam<const char*> {};

TEST_P(ImageKinds, ReadsLosslessKindsAndRefusesEveryTruncation) {
  const RgbaImage image = test::synthetic_photo(23, 11);
  const std::string kind = GetParam();
  Bytes bytes = encoded(to_mat(image), kind,
                        kind == ".webp" ? std::vector<int>{64, 101} : std::vector<int>{});
  const Result<RgbaImage> decoded = decode_image(bytes, kind);
  ASSERT_TRUE(decoded) << to_line(decoded.error());
  EXPECT_EQ(decoded->width, 23U);
  EXPECT_EQ(decoded->height, 11U);
  if (kind == ".jpg") {
    EXPECT_GT(psnr_db(*decoded, image), 25);
  } else {
    EXPECT_EQ(decoded->pixels, image.pixels);
  }
  const std::size_t step = bytes.size() > 400 ? 7 : 1;
  for (std::size_t size = 0; size + 1 < bytes.size(); size += step) {
    expect_code(Bytes(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(size)),
                size == 0 ? "io.empty" : "image.decode", kind + " of " + std::to_string(size));
  }
}

INSTANTIATE_TEST_SUITE_P(All, ImageKinds,
                         testing::Values(".png", ".jpg", ".bmp", ".webp", ".tiff"));

TEST(FileKind, SaysWhatAFileIs) {
  const auto code = [](FileKind wanted, std::string_view start) {
    const auto is = require_kind(wanted, start, "a.modar");
    return is ? "" : is.error().code;
  };
  const std::string_view png("\x89PNG\r\n\x1A\n........", 16);
  const std::string_view bundle("\x89MOD\r\n\x1A\n........", 16);
  EXPECT_EQ(code(FileKind::kPicture, bundle), "image.bundle");
  EXPECT_EQ(code(FileKind::kModel, bundle), "model.bundle");
  EXPECT_EQ(code(FileKind::kBundle, png), "bundle.picture");
  EXPECT_EQ(code(FileKind::kBundle, bundle), "");
  EXPECT_EQ(code(FileKind::kBundle, "MOD and no more.."), "") << "its reader says more";
}

TEST(ImageReader, KeepsAlphaAndNarrowsSixteenBits) {
  cv::Mat deep(2, 2, CV_16UC4);
  deep.at<cv::Vec4w>(0, 0) = {0, 257, 65535, 128 * 257};
  deep.at<cv::Vec4w>(0, 1) = {128, 129, 65406, 65407};
  deep.at<cv::Vec4w>(1, 0) = {1, 2, 3, 0};
  deep.at<cv::Vec4w>(1, 1) = {10 * 257, 20 * 257, 30 * 257, 65535};
  const Result<RgbaImage> image = decode_image(encoded(deep, ".png"), "deep");
  ASSERT_TRUE(image) << to_line(image.error());
  const std::vector<std::uint8_t> expected = {255, 1, 0, 128, 254, 1,  0,  255,
                                              0,   0, 0, 0,   30,  20, 10, 255};
  EXPECT_EQ(image->pixels, expected);
}

TEST(ImageReader, GrayBecomesColour) {
  cv::Mat gray(1, 2, CV_8UC1);
  gray.at<std::uint8_t>(0, 0) = 3;
  gray.at<std::uint8_t>(0, 1) = 200;
  for (const char* kind : {".png", ".bmp", ".tiff"}) {
    const Result<RgbaImage> image = decode_image(encoded(gray, kind), kind);
    ASSERT_TRUE(image) << to_line(image.error());
    EXPECT_EQ(image->pixels, (std::vector<std::uint8_t>{3, 3, 3, 255, 200, 200, 200, 255})) << kind;
  }
}

TEST(ImageReader, TgaFromTheBottomTheTopAndInRuns) {
  const std::vector<std::uint8_t> expected = {3, 2, 1, 255, 6, 5, 4, 255};  // red above the other
  const auto expect_pixels = [&expected](const Bytes& bytes, const char* what) {
    const Result<RgbaImage> image = decode_image(bytes, what);
    ASSERT_TRUE(image) << to_line(image.error());
    EXPECT_EQ(image->pixels, expected) << what;
  };
  expect_pixels(tga_header(2, 1, 2, 24, 0) + std::initializer_list<unsigned>{4, 5, 6, 1, 2, 3},
                "bottom");
  expect_pixels(tga_header(2, 1, 2, 24, 0x20) + std::initializer_list<unsigned>{1, 2, 3, 4, 5, 6},
                "top");
  expect_pixels(tga_header(10, 1, 2, 24, 0x20) +
                    std::initializer_list<unsigned>{0x80, 1, 2, 3, 0x00, 4, 5, 6},
                "runs");
  expect_pixels(tga_header(2, 2, 1, 24, 0x30) + std::initializer_list<unsigned>{4, 5, 6, 1, 2, 3},
                "right");
  expect_code(tga_header(10, 1, 2, 24, 0x20) + std::initializer_list<unsigned>{0x80, 1, 2, 3},
              "image.decode", "short run");
  expect_code(tga_header(2, 8192, 8192, 32, 0), "image.decode", "empty");
}

TEST(ImageReader, TgaAlphaCountsWhereTheHeaderSaysSo) {
  const Bytes pixel = Bytes{} + std::initializer_list<unsigned>{1, 2, 3, 4};
  for (const bool has_alpha : {false, true}) {
    Bytes file = tga_header(2, 1, 1, 32, has_alpha ? 0x28 : 0x20);
    file.insert(file.end(), pixel.begin(), pixel.end());
    const Result<RgbaImage> image = decode_image(file, "alpha");
    ASSERT_TRUE(image) << to_line(image.error());
    const std::uint8_t alpha = has_alpha ? 4 : 255;
    EXPECT_EQ(image->pixels, (std::vector<std::uint8_t>{3, 2, 1, alpha}));
  }
}

/// A TIFF file of 2x1 RGBA pixels, by the tables of the TIFF 6.0 specification.
Bytes tiny_tiff(unsigned orientation, const std::vector<unsigned>& samples) {
  Bytes file;
  const auto put = [&file](std::uint32_t value, std::size_t bytes) {
    for (std::size_t i = 0; i < bytes; ++i, value >>= 8) file.push_back(std::byte(value & 255));
  };
  constexpr std::uint32_t kPixels = 8;
  constexpr std::uint32_t kBits = 16;
  constexpr std::uint32_t kDirectory = 24;
  put(0x2A4949, 4);
  put(kDirectory, 4);
  for (const unsigned sample : samples) put(sample, 1);
  for (int i = 0; i < 4; ++i) put(8, 2);
  const std::uint32_t entries[][4] = {
      {256, 3, 1, 2},           {257, 3, 1, 1}, {258, 3, 4, kBits},
      {259, 3, 1, 1},           {262, 3, 1, 2}, {273, 4, 1, kPixels},
      {274, 3, 1, orientation}, {277, 3, 1, 4}, {278, 3, 1, 1},
      {279, 4, 1, 8},           {338, 3, 1, 2}};  // alpha: not multiplied in
  put(std::size(entries), 2);
  for (const auto& entry : entries) {
    put(entry[0], 2);
    put(entry[1], 2);
    put(entry[2], 4);
    put(entry[3], 4);
  }
  put(0, 4);
  return file;
}

TEST(ImageReader, TiffKeepsColoursUnderAlphaAndIsTurnedUpright) {
  const Result<RgbaImage> plain = decode_image(tiny_tiff(1, {200, 100, 50, 10, 1, 2, 3, 255}), "a");
  ASSERT_TRUE(plain) << to_line(plain.error());
  EXPECT_EQ(plain->pixels, (std::vector<std::uint8_t>{200, 100, 50, 10, 1, 2, 3, 255}));
  // 8: the first row is the picture's left column, the first pixel its bottom-left corner.
  const Result<RgbaImage> turned =
      decode_image(tiny_tiff(8, {200, 100, 50, 10, 1, 2, 3, 255}), "b");
  ASSERT_TRUE(turned) << to_line(turned.error());
  EXPECT_EQ(turned->height, 2U);
  EXPECT_EQ(turned->pixels, (std::vector<std::uint8_t>{1, 2, 3, 255, 200, 100, 50, 10}));
}

/// Corrects the checksum of a PNG's header (ISO/IEC 15948, annex D).
void seal_header(Bytes& png) {
  std::uint32_t crc = 0xFFFFFFFF;
  for (std::size_t i = 12; i < 29; ++i) {
    crc ^= std::to_integer<std::uint32_t>(png[i]);
    for (int bit = 0; bit < 8; ++bit) crc = crc >> 1 ^ ((crc & 1) != 0 ? 0xEDB88320 : 0);
  }
  for (std::size_t i = 0; i < 4; ++i) png[29 + i] = std::byte(~crc >> (24 - 8 * i) & 255);
}

TEST(ImageReader, SizesBeyondTheLimitAreRefusedBeforeDecoding) {
  Bytes png = encoded(cv::Mat(4, 4, CV_8UC3, cv::Scalar::all(9)), ".png");
  for (const std::size_t at : {18U, 19U, 22U, 23U}) png[at] = std::byte{0xff};
  seal_header(png);
  expect_code(png, "image.too-large", "65535 png");
  png[16] = std::byte{0x7f};
  seal_header(png);
  expect_code(png, "image.too-large", "2^31 png");
  Bytes bmp = encoded(cv::Mat(4, 4, CV_8UC3, cv::Scalar::all(9)), ".bmp");
  bmp[20] = std::byte{0x10};
  expect_code(bmp, "image.too-large", "wide bmp");
  expect_code(tga_header(2, 65535, 65535, 24, 0), "image.too-large", "tga");
}

/// A plain WebP file of 4 x 4 pixels, whose header states other sides.
Bytes webp_of(std::uint32_t width, std::uint32_t height) {
  Bytes webp = encoded(cv::Mat(4, 4, CV_8UC3, cv::Scalar::all(9)), ".webp", {64, 101});
  const std::uint32_t sides = (width - 1) | (height - 1) << 14;
  for (std::size_t i = 0; i < 3; ++i) webp[21 + i] = std::byte(sides >> (8 * i) & 255);
  webp[24] = (webp[24] & std::byte{0xF0}) | std::byte(sides >> 24);
  return webp;
}

TEST(ImageReader, TheAreaIsLimitedBeforeDecoding) {
  EXPECT_TRUE(check_image_size(16384, 4096, 100, "wide"));
  EXPECT_TRUE(check_image_size(8192, 8192, 100, "square"));
  EXPECT_EQ(check_image_size(16384, 4097, 100, "wide").error().code, "image.too-large");
  // A scan's texture of the greatest sides: 4 MiB are a byte for each 64 pixels.
  EXPECT_TRUE(check_image_size(16384, 16384, std::size_t{4} << 20, "scan"));
  EXPECT_FALSE(check_image_size(16384, 16384, (std::size_t{4} << 20) - 1, "scan"));
  EXPECT_FALSE(check_image_size(16385, 1, std::size_t{1} << 30, "scan"));
  EXPECT_NE(check_image_size(8192, 8193, 100, "tall").error().cure.find("67108864 in all"),
            std::string::npos);
  expect_code(webp_of(16383, 16383), "image.too-large", "16383 webp");
  expect_code(webp_of(8192, 8193), "image.too-large", "8193 webp");
  const auto image = decode_image(webp_of(8192, 8192), "8192 webp");
  EXPECT_TRUE(image || image.error().code == "image.decode");
}

TEST(ImageReader, OtherFilesAreRefused) {
  expect_code({}, "io.empty", "empty");
  expect_code(to_bytes({'h', 'e', 'l', 'l', 'o'}), "image.decode", "text");
  expect_code(to_bytes({'P', '6', '\n', '1', ' ', '1', '\n', '2', '5', '5', '\n', 1, 2, 3}),
              "image.decode", "ppm");
  const Result<RgbaImage> ktx = decode_image(
      to_bytes({0xAB, 'K', 'T', 'X', ' ', '2', '0', 0xBB, '\r', '\n', 0x1A, '\n', 0}), "k.ktx2");
  ASSERT_FALSE(ktx);
  EXPECT_EQ(ktx.error().code, "image.ktx");
  EXPECT_EQ(ktx.error().exit, ExitCode::kUnsupported);
  EXPECT_NE(ktx.error().cure.find("ktx extract"), std::string::npos);
  const Result<RgbaImage> dds = decode_image(to_bytes({'D', 'D', 'S', ' ', 124, 0, 0, 0}), "a.dds");
  ASSERT_FALSE(dds);
  EXPECT_EQ(dds.error().exit, ExitCode::kUnsupported);
  EXPECT_EQ(dds.error().cure.find("convert it: convert 'a.dds' 'a'.png"), 0u) << dds.error().cure;
  const Result<RgbaImage> missing = read_image("no/such/file.png");
  ASSERT_FALSE(missing);
  EXPECT_EQ(missing.error().code, "io.open");
  EXPECT_EQ(missing.error().exit, ExitCode::kIo);
}

/// A JPEG's EXIF segment that states an orientation.
Bytes exif_segment(unsigned orientation) {
  return Bytes() + std::initializer_list<unsigned>{
                       0xFF, 0xE1, 0, 34, 'E',         'x', 'i', 'f', 0,    0,    'I', 'I',
                       42,   0,    8, 0,  0,           0,   1,   0,   0x12, 0x01, 3,   0,
                       1,    0,    0, 0,  orientation, 0,   0,   0,   0,    0,    0,   0};
}

TEST(ImageReader, ExifOrientationIsApplied) {
  // Left half dark, right half bright, 32x16; 6 says: turn by 90 degrees clockwise to see it
  // upright.
  const RgbaImage image = test::paint(32, 16, [](std::uint32_t x, std::uint32_t) {
    const int value = x < 16 ? 20 : 230;
    return std::array<int, 3>{value, value, value};
  });
  Bytes jpeg = encoded(to_mat(image), ".jpg");
  const Bytes segment = exif_segment(6);
  jpeg.insert(jpeg.begin() + 2, segment.begin(), segment.end());
  const Result<RgbaImage> turned = decode_image(jpeg, "turned");
  ASSERT_TRUE(turned) << to_line(turned.error());
  ASSERT_EQ(turned->width, 16U);
  ASSERT_EQ(turned->height, 32U);
  EXPECT_LT(turned->pixels[0], 60);
  EXPECT_GT(turned->pixels[turned->pixels.size() - 4], 200);
  const std::string path = testing::TempDir() + "/turned.jpg";
  ASSERT_TRUE(write_file(path, jpeg));
  const Result<RgbaImage> texture = read_texture(path);
  ASSERT_TRUE(texture) << to_line(texture.error());
  EXPECT_EQ(texture->width, 32U) << "coordinates of models are of the stored rows";
  EXPECT_LT(texture->pixels[0], 60);
  EXPECT_GT(texture->pixels[texture->pixels.size() - 4], 200);
}

/// A JPEG's EXIF segment of an exposure: 26 mm on film, of a picture of those sides.
Bytes exposure_segment(unsigned width, unsigned height) {
  return Bytes() + std::initializer_list<unsigned>{
                       0xFF, 0xE1, 0, 76, 'E', 'x', 'i', 'f', 0, 0, 'I', 'I', 42, 0, 8, 0, 0,
                       0,  // one entry: where the exposure's
                           // directory is
                       1, 0, 0x69, 0x87, 4, 0, 1, 0, 0, 0, 26, 0, 0, 0, 0, 0, 0, 0, 3,
                       0,  // three entries
                       0x02, 0xA0, 3, 0, 1, 0, 0, 0, width & 255, width >> 8, 0, 0, 0x03, 0xA0, 3,
                       0, 1, 0, 0, 0, height & 255, height >> 8, 0, 0, 0x05, 0xA4, 3, 0, 1, 0, 0, 0,
                       26, 0, 0, 0, 0, 0, 0, 0};
}

TEST(ImageReader, ExifTellsTheFocalLengthOfWhatIsNotCropped) {
  const Bytes plain = encoded(to_mat(test::noise(64, 48, 3)), ".jpg");
  const auto focal = [&plain](unsigned width, unsigned height) {
    Bytes jpeg = plain;
    const Bytes segment = exposure_segment(width, height);
    jpeg.insert(jpeg.begin() + 2, segment.begin(), segment.end());
    const std::string path = testing::TempDir() + "exposure.jpg";
    std::ofstream(path, std::ios::binary)
        .write(reinterpret_cast<const char*>(jpeg.data()),
               static_cast<std::streamsize>(jpeg.size()));
    const auto photo = read_photo(path);
    std::remove(path.c_str());
    return photo ? photo->focal_px : -1;
  };
  // 26 mm of a film's diagonal of 43.27 mm; the picture's is 80 pixels long.
  EXPECT_NEAR(focal(64, 48), 26 / 43.2666 * 80, 0.01);
  EXPECT_NEAR(focal(640, 480), 26 / 43.2666 * 80, 0.01);
  EXPECT_EQ(focal(640, 400), 0);
}

TEST(ImageWriter, JpegIsWhatOpenCvReads) {
  RgbaImage image{64, 48, std::vector<std::uint8_t>(std::size_t{4} * 64 * 48)};
  for (std::size_t i = 0; i < image.pixels.size(); ++i) {
    const double x = static_cast<double>(i / 4 % 64);
    image.pixels[i] =
        i % 4 == 3
            ? 255
            : static_cast<std::uint8_t>(127 + 120 * std::sin(x / 20 + static_cast<double>(i % 4)));
  }
  const auto file = encode_jpeg(image, 90);
  ASSERT_TRUE(file) << to_line(file.error());
  const cv::Mat read = cv::imdecode(
      cv::Mat(1, static_cast<int>(file->size()), CV_8U, const_cast<std::byte*>(file->data())),
      cv::IMREAD_COLOR);
  ASSERT_EQ(read.size(), cv::Size(64, 48));
  EXPECT_GT(cv::PSNR(read, to_mat(image)), 38);
  EXPECT_FALSE(encode_jpeg({}, 90)) << "an empty picture";
}

TEST(ImageWriter, APreviewIsSmallAndLooksLikeThePicture) {
  RgbaImage image{900, 600, std::vector<std::uint8_t>(std::size_t{4} * 900 * 600, 255)};
  for (std::size_t i = 0; i < image.pixels.size(); i += 4) {
    const bool left = i / 4 % 900 < 450;
    image.pixels[i + 1] = left ? 20 : 160;  // magenta, and an orange that is transparent
    image.pixels[i + 2] = left ? 200 : 0;
    image.pixels[i + 3] = left ? 255 : 0;
  }
  const auto file = encode_preview(image, 600, 600);  // the proportions of another picture of it
  ASSERT_TRUE(file) << to_line(file.error());
  EXPECT_LE(file->size(), 15000U);
  const auto read = decode_image(*file, "preview");
  ASSERT_TRUE(read);
  EXPECT_EQ(std::pair(read->width, read->height), std::pair(512U, 512U));
  const std::uint8_t* const row = &read->pixels[std::size_t{4} * 512 * 256];
  const int wanted[2][3] = {{255, 20, 200}, {255, 255, 255}};
  for (std::size_t c = 0; c < 3; ++c) {
    EXPECT_NEAR(row[4 * 100 + c], wanted[0][c], 12) << c;
    EXPECT_NEAR(row[4 * 400 + c], wanted[1][c], 12) << c;
  }
  const auto noise = encode_preview(test::noise(800, 800, 3), 800, 800);
  ASSERT_TRUE(noise);
  EXPECT_LE(noise->size(), 15000U);
  EXPECT_GT(noise->size(), 8000U) << "smaller than it has to be";
  EXPECT_FALSE(encode_preview({}, 0, 0)) << "an empty picture";
}

TEST(ImageReader, JpegWhoseCodedDataIsCutShortIsRefused) {
  // Everything but the end marker is lost after the first half, so the markers alone look whole.
  Bytes jpeg = encoded(to_mat(test::noise(64, 64, 3)), ".jpg");
  ASSERT_TRUE(decode_image(jpeg, "whole"));
  jpeg.resize(jpeg.size() * 2 / 3);
  expect_code(jpeg + std::initializer_list<unsigned>{0xFF, 0xD9}, "image.decode", "cut short");
}

TEST(ImageReader, AJpegThatOnlyLacksItsEndMarkerIsWhole) {
  for (const bool progressive : {false, true}) {
    const std::vector<int> flags = {cv::IMWRITE_JPEG_PROGRESSIVE, progressive ? 1 : 0};
    std::vector<unsigned char> file;
    ASSERT_TRUE(cv::imencode(".jpg", to_mat(test::noise(64, 64, 3)), file, flags));
    const auto bytes = [&](std::size_t size) { return std::as_bytes(std::span(file)).first(size); };
    const auto whole = decode_image(bytes(file.size()), "whole");
    const auto marker_lost = decode_image(bytes(file.size() - 2), "no end");
    ASSERT_TRUE(whole && marker_lost) << progressive;
    EXPECT_EQ(marker_lost->pixels, whole->pixels);
    EXPECT_FALSE(decode_image(bytes(file.size() - 40), "cut short")) << progressive;
    if (!progressive) continue;
    std::size_t scan = file.size() - 2;
    while (file[scan] != 0xFF || file[scan + 1] != 0xDA) --scan;
    EXPECT_FALSE(decode_image(bytes(scan), "the last scan is lost"));
  }
}

TEST(PngEncoder, WritesAlphaWhereThereIsSome) {
  for (const bool opaque : {true, false}) {
    RgbaImage image = test::noise(9, 5, 1);
    image.pixels[3] = opaque ? 255 : 7;
    const Result<Bytes> png = encode_png(image);
    ASSERT_TRUE(png) << to_line(png.error());
    const cv::Mat raw(1, static_cast<int>(png->size()), CV_8UC1,
                      const_cast<std::byte*>(png->data()));
    const cv::Mat read = cv::imdecode(raw, cv::IMREAD_UNCHANGED);
    ASSERT_EQ(read.channels(), opaque ? 3 : 4);
    cv::Mat bgra;
    cv::cvtColor(cv::Mat(5, 9, CV_8UC4, image.pixels.data()), bgra,
                 opaque ? cv::COLOR_RGBA2BGR : cv::COLOR_RGBA2BGRA);
    EXPECT_EQ(cv::norm(read, bgra, cv::NORM_INF), 0);
  }
  EXPECT_FALSE(encode_png(RgbaImage{}));
}

/// A PNG of one colour with chunks behind its header.
Bytes with_chunks(const cv::Scalar& bgr, std::initializer_list<unsigned> chunks) {
  Bytes bytes = encoded(cv::Mat(2, 2, CV_8UC3, bgr), ".png");
  const Bytes added = Bytes{} + chunks;
  bytes.insert(bytes.begin() + 33, added.begin(), added.end());
  return bytes;
}

std::array<int, 3> first_pixel(const Bytes& bytes, Colours colours = Colours::kSrgb) {
  const auto image = decode_image(bytes, "picture", colours);
  if (!image) return {-1, -1, -1};
  return {image->pixels[0], image->pixels[1], image->pixels[2]};
}

void expect_near(const std::array<int, 3>& seen, const std::array<int, 3>& wanted) {
  for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(seen[i], wanted[i], 2) << i;
}

// sRGB of linear light (IEC 61966-2-1): 128 / 255 is 188.0, 64 / 255 is 137.2. W3C's test
// color-valid-display-p3: (0.26374, 0.59085, 0.16434) is #009900.
TEST(ImageReader, APngsGammaAndPrimariesBecomeSrgb) {
  const Bytes linear = with_chunks({0, 64, 128}, {0, 0, 0, 4, 'g', 'A', 'M', 'A', 0x00, 0x01, 0x86,
                                                  0xA0, 0x31, 0xE8, 0x96, 0x5F});
  expect_near(first_pixel(linear), {188, 137, 0});
  expect_near(first_pixel(linear, Colours::kStored), {128, 64, 0});
  const Bytes usual = with_chunks({0, 64, 128}, {0, 0, 0, 4, 'g', 'A', 'M', 'A', 0x00, 0x00, 0xB1,
                                                 0x8F, 0x0B, 0xFC, 0x61, 0x05});
  EXPECT_EQ(first_pixel(usual), (std::array{128, 64, 0}));
  const Bytes wide = with_chunks(
      {42, 151, 67},
      {0,    0,    0,    32,   'c',  'H',  'R',  'M',  0x00, 0x00, 0x7A, 0x26, 0x00, 0x00, 0x80,
       0x84, 0x00, 0x01, 0x09, 0xA0, 0x00, 0x00, 0x7D, 0x00, 0x00, 0x00, 0x67, 0x84, 0x00, 0x01,
       0x0D, 0x88, 0x00, 0x00, 0x3A, 0x98, 0x00, 0x00, 0x17, 0x70, 0xF1, 0xF8, 0xCA, 0x57});
  expect_near(first_pixel(wide), {0, 153, 0});
}

/// An ICC profile (ICC.1:2010): tags of XYZ numbers, s15Fixed16, and of one curve for all.
Bytes icc_profile(const char* space,
                  const std::vector<std::pair<const char*, std::array<double, 3>>>& xyz,
                  const std::vector<const char*>& curve_tags, const std::vector<double>& curve) {
  std::string data;
  const auto put = [](std::string& to, std::uint32_t value) {
    for (int shift = 24; shift >= 0; shift -= 8) to += static_cast<char>(value >> shift & 255);
  };
  const auto fixed = [&](std::string& to, double value) {
    put(to, static_cast<std::uint32_t>(std::lround(value * 65536)));
  };
  const std::size_t tags = xyz.size() + curve_tags.size();
  const std::size_t start = 132 + 12 * tags;
  std::string table;
  const auto tag = [&](const char* name, std::size_t at, std::size_t size) {
    table += name;
    put(table, static_cast<std::uint32_t>(start + at));
    put(table, static_cast<std::uint32_t>(size));
  };
  for (const auto& [name, values] : xyz) {
    tag(name, data.size(), 20);
    data += std::string("XYZ \0\0\0\0", 8);
    for (const double value : values) fixed(data, value);
  }
  for (const char* name : curve_tags) tag(name, data.size(), 12 + 4 * curve.size());
  data +=
      std::string("para\0\0\0\0\0", 9) + (curve.size() == 1 ? '\0' : '\3') + std::string(2, '\0');
  for (const double value : curve) fixed(data, value);
  std::string header;
  put(header, static_cast<std::uint32_t>(start + data.size()));
  header += std::string(4, '\0') + std::string("\4\0\0\0", 4) + "mntr" + space + "XYZ ";
  header += std::string(12, '\0') + "acsp" + std::string(28, '\0');
  for (const double value : {0.9642, 1.0, 0.8249}) fixed(header, value);
  header += std::string(48, '\0');
  put(header, static_cast<std::uint32_t>(tags));
  const std::string all = header + table + data;
  return to_bytes({all.begin(), all.end()});
}

/// A JPEG with a profile in its APP2.
Bytes with_profile(Bytes bytes, const Bytes& profile) {
  const auto size = static_cast<unsigned>(profile.size() + 16);
  Bytes segment = Bytes{} + std::initializer_list<unsigned>{0xFF, 0xE2, size >> 8, size & 255};
  for (const char c : std::string_view("ICC_PROFILE\0\1\1", 14)) {
    segment.push_back(static_cast<std::byte>(c));
  }
  segment.insert(segment.end(), profile.begin(), profile.end());
  bytes.insert(bytes.begin() + 2, segment.begin(), segment.end());
  return bytes;
}

Bytes with_profile(const cv::Mat& picture, const Bytes& profile) {
  return with_profile(encoded(picture, ".jpg", {cv::IMWRITE_JPEG_QUALITY, 100}), profile);
}

// Display P3 by its registered colorants, adapted to D50.
TEST(ImageReader, ColoursOfProfilesBecomeSrgb) {
  const std::vector<double> srgb = {2.4, 1 / 1.055, 0.055 / 1.055, 1 / 12.92, 0.04045};
  const Bytes p3 = icc_profile("RGB ",
                               {{"wtpt", {0.9642, 1, 0.8249}},
                                {"rXYZ", {0.51512, 0.2412, -0.00105}},
                                {"gXYZ", {0.29198, 0.69225, 0.04189}},
                                {"bXYZ", {0.1571, 0.06657, 0.78407}}},
                               {"rTRC", "gTRC", "bTRC"}, srgb);
  const Bytes wide = with_profile(cv::Mat(8, 8, CV_8UC3, cv::Scalar(42, 151, 67)), p3);
  expect_near(first_pixel(wide), {0, 153, 0});
  expect_near(first_pixel(wide, Colours::kStored), {67, 151, 42});
  const Bytes gray = icc_profile("GRAY", {{"wtpt", {0.9642, 1, 0.8249}}}, {"kTRC"}, {1.0});
  const Bytes linear = with_profile(cv::Mat(8, 8, CV_8UC1, cv::Scalar(64)), gray);
  expect_near(first_pixel(linear), {137, 137, 137});
  // A profile of gray for colours, and one that is cut short, are not used.
  const cv::Mat colours(8, 8, CV_8UC3, cv::Scalar(42, 151, 67));
  expect_near(first_pixel(with_profile(colours, gray)), {67, 151, 42});
  expect_near(first_pixel(with_profile(colours, {p3.begin(), p3.begin() + 150})), {67, 151, 42});
}

/// A profile of inks (ICC.1:2010, lut16Type): the Lab of each of their 16 mixtures, in between by
/// interpolation.
Bytes ink_profile(const std::array<std::array<double, 3>, 16>& mixtures) {
  std::string lut("mft2\0\0\0\0\4\3\2\0", 12);
  const auto put = [](std::string& to, std::uint32_t value, int bytes) {
    for (int i = bytes; i-- > 0;) to += static_cast<char>(value >> 8 * i & 255);
  };
  for (int i = 0; i < 9; ++i) put(lut, i % 4 == 0 ? 65536 : 0, 4);
  for (int i = 0; i < 2; ++i) put(lut, 2, 2);  // entries of curves
  const auto straight = [&](int channels) {
    for (int i = 0; i < channels; ++i) put(lut, 0xFFFF, 4);
  };
  straight(4);
  for (const auto& [l, a, b] : mixtures) {
    put(lut, static_cast<std::uint32_t>(std::lround(l * 652.8)), 2);
    put(lut, static_cast<std::uint32_t>(std::lround(a * 256 + 32768)), 2);
    put(lut, static_cast<std::uint32_t>(std::lround(b * 256 + 32768)), 2);
  }
  straight(3);
  std::string all;
  put(all, static_cast<std::uint32_t>(144 + lut.size()), 4);
  all += std::string(4, '\0') + std::string("\2\0\0\0", 4) + "prtrCMYKLab ";
  all += std::string(12, '\0') + "acsp" + std::string(28, '\0');
  for (const std::uint32_t white : {63190u, 65536u, 54061u}) put(all, white, 4);
  all += std::string(48, '\0');
  put(all, 1, 4);
  all += "A2B0";
  put(all, 144, 4);
  put(all, static_cast<std::uint32_t>(lut.size()), 4);
  all += lut;
  return to_bytes({all.begin(), all.end()});
}

/// Of one colour, its inks 255 at most. adobe: with the segment that says they are inverted.
Bytes ink_jpeg(std::array<std::uint8_t, 4> inks, bool adobe) {
  jpeg_compress_struct info{};
  jpeg_error_mgr errors{};
  unsigned char* buffer = nullptr;
  unsigned long size = 0;
  info.err = jpeg_std_error(&errors);
  jpeg_create_compress(&info);
  jpeg_mem_dest(&info, &buffer, &size);
  info.image_width = info.image_height = 8;
  info.input_components = 4;
  info.in_color_space = JCS_CMYK;
  jpeg_set_defaults(&info);
  jpeg_set_quality(&info, 100, TRUE);
  info.write_Adobe_marker = adobe ? TRUE : FALSE;
  jpeg_start_compress(&info, TRUE);
  std::array<std::uint8_t, 32> row{};
  for (std::size_t i = 0; i < row.size(); ++i) {
    row[i] = adobe ? static_cast<std::uint8_t>(255 - inks[i % 4]) : inks[i % 4];
  }
  for (JSAMPROW rows[] = {row.data()}; info.next_scanline < 8;)
    jpeg_write_scanlines(&info, rows, 1);
  jpeg_finish_compress(&info);
  const auto* first = reinterpret_cast<const std::byte*>(buffer);
  Bytes bytes(first, first + size);
  jpeg_destroy_compress(&info);
  std::free(buffer);
  return bytes;
}

// Lab of offset print on coated paper, in sRGB by CIE's formulas and Bradford's adaptation.
TEST(ImageReader, InksBecomeColoursByTheirProfile) {
  std::array<std::array<double, 3>, 16> mixtures{};  // index: C M Y K, the last one fastest
  mixtures[0] = {100, 0, 0};
  mixtures[8] = {55, -37, -50};
  mixtures[4] = {48, 74, -3};
  mixtures[2] = {89, -5, 93};
  mixtures[1] = {16, 0, 0};
  const Bytes profile = ink_profile(mixtures);
  for (const bool adobe : {true, false}) {
    const auto seen = [&](std::array<std::uint8_t, 4> inks, const Bytes& with) {
      return first_pixel(with_profile(ink_jpeg(inks, adobe), with));
    };
    expect_near(seen({0, 0, 255, 0}, profile), {247, 224, 0});
    expect_near(seen({0, 255, 0, 0}, profile), {216, 12, 122});
    expect_near(seen({0, 0, 0, 255}, profile), {40, 40, 40});
    expect_near(seen({0, 0, 0, 0}, profile), {255, 255, 255});
    // Without one that can be read.
    expect_near(seen({0, 255, 0, 0}, {profile.begin(), profile.begin() + 150}), {255, 0, 255});
    expect_near(seen({0, 0, 0, 255}, {profile.begin(), profile.begin() + 150}), {0, 0, 0});
  }
}

// As photo shops leave them: libpng would write to stderr, and it is not our words.
TEST(ImageReader, APngsColourProfileIsPassedOverInSilence) {
  const cv::Mat picture(5, 7, CV_8UC3, cv::Scalar(10, 20, 30));
  Bytes bytes = encoded(picture, ".png");
  // Behind the signature and the header: length, type, an invalid profile, an invalid checksum.
  const Bytes profile = Bytes{} + std::initializer_list<unsigned>{0,   0, 0, 3, 'i', 'C', 'C', 'P',
                                                                  'x', 0, 0, 1, 2,   3,   4};
  bytes.insert(bytes.begin() + 33, profile.begin(), profile.end());
  testing::internal::CaptureStderr();
  const Result<RgbaImage> image = decode_image(bytes, "profile.png");
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
  ASSERT_TRUE(image) << to_line(image.error());
  EXPECT_EQ(cv::norm(to_mat(*image), picture, cv::NORM_INF), 0);
}

}  // namespace
}  // namespace modar
