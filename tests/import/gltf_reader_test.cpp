// glTF in: hand-made files with known answers, Draco's own encoder, Debian's sample models, and our
// own GLB round the circle.
#include "bake/import/read_model.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <span>
#include <string>
#include <vector>

#include <draco/compression/encode.h>
#include <draco/mesh/triangle_soup_mesh_builder.h>
#include <meshoptimizer.h>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "bake/image/image.hpp"
#include "formats/base/atomic_file.hpp"
#include "tests/import/samples.hpp"
#include "tests/mesh/stages.hpp"

namespace modar {
namespace {

namespace fs = std::filesystem;

class Gltf : public ::testing::Test {
 protected:
  void SetUp() override {
    std::string name = (fs::temp_directory_path() / "modar-gltf-test-XXXXXX").string();
    ASSERT_NE(::mkdtemp(name.data()), nullptr);
    folder_ = name;
  }
  void TearDown() override { fs::remove_all(folder_); }

  /// A file of this JSON whose one buffer holds `bytes`.
  Result<SourceModel> read(const std::string& json, const std::string& bytes) {
    std::ofstream(folder_ / "data.bin", std::ios::binary) << bytes;
    std::ofstream(folder_ / "test.gltf", std::ios::binary)
        << R"({"asset":{"version":"2.0"},"buffers":[{"uri":"data.bin","byteLength":)"
        << bytes.size() << "}]," << json << "}";
    return read_gltf((folder_ / "test.gltf").string());
  }

  fs::path folder_;
};

template <class T>
std::string raw(const std::vector<T>& values) {
  return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T)};
}

/// Three positions, then three 16-bit indices.
std::string one_triangle() {
  return raw<float>({0, 0, 0, 1, 0, 0, 0, 1, 0}) + raw<std::uint16_t>({0, 1, 2, 0});
}

constexpr const char* kOneTriangle =
    R"("bufferViews":[{"buffer":0,"byteOffset":0,"byteLength":36},
    {"buffer":0,"byteOffset":36,"byteLength":6}],
    "accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"},
    {"bufferView":1,"componentType":5123,"count":3,"type":"SCALAR"}],)";

TEST_F(Gltf, NodesMoveTheirMeshes) {
  const auto model = read(
      std::string(kOneTriangle) +
          R"("meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1,"material":0}]}],
          "materials":[{"name":"red","doubleSided":true,
          "pbrMetallicRoughness":{"baseColorFactor":[1,0.214,0,1]}}],
          "nodes":[{"translation":[10,20,30],"children":[1,2]},
          {"mesh":0,"scale":[2,3,4]},
          {"mesh":0,"rotation":[0,0,0.7071067811865476,0.7071067811865476],"scale":[-1,1,1]}],
          "scenes":[{"nodes":[0]}],"scene":0)",
      one_triangle());
  ASSERT_TRUE(model) << to_line(model.error());
  ASSERT_EQ(model->positions.size(), 6u);
  EXPECT_EQ(model->positions[1], glm::dvec3(12, 20, 30));
  EXPECT_EQ(model->positions[2], glm::dvec3(10, 23, 30));
  // Mirrored along x, then a quarter turn about z: (1,0,0) to (0,-1,0), (0,1,0) to (-1,0,0).
  EXPECT_LT(glm::length(model->positions[4] - glm::dvec3(10, 19, 30)), 1e-12);
  EXPECT_LT(glm::length(model->positions[5] - glm::dvec3(9, 20, 30)), 1e-12);
  // The mirrored one is turned round, so that both still face +z.
  for (std::size_t f = 0; f < 2; ++f) {
    const auto at = [&](std::size_t c) {
      return model->positions[model->corner_positions[3 * f + c]];
    };
    EXPECT_GT(glm::cross(at(1) - at(0), at(2) - at(0)).z, 0) << f;
  }
  EXPECT_EQ(model->materials[0].name, "red");
  EXPECT_TRUE(model->materials[0].two_sided);
  // sRGB of linear 0.214 is 0.5 (IEC 61966-2-1).
  EXPECT_NEAR(static_cast<double>(model->materials[0].diffuse.y), 0.5, 0.001);
}

// Section 3.7.2.1 of the glTF 2.0 specification; fans begin at another corner of the same triangle.
TEST_F(Gltf, StripsAndFansAreTriangles) {
  const std::pair<int, std::vector<std::uint32_t>> kinds[] = {
      {4, {0, 1, 2}}, {5, {0, 1, 2, 1, 3, 2, 2, 3, 4}}, {6, {0, 1, 2, 0, 2, 3, 0, 3, 4}}};
  for (const auto& [mode, corners] : kinds) {
    const auto model =
        read(R"("bufferViews":[{"buffer":0,"byteOffset":0,"byteLength":60}],"accessors":[
            {"bufferView":0,"componentType":5126,"count":5,"type":"VEC3"}],"meshes":[{"primitives":
            [{"attributes":{"POSITION":0},"mode":)" +
                 std::to_string(mode) + R"(}]}],"nodes":[{"mesh":0}],"scenes":[{"nodes":[0]}])",
             raw<float>({0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0, 0, 2, 0}));
    ASSERT_TRUE(model) << to_line(model.error());
    EXPECT_EQ(std::vector(model->corner_positions.begin(), model->corner_positions.end()), corners);
  }
}

/// Three vertices: one on each of two joints, one on both. The second joint is 2 along x, a quarter
/// turn about z, and was bound where it stands without the turn.
std::string skinned_triangle(int last_joint = 1) {
  return one_triangle() +
         raw<std::uint8_t>(
             {0, 0, 0, 0, 1, 0, 0, 0, 0, static_cast<std::uint8_t>(last_joint), 0, 0}) +
         raw<float>({1, 0, 0, 0, 2, 0, 0, 0, 0.5f, 0.5f, 0, 0}) +
         raw<float>({1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0,  0, 0, 1,
                     1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, -2, 0, 0, 1});
}

constexpr const char* kSkin =
    R"("bufferViews":[{"buffer":0,"byteOffset":0,"byteLength":36},
    {"buffer":0,"byteOffset":36,"byteLength":6},{"buffer":0,"byteOffset":44,"byteLength":12},
    {"buffer":0,"byteOffset":56,"byteLength":48},{"buffer":0,"byteOffset":104,"byteLength":128}],
    "accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"},
    {"bufferView":1,"componentType":5123,"count":3,"type":"SCALAR"},
    {"bufferView":2,"componentType":5121,"count":3,"type":"VEC4"},
    {"bufferView":3,"componentType":5126,"count":3,"type":"VEC4"},
    {"bufferView":4,"componentType":5126,"count":2,"type":"MAT4"}],
    "meshes":[{"primitives":[{"attributes":{"POSITION":0,"JOINTS_0":2,"WEIGHTS_0":3},"indices":1}]}],
    "skins":[{"inverseBindMatrices":4,"joints":[1,2]}],
    "nodes":[{"mesh":0,"skin":0,"translation":[100,100,100]},{"children":[2],"translation":[0,0,5]},
    {"translation":[2,0,0],"rotation":[0,0,0.7071067811865476,0.7071067811865476]}],
    "scenes":[{"nodes":[0,1]}])";

