// A second reader against bundles of files that differ from what it reads: each fault that a reader
// of models can make is planted in the file that is baked, and found in the bundle.
#include <gtest/gtest.h>

#include <functional>
#include <map>
#include <set>
#include <string>

#include "bake/bundle/bundle_builder.hpp"
#include "bake/check/source/second_check.hpp"
#include "bake/extensions/lab/second/second.hpp"
#include "bake/image/image.hpp"
#include "formats/bundle_view.hpp"
#include "tests/formats/support.hpp"
#include "tests/texture/texture_samples.hpp"

namespace {

using namespace modar;
using namespace modar::test;
using Ids = std::set<std::string>;

/// A box of 2 x 4 x 1 without normals: a red half, and one with a picture.
constexpr const char* kObj = R"(mtllib box.mtl
v 0 0 0
v 2 0 0
v 2 4 0
v 0 4 0
v 0 0 1
v 2 0 1
v 2 4 1
v 0 4 1
vt 0 0
vt 1 0
vt 1 1
vt 0 1
usemtl red
f 4 3 2 1
f 1 2 6 5
f 2 3 7 6
usemtl pictured
f 3/1 4/2 8/3 7/4
f 4/1 1/2 5/3 8/4
f 5/1 6/2 7/3 8/4
)";
constexpr const char* kMtl = "newmtl red\nKd 0.8 0.1 0.1\nnewmtl pictured\nmap_Kd print.png\n";

constexpr const char* kPly = R"(ply
format ascii 1.0
element vertex 4
property float x
property float y
property float z
property uchar red
property uchar green
property uchar blue
element face 4
property list uchar int vertex_indices
end_header
0 0 0 255 0 0
1 0 0 0 255 0
0 1 0 0 0 255
0 0 1 255 255 0
3 0 2 1
3 0 1 3
3 0 3 2
3 1 2 3
)";

/// Two nodes with one triangle, one of them turned and moved; uvs from -1 to 3.
constexpr const char* kGltf = R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0,1]}],
"nodes":[{"mesh":0},{"mesh":0,"rotation":[0,0.6,0,0.8],"translation":[0,2,1]}],
"meshes":[{"primitives":[{"attributes":{"POSITION":0,"TEXCOORD_0":1},"material":0}]}],
"materials":[{"pbrMetallicRoughness":{"metallicFactor":0,"baseColorTexture":{"index":0}}}],
"textures":[{"source":0,"sampler":0}],"images":[{"uri":"print.png"}],
"samplers":[{"wrapS":10497,"wrapT":10497}],"buffers":[{"byteLength":60,"uri":"model.bin"}],
"bufferViews":[{"buffer":0,"byteLength":60}],
"accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[3,3,0]},
{"bufferView":0,"byteOffset":36,"componentType":5126,"count":3,"type":"VEC2"}]})";
constexpr float kFloats[15] = {0, 0, 0, 3, 0, 0, 0, 3, 0, -1, -1, 3, -1, -1, 3};

/// Quarters of four colours.
RgbaImage print() {
  RgbaImage image{32, 32, {}};
  for (int i = 0; i < 32 * 32; ++i) {
    const auto x = static_cast<std::uint8_t>(i % 32 < 16 ? 40 : 200);
    const auto y = static_cast<std::uint8_t>(i / 32 < 16 ? 60 : 220);
    image.pixels.insert(image.pixels.end(), {x, y, 90, 255});
  }
  return image;
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return at == std::string::npos ? text : text.replace(at, from.size(), to);
}

class SecondTest : public ::testing::Test {
 protected:
  SecondTest() {
    EXPECT_TRUE(write_png(print(), folder_.file("print.png")));
    write_file(folder_.file("model.bin"), std::as_bytes(std::span(kFloats)));
    write_file(folder_.file("box.mtl"), std::string_view(kMtl));
  }

  std::string write(const std::string& name, const std::string& text) {
    write_file(folder_.file(name), text);
    return folder_.file(name);
  }

  /// What the second reader, of `source`, finds in the bundle of `baked`.
  Ids issues(const std::string& baked, const std::string& source, std::uint32_t crease = 40) {
    BakeRequest request;
    request.models = {{baked, "model"}};
    request.crease = crease;
    request.occlusion = false;
    Report report;
    const auto content = build_bundle(request, report);
    if (!content) return {to_line(content.error())};
    const Bytes bytes = encode(*content);
    const auto bundle = BundleView::open(bytes);
    const auto read = second::read(source, 40);
    SecondModel second;
    if (!read || !read_second(write_second(*read), second)) return {"not read"};
    Ids ids;
    const auto done = check_second(*bundle, 0, second, [&](const Issue& issue) {
      ids.insert(issue.kind->id);
      details_ += issue.where + ": " + issue.detail + "\n";
    });
    EXPECT_TRUE(done);
    EXPECT_TRUE(second.knows_colours);
    return ids;
  }

