// Packed bundles: coded bytes, packed tracker records, stages, and bundles that arrive in pieces.
#include "modar/arriving_bundle.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <random>

#include "bake/extensions/web/packed_bundle.hpp"
#include "formats/bundle_view.hpp"
#include "formats/tracker_record.hpp"
#include "formats/transport/coded_bytes.hpp"
#include "formats/transport/recipe.hpp"
#include "formats/transport/stages.hpp"
#include "modar/packed_record.hpp"
#include "modar/pattern_record.hpp"
#include "tests/formats/support.hpp"

namespace modar {
namespace {

using test::Bytes;

/// Discs on a gradient, with a little noise.
GrayPicture discs(int width, int height) {
  std::mt19937 random(7);
  GrayPicture picture{width, height, {}};
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      picture.pixels.push_back(
          static_cast<std::uint8_t>(60 + x / 4 + y / 8 + static_cast<int>(random() % 3)));
    }
  }
  for (int i = 0; i < width * height / 300; ++i) {
    const int cx = static_cast<int>(random() % static_cast<unsigned>(width));
    const int cy = static_cast<int>(random() % static_cast<unsigned>(height));
    const int reach = 2 + static_cast<int>(random() % 7);
    const auto shade = static_cast<std::uint8_t>(random() % 256);
    for (int y = std::max(0, cy - reach); y < std::min(height, cy + reach); ++y) {
      for (int x = std::max(0, cx - reach); x < std::min(width, cx + reach); ++x) {
        const bool within = (x - cx) * (x - cx) + (y - cy) * (y - cy) < reach * reach;
        if (within) picture.pixels[static_cast<std::size_t>(y * width + x)] = shade;
      }
    }
  }
  return picture;
}

const Bytes& small_record() {
  static const Bytes kRecord = [] {
    TrackerRecordOptions options;
    options.features = 160;
    options.trial_views = 4;
    options.patches_per_level = 40;
    auto made = make_tracker_record(discs(90, 70).view(), options);
    EXPECT_TRUE(made);
    return made ? *made : Bytes();
  }();
  return kRecord;
}

std::vector<Bytes> samples() {
  std::mt19937 random(3);
  std::vector<Bytes> samples = {{}, {std::byte{7}}, Bytes(5000)};
  Bytes noise;
  for (int i = 0; i < 3000; ++i) noise.push_back(static_cast<std::byte>(random()));
  samples.push_back(noise);
  Bytes rising;  // a record of six bytes that counts
  for (int i = 0; i < 4000; ++i) {
    rising.push_back(static_cast<std::byte>(i % 6 == 0 ? i / 6 : i % 6));
  }
  samples.push_back(rising);
  return samples;
}

TEST(CodedBytes, ComeBackAndBecomeLess) {
  for (const std::uint32_t stride : {1u, 6u, 16u, kMostCodedStride}) {
    for (const Bytes& raw : samples()) {
      const Bytes coded = encode_bytes(raw, stride);
      EXPECT_EQ(decode_bytes(coded, raw.size(), stride), raw) << stride;
    }
  }
  // A counter that only its place in a record tells: 4000 bytes, one in six of which changes.
  EXPECT_LT(encode_bytes(samples()[4], 6).size(), 350u);
  EXPECT_LT(encode_bytes(samples()[3], 1).size(), 3100u) << "noise";
}

// Recorded hashes: packed bundles of earlier versions decode, so shipping.md keeps these bytes.
TEST(CodedBytes, StayAsTheyAre) {
  Bytes raw;
  for (const Bytes& sample : samples()) {
    for (const std::uint32_t stride : {1u, 6u, 16u, kMostCodedStride}) {
      const Bytes coded = encode_bytes(sample, stride);
      raw.insert(raw.end(), coded.begin(), coded.end());
    }
  }
  EXPECT_EQ(raw_hash(raw), 10649338886243673461u);
  GrayPicture wild = discs(120, 80);
  for (std::size_t x = 0; x < 120; ++x) wild.pixels[120 * 40 + x] = x % 2 == 0 ? 0 : 255;
  EXPECT_EQ(raw_hash(encode_picture(wild.pixels, 120)), 5210534267697569889u);
}

TEST(CodedBytes, ThatEndTooEarlyAreRefused) {
  const Bytes coded = encode_bytes(samples()[3], 1);
  EXPECT_FALSE(decode_bytes(std::span(coded).first(coded.size() / 2), 3000, 1));
  EXPECT_FALSE(decode_bytes({}, 3000, 1));
}