TEST_F(Gltf, HiddenNodesAreLeftOutAndMorphTargetsHaveTheirDefaultWeights) {
  // The target is the triangle's own positions: at a weight of 0.5 it is half as large again.
  const auto read_with = [&](const char* mesh, const char* nodes) {
    return read(std::string(kOneTriangle) + R"("meshes":[{)" + mesh +
                    R"("primitives":[{"attributes":{"POSITION":0},"indices":1,
                    "targets":[{"POSITION":0}]}]}],"scenes":[{"nodes":[0]}],"nodes":)" +
                    nodes,
                one_triangle());
  };
  const char* const weights = R"("weights":[0.5],)";
  const auto mesh = read_with(weights, R"([{"mesh":0}])");
  ASSERT_TRUE(mesh) << to_line(mesh.error());
  EXPECT_EQ(mesh->positions[1], glm::dvec3(1.5, 0, 0));
  const auto node = read_with(weights, R"([{"mesh":0,"weights":[2]}])");
  ASSERT_TRUE(node) << to_line(node.error());
  EXPECT_EQ(node->positions[1], glm::dvec3(3, 0, 0)) << "a node's weights win";
  const auto hidden = read_with("", R"([{"children":[1,2]},{"mesh":0},
          {"extensions":{"KHR_node_visibility":{"visible":false}},"children":[3]},{"mesh":0}])");
  ASSERT_TRUE(hidden) << to_line(hidden.error());
  EXPECT_EQ(hidden->face_count(), 1u);
}

TEST_F(Gltf, SkinnedMeshesFollowTheirJoints) {
  const auto model = read(kSkin, skinned_triangle());
  ASSERT_TRUE(model) << to_line(model.error());
  ASSERT_EQ(model->positions.size(), 3u);
  // The node's own place does not count. (1,0,0) is at (-1,0,0) of the second joint, which the
  // turn takes to (0,-1,0); its weight of 2 counts as 1.
  EXPECT_LT(glm::length(model->positions[0] - glm::dvec3(0, 0, 5)), 1e-12);
  EXPECT_LT(glm::length(model->positions[1] - glm::dvec3(2, -1, 5)), 1e-12);
  // (0,1,0): half of itself, half of (-2,1,0) turned to (-1,-2,0) and moved to (1,-2,0).
  EXPECT_LT(glm::length(model->positions[2] - glm::dvec3(0.5, -0.5, 5)), 1e-12);
  EXPECT_TRUE(model->diagnostics.empty());
  const auto broken = read(kSkin, skinned_triangle(2));
  ASSERT_FALSE(broken) << "a joint that is not there";
  EXPECT_EQ(broken.error().code, "gltf.skin");
}

TEST_F(Gltf, InstancedNodesAreCopied) {
  const std::string instances =
      R"("nodes":[{"mesh":0,"translation":[0,0,1],"extensions":{"EXT_mesh_gpu_instancing":
      {"attributes":{"TRANSLATION":2,"SCALE":3}}}}],"scenes":[{"nodes":[0]}],
      "extensionsUsed":["EXT_mesh_gpu_instancing"],"extensionsRequired":["EXT_mesh_gpu_instancing"])";
  const auto file = [&](int scales) {
    const std::string count = std::to_string(scales);
    return read(R"("bufferViews":[{"buffer":0,"byteOffset":0,"byteLength":36},
        {"buffer":0,"byteOffset":36,"byteLength":6},{"buffer":0,"byteOffset":44,"byteLength":48}],
        "accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"},
        {"bufferView":1,"componentType":5123,"count":3,"type":"SCALAR"},
        {"bufferView":2,"componentType":5126,"count":2,"type":"VEC3"},
        {"bufferView":2,"byteOffset":24,"componentType":5126,"count":)" +
                    count + R"(,"type":"VEC3"}],
        "meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1}]}],)" +
                    instances,
                one_triangle() + raw<float>({10, 0, 0, 20, 0, 0, 1, 1, 1, 2, 3, 4}));
  };
  const auto model = file(2);
  ASSERT_TRUE(model) << to_line(model.error());
  ASSERT_EQ(model->positions.size(), 6u);
  EXPECT_EQ(model->positions[1], glm::dvec3(11, 0, 1));
  EXPECT_EQ(model->positions[4], glm::dvec3(22, 0, 1));
  EXPECT_EQ(model->positions[5], glm::dvec3(20, 3, 1));
  EXPECT_EQ(model->corner_positions.size(), 6u);
  EXPECT_FALSE(file(1)) << "two places, one scale";
}

TEST_F(Gltf, BrokenFilesAreErrors) {
  const std::string scene = R"("nodes":[{"mesh":0}],"scenes":[{"nodes":[0]}])";
  const std::string mesh =
      R"("meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1}]}],)";
  ASSERT_TRUE(read(kOneTriangle + mesh + scene, one_triangle()));
  // An index beyond the vertices.
  std::string bytes = one_triangle();
  bytes[36] = 3;
  const auto index = read(kOneTriangle + mesh + scene, bytes);
  ASSERT_FALSE(index);
  EXPECT_EQ(index.error().code, "gltf.accessor");
  // More vertices than the buffer holds.
  std::string much = kOneTriangle;
  much.replace(much.find("\"count\":3"), 9, "\"count\":4");
  const auto beyond = read(much + mesh + scene, one_triangle());
  ASSERT_FALSE(beyond);
  EXPECT_EQ(beyond.error().code, "gltf.accessor");
  // Billions of zeros out of nothing.
  std::string nothing = kOneTriangle;
  nothing.replace(nothing.find("{\"bufferView\":0,\"componentType\":5126,\"count\":3"), 46,
                  "{\"componentType\":5126,\"count\":3000000000");
  const auto zeros = read(nothing + mesh + scene, one_triangle());
  ASSERT_FALSE(zeros);
  EXPECT_EQ(zeros.error().code, "gltf.accessor");
  // A node that is its own child.
  EXPECT_FALSE(read(kOneTriangle + mesh + R"("nodes":[{"mesh":0,"children":[0]}],)" +
                        R"("scenes":[{"nodes":[0]}])",
                    one_triangle()));
  EXPECT_FALSE(read(kOneTriangle + mesh + R"("nodes":[],"scenes":[{"nodes":[]}])", one_triangle()));
  EXPECT_FALSE(read("this is no JSON", ""));
  EXPECT_EQ(read_gltf("/no/such.glb").error().code, "io.open");
}

