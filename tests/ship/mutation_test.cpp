// Documents, recipes and pieces, mutated at random: errors or other values, never a crash. A
// hundred thousand of them; a million under MODAR_SOAK=full.
#include <gtest/gtest.h>

#include <cstring>
#include <functional>
#include <random>
#include <string>

#include "bake/ship/keys/keys.hpp"
#include "bake/ship/recipe_maker.hpp"
#include "modar/piece.hpp"
#include "modar/release.hpp"
#include "tests/formats/support.hpp"
#include "tests/soak.hpp"

namespace modar {
namespace {

int rounds(int share) {
  return (testing::soak() ? 1'000'000 : 100'000) / share;
}

/// Flips, overwrites, inserts, removes and repeats.
std::string mutated(std::string bytes, std::mt19937& random) {
  const auto place = [&](std::size_t size) { return size == 0 ? 0 : random() % size; };
  for (unsigned i = 1 + random() % 4; i-- > 0;) {
    const std::size_t at = place(bytes.size());
    switch (random() % 6) {
      case 0:
        if (!bytes.empty()) bytes[at] = static_cast<char>(bytes[at] ^ 1 << random() % 8);
        break;
      case 1:
        if (!bytes.empty()) bytes[at] = static_cast<char>(random());
        break;
      case 2:
        bytes.insert(at, random() % 20, static_cast<char>(random()));
        break;
      case 3:
        bytes.erase(at, random() % 20);
        break;
      case 4:
        bytes.insert(at, bytes.substr(place(bytes.size()), random() % 40));
        break;
      default:
        bytes.resize(place(bytes.size() + 1));
        break;
    }
  }
  return bytes;
}

std::span<const std::byte> as_bytes(const std::string& text) {
  return std::as_bytes(std::span(text.data(), text.size()));
}

PublishedBundle golden_pieces() {
  const auto bytes = encode_bundle(test::golden_content());
  auto made = make_recipe(*BundleView::open(*bytes), {});
  return std::move(*made);
}

TEST(Mutations, Documents) {
  Release release;
  release.version = 3;
  release.expires = 1798761600;
  release.bundles.resize(2);
  release.bundles[0].name = "vase";
  release.bundles[0].devices = {"ace2"};
  release.bundles[1].name = "mural";
  const std::string text = release_text(release);
  const auto key = make_key();
  const std::string signature = sign(*key, text, "modar release 3");
  const std::string link = key_rotation_text({1, public_key_line(key->public_key)});
  std::mt19937 random(1);
  for (int i = rounds(2); i-- > 0;) {
    const std::string document = mutated(text, random);
    if (const auto parsed = parse_release(document)) {
      EXPECT_FALSE(parsed->bundles.empty());
      EXPECT_EQ(parsed->bundles[0].name.find('/'), std::string::npos);
    }
    if (const auto parsed = parse_signature(mutated(signature, random));
        parsed && document != text) {
      EXPECT_FALSE(verify_signature(document, *parsed, key->public_key));
    }
    (void)parse_key_rotation(mutated(link, random));
    (void)parse_public_key(mutated(public_key_text(key->public_key), random));
  }
}

TEST(Mutations, RecipesAndPieces) {
  const PublishedBundle made = golden_pieces();
  const std::string recipe(reinterpret_cast<const char*>(made.recipe.data()), made.recipe.size());
  std::mt19937 random(2);
  std::vector<std::uint64_t> aligned;
  for (int i = rounds(4); i-- > 0;) {
    const std::string bytes = mutated(recipe, random);
    aligned.assign(bytes.size() / 8 + 1, 0);
    std::memcpy(aligned.data(), bytes.data(), bytes.size());
    const auto view = open_recipe(std::as_bytes(std::span(aligned)).first(bytes.size()));
    if (!view) continue;
    for (const PieceRecord& piece : view->pieces) {
      ASSERT_LE(piece.offset + piece.raw_size - piece.second_size, view->header.bundle_size);
      ASSERT_LE(piece.second_offset + piece.second_size, view->header.bundle_size);
    }
  }
  const auto view = open_recipe(made.recipe);
  for (int i = rounds(4); i-- > 0;) {
    const PieceRecord& piece = view->pieces[random() % view->pieces.size()];
    if (piece.stored_size == 0) continue;
    const auto& stored = made.objects.at(std::to_array(piece.id));
    const std::string bytes =
        mutated(std::string(reinterpret_cast<const char*>(stored.data()), stored.size()), random);
    PieceRecord other = piece;
    if (random() % 4 == 0) other.form = static_cast<std::uint8_t>(1 + random() % 6);
    if (const auto raw = decode_piece(other, as_bytes(bytes))) {
      ASSERT_EQ(raw->size(), piece.raw_size);
    }
  }
}

}  // namespace
}  // namespace modar
