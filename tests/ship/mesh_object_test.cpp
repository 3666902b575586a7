// Chunks through the mesh coder and back: every byte, whatever the mesh; and broken objects.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <random>

#include "formats/quantise.hpp"
#include "formats/transport/chunk_order.hpp"
#include "formats/transport/mesh_coder.hpp"

namespace modar {
namespace {

/// Half positions, byte normals, 16-bit uv and colours: 20 bytes.
LayoutRecord full_layout() {
  LayoutRecord layout{};
  layout.stride = 20;
  layout.attribute_count = 4;
  const auto half = static_cast<std::uint8_t>(ComponentType::kHalf);
  layout.attributes[0] = {1, half, 3, 0, 0, 0};
  layout.attributes[1] = {2, static_cast<std::uint8_t>(ComponentType::kI8), 3, 1, 8, 0};
  layout.attributes[2] = {3, static_cast<std::uint8_t>(ComponentType::kU16), 2, 1, 12, 0};
  layout.attributes[3] = {4, static_cast<std::uint8_t>(ComponentType::kU8), 4, 1, 16, 0};
  return layout;
}

/// 16-bit integer positions and nothing else but a normal.
LayoutRecord integer_layout() {
  LayoutRecord layout{};
  layout.stride = 12;
  layout.attribute_count = 2;
  layout.attributes[0] = {1, static_cast<std::uint8_t>(ComponentType::kI16), 3, 0, 0, 0};
  layout.attributes[1] = {2, static_cast<std::uint8_t>(ComponentType::kI8), 3, 1, 8, 0};
  return layout;
}

struct Mesh {
  LayoutRecord layout;
  std::vector<std::byte> vertices;
  std::vector<std::uint16_t> indices;

