// PLY and STL in: hand-made files with known answers. tests/mesh/oracle_test.cpp holds Debian's
// sample files against assimp.
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include <glm/geometric.hpp>

#include "bake/import/read_model.hpp"

namespace modar {
namespace {

template <class T>
void put(std::string& to, T value, bool big = false) {
  char raw[sizeof(T)];
  std::memcpy(raw, &value, sizeof value);
  for (std::size_t i = 0; i < sizeof(T); ++i) to += raw[big ? sizeof(T) - 1 - i : i];
}

/// A binary STL of these corners, three a triangle.
std::string binary_stl(const std::vector<glm::vec3>& corners, std::string header = "",
                       std::uint16_t bits = 0) {
  header.resize(80, ' ');
  put(header, static_cast<std::uint32_t>(corners.size() / 3));
  for (std::size_t i = 0; i < corners.size(); i += 3) {
    for (int k = 0; k < 3; ++k) put(header, 0.0f);  // the normal, which many leave at zero
    for (std::size_t c = i; c < i + 3; ++c) {
      for (int k = 0; k < 3; ++k) put(header, corners[c][k]);
    }
    put(header, bits);
  }
  return header;
}

/// Both sides of a roof whose slopes meet at that angle, along y.
std::vector<glm::vec3> roof(float degrees) {
  const float half = degrees / 2 * 3.14159265f / 180;
  const glm::vec3 left(-std::sin(half), 0, -std::cos(half));
  const glm::vec3 right(std::sin(half), 0, -std::cos(half));
  const glm::vec3 top(0, 0, 0);
  const glm::vec3 along(0, 1, 0);
  return {top, top + along, left, top, right, top + along};
}

TEST(Stl, BinaryAndTextAreTheSame) {
  const std::vector<glm::vec3> corners = roof(60);
  // A header that begins as text does.
  const auto binary = parse_stl(binary_stl(corners, "solid of revolution"), "a.stl");
  ASSERT_TRUE(binary) << to_line(binary.error());
  std::string text = "solid roof\n";
  for (std::size_t i = 0; i < corners.size(); i += 3) {
    text += " facet normal 0 0 0\r\n  OUTER LOOP\n";
    for (std::size_t c = i; c < i + 3; ++c) {
      char line[128];
      std::snprintf(line, sizeof line, "   vertex %.9g %.9g %+.9g\n",
                    static_cast<double>(corners[c].x), static_cast<double>(corners[c].y),
                    static_cast<double>(corners[c].z));
      text += line;
    }
    text += "  endloop\n endfacet\n";
  }
  const auto read = parse_stl(text + "endsolid roof\n", "a.stl");
  ASSERT_TRUE(read) << to_line(read.error());
  for (const SourceModel* model : {&*binary, &*read}) {
    EXPECT_EQ(model->face_count(), 2u);
    ASSERT_EQ(model->positions.size(), 4u) << "corners of one place are one position";
    for (std::size_t c = 0; c < corners.size(); ++c) {
      EXPECT_EQ(glm::vec3(model->positions[model->corner_positions[c]]), corners[c]);
    }
    EXPECT_EQ(model->up.axis, UpAxis::kZ);
  }
}

TEST(Stl, BytesBehindTheFacetsAndAMarkBeforeTheTextArePassedOver) {
  const auto read =
      parse_stl(binary_stl(roof(60), "solid written here") + std::string("\0\n", 2), "a.stl");
  ASSERT_TRUE(read) << to_line(read.error());
  EXPECT_EQ(read->face_count(), 2u);
  const auto text = parse_stl(
      "\xEF\xBB\xBFsolid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\n"
      "vertex 0 1 0\nendloop\nendfacet\nendsolid a\n",
      "a.stl");
  ASSERT_TRUE(text) << to_line(text.error());
  EXPECT_EQ(text->face_count(), 1u);
  EXPECT_TRUE(text->diagnostics.empty());
}

TEST(Stl, TextWithoutItsLastLineMayBeTruncated) {
  const auto text = parse_stl(
      "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\n"
      "vertex 0 1 0\nendloop\nendfacet\n",
      "a.stl");
  ASSERT_TRUE(text) << to_line(text.error());
  ASSERT_EQ(text->diagnostics.size(), 1u);
  EXPECT_EQ(text->diagnostics[0].id, "stl.unfinished");
}

TEST(ReadModel, ColoursOfVerticesAreSeenAsTheyAre) {
  const auto diffuse_of = [](const std::string& vertex_tail) {
    const std::string path = ::testing::TempDir() + "modar_clay.obj";
    std::ofstream(path) << "v 0 0 0" << vertex_tail << "\nv 1 0 0" << vertex_tail << "\nv 0 1 0"
                        << vertex_tail << "\nf 1 2 3\n";
    const auto model = read_model(path, {});
    std::filesystem::remove(path);
    return model ? model->materials.at(0).diffuse : glm::vec3(-1.0f);
  };
  EXPECT_EQ(diffuse_of(" 0.2 0.4 0.6"), glm::vec3(1.0f));
  EXPECT_EQ(diffuse_of(""), glm::vec3(kClay));
}

TEST(Stl, ColoursOfFacets) {
  // Blue in the low bits, bit 15 set: pure red.
  const auto red = parse_stl(binary_stl(roof(90), "", 0xFC00), "a.stl");
  ASSERT_TRUE(red);
  ASSERT_EQ(red->colours.size(), red->positions.size());
  EXPECT_EQ(red->colours[0], glm::vec3(1, 0, 0));
  // Magics: red in the low bits, bit 15 unset; where it is set, the header's colour.
  const std::string header = std::string("COLOR=") + '\x00' + '\xFF' + '\x00' + '\xFF';
  const auto blue = parse_stl(binary_stl(roof(90), header, 0x7C00), "a.stl");
  ASSERT_TRUE(blue);
  EXPECT_EQ(blue->colours[0], glm::vec3(0, 0, 1));
  const auto green = parse_stl(binary_stl(roof(90), header, 0x8000), "a.stl");
  ASSERT_TRUE(green);
  EXPECT_EQ(green->colours[0], glm::vec3(0, 1, 0));
  EXPECT_TRUE(parse_stl(binary_stl(roof(90)), "a.stl")->colours.empty());
}

TEST(Stl, RefusesWhatIsNone) {
  std::string cut = binary_stl(roof(90));
  cut.pop_back();
  const auto short_file = parse_stl(cut, "dir/a.stl");
  ASSERT_FALSE(short_file);
  EXPECT_EQ(short_file.error().code, "stl.short");
  EXPECT_EQ(short_file.error().where, "dir/a.stl: byte 80");
  cut.replace(0, 6, "solid ");  // as headers of binary files begin, too
  EXPECT_EQ(parse_stl(cut, "a.stl").error().code, "stl.short");
  std::string many = binary_stl(roof(90));
  many[83] = '\xFF';  // four thousand million triangles
  EXPECT_EQ(parse_stl(many, "a.stl").error().code, "stl.short");
  const auto words = parse_stl("solid x\nfacet normal 0 0 1\nvertex 1 2\n", "a.stl");
  ASSERT_FALSE(words);
  EXPECT_EQ(words.error().code, "stl.text");
  EXPECT_EQ(words.error().where, "a.stl:3");
  EXPECT_EQ(parse_stl("", "a.stl").error().code, "stl.no-faces");
  std::vector<glm::vec3> bad = roof(90);
  bad[0].x = NAN;
  const auto half = parse_stl(binary_stl(bad), "a.stl");
  ASSERT_TRUE(half);
  EXPECT_EQ(half->face_count(), 1u);
  ASSERT_EQ(half->diagnostics.size(), 1u);
  EXPECT_EQ(half->diagnostics[0].id, "stl.not-finite");
}

constexpr const char* kQuadHeader =
    "element vertex 4\n"
    "property float x\nproperty float y\nproperty double z\n"
    "property uchar red\nproperty uchar green\nproperty uchar blue\nproperty uchar alpha\n"
    "element face 2\n"
    "property list uchar int vertex_indices\n"
    "end_header\n";

TEST(Ply, TextAndBothByteOrdersAreTheSame) {
  const std::string start = "ply\nformat ";
  const std::string quad = std::string(" 1.0\ncomment Z up\n") + kQuadHeader;
  const std::string text = start + "ascii" + quad +
                           "0 0 0.5 255 0 0 255\n1 0 0.5 0 255 0 255\n1 1 0.5 0 0 255 255\n"
                           "0 1 0.5 51 51 51 255\n4 0 1 2 3\n3 0 2 3\n";
  std::string files[3] = {text, start + "binary_little_endian" + quad,
                          start + "binary_big_endian" + quad};
  const float xy[4][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  const unsigned char rgb[4][3] = {{255, 0, 0}, {0, 255, 0}, {0, 0, 255}, {51, 51, 51}};
  for (int f = 1; f < 3; ++f) {
    const bool big = f == 2;
    for (int v = 0; v < 4; ++v) {
      put(files[f], xy[v][0], big);
      put(files[f], xy[v][1], big);
      put(files[f], 0.5, big);
      for (const unsigned char c : rgb[v]) put(files[f], c);
      put(files[f], '\xFF');
    }
    for (const auto& face : {std::vector<int>{0, 1, 2, 3}, std::vector<int>{0, 2, 3}}) {
      put(files[f], static_cast<unsigned char>(face.size()));
      for (const int index : face) put(files[f], index, big);
    }
  }
  for (const std::string& file : files) {
    const auto model = parse_ply(file, "a.ply");
    ASSERT_TRUE(model) << to_line(model.error());
    ASSERT_EQ(model->face_count(), 2u);
    EXPECT_EQ(model->face_size(0), 4u);
    EXPECT_EQ(model->face_size(1), 3u);
    EXPECT_EQ(model->corner_positions[5], 2u);
    EXPECT_EQ(model->positions[2], glm::dvec3(1, 1, 0.5));
    EXPECT_EQ(model->colours[1], glm::vec3(0, 1, 0));
    EXPECT_FLOAT_EQ(model->colours[3].r, 0.2f);
    EXPECT_EQ(model->up.axis, UpAxis::kZ);
    EXPECT_EQ(model->up.reason, UpReason::kHeader);
  }
}

// Blender's exporters of PLY write Z up unless the person says otherwise, in which case a comment
// that names the axis decides.
TEST(Ply, FilesOfBlenderStandUpright) {
  const std::pair<const char*, UpAxis> cases[] = {
      {"Created by Blender 3.4.1 - www.blender.org", UpAxis::kZ},
      {"Created in Blender version 4.0.0", UpAxis::kZ},
      {"Created by Blender 3.4.1\ncomment Y up", UpAxis::kY},
      {"Created by another program", UpAxis::kY}};
  for (const auto& [comment, up] : cases) {
    const auto model = parse_ply(std::string("ply\nformat ascii 1.0\ncomment ") + comment +
                                     "\nelement vertex 3\nproperty float x\nproperty float y\n"
                                     "property float z\nelement face 1\n"
                                     "property list uchar int vertex_index\nend_header\n"
                                     "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n",
                                 "a.ply");
    ASSERT_TRUE(model) << to_line(model.error());
    EXPECT_EQ(model->up.axis, up) << comment;
  }
}

TEST(Ply, CornersWithUvsOfTheirOwnAndStrips) {
  const auto corners = parse_ply(
      "ply\nformat ascii 1.0\ncomment TextureFile stone wall.png\nelement vertex 3\n"
      "property float x\nproperty float y\nproperty float z\nelement face 1\n"
      "property list uchar int vertex_index\nproperty list uchar float texcoord\nend_header\n"
      "0 0 0\n1 0 0\n0 1 0\n3 0 1 2 6 0 0 1 0 0 .5\n",
      "a.ply");
  ASSERT_TRUE(corners) << to_line(corners.error());
  ASSERT_EQ(corners->uvs.size(), 3u);
  EXPECT_EQ(corners->uvs[corners->corner(2).uv], glm::dvec2(0, 0.5));
  ASSERT_EQ(corners->diagnostics.size(), 1u);
  EXPECT_EQ(corners->diagnostics[0].id, "ply.missing-texture");
  const auto strip = parse_ply(
      "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n"
      "property float z\nelement tristrips 1\nproperty list int int vertex_indices\nend_header\n"
      "0 0 0 1 0 0 0 1 0 1 1 0\n8 0 1 2 3 -1 0 1 3\n",
      "a.ply");
  ASSERT_TRUE(strip) << to_line(strip.error());
  ASSERT_EQ(strip->face_count(), 3u);
  for (std::size_t f = 0; f < 2; ++f) {  // every second one of a strip winds the other way
    const glm::dvec3 a = strip->positions[strip->corner_positions[3 * f]];
    const glm::dvec3 b = strip->positions[strip->corner_positions[3 * f + 1]];
    const glm::dvec3 c = strip->positions[strip->corner_positions[3 * f + 2]];
    EXPECT_GT(glm::cross(b - a, c - a).z, 0) << f;
  }
}

TEST(Ply, FacesHaveColoursAndTextIsAnElementALine) {
  const std::string vertices =
      "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n"
      "property float z\nelement face 2\nproperty list uchar int vertex_indices\n"
      "property uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n"
      "0 0 0 9 9\n1 0 0 9 9\n1 1 0 9 9\n0 1 0 9 9\n";
  const auto read = parse_ply(vertices + "3 0 1 2 255 0 0\n3 0 2 3 0 0 255\n", "a.ply");
  ASSERT_TRUE(read) << to_line(read.error());
  ASSERT_EQ(read->face_count(), 2u);
  ASSERT_EQ(read->positions.size(), 6u) << "two of them in two colours";
  for (std::size_t c = 0; c < 6; ++c) {
    EXPECT_EQ(read->colours[read->corner_positions[c]],
              c < 3 ? glm::vec3(1, 0, 0) : glm::vec3(0, 0, 1));
  }
  EXPECT_EQ(read->positions[read->corner_positions[5]], glm::dvec3(0, 1, 0));
  // MeshLab's lists of corners' colours, of which its header knows nothing.
  const auto lists =
      parse_ply(vertices + "3 0 1 2 9 1 1 1 1 1 1 1 1 1\r\n3 0 2 3 9 1 1 1 1 1 1 1 1 1\n", "a.ply");
  ASSERT_TRUE(lists) << to_line(lists.error());
  EXPECT_EQ(lists->face_count(), 2u);
  EXPECT_TRUE(lists->colours.empty());
  const auto floats = parse_ply(
      "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
      "property float red\nproperty float green\nproperty float blue\nelement face 1\n"
      "property list uchar int vertex_indices\nend_header\n"
      "0 0 255 0 51\n1 0 255 0 51\n0 1 255 0 51\n3 0 1 2\n",
      "a.ply");
  ASSERT_TRUE(floats) << to_line(floats.error());
  EXPECT_EQ(floats->colours[1], glm::vec3(1.0f, 0.0f, 0.2f));
}

TEST(Ply, ALineThatIsTooShortSpoilsOneElement) {
  const std::string header =
      "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n"
      "property float z\nelement face 3\nproperty list uchar int vertex_indices\nend_header\n";
  const std::string vertices = "0 0 0\n1 0 0\n1 1 0\n0 1 0\n";
  const std::string faces = "3 0 1 2\n4 0 1 2\n3 0 2 3\n";
  for (const std::string end : {"\n", "\r\n", "\r"}) {
    std::string text = header + vertices + faces;
    for (std::size_t i = 0; (i = text.find('\n', i)) != std::string::npos; i += end.size()) {
      text.replace(i, 1, end);
    }
    const auto read = parse_ply(text, "a.ply");
    ASSERT_TRUE(read) << to_line(read.error());
    EXPECT_EQ(read->face_count(), 2u);
    EXPECT_EQ(read->lost_faces, 1u);
    EXPECT_EQ(read->corner_positions[5], 3u);
  }
  // A vertex with a number too few is named, and not the file's last line.
  const auto vertex = parse_ply(header + "0 0 0\n1 0\n1 1 0\n0 1 0\n" + faces, "a.ply");
  ASSERT_FALSE(vertex);
  EXPECT_NE(vertex.error().cause.find("at vertex 1 of 4"), std::string::npos)
      << vertex.error().cause;
}

TEST(Ply, ColoursAndPicturesAreThoseThatProgramsMean) {
  const auto read = [](const std::string& type, const std::string& colour, const std::string& faces,
                       const std::string& face_lines) {
    const std::string channels =
        "property " + type + " red\nproperty " + type + " green\nproperty " + type + " blue\n";
    return parse_ply(
        "ply\nformat ascii 1.0\ncomment TextureFile none.png\nelement vertex 3\nproperty float x\n"
        "property float y\n" +
            channels + "element face 2\nproperty list uchar int vertex_indices\n" + faces +
            "end_header\n0 0 " + colour + "\n1 0 " + colour + "\n0 1 " + colour + "\n" + face_lines,
        "a.ply");
  };
  const std::string plain = "3 0 1 2\n3 2 1 0\n";
  for (const auto& [type, colour] :
       {std::pair("ushort", "65535 0 13107"), {"ushort", "255 0 51"}}) {
    const auto model = read(type, colour, "", plain);
    ASSERT_TRUE(model) << to_line(model.error());
    EXPECT_NEAR(model->colours[0].x, 1, 1e-3) << colour;
    EXPECT_NEAR(model->colours[0].z, 0.2, 1e-3) << colour;
  }
  // Faces' colours are seen where all vertices have one, which MeshLab writes by itself.
  const auto faces = read("uchar", "255 255 255",
                          "property uchar red\nproperty uchar green\nproperty uchar blue\n",
                          "3 0 1 2 255 0 0\n3 2 1 0 0 0 255\n");
  ASSERT_TRUE(faces) << to_line(faces.error());
  EXPECT_EQ(faces->colours[faces->corner_positions[0]], glm::vec3(1, 0, 0));
  EXPECT_EQ(faces->colours[faces->corner_positions[3]], glm::vec3(0, 0, 1));
  // MeshLab's faces without a picture.
  const auto bare = read("uchar", "1 2 3", "property int texnumber\n", "3 0 1 2 0\n3 2 1 0 -1\n");
  ASSERT_TRUE(bare) << to_line(bare.error());
  ASSERT_EQ(bare->material_runs.size(), 2u);
  EXPECT_EQ(bare->material_runs[1].value, 1u);
  ASSERT_EQ(bare->materials.size(), 2u);
  EXPECT_EQ(bare->materials[1].diffuse, SourceMaterial().diffuse);
}

TEST(Ply, RefusesWhatIsNone) {
  const std::string header =
      "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
      "property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n";
  const auto code = [](const std::string& text) {
    const auto read = parse_ply(text, "a.ply");
    return read ? std::string() : read.error().code;
  };
  EXPECT_EQ(code(header + "0 0 0 1 0 0 0 1 0\n3 0 1 2\n"), "");
  const auto twice = parse_ply(
      "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
      "property uchar red\nproperty uchar green\nproperty uchar blue\nelement vertex 1\n"
      "property float x\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n"
      "0 0 1 2 3 1 0 4 5 6 0 1 7 8 9\n5\n3 0 1 2\n",
      "a.ply");
  ASSERT_TRUE(twice) << to_line(twice.error());
  EXPECT_EQ(twice->positions.size(), 3u);
  EXPECT_EQ(twice->colours.size(), 3u);
  std::string odd = header;  // a line that an old Blender writes
  odd.insert(odd.find("element"), "Created by Blender3D 247\n");
  EXPECT_EQ(code(odd + "0 0 0 1 0 0 0 1 0\n3 0 1 2\n"), "");
  EXPECT_EQ(code(header + "0 0 0 1 0 0 0 1 0\n3 0 1"), "ply.short");
  EXPECT_EQ(code(header + "0 0 0 1 0 zero 0 1 0\n3 0 1 2\n"), "ply.number");
  EXPECT_EQ(code(header + "0 0 0 1 0 0 0 1 0\n3 0 1 3\n"), "ply.no-faces");
  EXPECT_EQ(code(header + "0 0 0 1 0 0 0 1 0\n255 0 1 3\n"), "ply.number");
  EXPECT_EQ(code("solid"), "ply.header");
  EXPECT_EQ(code("ply\nformat ascii 1.0\nelement vertex -1\nend_header\n"), "ply.header");
  EXPECT_EQ(code("ply\nformat ascii 1.0\nproperty float x\nend_header\n"), "ply.header");
  EXPECT_EQ(
      code("ply\nformat ascii 1.0\nelement vertex 9999999999\nproperty float x\nend_header\n"),
      "ply.short");
  const auto points = parse_ply(
      "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nend_header\n0\n", "a.ply");
  ASSERT_FALSE(points);
  EXPECT_EQ(points.error().code, "ply.no-faces");
  EXPECT_NE(points.error().cure.find("mesh the point cloud"), std::string::npos);
  for (const std::string names : {"float f_dc_0\nproperty float scale_0\nproperty float rot_0",
                                  "uint packed_position\nproperty uint packed_rotation\n"
                                  "property uint packed_scale"}) {
    const auto splat =
        parse_ply("ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty " + names +
                      "\nend_header\n0 0 0 0\n",
                  "a.ply");
    ASSERT_FALSE(splat);
    EXPECT_NE(splat.error().cure.find("Gaussian splat"), std::string::npos);
  }
}

}  // namespace
}  // namespace modar