TEST(CodedPicture, ComesBackAndIsSmallerThanItsNoise) {
  for (const auto& [width, height] : {std::pair{1, 1}, {1, 40}, {40, 1}, {200, 150}}) {
    const GrayPicture picture = discs(width, height);
    const Bytes coded = encode_picture(picture.pixels, static_cast<std::uint32_t>(width));
    PictureDecoder decoder(coded, static_cast<std::uint32_t>(width),
                           static_cast<std::uint32_t>(height));
    EXPECT_EQ(decoder.finish(), picture.pixels);
  }
  // A gradient with three equally likely grays of noise: log2(3) bits a pixel are its least.
  GrayPicture noisy{256, 256, {}};
  std::mt19937 random(5);
  for (int i = 0; i < 256 * 256; ++i) {
    noisy.pixels.push_back(
        static_cast<std::uint8_t>(40 + i % 256 / 2 + static_cast<int>(random() % 3)));
  }
  const double bits = 8.0 * static_cast<double>(encode_picture(noisy.pixels, 256).size()) / 65536;
  EXPECT_GT(bits, std::log2(3.0) - 0.01);
  EXPECT_LT(bits, 1.25 * std::log2(3.0));
}

TEST(CodedPicture, ComesBackWhileItComes) {
  std::mt19937 random(11);
  GrayPicture noise{150, 90, {}};
  for (int i = 0; i < 150 * 90; ++i) noise.pixels.push_back(static_cast<std::uint8_t>(random()));
  // Of a flat picture with a row of black and white, which no row before foretells: 16 bits a pixel
  // do not hold it.
  GrayPicture flat{150, 90, std::vector<std::uint8_t>(150 * 90, 77)};
  for (std::size_t x = 0; x < 150; ++x) flat.pixels[150 * 60 + x] = x % 2 == 0 ? 0 : 255;
  for (const GrayPicture& picture : {discs(200, 150), noise, flat}) {
    const auto width = static_cast<std::uint32_t>(picture.width);
    const Bytes coded = encode_picture(picture.pixels, width);
    Bytes memory(coded.size(), std::byte{0xA5});  // missing bytes must not be read
    PictureDecoder decoder(memory, width, static_cast<std::uint32_t>(picture.height));
    for (std::size_t there = 0; there < coded.size(); there += 1 + random() % (coded.size() / 7)) {
      std::copy_n(coded.begin(), there, memory.begin());
      decoder.go_on(there);
    }
    std::copy(coded.begin(), coded.end(), memory.begin());
    EXPECT_EQ(decoder.finish(), picture.pixels);
  }
}

TEST(PackedRecord, ComesBackWhileItComes) {
  const Bytes packed = pack_tracker_record(small_record()).value();
  Bytes memory(packed.size());
  RecordUnpacker unpacker(memory);
  for (std::size_t there = 0; there < packed.size(); there += 1000) {
    std::copy_n(packed.begin(), there, memory.begin());
    unpacker.go_on(there);
  }
  memory = packed;
  EXPECT_EQ(unpacker.finish().value(), small_record());
}

TEST(PackedRecord, ComesBackByteForByte) {
  const Bytes& record = small_record();
  const auto packed = pack_tracker_record(record);
  ASSERT_TRUE(packed);
  EXPECT_LT(packed->size(), record.size() / 2);
  const auto again = unpack_tracker_record(*packed);
  ASSERT_TRUE(again) << again.error().cause;
  EXPECT_EQ(*again, record);
}

TEST(PackedRecord, OfAnotherMakerIsNotPacked) {
  Bytes record = small_record();
  TrackerRecordHeader header{};
  std::memcpy(&header, record.data(), sizeof header);
  const auto altered = [&](std::uint64_t at) {
    record[at] ^= std::byte{1};
    const bool packs = pack_tracker_record(record).has_value();
    record[at] ^= std::byte{1};
    return !packs;
  };
  EXPECT_TRUE(altered(header.codes_offset));
  EXPECT_TRUE(altered(header.patches_offset + 6)) << "a score";
  EXPECT_TRUE(altered(record.size() - 1)) << "a pixel of a coarser level";
  EXPECT_FALSE(pack_tracker_record(std::span(record).first(200)));
}

TEST(PackedRecord, DamageIsRefusedOrMakesOtherBytes) {
  Bytes packed = pack_tracker_record(small_record()).value();
  for (std::size_t at = 0; at < packed.size(); at += 1 + packed.size() / 12) {
    packed[at] ^= std::byte{16};
    const auto made = unpack_tracker_record(packed);
    EXPECT_FALSE(made && *made == small_record()) << at;
    packed[at] ^= std::byte{16};
  }
  for (const std::size_t size : {std::size_t{0}, std::size_t{31}, packed.size() - 1}) {
    EXPECT_FALSE(unpack_tracker_record(std::span(packed).first(size))) << size;
  }
}

/// All of the format, with a record, proxies and a texture whose finest level is above
/// kShownSide.
Bytes staged_bundle() {
  BundleContent content = test::lit_content();
  test::add_proxies(content);
  ExtraSection record;
  record.type = static_cast<std::uint32_t>(SectionType::kTrackerRecord);
  record.owner = 0;
  record.bytes = small_record();
  content.extra.push_back(std::move(record));
  return test::encode(content);
}