TEST_F(Gltf, RequiredExtensionsAreReadOrRefusedByName) {
  const std::string scene =
      R"("meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1}]}],)"
      R"("nodes":[{"mesh":0}],"scenes":[{"nodes":[0]}])";
  const auto requires_these = [&](const std::string& names) {
    return read(kOneTriangle + scene + R"(,"extensionsUsed":[)" + names +
                    R"(],"extensionsRequired":[)" + names + "]",
                one_triangle());
  };
  EXPECT_TRUE(requires_these(R"("KHR_mesh_quantization","KHR_texture_transform")"));
  EXPECT_TRUE(requires_these(R"("KHR_lights_punctual","KHR_materials_clearcoat")"));
  EXPECT_TRUE(requires_these(R"("KHR_materials_pbrSpecularGlossiness")"));
  const auto refused = requires_these(R"("KHR_texture_basisu","MODAR_none")");
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().exit, ExitCode::kUnsupported);
  EXPECT_EQ(refused.error().code, "gltf.extension");
  EXPECT_NE(refused.error().cause.find("KHR_texture_basisu, MODAR_none"), std::string::npos);
  const auto basis = requires_these(R"("KHR_texture_basisu")");
  ASSERT_FALSE(basis);
  EXPECT_EQ(basis.error().exit, ExitCode::kUnsupported);
  EXPECT_NE(basis.error().cure.find(": npx @gltf-transform/cli ktxdecompress '"),
            std::string::npos);
  // Only used: read without, and said.
  const auto used =
      read(kOneTriangle + scene + R"(,"extensionsUsed":["KHR_materials_clearcoat"],)" +
               R"("animations":[{"channels":[],"samplers":[]}],)" +
               R"("materials":[{"normalTexture":{"index":0},"alphaMode":"MASK"}])",
           one_triangle());
  ASSERT_TRUE(used) << to_line(used.error());
  std::vector<std::string> ids;
  for (const Diagnostic& d : used->diagnostics) ids.push_back(d.id);
  std::sort(ids.begin(), ids.end());
  EXPECT_EQ(ids, (std::vector<std::string>{"gltf.alpha-mask", "gltf.left-out"}));
  EXPECT_EQ(used->diagnostics.back().message,
            "left out: 1 animation (the pose of the file's nodes is baked), extensions "
            "KHR_materials_clearcoat");
  EXPECT_EQ(used->diagnostics.back().cure,
            "for another pose, apply it to the model and export it again");
}

TEST_F(Gltf, TheAlphaOfVerticesIsMissedWhereItWouldShow) {
  for (const std::string mode : {"OPAQUE", "BLEND"}) {
    const auto model = read(
        R"("bufferViews":[{"buffer":0,"byteLength":36},{"buffer":0,"byteOffset":36,"byteLength":12}],
        "accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"},
        {"bufferView":1,"componentType":5121,"normalized":true,"count":3,"type":"VEC4"}],
        "meshes":[{"primitives":[{"attributes":{"POSITION":0,"COLOR_0":1},"material":0}]}],
        "materials":[{"alphaMode":")" +
            mode + R"("}],"nodes":[{"mesh":0}],"scenes":[{"nodes":[0]}])",
        raw<float>({0, 0, 0, 1, 0, 0, 0, 1, 0}) +
            raw<std::uint8_t>({255, 0, 0, 100, 255, 0, 0, 100, 255, 0, 0, 100}));
    ASSERT_TRUE(model) << to_line(model.error());
    EXPECT_EQ(model->diagnostics.empty(), mode == "OPAQUE") << mode;
  }
}

TEST_F(Gltf, AnEmptyPictureIsReportedAndRefusesNothing) {
  const auto model = read(
      std::string(kOneTriangle) +
          R"("meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1,"material":0}]}],)"
          R"("nodes":[{"mesh":0}],"scenes":[{"nodes":[0]}],"textures":[{"source":0}],)"
          R"("images":[{"uri":"data:image/png;base64,"}],)"
          R"("materials":[{"pbrMetallicRoughness":{"baseColorTexture":{"index":0}}}])",
      one_triangle());
  ASSERT_TRUE(model) << to_line(model.error());
  EXPECT_FALSE(read_image(model->materials[0].diffuse_map)) << "the bake says so";
}

TEST_F(Gltf, GlassAndGlossinessHaveTheCoresNearest) {
  const std::string gloss = R"({"extensions":{"KHR_materials_pbrSpecularGlossiness":{)";
  const auto model = read(
      std::string(kOneTriangle) +
          R"("meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1}]}],)"
          R"("nodes":[{"mesh":0}],"scenes":[{"nodes":[0]}],)"
          R"("images":[{"uri":"data:image/png;base64,iVBORw0KGgo="}],"textures":[{"source":0}],)"
          R"("materials":[)" +
          gloss + R"("diffuseFactor":[0.5,0.25,0.25,0.25],"specularFactor":[0.04,0.04,0.04],)" +
          R"("glossinessFactor":0}},"alphaMode":"BLEND"},)" + gloss +
          R"("diffuseFactor":[0,0,0,1],"specularFactor":[1,0.2140411,0]}}},)" + gloss +
          R"("diffuseTexture":{"index":0}}}},)"
          R"({"extensions":{"KHR_materials_transmission":{"transmissionFactor":1}}},)"
          R"({"extensions":{"KHR_materials_transmission":{"transmissionFactor":"x"}}},)" +
          gloss + R"("diffuseFactor":[1],"diffuseTexture":[2]}}}])",
      one_triangle());
  ASSERT_TRUE(model) << to_line(model.error());
  const std::vector<SourceMaterial>& m = model->materials;
  EXPECT_NEAR(m[0].diffuse.r, 0.735, 1e-3);  // sRGB of 0.5
  EXPECT_NEAR(m[0].diffuse.g, 0.537, 1e-3);
  EXPECT_EQ(m[0].opacity, 0.25f);
  EXPECT_EQ(m[0].specular, glm::vec3(0.0f)) << "rough";
  // Reflects more than it scatters: a metal of that colour.
  EXPECT_EQ(m[1].diffuse.r, 1.0f);
  EXPECT_NEAR(m[1].diffuse.g, 0.5, 1e-3);
  EXPECT_EQ(m[1].metalness, 1.0f);
  EXPECT_FALSE(m[2].diffuse_map.empty());
  EXPECT_EQ(m[2].diffuse, glm::vec3(1.0f));
  EXPECT_NEAR(m[3].opacity, 0.2, 1e-6);
  EXPECT_EQ(m[4].opacity, 1.0f);
  EXPECT_EQ(m[5].diffuse, glm::vec3(1.0f)) << "wrong types are left out";
}

TEST_F(Gltf, VersionOneIsRefusedAsSuch) {
  std::ofstream(folder_ / "one.gltf") << R"({"asset":{"version":"1.0"},"meshes":{"a":{}}})";
  const auto text = read_gltf((folder_ / "one.gltf").string());
  ASSERT_FALSE(text);
  EXPECT_EQ(text.error().code, "gltf.version");
  // A header of version 1: length 20, scene length 0, format JSON.
  std::ofstream(folder_ / "one.glb", std::ios::binary)
      << "glTF" << raw<std::uint32_t>({1, 20, 0, 0});
  const auto binary = read_gltf((folder_ / "one.glb").string());
  ASSERT_FALSE(binary);
  EXPECT_EQ(binary.error().exit, ExitCode::kUnsupported);
  EXPECT_EQ(binary.error().code, "gltf.version");
}

TEST_F(Gltf, AGlbThatIsCutShortIsCalledSo) {
  for (const std::uint32_t stated : {20U, 21U}) {
    std::ofstream(folder_ / "cut.glb", std::ios::binary)
        << "glTF" << raw<std::uint32_t>({2, stated, 0, 0x4E4F534A});
    const auto read = read_gltf((folder_ / "cut.glb").string());
    ASSERT_FALSE(read);
    EXPECT_EQ(read.error().code == "gltf.short", stated == 21) << to_line(read.error());
  }
}