  std::uint16_t add(double x, double y, double z, double u, double v) {
    std::vector<std::byte> bytes(layout.stride);
    const bool integers =
        layout.attributes[0].type == static_cast<std::uint8_t>(ComponentType::kI16);
    const std::array<double, 3> p = {x, y, z};
    for (std::size_t c = 0; c < 3; ++c) {
      std::uint16_t value = float_to_half(static_cast<float>(p[c]));
      if (value == 0x8000) value = 0;
      if (integers) value = static_cast<std::uint16_t>(std::lround(30000 * p[c]));
      std::memcpy(bytes.data() + 2 * c, &value, 2);
      bytes[8 + c] =
          static_cast<std::byte>(float_to_snorm8(static_cast<float>(std::sin(9 * p[c]))));
    }
    if (layout.stride == 20) {
      const std::array<std::uint16_t, 2> uv = {float_to_unorm16(static_cast<float>(u)),
                                               float_to_unorm16(static_cast<float>(v))};
      std::memcpy(bytes.data() + 12, uv.data(), 4);
      for (std::size_t c = 0; c < 4; ++c) bytes[16 + c] = static_cast<std::byte>(200 * u);
    }
    vertices.insert(vertices.end(), bytes.begin(), bytes.end());
    return static_cast<std::uint16_t>(vertices.size() / layout.stride - 1);
  }
  void face(std::uint16_t a, std::uint16_t b, std::uint16_t c) {
    indices.insert(indices.end(), {a, b, c});
  }
  /// As the bake stores it.
  void order() {
    ChunkOrderer orderer;
    std::vector<std::byte> ordered;
    for (const std::uint16_t old : orderer.order(vertices, layout.stride, indices)) {
      const auto* at = vertices.data() + old * std::size_t{layout.stride};
      ordered.insert(ordered.end(), at, at + layout.stride);
    }
    vertices = ordered;
  }
};

/// A wavy sheet with a seam of its texture in the middle.
Mesh sheet(LayoutRecord layout, int n) {
  Mesh mesh{layout, {}, {}};
  for (int side = 0; side < 2; ++side) {
    const int first = static_cast<int>(mesh.vertices.size() / layout.stride);
    for (int y = 0; y <= n; ++y) {
      for (int x = 0; x <= n; ++x) {
        const double px = (side + double(x) / n) - 1;
        mesh.add(px, 2.0 * y / n - 1, 0.3 * std::sin(5 * px) * std::cos(0.2 * y),
                 side == 0 ? 0.5 * x / n : 1 - 0.5 * x / n, double(y) / n);
      }
    }
    const auto at = [&](int x, int y) {
      return static_cast<std::uint16_t>(first + y * (n + 1) + x);
    };
    for (int y = 0; y < n; ++y) {
      for (int x = 0; x < n; ++x) {
        mesh.face(at(x, y), at(x + 1, y), at(x + 1, y + 1));
        mesh.face(at(x, y), at(x + 1, y + 1), at(x, y + 1));
      }
    }
  }
  return mesh;
}

std::vector<std::byte> expect_restored(Mesh mesh) {
  mesh.order();
  const auto object = encode_mesh(mesh.vertices, mesh.indices, mesh.layout);
  EXPECT_TRUE(object);
  if (!object) return {};
  const auto back = decode_mesh(*object);
  EXPECT_TRUE(back);
  if (!back) return {};
  EXPECT_EQ(back->vertices, mesh.vertices);
  EXPECT_EQ(back->indices, mesh.indices);
  return *object;
}

TEST(MeshObject, RestoresSheetsAndIsSmall) {
  for (const LayoutRecord& layout : {full_layout(), integer_layout()}) {
    const Mesh mesh = sheet(layout, 40);
    const auto object = expect_restored(mesh);
    EXPECT_LT(object.size(), (mesh.vertices.size() + 2 * mesh.indices.size()) / 3);
  }
}

TEST(MeshObject, RestoresWhatNoEditorWouldMake) {
  std::mt19937 random(6);
  for (int round = 0; round < 25; ++round) {
    Mesh mesh{round % 2 == 0 ? full_layout() : integer_layout(), {}, {}};
    std::uniform_real_distribution<double> any(-1, 1);
    const int count = 3 + round * 8;
    for (int i = 0; i < count; ++i) {
      // A coarse lattice, so that places meet.
      const auto place = [&] { return std::round(any(random) * 3) / 3; };
      mesh.add(place(), place(), place(), std::abs(any(random)), 0.5);
    }
    for (int i = 0; i < 3 * count; ++i) {
      const auto v = [&] {
        return static_cast<std::uint16_t>(random() % static_cast<unsigned>(count));
      };
      const std::uint16_t a = v();
      mesh.face(a, random() % 10 == 0 ? a : v(), v());  // degenerate ones, doubles, fans of many
    }
    // Vertices that no triangle uses cannot be in a chunk.
    for (int i = 0; i < count; ++i) {
      const auto v = static_cast<std::uint16_t>(i);
      mesh.face(v, static_cast<std::uint16_t>((i + 1) % count),
                static_cast<std::uint16_t>((i + 2) % count));
    }
    expect_restored(mesh);
  }
}

/// A chunk whose coarser levels use the first vertices: a quarter, then another one, then the rest.
Mesh grouped(Mesh mesh) {
  mesh.order();
  std::mt19937 random(3);
  std::vector<std::byte> groups(mesh.vertices.size() / mesh.layout.stride);
  for (std::byte& group : groups) group = static_cast<std::byte>(random() % 3);
  const std::vector<std::uint16_t> numbers = numbers_by_group(groups);
  const std::vector<std::byte> before = mesh.vertices;
  for (std::size_t v = 0; v < numbers.size(); ++v) {
    std::memcpy(mesh.vertices.data() + numbers[v] * std::size_t{mesh.layout.stride},
                before.data() + v * mesh.layout.stride, mesh.layout.stride);
  }
  for (std::uint16_t& index : mesh.indices) index = numbers[index];
  return mesh;
}

TEST(MeshObject, GroupsOfVerticesCostTwoBitsEachAtMost) {
  const std::size_t without = expect_restored(sheet(full_layout(), 40)).size();
  const Mesh mesh = grouped(sheet(full_layout(), 40));
  const auto object = encode_mesh(mesh.vertices, mesh.indices, mesh.layout);
  ASSERT_TRUE(object);
  EXPECT_EQ(object->front(), std::byte{3});
  EXPECT_LE(object->size(), without + mesh.vertices.size() / mesh.layout.stride / 4);
  const auto back = decode_mesh(*object);
  ASSERT_TRUE(back);
  EXPECT_EQ(back->vertices, mesh.vertices);
  EXPECT_EQ(back->indices, mesh.indices);

  std::vector<std::byte> newer = *object;
  newer[0] = std::byte{4};
  const auto refused = decode_mesh(newer);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, "mesh.version");
  newer[0] = std::byte{2};
  EXPECT_FALSE(decode_mesh(newer));
  newer = *object;
  newer.push_back(std::byte{0});
  EXPECT_FALSE(decode_mesh(newer)) << "a byte too many";
}

TEST(MeshObject, OcclusionTravelsAsAnAttribute) {
  Mesh mesh = sheet(full_layout(), 40);
  const std::size_t without = expect_restored(mesh).size();
  for (std::size_t v = 0; v < mesh.vertices.size(); v += mesh.layout.stride) {
    mesh.vertices[v + 11] = static_cast<std::byte>(100 + 20 * std::sin(0.0002 * double(v)));
  }
  Mesh unknown = mesh;
  unknown.order();
  EXPECT_FALSE(encode_mesh(unknown.vertices, unknown.indices, unknown.layout))
      << "a byte of no attribute cannot travel";
  AttributeRecord& occlusion = mesh.layout.attributes[mesh.layout.attribute_count++];
  occlusion = {kTravellingOcclusion, static_cast<std::uint8_t>(ComponentType::kU8), 1, 0, 11, 0};
  EXPECT_LT(expect_restored(mesh).size(), without + mesh.vertices.size() / mesh.layout.stride / 2);
}

TEST(MeshObject, LevelsComeBackInTheirOrder) {
  Mesh mesh = sheet(full_layout(), 30);
  mesh.order();
  std::vector<std::uint16_t> indices;
  for (std::size_t i = 0; i < mesh.indices.size(); i += 9) {
    indices.insert(indices.end(), {mesh.indices[i], mesh.indices[i + 1], mesh.indices[i + 2]});
  }
  EXPECT_FALSE(encode_level(indices)) << "not in the bake's order";
  LevelOrderer orderer;
  orderer.order(indices, 65536);
  const auto buffer = encode_level(indices);
  ASSERT_TRUE(buffer);
  EXPECT_LT(buffer->size(), 2 * indices.size());
  const auto back = decode_level(*buffer, indices.size());
  ASSERT_TRUE(back);
  EXPECT_EQ(*back, indices);
  for (std::size_t size = 0; size < buffer->size(); ++size) {
    EXPECT_FALSE(decode_level(std::span(*buffer).first(size), indices.size()));
  }
}

/// More vertices at one place than the coder compares before it writes a number, and all bit
/// patterns of halves: -0, infinity, NaN.
TEST(MeshObject, RestoresCrowdedPlacesAndOddHalves) {
  for (const int crowd : {16, 17, 18, 400}) {
    Mesh mesh{full_layout(), {}, {}};
    for (int i = 0; i < crowd; ++i) {
      const std::uint16_t tip = mesh.add(0, 0, 1, 0.5 + i / 1000.0, 0.5);
      const std::uint16_t a = mesh.add(std::cos(i), std::sin(i), 0, 0, 0);
      const std::uint16_t b = mesh.add(std::cos(i + 1), std::sin(i + 1), 0, 0, 0);
      mesh.face(tip, a, b);
    }
    // Each tip again, far from where it was new.
    for (int i = 0; i < crowd; ++i) {
      const auto tip = static_cast<std::uint16_t>(3 * i);
      mesh.face(tip, static_cast<std::uint16_t>(3 * ((i + crowd / 2) % crowd) + 1), 2);
    }
    expect_restored(mesh);
  }
  Mesh mesh{full_layout(), {}, {}};
  for (const unsigned bits : {0x8000u, 0x0000u, 0x8001u, 0x7C00u, 0xFC00u, 0x7E01u, 0xFFFFu}) {
    const std::uint16_t vertex = mesh.add(0, 0, 0, 0, 0);
    std::memcpy(mesh.vertices.data() + vertex * 20, &bits, 2);
  }
  for (std::uint16_t v = 0; v < 5; ++v) {
    mesh.face(v, static_cast<std::uint16_t>(v + 1), static_cast<std::uint16_t>(v + 2));
  }
  expect_restored(mesh);
}

TEST(MeshObject, RestoresTheLargestChunk) {
  Mesh mesh{integer_layout(), {}, {}};
  for (int y = 0; y < 256; ++y) {
    for (int x = 0; x < 256; ++x) mesh.add(x / 256.0, y / 256.0, 0.1 * std::sin(x * 0.1), 0, 0);
  }
  const auto at = [](int x, int y) { return static_cast<std::uint16_t>(256 * y + x); };
  for (int y = 0; y < 255; ++y) {
    for (int x = 0; x < 255; ++x) mesh.face(at(x, y), at(x + 1, y), at(x, y + 1));
    for (int x = 0; x < 255; ++x) mesh.face(at(x + 1, y), at(x + 1, y + 1), at(x, y + 1));
  }
  EXPECT_EQ(mesh.vertices.size() / mesh.layout.stride, 65536u);
  expect_restored(mesh);
}

TEST(MeshObject, RefusesAnotherOrderThanTheBakes) {
  Mesh mesh = sheet(full_layout(), 6);
  mesh.order();
  std::rotate(mesh.indices.begin(), mesh.indices.begin() + 3, mesh.indices.end());
  EXPECT_FALSE(encode_mesh(mesh.vertices, mesh.indices, mesh.layout));
}

TEST(MeshObject, TruncatedAndFlippedObjectsAreErrorsOrOtherMeshes) {
  const auto object = expect_restored(sheet(full_layout(), 4));
  ASSERT_FALSE(object.empty());
  for (std::size_t size = 0; size < object.size(); ++size) {
    EXPECT_FALSE(decode_mesh(std::span(object).first(size))) << size;
  }
  // The id of a piece is checked before it is decoded; this is for the day when it is not.
  std::mt19937 random(7);
  for (int i = 0; i < 3000; ++i) {
    auto damaged = object;
    for (std::size_t n = 1 + random() % 3; n-- > 0;) {
      // Half of them in the header and the first triangles.
      const std::size_t end = i % 2 == 0 ? sizeof(MeshObjectHeader) + 64 : damaged.size();
      damaged[random() % end] ^= static_cast<std::byte>(1u << random() % 8);
    }
    const auto chunk = decode_mesh(damaged);
    EXPECT_TRUE(!chunk || chunk->vertices.size() <= 65536u * 20);
  }
}

}  // namespace
}  // namespace modar