TEST(Stages, CoverEverySectionOnceInTheOrderOfNeed) {
  const Bytes bytes = staged_bundle();
  const auto bundle = BundleView::open(bytes);
  ASSERT_TRUE(bundle);
  std::vector<int> covered(bytes.size());
  LoadStage last = LoadStage::kFind;
  for (const StageRange& range : stage_ranges(*bundle)) {
    EXPECT_LE(last, range.stage);
    last = range.stage;
    ASSERT_LE(range.offset + range.size, bytes.size());
    for (std::uint64_t i = 0; i < range.size; ++i) ++covered[range.offset + i];
  }
  EXPECT_EQ(last, LoadStage::kRefine) << "chunks that a proxy is drawn for";
  for (const SectionEntry& entry : bundle->sections()) {
    for (std::uint64_t i = 0; i < entry.size; ++i) {
      ASSERT_EQ(covered[entry.offset + i], 1) << entry.type << " byte " << i;
    }
  }
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    ASSERT_TRUE(covered[i] == 1 || bytes[i] == std::byte{0}) << i;
  }
}

/// What arrives of a packed bundle up to a stage.
std::unique_ptr<ArrivingBundle> arrived(const Bytes& packed, LoadStage until) {
  const auto size = packed_recipe_size(packed);
  EXPECT_TRUE(size);
  const auto recipe = open_packed(std::span(packed).first(*size));
  EXPECT_TRUE(recipe);
  auto bundle = ArrivingBundle::create(recipe->header.bundle_size);
  std::size_t at = *size;
  for (const PieceRecord& piece : recipe->pieces) {
    const auto stored = std::span(packed).subspan(at, piece.stored_size);
    at += piece.stored_size;
    if (static_cast<LoadStage>(piece.stage) > until) continue;
    auto raw = decode_own_piece(piece, stored);
    EXPECT_TRUE(raw);
    EXPECT_TRUE(bundle->put_piece(piece, *raw));
  }
  EXPECT_EQ(at, packed.size());
  return bundle;
}

Bytes copy(ArrivingBundle& bundle) {
  return {bundle.bytes().begin(), bundle.bytes().end()};
}

TEST(Arriving, AllPiecesMakeTheBundle) {
  const Bytes bytes = staged_bundle();
  const Bytes packed = pack_bundle(BundleView::open(bytes).value(), 1);
  EXPECT_EQ(pack_bundle(BundleView::open(bytes).value(), 3), packed);
  EXPECT_EQ(copy(*arrived(packed, LoadStage::kRefine)), bytes);
}

TEST(Arriving, TheFirstStageOpensAndHasTheRecord) {
  const Bytes bytes = staged_bundle();
  const auto first = arrived(pack_bundle(BundleView::open(bytes).value(), 1), LoadStage::kFind);
  const auto bundle = BundleView::open(first->bytes());
  ASSERT_TRUE(bundle) << bundle.error().cause;
  const auto record = bundle->section(SectionType::kTrackerRecord, 0);
  EXPECT_TRUE(
      std::equal(record.begin(), record.end(), small_record().begin(), small_record().end()));
  EXPECT_NE(copy(*first), bytes);
}

TEST(Arriving, WhatIsShownFirstIsThere) {
  const Bytes bytes = staged_bundle();
  const auto whole = BundleView::open(bytes).value();
  const auto some = arrived(pack_bundle(whole, 2), LoadStage::kShow);
  const Bytes before = copy(*some);
  const auto bundle = BundleView::open(some->bytes());
  ASSERT_TRUE(bundle) << bundle.error().cause;
  ASSERT_TRUE(some->show_coarsest());
  const auto there = [&](std::uint64_t from, std::uint64_t size) {
    return std::equal(bytes.begin() + static_cast<std::ptrdiff_t>(from),
                      bytes.begin() + static_cast<std::ptrdiff_t>(from + size),
                      some->bytes().begin() + static_cast<std::ptrdiff_t>(from));
  };
  const auto indices = static_cast<std::uint64_t>(whole.indices().data() - bytes.data());
  ASSERT_GT(whole.proxies().size(), 0u);
  for (std::uint32_t m = 0; m < bundle->models().size(); ++m) {
    std::uint32_t group = m;  // the coarsest that the bundle has
    for (std::uint32_t i = 0; i < bundle->proxies().size(); ++i) {
      if (bundle->proxies()[i].model == m) group = bundle->models().size() + i;
    }
    const ChunkGroup chunks = bundle->chunk_group(group);
    const ChunkRecord& chunk = bundle->chunks()[chunks.first_chunk];
    const LevelRecord& level = bundle->levels()[chunk.first_level];
    EXPECT_TRUE(there(indices + level.index_offset, 2ull * level.index_count)) << m;
    EXPECT_TRUE(group == m || level.error == 0.0f) << "is chosen from everywhere";
  }
  for (std::uint32_t t = 0; t < bundle->textures().size(); ++t) {
    EXPECT_LE(bundle->textures()[t].width, kShownSide);
  }
  some->show_all();
  EXPECT_EQ(copy(*some), before);
}