TEST_F(Gltf, ImageNamesArePercentDecodedAndMayBeWebp) {
  std::ofstream(folder_ / "my wall.webp") << "RIFF";
  std::ofstream(folder_ / "100%.png") << "png";
  const auto model = read(
      std::string(kOneTriangle) +
          R"("meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1,"material":0}]}],
          "images":[{"uri":"my%20wall.webp"},{"uri":"100%.png"}],
          "textures":[{"extensions":{"EXT_texture_webp":{"source":0}}},{"source":1}],
          "materials":[{"pbrMetallicRoughness":{"baseColorTexture":{"index":0}}},
          {"pbrMetallicRoughness":{"baseColorTexture":{"index":1}}}],
          "nodes":[{"mesh":0}],"scenes":[{"nodes":[0]}],"extensionsUsed":["EXT_texture_webp"])",
      one_triangle());
  ASSERT_TRUE(model) << to_line(model.error());
  EXPECT_EQ(fs::path(model->materials[0].diffuse_map).filename(), "my wall.webp");
  EXPECT_EQ(fs::path(model->materials[1].diffuse_map).filename(), "100%.png");
  EXPECT_TRUE(model->diagnostics.empty());
}

TEST_F(Gltf, DataOfAnyStatedTypeIsReadByItsBytes) {
  // A red PNG of one pixel.
  const std::string picture =
      "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAIAAACQd1PeAAAADElEQVR4nGP4z8AAAAMBAQDJ/"
      "pLvAAAAAElFTkSuQmCC";
  const std::string buffer = "AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAAAAABAAIAAAA=";
  for (const char* type : {"", "model/gltf-buffer", "image/png;charset=utf-8", "image/jpg"}) {
    std::ofstream(folder_ / "a.gltf")
        << R"({"asset":{"version":"2.0"},"buffers":[{"byteLength":44,"uri":"data:)" << type
        << ";base64," << buffer << R"("}],)" << kOneTriangle
        << R"("meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1,"material":0}]}],
          "nodes":[{"mesh":0}],"scenes":[{"nodes":[0]}],"textures":[{"source":0}],
          "materials":[{"pbrMetallicRoughness":{"baseColorTexture":{"index":0}}}],
          "images":[{"uri":"data:)"
        << type << ";base64," << picture << R"("}]})";
    const auto model = read_gltf((folder_ / "a.gltf").string());
    ASSERT_TRUE(model) << type << to_line(model.error());
    EXPECT_TRUE(read_image(model->materials[0].diffuse_map)) << type;
    EXPECT_TRUE(model->files.empty()) << type;
  }
  std::ofstream(folder_ / "a.gltf")
      << R"({"asset":{"version":"2.0"},"buffers":[{"byteLength":4,"uri":"data:)"
      << std::string(5000, 'x') << "\"}]}";
  const auto broken = read_gltf((folder_ / "a.gltf").string());
  ASSERT_FALSE(broken);
  EXPECT_LT(to_line(broken.error()).size(), 600u);
}

TEST_F(Gltf, BuffersAndImagesAreFoundWhereOthersAre) {
  fs::create_directories(folder_ / "textures");
  std::ofstream(folder_ / "textures" / "Wall.PNG") << "png";
  std::ofstream(folder_ / "Mesh 1.bin", std::ios::binary) << one_triangle();
  std::ofstream(folder_ / "a.gltf")
      << R"({"asset":{"version":"2.0"},"buffers":[{"byteLength":44,"uri":"C:\\me\\mesh%201.bin"}],)"
      << kOneTriangle
      << R"("meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1,"material":0}]}],
          "nodes":[{"mesh":0}],"scenes":[{"nodes":[0]}],"textures":[{"source":0}],
          "materials":[{"pbrMetallicRoughness":{"baseColorTexture":{"index":0}}}],
          "images":[{"uri":"maps\\wall.png"}]})";
  const auto model = read_gltf((folder_ / "a.gltf").string());
  ASSERT_TRUE(model) << to_line(model.error());
  EXPECT_EQ(fs::path(model->materials[0].diffuse_map).filename(), "Wall.PNG");
  ASSERT_EQ(model->diagnostics.size(), 1u);
  EXPECT_EQ(model->diagnostics[0].id, "model.found-elsewhere");
}

TEST_F(Gltf, PicturesAndModesOfAlphaAreFoldedIntoTheColour) {
  const auto picture = [&](const char* name, std::vector<std::uint8_t> pixels) {
    const RgbaImage image = {2, 1, std::move(pixels)};
    ASSERT_TRUE(write_png(image, (folder_ / name).string()));
  };
  picture("colour.png", {200, 100, 0, 255, 200, 100, 0, 100});
  picture("solid.png", {200, 100, 0, 255, 200, 100, 0, 255});
  picture("glow.png", {0, 0, 255, 255, 0, 0, 0, 255});
  picture("shade.png", {255, 9, 9, 255, 0, 9, 9, 255});
  picture("rough.png", {0, 51, 255, 255, 0, 153, 255, 255});  // means: 0.4 and 1
  const auto model = read(
      std::string(kOneTriangle) +
          R"("meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1,"material":0}]}],
          "images":[{"uri":"colour.png"},{"uri":"glow.png"},{"uri":"shade.png"},{"uri":"rough.png"},
          {"uri":"solid.png"}],
          "textures":[{"source":0},{"source":1},{"source":2},{"source":3},{"source":4}],
          "materials":[
          {"pbrMetallicRoughness":{"baseColorTexture":{"index":0}}},
          {"pbrMetallicRoughness":{"baseColorTexture":{"index":0}},"alphaMode":"BLEND"},
          {"pbrMetallicRoughness":{"baseColorTexture":{"index":0}},"alphaMode":"MASK"},
          {"pbrMetallicRoughness":{"baseColorTexture":{"index":0},"baseColorFactor":[1,1,1,0.9]},
           "alphaMode":"MASK","alphaCutoff":0.35},
          {"pbrMetallicRoughness":{"baseColorTexture":{"index":4}}},
          {"pbrMetallicRoughness":{"baseColorTexture":{"index":4},"baseColorFactor":[0,1,1,1]},
           "emissiveTexture":{"index":1},"emissiveFactor":[1,1,1],"occlusionTexture":{"index":2}},
          {"pbrMetallicRoughness":{"baseColorFactor":[1,0.5,0,1],"roughnessFactor":1,
           "metallicRoughnessTexture":{"index":3}},"emissiveTexture":{"index":1,"texCoord":1},
           "emissiveFactor":[0.5,0,0.5]}],
          "nodes":[{"mesh":0}],"scenes":[{"nodes":[0]}])",
      one_triangle());
  ASSERT_TRUE(model) << to_line(model.error());
  const auto pixels = [&](std::size_t material) {
    const Result<RgbaImage> image = read_image(model->materials[material].diffuse_map);
    return image ? image->pixels : std::vector<std::uint8_t>();
  };
  using Bytes = std::vector<std::uint8_t>;
  EXPECT_EQ(pixels(0), (Bytes{200, 100, 0, 255, 200, 100, 0, 255}));
  EXPECT_EQ(fs::path(model->materials[1].diffuse_map), folder_ / "colour.png");
  EXPECT_EQ(pixels(2), (Bytes{200, 100, 0, 255, 200, 100, 0, 0}));
  EXPECT_EQ(fs::path(model->materials[2].diffuse_map).filename(), "colour.png");
  // 100 / 255 of 0.9 is 0.353.
  EXPECT_EQ(pixels(3), (Bytes{200, 100, 0, 255, 200, 100, 0, 255}));
  EXPECT_EQ(fs::path(model->materials[4].diffuse_map), folder_ / "solid.png");
  // sRGB 100 is 0.1274 in linear light; half of that, where all is occluded, is sRGB 71.
  EXPECT_EQ(pixels(5), (Bytes{0, 100, 255, 255, 0, 71, 0, 255}));
  EXPECT_EQ(model->materials[5].diffuse, glm::vec3(1.0f));
  // Another set of coordinates: the map's mean, (0, 0, 0.5) in linear light, times the factor; 0.25
  // is sRGB 0.537. Roughness 0.4 is an exponent of 76.1.
  EXPECT_TRUE(model->materials[6].diffuse_map.empty());
  EXPECT_EQ(model->materials[6].emission.x, 0.0f);
  EXPECT_NEAR(model->materials[6].emission.z, 0.537f, 0.002f);
  EXPECT_NEAR(model->materials[6].shininess, 76.1f, 0.1f);
  // (n + 2) / 8 of the drawn exponent, 40, times (40 / 76.1)^(1/2), in sRGB; the colour comes
  // later.
  EXPECT_NEAR(model->materials[6].specular.x, 1.786f, 0.005f);
  EXPECT_EQ(model->materials[6].specular.z, model->materials[6].specular.x);
  // glTF 2.0, 5.22: metal of roughness 1 where a file states nothing.
  EXPECT_EQ(model->materials[0].metalness, 1.0f);
  EXPECT_LT(model->materials[0].shininess, 0.2f);
  std::vector<std::string> ids;
  for (const Diagnostic& d : model->diagnostics) ids.push_back(d.id);
  std::sort(ids.begin(), ids.end());
  EXPECT_EQ(ids,
            (std::vector<std::string>{"gltf.alpha-mask", "gltf.emissive-map", "gltf.emissive-map",
                                      "gltf.metal-map", "gltf.occlusion-map"}));
}

