// Recipes of the golden bundle: complete, assembled here, and broken in every byte.
#include "formats/transport/recipe.hpp"

#include <gtest/gtest.h>

#include <cstring>

#include "bake/ship/recipe_maker.hpp"
#include "modar/piece.hpp"
#include "modar/release.hpp"
#include "tests/formats/support.hpp"

namespace modar {
namespace {

std::vector<std::byte> bundle_bytes() {
  const auto bytes = encode_bundle(test::golden_content());
  EXPECT_TRUE(bytes);
  return bytes ? *bytes : std::vector<std::byte>();
}

PublishedBundle published(const std::vector<std::byte>& bytes, unsigned jobs) {
  const auto view = BundleView::open(bytes);
  EXPECT_TRUE(view);
  RecipeOptions options;
  options.jobs = jobs;
  auto made = make_recipe(*view, options);
  EXPECT_TRUE(made);
  return made ? std::move(*made) : PublishedBundle();
}

TEST(Recipe, PiecesMakeTheBundle) {
  const auto bytes = bundle_bytes();
  const PublishedBundle made = published(bytes, 2);
  const auto recipe = open_recipe(made.recipe);
  ASSERT_TRUE(recipe);
  std::vector<std::byte> built(recipe->header.bundle_size);
  for (const PieceRecord& piece : recipe->pieces) {
    std::span<const std::byte> stored;
    if (piece.stored_size == 0) {
      stored = std::span(built).subspan(piece.second_offset, piece.second_size);
    } else {
      stored = made.objects.at(std::to_array(piece.id));
    }
    const auto raw = decode_piece(piece, stored);
    ASSERT_TRUE(raw);
    const bool mesh = piece.form == static_cast<std::uint8_t>(PieceForm::kMesh);
    const std::size_t second = mesh ? piece.second_size : 0;
    std::memcpy(built.data() + piece.offset, raw->data(), raw->size() - second);
    ASSERT_NE(piece.form, static_cast<std::uint8_t>(PieceForm::kLevel)) << "too small for one";
    for (std::size_t i = 0; i < second; i += 2) {
      std::uint16_t index = 0;
      std::memcpy(&index, raw->data() + raw->size() - second + i, 2);
      index = static_cast<std::uint16_t>(index + piece.index_base);
      std::memcpy(built.data() + piece.second_offset + i, &index, 2);
    }
  }
  EXPECT_EQ(built, bytes);
  EXPECT_EQ(bundle_hash(built), std::to_array(recipe->header.bundle_hash));
}

TEST(Recipe, HangsOnTheBundleAlone) {
  const auto bytes = bundle_bytes();
  const PublishedBundle one = published(bytes, 1);
  const PublishedBundle many = published(bytes, 7);
  EXPECT_EQ(one.recipe, many.recipe);
  EXPECT_EQ(one.objects, many.objects);
}

TEST(Recipe, EveryTruncationIsRefused) {
  const PublishedBundle made = published(bundle_bytes(), 1);
  for (std::size_t size = 0; size < made.recipe.size(); ++size) {
    std::vector<std::uint64_t> aligned((size + 7) / 8 + 1);
    std::memcpy(aligned.data(), made.recipe.data(), size);
    EXPECT_FALSE(open_recipe(std::as_bytes(std::span(aligned)).first(size))) << size;
  }
}

TEST(Recipe, FieldsOutOfRangeAreRefused) {
  const PublishedBundle made = published(bundle_bytes(), 1);
  const auto refused = [&](auto&& change) {
    auto bytes = made.recipe;
    auto* header = reinterpret_cast<RecipeHeader*>(bytes.data());
    auto* piece = reinterpret_cast<PieceRecord*>(bytes.data() + sizeof(RecipeHeader));
    change(*header, *piece);
    header->table_hash = 0;  // so that the hash is not what refuses it
    if (header->version == 2) header->table_hash = raw_hash(bytes);
    return !open_recipe(bytes);
  };
  EXPECT_FALSE(refused([](RecipeHeader&, PieceRecord&) {}));
  EXPECT_TRUE(refused([](RecipeHeader& h, PieceRecord&) { h.magic[0] = 0; }));
  EXPECT_TRUE(refused([](RecipeHeader& h, PieceRecord&) { h.version = 0; }));
  EXPECT_TRUE(refused([](RecipeHeader& h, PieceRecord&) { h.version = 3; }));
  EXPECT_TRUE(refused([](RecipeHeader& h, PieceRecord&) { h.version = 1; })) << "it has stages";
  EXPECT_TRUE(refused([](RecipeHeader& h, PieceRecord&) { ++h.piece_count; }));
  EXPECT_TRUE(refused([](RecipeHeader& h, PieceRecord&) { h.bundle_size = 100; }));
  EXPECT_TRUE(refused([](RecipeHeader&, PieceRecord& p) { p.form = 0; }));
  EXPECT_TRUE(refused([](RecipeHeader&, PieceRecord& p) { p.form = 77; }));
  EXPECT_TRUE(refused([](RecipeHeader&, PieceRecord& p) { p.raw_size = 0; }));
  EXPECT_TRUE(refused([](RecipeHeader&, PieceRecord& p) { p.raw_size = kMaxPieceBytes + 1; }));
  EXPECT_TRUE(refused([](RecipeHeader&, PieceRecord& p) { p.offset = ~0ull; }));
  EXPECT_TRUE(refused([](RecipeHeader&, PieceRecord& p) { p.offset = ~0ull - p.raw_size + 1; }));
  EXPECT_TRUE(refused([](RecipeHeader&, PieceRecord& p) { p.second_offset = 1; }));
  EXPECT_TRUE(refused([](RecipeHeader&, PieceRecord& p) { p.second_size = 6; }));
  EXPECT_TRUE(refused([](RecipeHeader&, PieceRecord& p) { p.stored_size = 0; }));
  EXPECT_TRUE(refused([](RecipeHeader&, PieceRecord& p) { p.index_base = 1; }));
  EXPECT_TRUE(refused([](RecipeHeader&, PieceRecord& p) { p.reserved[7] = 1; }));
  EXPECT_TRUE(refused([](RecipeHeader&, PieceRecord& p) { p.stage = 4; }));
  EXPECT_TRUE(refused([](RecipeHeader&, PieceRecord& p) { p.form = 8; })) << "without a stride";
  EXPECT_FALSE(refused([](RecipeHeader&, PieceRecord& p) { p.form = 8, p.index_base = 256; }));
  EXPECT_TRUE(refused([](RecipeHeader&, PieceRecord& p) { p.form = 8, p.index_base = 257; }));
}

TEST(Recipe, EveryDamagedByteIsRefused) {
  auto recipe = published(bundle_bytes(), 1).recipe;
  ASSERT_TRUE(open_recipe(recipe));
  for (std::byte& byte : recipe) {
    byte ^= std::byte{4};
    EXPECT_FALSE(open_recipe(recipe)) << &byte - recipe.data();
    byte ^= std::byte{4};
  }
}

TEST(Recipe, ABitOfAPieceIsABitTooMany) {
  const PublishedBundle made = published(bundle_bytes(), 1);
  const auto recipe = open_recipe(made.recipe);
  ASSERT_TRUE(recipe);
  for (const PieceRecord& piece : recipe->pieces) {
    if (piece.stored_size == 0) continue;
    auto stored = made.objects.at(std::to_array(piece.id));
    for (std::size_t bit = 0; bit < 8 * std::min<std::size_t>(stored.size(), 400); ++bit) {
      stored[bit / 8] ^= static_cast<std::byte>(1u << bit % 8);
      EXPECT_NE(object_id(stored), std::to_array(piece.id));
      stored[bit / 8] ^= static_cast<std::byte>(1u << bit % 8);
    }
  }
}

}  // namespace
}  // namespace modar