  /// A bundle of the changed text, against the text itself.
  Ids fault(const std::string& name, const std::string& text, const std::string& from,
            const std::string& to) {
    const std::string source = write(name, text);
    return issues(write("bad_" + name, replaced(text, from, to)), source);
  }

  ScratchFolder folder_;
  std::string details_;
};

TEST_F(SecondTest, GoodBundlesDifferInNothing) {
  for (const auto& [name, text] : std::map<std::string, const char*>{
           {"box.obj", kObj}, {"tetrahedron.ply", kPly}, {"turned.gltf", kGltf}}) {
    const std::string path = write(name, text);
    EXPECT_EQ(issues(path, path), Ids()) << details_;
  }
}

TEST_F(SecondTest, ColoursAreReadAsTheBakeReadsThem) {
  const std::string bytes = "v 0 0 0 200 40 30\nv 1 0 0 200 40 30\nv 0 1 0 20 40 230\nf 1 2 3\n";
  const std::string alpha =
      "v 0 0 0 0.8 0.2 0.1 1\nv 1 0 0 0.8 0.2 0.1 1\nv 0 1 0 0.1 0.2 0.9 1\nf 1 2 3\n";
  write("words.mtl", replaced(replaced(kMtl, "Kd 0.8", "Kd 0.8 0.1 0.1\nKd spectral 0.8"), "map_Kd",
                              "Kd xyz 0.5 0.5 0.5\nmap_Kd"));
  const std::string unlit = replaced(
      kGltf, R"("metallicFactor":0,"baseColorTexture":{"index":0}})",
      R"("metallicFactor":0,"baseColorFactor":[0.6,0.02,0.01,1]},"extensions":{"KHR_materials_unlit":{}})");
  const std::string painted =
      "v 0 0 0\nv 1 0 0\nv 0 1 0\n#MRGB FFC8281EFFC8281EFF1428E6\nf 1 2 3\n";
  for (const auto& [name, text] :
       std::map<std::string, std::string>{{"bytes.obj", bytes},
                                          {"painted.obj", painted},
                                          {"alpha.obj", alpha},
                                          {"unlit.gltf", unlit},
                                          {"words.obj", replaced(kObj, "box.mtl", "words.mtl")}}) {
    const std::string path = write(name, text);
    EXPECT_EQ(issues(path, path), Ids()) << name << details_;
  }
}

TEST_F(SecondTest, SheetsWrittenInBothWindingsAreApart) {
  std::string both = replaced(kObj, "usemtl red\n", "usemtl red\ns 1\n");
  std::string backs = "usemtl red\n";
  for (const char* const face :
       {"1 2 3 4", "5 6 2 1", "6 7 3 2", "7 8 4 3", "8 5 1 4", "8 7 6 5"}) {
    backs += std::string("f ") + face + "\n";
  }
  const std::string path = write("doubled.obj", both + backs);
  EXPECT_EQ(issues(path, path), Ids()) << details_;
}

TEST_F(SecondTest, PolygonsThatGoAroundAgainAreOneRound) {
  const std::string path =
      write("again.obj", replaced(kObj, "f 4 3 2 1\n", "f 4 3 2 1 4 3 2 1 4 3 2 1 4\n"));
  EXPECT_EQ(issues(path, path), Ids()) << details_;
  EXPECT_EQ(issues(write("box.obj", kObj), path), Ids()) << details_;
}

// Any triangulation of a polygon that is not flat is right; each of the five of a pentagon, and
// both of each of two quadrangles, are in a file of triangles that is baked.
TEST_F(SecondTest, BentPolygonsMayBeCutAlongAnyDiagonals) {
  const std::string corners =
      "v -5 0 5\nv 5 0 5\nv 5 0 -5\nv 0 5 -5\nv -5 0 -5\nv 15 8 5\nv 15 0 -5\n";
  const std::string path = write("bent.obj", corners + "f 1 2 3 4 5\nf 2 6 7 3\n");
  const auto cut = [&](const std::string& pentagon, const std::string& quadrangle) {
    return issues(write("cut.obj", corners + pentagon + quadrangle), path, 0);
  };
  for (int i = 0; i < 5; ++i) {
    const auto at = [&](int k) { return std::to_string((i + k) % 5 + 1) + " "; };
    const std::string fan = "f " + at(0) + at(1) + at(2) + "\nf " + at(0) + at(2) + at(3) + "\nf " +
                            at(0) + at(3) + at(4) + "\n";
    for (const char* quadrangle : {"f 2 6 7\nf 2 7 3\n", "f 2 6 3\nf 6 7 3\n"}) {
      const Ids ids = cut(fan, quadrangle);
      EXPECT_FALSE(ids.contains("SOURCE_SURFACE") || ids.contains("SOURCE_COUNTS"))
          << i << details_;
    }
    const Ids lost = cut(fan.substr(fan.find('\n') + 1), "f 2 6 7\nf 2 7 3\n");
    EXPECT_TRUE(lost.contains("SOURCE_SURFACE")) << i;
  }
  // From above, its last corner is on an edge.
  const std::string folded = write("folded.obj", corners + "s 1\nf 1 2 3 5 4\n");
  EXPECT_EQ(issues(folded, folded), Ids()) << details_;
}