/// Three triangles, two on the left half of a map and one on the right one.
std::string three_triangles() {
  return raw<float>(
             {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 1, 0, 1, 0, 1, 1, 0, 0, 2, 1, 0, 2, 0, 1, 2}) +
         raw<float>({0.05f, 0.1f, 0.4f, 0.1f, 0.05f, 0.9f, 0.55f, 0.1f, 0.9f, 0.1f, 0.55f, 0.9f,
                     0.05f, 0.1f, 0.4f, 0.1f, 0.05f, 0.9f});
}

constexpr const char* kThreeTriangles =
    R"("bufferViews":[{"buffer":0,"byteOffset":0,"byteLength":108},
    {"buffer":0,"byteOffset":108,"byteLength":72}],
    "accessors":[{"bufferView":0,"componentType":5126,"count":9,"type":"VEC3"},
    {"bufferView":1,"componentType":5126,"count":9,"type":"VEC2"}],
    "meshes":[{"primitives":[{"attributes":{"POSITION":0,"TEXCOORD_0":1},"material":0}]}],
    "nodes":[{"mesh":0}],"scenes":[{"nodes":[0]}],
    "images":[{"uri":"metal.png"}],"textures":[{"source":0}],)";

TEST_F(Gltf, PicturesOfWhatIsLitMirrorLightInTheirDarkPlaces) {
  ASSERT_TRUE(write_png({1, 1, {9, 9, 9, 255}}, (folder_ / "metal.png").string()));
  const auto model = read(
      std::string(kThreeTriangles) +
          R"("materials":[{"pbrMetallicRoughness":{"baseColorTexture":{"index":0},"metallicFactor":0}},
          {"pbrMetallicRoughness":{"baseColorTexture":{"index":0},"metallicFactor":0},
           "extensions":{"KHR_materials_unlit":{}}},
          {"pbrMetallicRoughness":{"baseColorTexture":{"index":0}}},
          {"pbrMetallicRoughness":{"baseColorFactor":[1,0,0,1]},
           "extensions":{"KHR_materials_unlit":{}}}])",
      three_triangles());
  ASSERT_TRUE(model) << to_line(model.error());
  EXPECT_FLOAT_EQ(model->materials[0].reflectance, 0.04f) << "glTF 2.0, appendix B";
  EXPECT_EQ(model->materials[1].reflectance, 0.0f) << "unlit";
  EXPECT_TRUE(std::any_of(model->diagnostics.begin(), model->diagnostics.end(),
                          [](const Diagnostic& d) { return d.id == "gltf.unlit"; }))
      << "a picture is lit all the same";
  EXPECT_EQ(model->materials[3].emission, glm::vec3(1, 0, 0)) << "a colour is not";
  EXPECT_EQ(model->materials[3].diffuse, glm::vec3(0.0f));
  EXPECT_EQ(model->materials[2].metalness, 1.0f) << "glTF 2.0, 5.22: the default";
}

TEST_F(Gltf, FacesThatAMapCallsMetalAreAMaterialOfTheirOwn) {
  // Green is roughness, blue metalness: metal of roughness 0.4 on the left, plain 0.8 on the right.
  const auto map = [&](std::uint8_t right_metal) {
    RgbaImage image{8, 2, {}};
    for (int i = 0; i < 16; ++i) {
      const bool left = i % 8 < 4;
      image.pixels.insert(image.pixels.end(), {0,
                                               static_cast<std::uint8_t>(left               ? 102
                                                                         : right_metal == 0 ? 204
                                                                                            : 102),
                                               left ? std::uint8_t{255} : right_metal, 255});
    }
    ASSERT_TRUE(write_png(image, (folder_ / "metal.png").string()));
  };
  const auto read_with = [&](const char* map_info) {
    return read(
        std::string(kThreeTriangles) +
            R"("materials":[{"name":"m","pbrMetallicRoughness":{"baseColorFactor":[1,0.5,0,1],
                    "metallicRoughnessTexture":)" +
            map_info + "}}]",
        three_triangles());
  };
  map(0);
  const auto two = read_with(R"({"index":0})");
  ASSERT_TRUE(two) << to_line(two.error());
  RunCursor runs(two->material_runs);
  const SourceMaterial& left = two->materials[runs.at(0)];
  const SourceMaterial& right = two->materials[runs.at(1)];
  EXPECT_EQ(&left, &two->materials[runs.at(2)]);
  EXPECT_NE(left.name, right.name);
  EXPECT_EQ(left.metalness, 1.0f);
  EXPECT_NEAR(left.shininess, 76.1f, 6.0f);  // 2 / 0.4^4 - 2, in steps of 1/32
  EXPECT_EQ(right.metalness, 0.0f);
  map(255);  // all metal of one roughness: nothing to split
  const auto one = read_with(R"({"index":0})");
  ASSERT_TRUE(one) << to_line(one.error());
  EXPECT_EQ(one->materials.size(), 2u);  // and clay
  map(0);                                // another set of coordinates: the means alone
  const auto other = read_with(R"({"index":0,"texCoord":1})");
  ASSERT_TRUE(other) << to_line(other.error());
  EXPECT_EQ(other->materials.size(), 2u);
  EXPECT_NEAR(other->materials[0].metalness, 0.5f, 0.01f);
}