/// A raw bundle that comes in its own order, as far as `end`, in pieces; its error, if any.
Result<void> pass_all(ArrivingBundle& bundle, std::span<const std::byte> bytes, std::uint64_t end) {
  const std::uint64_t start = gpu_start(BundleView::open(bundle.bytes()).value());
  MODAR_TRY(bundle.keep(true));
  for (std::uint64_t at = start; at < end; at += 1001) {
    MODAR_TRY(bundle.pass(at, bytes.subspan(at, std::min<std::uint64_t>(1001, end - at))));
  }
  return bundle.verify();
}

TEST(Arriving, OfWhatPassesByIsKeptWhatIsRead) {
  Bytes bytes = staged_bundle();
  const auto whole = BundleView::open(bytes).value();
  const std::uint64_t start = gpu_start(whole);
  const auto begin = [&] {
    auto bundle = ArrivingBundle::create(bytes.size());
    bundle->put(0, std::span(bytes).first(start));
    return bundle;
  };
  const auto bundle = begin();
  const auto passed = pass_all(*bundle, bytes, bytes.size());
  ASSERT_TRUE(passed) << passed.error().cause;
  for (const StageRange& range : bundle->kept()) {
    EXPECT_TRUE(std::equal(bytes.begin() + static_cast<std::ptrdiff_t>(range.offset),
                           bytes.begin() + static_cast<std::ptrdiff_t>(range.offset + range.size),
                           bundle->bytes().begin() + static_cast<std::ptrdiff_t>(range.offset)));
  }
  EXPECT_GT(bundle->kept().size(), 1u) << "proxies and small levels of textures";
  EXPECT_NE(copy(*bundle), bytes);
  // Whoever reads triangles finds those of proxies, and only meanwhile.
  const auto first_chunk = [&] {
    return BundleView::open(bundle->bytes()).value().models()[0].first_chunk;
  };
  const std::uint32_t before = first_chunk();
  const std::byte* const models =
      bundle->bytes().data() + (whole.section(SectionType::kModels).data() - bytes.data());
  const auto record = [&] {
    ModelRecord model{};
    std::memcpy(&model, models + sizeof(TableHeader), sizeof model);
    return model;
  };
  EXPECT_EQ(record().first_chunk, before);
  const std::uint32_t meanwhile = bundle->with_proxies([&] { return record().first_chunk; });
  EXPECT_GE(meanwhile, whole.chunks().own().size());
  EXPECT_EQ(record().first_chunk, before);
  // Bytes that are wrong or missing.
  EXPECT_EQ(pass_all(*begin(), bytes, bytes.size() - 1).error().code, "section.hash");
  bytes[start + 5] ^= std::byte{1};
  EXPECT_EQ(pass_all(*begin(), bytes, bytes.size()).error().code, "section.hash");
  bytes[start + 5] ^= std::byte{1};
  const auto damaged = begin();
  const auto record_of = whole.section(SectionType::kTrackerRecord, 0);
  damaged->bytes()[static_cast<std::size_t>(record_of.data() - bytes.data()) + 300] ^= std::byte{1};
  EXPECT_FALSE(pass_all(*damaged, bytes, bytes.size()));
}

TEST(Arriving, OtherFilesAndOrdersAreRefused) {
  const Bytes bytes = staged_bundle();
  const Bytes packed = pack_bundle(BundleView::open(bytes).value(), 1);
  EXPECT_FALSE(packed_recipe_size(bytes)) << "a bundle";
  EXPECT_FALSE(packed_recipe_size(std::span(packed).first(63)));
  const std::size_t size = packed_recipe_size(packed).value();
  const auto recipe = open_packed(std::span(packed).first(size));
  ASSERT_TRUE(recipe);
  std::vector<PieceRecord> pieces(recipe->pieces.begin(), recipe->pieces.end());
  ASSERT_TRUE(open_packed(recipe_bytes(recipe->header, pieces)));
  std::swap(pieces.front(), pieces.back());
  EXPECT_FALSE(open_packed(recipe_bytes(recipe->header, pieces))) << "the last stage first";
  std::swap(pieces.front(), pieces.back());
  pieces[0].form = static_cast<std::uint8_t>(PieceForm::kZstd);
  pieces[0].index_base = 0;
  EXPECT_FALSE(open_packed(recipe_bytes(recipe->header, pieces))) << "pages have no zstd";
}

}  // namespace
}  // namespace modar