TEST_F(SecondTest, PicturesContinueAsSamplersSay) {
  constexpr const char* kRepeat = R"("wrapS":10497,"wrapT":10497)";
  for (const char* const modes :
       {R"("wrapS":33071,"wrapT":33071)", R"("wrapS":33648,"wrapT":33648)",
        R"("wrapS":33071,"wrapT":33648)", R"("wrapS":10497,"wrapT":33071)"}) {
    const std::string path = write("sampler.gltf", replaced(kGltf, kRepeat, modes));
    EXPECT_EQ(issues(path, path), Ids()) << modes << details_;
  }
}

TEST_F(SecondTest, GeneratedNormalsWithoutTheirCreases) {
  const std::string path = write("box.obj", kObj);
  EXPECT_EQ(issues(path, path, 180), Ids{"SOURCE_COLOUR"});
}

TEST_F(SecondTest, LostMaterialColour) {
  EXPECT_EQ(fault("box.obj", kObj, "usemtl red", "usemtl pictured"), Ids{"SOURCE_COLOUR"});
}

TEST_F(SecondTest, LostTexture) {
  write("bare.mtl", "newmtl red\nKd 0.8 0.1 0.1\nnewmtl pictured\nKd 1 1 1\n");
  EXPECT_EQ(fault("box.obj", kObj, "box.mtl", "bare.mtl"), Ids{"SOURCE_COLOUR"});
}

TEST_F(SecondTest, FlippedUvs) {
  EXPECT_EQ(
      fault("box.obj", kObj, "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1", "vt 0 1\nvt 1 1\nvt 1 0\nvt 0 0"),
      Ids{"SOURCE_COLOUR"});
}

TEST_F(SecondTest, DroppedFace) {
  const Ids ids = fault("box.obj", kObj, "f 4 3 2 1\n", "");
  EXPECT_TRUE(ids.contains("SOURCE_SURFACE")) << details_;
}

TEST_F(SecondTest, ScaledVertices) {
  const Ids ids = fault("box.obj", kObj, "v 0 4 0\n", "v 0 4.4 0\n");
  EXPECT_TRUE(ids.contains("SOURCE_SURFACE")) << details_;
}

TEST_F(SecondTest, MirroredFaces) {
  const Ids ids = fault("box.obj", kObj, "f 5/1 6/2 7/3 8/4", "f 8/4 7/3 6/2 5/1");
  EXPECT_TRUE(ids.contains("SOURCE_SURFACE")) << details_;  // the volume
}

TEST_F(SecondTest, IgnoredNodeTransform) {
  const Ids ids = fault("turned.gltf", kGltf, R"(,"translation":[0,2,1])", "");
  EXPECT_TRUE(ids.contains("SOURCE_SURFACE")) << details_;
}

TEST_F(SecondTest, WrongWrapMode) {
  const std::string clamped = replaced(kGltf, R"("wrapS":10497)", R"("wrapS":33071)");
  EXPECT_EQ(issues(write("turned.gltf", kGltf), write("clamped.gltf", clamped)),
            Ids{"SOURCE_COLOUR"});
}

TEST_F(SecondTest, LostVertexColours) {
  EXPECT_EQ(fault("tetrahedron.ply", kPly, "0 0 0 255 0 0\n1 0 0 0 255 0",
                  "0 0 0 255 255 255\n1 0 0 255 255 255"),
            Ids{"SOURCE_COLOUR"});
}

TEST_F(SecondTest, SaysWhereOneReaderAloneHasRead) {
  const std::string path = write("box.obj", kObj);
  BakeRequest request;
  request.models = {{path, "model"}};
  Report report;
  const auto content = build_bundle(request, report);
  ASSERT_TRUE(content);
  const Bytes bytes = encode(*content);
  std::string said;
  ASSERT_TRUE(check_second(
      *BundleView::open(bytes), request, folder_.file("none"),
      [&](const Issue& issue) { said += std::string(issue.kind->id) + issue.detail; }));
  EXPECT_EQ(said, "SOURCE_READERthe program '" + folder_.file("none") +
                      "' of the laboratory is not installed");
}

}  // namespace