// glTF 2.0, 3.8.2: colour space information of image files is ignored.
TEST_F(Gltf, WhatPicturesStateOfTheirColoursIsIgnored) {
  auto png = encode_png(RgbaImage{1, 1, {128, 64, 0, 255}});
  ASSERT_TRUE(png);
  const auto gamma = {0,    0,    0,    4,    0x67, 0x41, 0x4D, 0x41,   // gAMA of 1, its checksum
                      0x00, 0x01, 0x86, 0xA0, 0x31, 0xE8, 0x96, 0x5F};  // behind the header
  std::vector<std::byte> bytes;
  for (const int value : gamma) bytes.push_back(static_cast<std::byte>(value));
  png->insert(png->begin() + 33, bytes.begin(), bytes.end());
  const std::string path = (folder_ / "linear.png").string();
  ASSERT_TRUE(write_file(path, std::span<const std::byte>(*png)));
  EXPECT_NEAR(read_image(path)->pixels[0], 188, 1) << "as other formats show it";
  const auto model = read(
      std::string(kOneTriangle) +
          R"("meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1,"material":0}]}],
          "images":[{"uri":"linear.png"}],"textures":[{"source":0}],
          "materials":[{"pbrMetallicRoughness":{"baseColorTexture":{"index":0}}}],
          "nodes":[{"mesh":0}],"scenes":[{"nodes":[0]}])",
      one_triangle());
  ASSERT_TRUE(model) << to_line(model.error());
  const auto image = read_image(model->materials[0].diffuse_map);
  ASSERT_TRUE(image);
  EXPECT_EQ(image->pixels, (std::vector<std::uint8_t>{128, 64, 0, 255}));
}

TEST_F(Gltf, SparseAccessorsReplaceWhatTheyList) {
  const auto file = [&](const char* base, int index) {
    // The base's third vertex moves to (5, 6, 7); without a base the others are zero, bar the
    // second.
    const std::string bytes = one_triangle() +
                              raw<std::uint8_t>({1, static_cast<std::uint8_t>(index), 0, 0}) +
                              raw<float>({4, 0, 1, 5, 6, 7});
    return read(std::string(R"("bufferViews":[{"buffer":0,"byteOffset":0,"byteLength":36},
        {"buffer":0,"byteOffset":36,"byteLength":6},{"buffer":0,"byteOffset":44,"byteLength":2},
        {"buffer":0,"byteOffset":48,"byteLength":24}],
        "accessors":[{)") +
                    base + R"("componentType":5126,"count":3,"type":"VEC3",
        "sparse":{"count":2,"indices":{"bufferView":2,"componentType":5121},"values":{"bufferView":3}}},
        {"bufferView":1,"componentType":5123,"count":3,"type":"SCALAR"}],
        "meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1}]}],
        "nodes":[{"mesh":0}],"scenes":[{"nodes":[0]}])",
                bytes);
  };
  const auto over = file("\"bufferView\":0,", 2);
  ASSERT_TRUE(over) << to_line(over.error());
  EXPECT_EQ(over->positions[0], glm::dvec3(0, 0, 0));
  EXPECT_EQ(over->positions[1], glm::dvec3(4, 0, 1));
  EXPECT_EQ(over->positions[2], glm::dvec3(5, 6, 7));
  const auto alone = file("", 2);
  ASSERT_TRUE(alone) << to_line(alone.error());
  EXPECT_EQ(alone->positions[0], glm::dvec3(0, 0, 0));
  EXPECT_EQ(alone->positions[2], glm::dvec3(5, 6, 7));
  EXPECT_FALSE(file("", 3)) << "an element that is not there";
}

TEST_F(Gltf, TextureTransformsMoveTheUv) {
  const auto model = read(std::string(R"("bufferViews":[{"buffer":0,"byteOffset":0,"byteLength":36},
      {"buffer":0,"byteOffset":36,"byteLength":6},{"buffer":0,"byteOffset":44,"byteLength":24}],
      "accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"},
      {"bufferView":1,"componentType":5123,"count":3,"type":"SCALAR"},
      {"bufferView":2,"componentType":5126,"count":3,"type":"VEC2"}],
      "materials":[{"pbrMetallicRoughness":{"baseColorTexture":{"index":0,"extensions":
      {"KHR_texture_transform":{"offset":[0.5,0.25],"rotation":1.5707963267948966,"scale":[2,4],
      "texCoord":1}}}}}],
      "meshes":[{"primitives":[{"attributes":{"POSITION":0,"TEXCOORD_1":2},"indices":1,"material":0}]}],
      "nodes":[{"mesh":0}],"scenes":[{"nodes":[0]}])"),
                          one_triangle() + raw<float>({0, 0, 1, 0, 0, 1}));
  ASSERT_TRUE(model) << to_line(model.error());
  ASSERT_EQ(model->uvs.size(), 3u);
  // Scaled, then a quarter turn counter-clockwise as the image is seen, v down: to the right goes
  // up.
  const auto expect = [&](std::size_t v, double x, double down) {
    EXPECT_NEAR(model->uvs[v].x, x, 1e-12) << v;
    EXPECT_NEAR(model->uvs[v].y, 1.0 - down, 1e-12) << v;
  };
  expect(0, 0.5, 0.25);
  expect(1, 0.5, 0.25 - 2);
  expect(2, 0.5 + 4, 0.25);
}

TEST_F(Gltf, NormalMapsHaveTheirScaleAndPlaceOnTheColour) {
  ASSERT_TRUE(write_png({1, 1, {128, 128, 255, 255}}, (folder_ / "n.png").string()));
  const auto model = read(
      std::string(kOneTriangle) +
          R"("meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1,"material":0}]}],
          "images":[{"uri":"n.png"}],"textures":[{"source":0}],
          "materials":[{"normalTexture":{"index":0,"scale":0.5}},
          {"pbrMetallicRoughness":{"baseColorTexture":{"index":0,"extensions":
           {"KHR_texture_transform":{"scale":[2,2],"offset":[0.5,0]}}}},
           "normalTexture":{"index":0,"extensions":{"KHR_texture_transform":{"scale":[8,4]}}}},
          {"normalTexture":{"index":0,"texCoord":1}},
          {"normalTexture":{"index":0},"extensions":{"KHR_materials_unlit":{}}}],
          "nodes":[{"mesh":0}],"scenes":[{"nodes":[0]}])",
      one_triangle());
  ASSERT_TRUE(model) << to_line(model.error());
  const auto normal = [&](std::size_t material) { return model->materials[material].normal; };
  EXPECT_EQ(fs::path(normal(0).path), folder_ / "n.png");
  EXPECT_FLOAT_EQ(normal(0).scale, 0.5f);
  EXPECT_FALSE(normal(0).may_be_heights);
  EXPECT_EQ(normal(0).uv, glm::dmat3(1.0));
  // The file's (1, 1) is (2.5, 2) on the colour and (8, 4) on the map.
  const glm::dvec3 at = normal(1).uv * glm::dvec3(2.5, 2, 1);
  EXPECT_NEAR(at.x, 8, 1e-12);
  EXPECT_NEAR(at.y, 4, 1e-12);
  EXPECT_TRUE(normal(2).path.empty()) << "another set of uvs";
  EXPECT_TRUE(normal(3).path.empty()) << "unlit";
  ASSERT_EQ(model->diagnostics.size(), 1U);
  EXPECT_EQ(model->diagnostics[0].id, "gltf.normal-map");
}

TEST_F(Gltf, DracoPrimitivesAreWhatTheEncoderWasGiven) {
  constexpr int kSide = 12;
  draco::TriangleSoupMeshBuilder builder;
  builder.Start(kSide * kSide);
  const int attribute =
      builder.AddAttribute(draco::GeometryAttribute::POSITION, 3, draco::DT_FLOAT32);
  double area = 0;
  for (int i = 0; i < kSide * kSide; ++i) {
    const auto x = static_cast<float>(i % kSide);
    const auto y = static_cast<float>(i / kSide);
    const std::array<float, 3> a = {x, y, 0.1f * x * y};
    const std::array<float, 3> b = {x + 1, y, 0.1f * (x + 1) * y};
    const std::array<float, 3> c = {x, y + 1, 0.1f * x * (y + 1)};
    builder.SetAttributeValuesForFace(attribute, draco::FaceIndex(static_cast<std::uint32_t>(i)),
                                      a.data(), b.data(), c.data());
    area += 0.5 * std::sqrt(1 + 0.01 * double(y * y) + 0.01 * double(x * x));
  }
  const auto mesh = builder.Finalize();
  draco::Encoder encoder;
  draco::EncoderBuffer buffer;
  ASSERT_TRUE(encoder.EncodeMeshToBuffer(*mesh, &buffer).ok());
  const std::string bytes(buffer.data(), buffer.size());
  const auto model = read(
      R"("extensionsUsed":["KHR_draco_mesh_compression"],
      "extensionsRequired":["KHR_draco_mesh_compression"],
      "bufferViews":[{"buffer":0,"byteOffset":0,"byteLength":)" +
          std::to_string(bytes.size()) + R"(}],
      "accessors":[{"componentType":5126,"count":)" +
          std::to_string(mesh->num_points()) + R"(,"type":"VEC3"},
      {"componentType":5125,"count":)" +
          std::to_string(3 * mesh->num_faces()) + R"(,"type":"SCALAR"}],
      "meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1,"extensions":
      {"KHR_draco_mesh_compression":{"bufferView":0,"attributes":{"POSITION":0}}}}]}],
      "nodes":[{"mesh":0}],"scenes":[{"nodes":[0]}])",
      bytes);
  ASSERT_TRUE(model) << to_line(model.error());
  ASSERT_EQ(model->face_count(), std::size_t{kSide * kSide});
  double found = 0;
  for (std::size_t f = 0; f < model->face_count(); ++f) {
    const auto at = [&](std::size_t c) {
      return model->positions[model->corner_positions[3 * f + c]];
    };
    found += glm::length(glm::cross(at(1) - at(0), at(2) - at(0))) / 2;
  }
  EXPECT_NEAR(found, area, 1e-3 * area);
}

/// A view as meshoptimizer packs it, and the JSON of its extension.
struct PackedView {
  std::string bytes;
  std::string json;
};
PackedView packed(const std::string& bytes, std::size_t offset, std::size_t count,
                  std::size_t stride, const std::string& kind) {
  return {bytes, R"("extensions":{"EXT_meshopt_compression":{"buffer":0,"byteOffset":)" +
                     std::to_string(offset) + R"(,"byteLength":)" + std::to_string(bytes.size()) +
                     R"(,"count":)" + std::to_string(count) + R"(,"byteStride":)" +
                     std::to_string(stride) + R"(,"mode":)" + kind + "}}"};
}

TEST_F(Gltf, ViewsThatMeshoptimizerPackedAreWhatItWasGiven) {
  const std::vector<float> positions = {0, 0, 0.1f, 1, 0, 0.2f, 1, 1, 0.3f, 0, 1, 0.4f};
  const std::vector<float> normals = {0, 0, 1, 0, 0.6f, 0, 0.8f, 0, 0, 0.6f, 0.8f, 0, 0, 0, -1, 0};
  const std::vector<unsigned> corners = {0, 1, 2, 0, 2, 3};
  std::vector<unsigned char> vertex_bytes(meshopt_encodeVertexBufferBound(4, 12));
  vertex_bytes.resize(meshopt_encodeVertexBuffer(vertex_bytes.data(), vertex_bytes.size(),
                                                 positions.data(), 4, 12));
  std::vector<std::int8_t> eighths(16);
  meshopt_encodeFilterOct(eighths.data(), 4, 4, 8, normals.data());
  std::vector<unsigned char> normal_bytes(meshopt_encodeVertexBufferBound(4, 4));
  normal_bytes.resize(
      meshopt_encodeVertexBuffer(normal_bytes.data(), normal_bytes.size(), eighths.data(), 4, 4));
  std::vector<unsigned char> triangles(meshopt_encodeIndexBufferBound(6, 4));
  triangles.resize(
      meshopt_encodeIndexBuffer(triangles.data(), triangles.size(), corners.data(), 6));
  std::vector<unsigned char> sequence(meshopt_encodeIndexSequenceBound(6, 4));
  sequence.resize(meshopt_encodeIndexSequence(sequence.data(), sequence.size(), corners.data(), 6));
  const auto write = [&](bool glb, const std::string& damage) {
    std::string all = "front";  // nothing is at the beginning
    const auto add = [&](const std::vector<unsigned char>& bytes, std::size_t count,
                         std::size_t stride, const std::string& kind) {
      PackedView view = packed(raw(bytes), all.size(), count, stride, kind);
      all += view.bytes;
      return view.json;
    };
    const std::string p = add(vertex_bytes, 4, 12, R"("ATTRIBUTES")");
    const std::string n = add(normal_bytes, 4, 4, R"("ATTRIBUTES","filter":"OCTAHEDRAL")");
    const std::string i =
        glb ? add(sequence, 6, 4, R"("INDICES")") : add(triangles, 6, 2, R"("TRIANGLES")");
    if (damage == "bytes") all[5] = 'x';
    std::string json =
        R"({"asset":{"version":"2.0"},"extensionsUsed":["EXT_meshopt_compression"],
        "extensionsRequired":["EXT_meshopt_compression"],"buffers":[{)" +
        std::string(glb ? "" : R"("uri":"packed%20views.bin",)") + R"("byteLength":)" +
        std::to_string(all.size()) +
        R"(},{"byteLength":999,"extensions":{"EXT_meshopt_compression":{"fallback":true}}}],
        "bufferViews":[{"buffer":1,"byteLength":48,"byteStride":12,)" +
        p + R"(},{"buffer":1,"byteOffset":48,"byteLength":16,"byteStride":4,)" + n +
        R"(},{"buffer":1,"byteOffset":64,"byteLength":12,)" + i + R"(}],
        "accessors":[{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3"},
        {"bufferView":1,"componentType":5120,"normalized":true,"count":4,"type":"VEC3"},
        {"bufferView":2,"componentType":)" +
        (glb ? "5125" : "5123") +
        R"(,"count":6,"type":"SCALAR"}],
        "meshes":[{"primitives":[{"attributes":{"POSITION":0,"NORMAL":1},"indices":2}]}],
        "nodes":[{"mesh":0}],"scenes":[{"nodes":[0]}]})";
    if (damage == "count") json.replace(json.find("\"count\":4"), 9, "\"count\":4000000000");
    const fs::path path = folder_ / (glb ? "packed.glb" : "packed.gltf");
    if (!glb) {
      std::ofstream(folder_ / "packed views.bin", std::ios::binary) << all;
      std::ofstream(path, std::ios::binary) << json;
      return read_gltf(path.string());
    }
    json.resize((json.size() + 3) / 4 * 4, ' ');
    all.resize((all.size() + 3) / 4 * 4);
    const auto number = [](std::size_t size) { return static_cast<std::uint32_t>(size); };
    std::ofstream(path, std::ios::binary)
        << "glTF"
        << raw<std::uint32_t>(
               {2, number(28 + json.size() + all.size()), number(json.size()), 0x4E4F534A})
        << json << raw<std::uint32_t>({number(all.size()), 0x004E4942}) << all;
    return read_gltf(path.string());
  };
  for (const bool glb : {false, true}) {
    const auto model = write(glb, "");
    ASSERT_TRUE(model) << to_line(model.error());
    ASSERT_EQ(model->face_count(), 2u);
    for (std::size_t c = 0; c < 6; ++c) {
      // Triangles keep their order, and may begin at another corner.
      const std::size_t first = c / 3 * 3;
      const auto begin = corners.begin() + static_cast<std::ptrdiff_t>(first);
      const auto& p = model->positions[model->corner_positions[c]];
      const auto v = static_cast<std::size_t>(std::lround(10 * p.z) - 1);
      EXPECT_NE(std::find(begin, begin + 3, v), begin + 3) << glb << " " << c;
      EXPECT_EQ(
          p, glm::dvec3(glm::vec3(positions[3 * v], positions[3 * v + 1], positions[3 * v + 2])));
      EXPECT_TRUE(!glb || v == corners[c]);
      const std::uint32_t n = model->corner_normals.at(c, model->corner_positions[c]);
      const glm::dvec3 expected(normals[4 * v], normals[4 * v + 1], normals[4 * v + 2]);
      EXPECT_LT(glm::length(glm::dvec3(model->normals[n]) - expected), 0.02) << glb << " " << c;
    }
    for (const char* damage : {"bytes", "count"}) {
      const auto refused = write(glb, damage);
      ASSERT_FALSE(refused) << damage;
      EXPECT_EQ(refused.error().code, "gltf.meshopt");
      EXPECT_NE(refused.error().cause.find("buffer view 0"), std::string::npos);
    }
  }
}

/// A unit box by gltfpack 1.3. Debian's meshoptimizer decodes what `-cc` writes, not what `-cz`
/// does.
std::string gltfpack_box(const char* option) {
  const char* const source = std::getenv("MODAR_SOURCE_DIR");
  std::ifstream file(std::string(source != nullptr ? source : ".") +
                         "/tests/fuzz/corpus/gltf/gltfpack_" + option + ".glb",
                     std::ios::binary);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

TEST_F(Gltf, GltfpacksFilesAreReadOrRefusedWithTheCommandThatUnpacksThem) {
  const auto read_bytes = [&](const std::string& bytes) {
    const fs::path path = folder_ / "it's a box.glb";
    std::ofstream(path, std::ios::binary) << bytes;
    return read_gltf(path.string());
  };
  const auto box = read_bytes(gltfpack_box("cc"));
  ASSERT_TRUE(box) << to_line(box.error());
  ASSERT_EQ(box->face_count(), 12u);
  ASSERT_EQ(box->positions.size(), 8u);
  for (std::size_t v = 0; v < 8; ++v) {
    // A corner's colour is its place.
    EXPECT_LT(glm::length(box->positions[v] - glm::dvec3(box->colours[v])), 1e-3) << v;
  }
  const std::string newer = gltfpack_box("cz");
  const auto refused = read_bytes(newer);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, "gltf.meshopt");
  EXPECT_EQ(refused.error().exit, ExitCode::kUnsupported);
  EXPECT_NE(refused.error().cause.find("view 0 (at byte 0 of"), std::string::npos);
  const std::string name = (folder_ / "it'\\''s a box").string();
  EXPECT_EQ(refused.error().cure, "convert it: npx gltfpack -noq -km -i '" + name + ".glb' -o '" +
                                      name + ".unpacked.glb'");
  // The extension's other name does not matter, the version does.
  std::string older = gltfpack_box("cc");
  for (std::size_t at = 0; (at = older.find("EXT_meshopt", at)) != std::string::npos; ++at) {
    older.replace(at, 3, "KHR");
  }
  const auto same = read_bytes(older);
  ASSERT_TRUE(same) << to_line(same.error());
  EXPECT_EQ(same->positions, box->positions);
  // Both of its meshes and textures.
  std::string both = newer;
  const std::string required = R"("extensionsRequired":["KHR_mesh_quantization")";
  const std::size_t at = both.find(required);
  ASSERT_NE(at, std::string::npos);
  both.replace(at, required.size(), R"("extensionsRequired":["KHR_texture_basisu"   )");
  const auto twice = read_bytes(both);
  ASSERT_FALSE(twice);
  EXPECT_NE(twice.error().cure.find("unpacked.glb' && npx @gltf-transform/cli ktxdecompress '" +
                                    name + ".unpacked.glb' '" + name + ".png.glb'"),
            std::string::npos)
      << twice.error().cure;
}

TEST_F(Gltf, ATextureOfKtxAloneIsThePictureThatCannotBeRead) {
  const auto model = read(
      std::string(R"("bufferViews":[{"buffer":0,"byteOffset":0,"byteLength":36},
          {"buffer":0,"byteOffset":36,"byteLength":6},{"buffer":0,"byteOffset":0,"byteLength":12}],
          "accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"},
          {"bufferView":1,"componentType":5123,"count":3,"type":"SCALAR"}],)") +
          R"("meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1,"material":0}]}],
          "materials":[{"pbrMetallicRoughness":{"baseColorTexture":{"index":0}}}],
          "textures":[{"extensions":{"KHR_texture_basisu":{"source":0}}}],
          "images":[{"bufferView":2,"mimeType":"image/ktx2"}],
          "nodes":[{"mesh":0}],"scenes":[{"nodes":[0]}])",
      one_triangle());
  ASSERT_TRUE(model) << to_line(model.error());
  EXPECT_TRUE(model->materials[0].diffuse_map.ends_with(".ktx2"))
      << model->materials[0].diffuse_map;
}

TEST_F(Gltf, SampleModelsAreReadOrRefused) {
  const fs::path samples = "/usr/share/assimp/models/glTF2";
  if (!fs::is_directory(samples)) GTEST_SKIP() << "assimp-testmodels is not installed";
  std::size_t good = 0;
  std::vector<fs::path> files;
  for (const auto& entry : fs::recursive_directory_iterator(samples)) files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  for (const fs::path& path : files) {
    if (path.extension() != ".gltf" && path.extension() != ".glb") continue;
    const auto model = read_gltf(path.string());
    if (!model) {
      EXPECT_FALSE(model.error().code.empty()) << path;
      continue;
    }
    ++good;
    Report report;
    const auto mesh = weld(*model, report);
    if (path.filename() == "BoxTextured.glb") {
      EXPECT_EQ(model->face_count(), 12u);
      ASSERT_TRUE(mesh);
      EXPECT_EQ(mesh->source_max - mesh->source_min, glm::dvec3(1.0));
      EXPECT_FALSE(model->materials[0].diffuse_map.empty());
      EXPECT_TRUE(fs::exists(model->materials[0].diffuse_map));
    }
  }
  EXPECT_GT(good, 15u);
}

TEST_F(Gltf, ImagesInsideTheFileGoWithTheMaterials) {
  const fs::path sample = "/usr/share/assimp/models/glTF2/BoxTextured-glTF-Binary/BoxTextured.glb";
  if (!fs::exists(sample)) GTEST_SKIP() << "assimp-testmodels is not installed";
  std::string path;
  {
    const auto model = read_gltf(sample.string());
    ASSERT_TRUE(model);
    path = model->materials[0].diffuse_map;
    std::ifstream image(path, std::ios::binary);
    char head[4] = {};
    image.read(head, 4);
    EXPECT_EQ(std::memcmp(head, "\x89PNG", 4), 0);
  }
  EXPECT_FALSE(fs::exists(path)) << "the temporary file outlives its model";
}

}  // namespace
}  // namespace modar
