// MTL statements, and names of files as exporters write them.
#include <gtest/gtest.h>

#include <array>
#include <filesystem>
#include <fstream>

#include "bake/image/image.hpp"
#include "bake/import/obj/mtl_reader.hpp"
#include "bake/import/read_model.hpp"

namespace modar {
namespace {

namespace fs = std::filesystem;

class MtlReader : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::path(::testing::TempDir()) /
              ::testing::UnitTest::GetInstance()->current_test_info()->name();
    fs::remove_all(folder_);
    fs::create_directories(folder_ / "Maps");
    for (const char* name : {"wood.jpg", "two words.png", "Maps/Stone.PNG", "-odd.png"}) {
      std::ofstream(folder_ / name) << "x";
    }
  }
  void TearDown() override { fs::remove_all(folder_); }

  std::string found(const std::string& statement) {
    std::string name;
    bool transformed = false;
    const std::string path = find_map_file(statement, folder_.string(), name, transformed);
    transformed_ = transformed;
    return path.empty() ? path : fs::relative(path, folder_).string();
  }
  std::vector<SourceMaterial> parse(const std::string& text) {
    return parse_mtl(text, folder_.string(), "m.mtl", findings_);
  }

  fs::path folder_;
  std::vector<Diagnostic> findings_;
  bool transformed_ = false;
};

TEST_F(MtlReader, FindsFilesHoweverTheyAreWritten) {
  EXPECT_EQ(found("wood.jpg"), "wood.jpg");
  EXPECT_EQ(found(".\\wood.jpg"), "wood.jpg");
  EXPECT_EQ(found("./wood.jpg"), "wood.jpg");
  EXPECT_EQ(found("WOOD.JPG"), "wood.jpg");
  EXPECT_EQ(found("\"two words.png\""), "two words.png");
  EXPECT_EQ(found("two words.png"), "two words.png");
  EXPECT_EQ(found("two\\ words.png"), "two words.png");
  EXPECT_EQ(found("maps\\stone.png"), "Maps/Stone.PNG");
  EXPECT_EQ(found("C:\\Users\\me\\textures\\wood.jpg"), "wood.jpg");
  EXPECT_EQ(found("/home/me/wood.jpg"), "wood.jpg");
  EXPECT_EQ(found("-odd.png"), "-odd.png");
  EXPECT_EQ(found("C:\\Users\\me\\Maps\\stone.png"), "Maps/Stone.PNG");
  EXPECT_EQ(found("two%20words.png"), "two words.png");
  EXPECT_EQ(found("stone.jpg"), "");
  EXPECT_EQ(found("Maps"), "");
  EXPECT_EQ(found(""), "");
}

TEST_F(MtlReader, FindsFilesInFoldersOfTexturesAndInOtherEncodings) {
  fs::create_directories(folder_ / "scene/textures");
  fs::create_directories(folder_ / "textures");
  std::ofstream(folder_ / "scene/textures/inside.png") << "x";
  std::ofstream(folder_ / "textures/above.png") << "x";
  std::ofstream(folder_ / "scene/Gefa\xCC\x88\xC3\x9F.png")
      << "x";  // a and its mark, as macOS has it
  const auto found_in = [&](const char* name) {
    const std::string path = find_named_file(name, (folder_ / "scene/").string());
    return path.empty() ? path : fs::relative(path, folder_).string();
  };
  EXPECT_EQ(found_in("inside.png"), "scene/textures/inside.png");
  EXPECT_EQ(found_in("D:\\work\\inside.png"), "scene/textures/inside.png");
  EXPECT_EQ(found_in("above.png"), "textures/above.png");
  const std::string marked = "scene/Gefa\xCC\x88\xC3\x9F.png";
  EXPECT_EQ(found_in("Gef\xC3\xA4\xC3\x9F.png"), marked) << "one character";
  EXPECT_EQ(found_in("Gef\xE4\xDF.png"), marked) << "cp1252";
  EXPECT_EQ(found_in("Gefo\xCC\x88\xC3\x9F.png"), "");
  EXPECT_EQ(find_named_file("above.png", ModelFolder((folder_ / "scene/").string(),
                                                     (folder_ / "scene").string())),
            "")
      << "outside of what may be read";
}

TEST_F(MtlReader, OptionsAreNoPartOfTheName) {
  EXPECT_EQ(found("-clamp on wood.jpg"), "wood.jpg");
  EXPECT_EQ(found("-o 0 0 0 -s 1 1 1 wood.jpg"), "wood.jpg");
  EXPECT_FALSE(transformed_);
  EXPECT_EQ(found("-s 0.5 wood.jpg"), "wood.jpg");
  EXPECT_TRUE(transformed_);
  EXPECT_EQ(found("-mm 0.1 0.3 -texres 512 two words.png"), "two words.png");
  EXPECT_TRUE(transformed_);
  EXPECT_EQ(found("-mm 0 1.0 wood.jpg"), "wood.jpg");
  EXPECT_FALSE(transformed_);
  EXPECT_EQ(found("-imfchan r wood.jpg -bm 1.5"), "wood.jpg");
  EXPECT_EQ(found("-unknown hello world -single two words.png"), "two words.png");
}

TEST_F(MtlReader, ReadsProperties) {
  const auto m = parse(
      "\xEF\xBB\xBF# comment\r\nKd 9 9 9\r\n"
      "newmtl  a b \r\n\tKa .1 .2 .3\r\nKd 0.5 0.4 0.3\r\nKs 1 1 \\\n 0.25\nKe 0 0 1\nNs 96\n"
      "Tr 0.25\nd 0.5\nTr 0.9\nmap_Kd Maps\\stone.png\n"
      "newmtl c\nTr 0.25\nmap_Kd missing.png\nnewmtl d\nTr 1.0");
  ASSERT_EQ(m.size(), 3u);
  EXPECT_EQ(m[0].name, "a b");
  EXPECT_EQ(m[0].ambient, glm::vec3(0.1f, 0.2f, 0.3f));
  EXPECT_EQ(m[0].diffuse, glm::vec3(0.5f, 0.4f, 0.3f));
  EXPECT_EQ(m[0].specular, glm::vec3(1, 1, 0.25f));
  EXPECT_EQ(m[0].emission, glm::vec3(0, 0, 1));
  EXPECT_EQ(m[0].shininess, 96.0f);
  EXPECT_EQ(m[0].opacity, 0.5f);
  EXPECT_EQ(fs::relative(m[0].diffuse_map, folder_), "Maps/Stone.PNG");
  EXPECT_EQ(m[1].opacity, 0.75f);
  EXPECT_EQ(m[1].diffuse_map, "");
  EXPECT_EQ(m[2].opacity, 1.0f);
  ASSERT_EQ(findings_.size(), 2u);
  EXPECT_EQ(findings_[0].id, "mtl.missing-map");
  EXPECT_EQ(findings_[0].line, 16u);
  EXPECT_EQ(findings_[1].id, "mtl.invisible");
}

// Tile 1001 + u + 10 v has the uvs from (u, v) on, as Blender, Mari and others number them.
TEST_F(MtlReader, FacesShowTheTileThatTheyAreIn) {
  for (const char* name : {"skin.1002.png", "skin.1011.png"}) std::ofstream(folder_ / name) << "x";
  std::ofstream(folder_ / "m.mtl") << "newmtl plain\nKd 1 0 0\nnewmtl skin\nKd 0 0 0\n"
                                      "map_Kd -s 0.5 1 1 -o 0 0.25 0 Skin.<UDIM>.png\n";
  const auto model = parse_obj(
      "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\n"
      "vt 2 0\nvt 4 0\nvt 2 0.5\n"        // times and plus the above: from (1, 0.25), in 1002
      "vt 0 0.75\nvt 1 0.75\nvt 0 1.5\n"  // from (0, 1), in 1011
      "vt 4 0\nvt 5 0\nvt 4 0.5\n"        // in 1003
      "vt -2 0\nvt -1 0\nvt -2 0.5\n"     // in none
      "usemtl skin\nf 1/1 2/2 3/3\nf 1/4 2/5 3/6\nusemtl plain\nf 1/1 2/2 3/3\n"
      "usemtl skin\nf 1/7 2/8 3/9\nf 1/10 2/11 3/12\nf 1/4 2/5 3/6\n",
      folder_.string() + "/", "m.obj");
  ASSERT_TRUE(model) << to_line(model.error());
  std::vector<std::string> maps;
  RunCursor materials(model->material_runs);
  for (std::size_t f = 0; f < model->face_count(); ++f) {
    maps.push_back(fs::path(model->materials[materials.at(f)].diffuse_map).filename().string());
  }
  EXPECT_EQ(maps, (std::vector<std::string>{"skin.1002.png", "skin.1011.png", "", "", "",
                                            "skin.1011.png"}));
  const auto uv = [&](std::size_t corner) { return model->uvs[model->corner(corner).uv]; };
  EXPECT_EQ(uv(0), glm::dvec2(0, 0.25));
  EXPECT_EQ(uv(1), glm::dvec2(1, 0.25));
  EXPECT_EQ(uv(3), glm::dvec2(0, 0));
  EXPECT_EQ(uv(5), glm::dvec2(0, 0.75));
  EXPECT_EQ(uv(6), glm::dvec2(2, 0)) << "another material's";
  std::vector<std::string> said;
  for (const Diagnostic& d : model->diagnostics) {
    if (d.id == "mtl.missing-map") said.push_back(d.message);
  }
  EXPECT_EQ(said,
            (std::vector<std::string>{"tile 'skin.1003.png' of 1 faces was not found",
                                      "tile 'beyond 1001 to 1100' of 1 faces was not found"}));
}

TEST_F(MtlReader, NormalMapsHaveSeveralNames) {
  const auto m = parse(
      "newmtl a\nmap_Bump -bm 0.25 wood.jpg\n"
      "newmtl b\nbump wood.jpg\nnorm -s 1 1 1 two words.png\n"
      "newmtl c\nnorm two words.png\nmap_bump wood.jpg\n"
      "newmtl d\nnorm missing.png\n");
  ASSERT_EQ(m.size(), 4u);
  const auto name = [&](std::size_t i) { return fs::path(m[i].normal.path).filename().string(); };
  EXPECT_EQ(name(0), "wood.jpg");
  EXPECT_EQ(m[0].normal.scale, 0.25f);
  EXPECT_TRUE(m[0].normal.may_be_heights);
  for (const std::size_t i : {1U, 2U}) {
    EXPECT_EQ(name(i), "two words.png") << i;
    EXPECT_EQ(m[i].normal.scale, 1.0f);
    EXPECT_FALSE(m[i].normal.may_be_heights) << i;
  }
  EXPECT_EQ(name(3), "");
  ASSERT_EQ(findings_.size(), 1u);
  EXPECT_EQ(findings_[0].id, "mtl.missing-map");
}

TEST_F(MtlReader, ReflectionFollowsFromWhatTheMaterialStates) {
  const auto m = parse(
      "newmtl matt\nKd 0.5\nnewmtl shiny\nKd 0.5\nKs 0.5\nNs 50\n"
      "newmtl mirror\nKd 0\nKs 1\nNs 50\nillum 3\n"
      "newmtl brass\nKd 0.9 0.8 0.5\nPr 0.4\nPm 1\nnewmtl chalk\nKd 0.9\nPr 1\nPm 0\n"
      "newmtl leaf\nKd 0 0.5 0\nPr 1\nPm 0\n"
      "newmtl wet\nKd 0 0.5 0\nPr 0.4\nPm 0\nnewmtl wetter\nKd 0 0.5 0\nPr 0.4\nPm 0.001");
  ASSERT_EQ(m.size(), 8u);
  EXPECT_EQ(m[0].reflectance, 0.0f);
  EXPECT_FLOAT_EQ(m[1].reflectance, 0.04f) << "glTF 2.0, appendix B";
  EXPECT_FLOAT_EQ(m[2].reflectance, 1.0f);
  EXPECT_EQ(m[3].metalness, 1.0f);
  EXPECT_NEAR(m[3].shininess, 76.1f, 0.1f);  // 2 / 0.4^4 - 2
  EXPECT_EQ(m[4].reflectance, 0.0f) << "nothing of it would be seen";
  EXPECT_FLOAT_EQ(m[5].reflectance, 0.04f) << "it is seen in red and blue";
  EXPECT_EQ(m[6].specular, m[7].specular) << "a bundle has steps of 1/255 of metalness";
}

TEST_F(MtlReader, APictureAloneIsSeenAsItIs) {
  const auto m = parse(
      "newmtl bare\nmap_Kd wood.jpg\nnewmtl tint\nKd 0.5 0.4 0.3\nmap_Kd wood.jpg\n"
      "newmtl no");
  ASSERT_EQ(m.size(), 3u);
  EXPECT_EQ(m[0].diffuse, glm::vec3(1.0f));
  EXPECT_EQ(m[1].diffuse, glm::vec3(0.5f, 0.4f, 0.3f));
  EXPECT_EQ(m[2].diffuse, glm::vec3(kClay));
}

TEST_F(MtlReader, MaterialsAreWhatExportersMean) {
  // In each the program that writes such a file shows the unchanged picture.
  const auto m = parse(
      "newmtl maya\nKd 0 0 0\nmap_Kd wood.jpg\nnewmtl meshroom\nKd 0.6 0.6 0.6\nmap_Kd wood.jpg\n"
      "newmtl ambient\nmap_Ka wood.jpg\nnewmtl glow\nKd 0 0 0\nKe 1 1 1\nmap_Ke wood.jpg\n"
      "newmtl mask\nKd 0.2 0.6 0.2\nmap_d wood.jpg\n");
  ASSERT_EQ(m.size(), 5u);
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(m[i].diffuse, glm::vec3(1.0f)) << m[i].name;
    EXPECT_EQ(fs::path(m[i].diffuse_map).filename(), "wood.jpg") << m[i].name;
    EXPECT_EQ(m[i].emission, glm::vec3(0.0f)) << m[i].name;
  }
  EXPECT_EQ(m[4].diffuse, glm::vec3(0.2f, 0.6f, 0.2f));
  for (const auto& each :
       parse("newmtl zero\nKa 0 0 0\nKd 0.9 0.2 0.1\nnewmtl one\nKd 0.9 0.2 0.1\nKa 1 1 1\n")) {
    EXPECT_EQ(each.ambient, glm::vec3(0.9f, 0.2f, 0.1f)) << each.name;
  }
  ASSERT_EQ(findings_.size(), 1u);
  EXPECT_EQ(findings_[0].id, "mtl.opacity-map") << "wood.jpg is no picture";
}

TEST_F(MtlReader, AMapOfOpacityCutsOutTheColour) {
  ASSERT_TRUE(write_png({2, 1, {10, 20, 30, 255, 40, 50, 60, 255}}, (folder_ / "c.png").string()));
  ASSERT_TRUE(write_png({2, 1, {0, 0, 0, 255, 255, 255, 255, 255}}, (folder_ / "d.png").string()));
  ASSERT_TRUE(write_png({2, 1, {255, 255, 255, 255, 9, 9, 9, 64}}, (folder_ / "a.png").string()));
  const auto m = parse(
      "newmtl both\nKd 0.8 0.8 0.8\nmap_Kd c.png\nmap_d d.png\nnewmtl alone\nKd 0.2 0.6 0.2\n"
      "map_d d.png\nnewmtl alpha\nmap_Kd c.png\nmap_d a.png\nnewmtl one\nmap_Kd a.png\nmap_d "
      "a.png\n");
  ASSERT_EQ(m.size(), 4u);
  EXPECT_TRUE(findings_.empty());
  const auto pixels = [](const SourceMaterial& material) {
    const auto image = read_image(material.diffuse_map);
    return image ? image->pixels : std::vector<std::uint8_t>();
  };
  using Pixels = std::vector<std::uint8_t>;
  EXPECT_EQ(pixels(m[0]), (Pixels{10, 20, 30, 0, 40, 50, 60, 255}));
  EXPECT_EQ(m[1].diffuse, glm::vec3(0.2f, 0.6f, 0.2f));
  EXPECT_EQ(pixels(m[1]), (Pixels{255, 255, 255, 0, 255, 255, 255, 255}));
  EXPECT_EQ(pixels(m[2]), (Pixels{10, 20, 30, 255, 40, 50, 60, 64}));
  EXPECT_EQ(fs::path(m[3].diffuse_map).filename(), "a.png");
}

TEST_F(MtlReader, Utf16IsText) {
  const std::u16string text = u"newmtl K\u00e4\U0001F600\nKd 0.2 0.6 0.2\n";
  for (const bool big : {false, true}) {
    std::string bytes = big ? "\xFE\xFF" : "\xFF\xFE";
    for (const char16_t unit : text) {
      const auto high = static_cast<char>(unit >> 8);
      const auto low = static_cast<char>(unit & 0xFF);
      bytes += big ? std::string{high, low} : std::string{low, high};
    }
    const auto m = parse_mtl(bytes, folder_.string(), "m.mtl", findings_);
    ASSERT_EQ(m.size(), 1u);
    EXPECT_EQ(m[0].name, "K\xC3\xA4\xF0\x9F\x98\x80");
    EXPECT_EQ(m[0].diffuse, glm::vec3(0.2f, 0.6f, 0.2f));
    std::ofstream(folder_ / "w.mtl", std::ios::binary) << bytes;
    std::ofstream(folder_ / "w.obj") << "mtllib w.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    const auto model = read_model((folder_ / "w.obj").string(), {});
    ASSERT_TRUE(model);
    EXPECT_EQ(model->materials[0].diffuse, m[0].diffuse) << "the first one, as no face names one";
  }
}

TEST_F(MtlReader, MapsAreScaledAndShiftedAsWritten) {
  std::ofstream(folder_ / "m.mtl") << "newmtl a\nmap_Kd -s 3 2 1 -o 0.5 0.25 0 wood.jpg\n";
  std::ofstream(folder_ / "m.obj") << "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\n"
                                      "vt 0 1\nf 1/1 2/2 3/3\nusemtl a\nf 1/1 2/2 3/3\n";
  const auto model = read_model((folder_ / "m.obj").string(), {});
  ASSERT_TRUE(model) << to_line(model.error());
  const glm::dvec2 wanted[] = {{0, 0}, {1, 0}, {0, 1}, {0.5, 0.25}, {3.5, 0.25}, {0.5, 2.25}};
  for (std::size_t c = 0; c < 6; ++c) {
    EXPECT_EQ(model->uvs[model->corner(c).uv], wanted[c])
        << c;  // three.js r170: uv * repeat + offset
  }
  EXPECT_TRUE(model->diagnostics.empty());
}

TEST_F(MtlReader, AMaterialThatNoFaceNamesIsUsed) {
  std::ofstream(folder_ / "m.mtl") << "newmtl material_0\nmap_Kd wood.jpg\n";
  std::ofstream(folder_ / "m.obj") << "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
  const auto model = read_model((folder_ / "m.obj").string(), {});
  ASSERT_TRUE(model) << to_line(model.error());
  ASSERT_EQ(model->materials.size(), 1u);
  EXPECT_EQ(fs::path(model->materials[0].diffuse_map).filename(), "wood.jpg");
  EXPECT_EQ(model->diagnostics.at(0).id, "obj.no-usemtl");
}

TEST_F(MtlReader, TheMeanOfATextureIsNotMultipliedByIt) {
  // Half of it (200, 100, 50), half (100, 0, 0): as SketchUp's exporter writes it.
  RgbaImage image{4, 4, {}};
  for (int p = 0; p < 16; ++p) {
    const std::array<std::uint8_t, 4> one = {200, 100, 50, 255};
    const std::array<std::uint8_t, 4> other = {100, 0, 0, 255};
    const auto& pixel = p % 2 == 0 ? one : other;
    image.pixels.insert(image.pixels.end(), pixel.begin(), pixel.end());
  }
  ASSERT_TRUE(write_png(image, (folder_ / "brick.png").string()));
  std::ofstream(folder_ / "m.mtl") << "newmtl mean\nKa 0 0 0\nKd 0.5882 0.1961 0.0980\n"
                                      "map_Kd brick.png\n"
                                      "newmtl tint\nKd 0.5882 0.1961 0.2\nmap_Kd brick.png\n"
                                      "newmtl broken\nKd 0.5 0.5 0.5\nmap_Kd wood.jpg\n"
                                      "newmtl plain\nKd 0.5882 0.1961 0.0980\n";
  std::ofstream(folder_ / "m.obj") << "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\n"
                                      "usemtl mean\nf 1 2 3\nusemtl tint\nf 1 2 3\n"
                                      "usemtl broken\nf 1 2 3\nusemtl plain\nf 1 2 3\n";
  const auto model = read_model((folder_ / "m.obj").string(), {});
  ASSERT_TRUE(model) << to_line(model.error());
  ASSERT_EQ(model->materials.size(), 5u);
  EXPECT_EQ(model->materials[1].diffuse, glm::vec3(1.0f));
  EXPECT_EQ(model->materials[1].ambient, glm::vec3(1.0f));
  EXPECT_EQ(model->materials[2].diffuse, glm::vec3(0.5882f, 0.1961f, 0.2f));
  EXPECT_EQ(model->materials[3].diffuse, glm::vec3(1.0f)) << "gray is not multiplied";
  EXPECT_EQ(model->materials[4].diffuse, glm::vec3(0.5882f, 0.1961f, 0.0980f));
  ASSERT_EQ(model->diagnostics.size(), 1u);
  EXPECT_EQ(model->diagnostics[0].id, "mtl.mean-colour");
}

TEST_F(MtlReader, ObjTakesTheFileBesideItWhenItNamesAnother) {
  std::ofstream(folder_ / "Box.MTL") << "newmtl red\nKd 1 0 0\n";
  std::ofstream(folder_ / "box.obj") << "mtllib gone.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\n"
                                        "usemtl red\nf 1 2 3\nusemtl blue\nf 3 2 1\n";
  const auto model = read_obj((folder_ / "box.obj").string());
  ASSERT_TRUE(model);
  ASSERT_EQ(model->materials.size(), 3u);
  EXPECT_EQ(model->materials[1].diffuse, glm::vec3(1, 0, 0));
  ASSERT_EQ(model->material_runs.size(), 2u);
  EXPECT_EQ(model->material_runs[0].value, 1u);
  EXPECT_EQ(model->material_runs[1].value, 2u);
  std::vector<std::string> ids;
  for (const Diagnostic& f : model->diagnostics) ids.push_back(f.id);
  EXPECT_EQ(ids, (std::vector<std::string>{"obj.missing-mtl", "obj.mtl-beside",
                                           "obj.undefined-material"}));
}

TEST_F(MtlReader, LibrariesWithBlanksAndSeveralOnALine) {
  std::ofstream(folder_ / "my lib.mtl") << "newmtl a\nKd 1 0 0\n";
  std::ofstream(folder_ / "other.mtl") << "newmtl b\nKd 0 1 0\n";
  const std::string faces = "v 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl a\nf 1 2 3\nusemtl b\nf 1 2 3\n";
  for (const char* library :
       {"mtllib my lib.mtl\nmtllib other.mtl\n", "mtllib my\\ lib.mtl other.mtl\n"}) {
    const auto model = parse_obj(library + faces, folder_.string(), "x.obj");
    ASSERT_TRUE(model);
    EXPECT_TRUE(model->diagnostics.empty()) << library;
    ASSERT_EQ(model->materials.size(), 3u);
    EXPECT_EQ(model->materials[1].diffuse, glm::vec3(1, 0, 0));
    EXPECT_EQ(model->materials[2].diffuse, glm::vec3(0, 1, 0));
  }
}

/// A model with texture coordinates that names a material file which is not there.
void write_textured(const std::filesystem::path& path) {
  std::ofstream(path) << "mtllib gone.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\n"
                         "usemtl red\nf 1/1 2/2 3/3\nusemtl blue\nf 3/3 2/2 1/1\n";
}

TEST_F(MtlReader, ObjWithoutMaterialsTakesThePictureOfItsName) {
  for (const char* name : {"Pawn_Albedo.PNG", "pawn diffuse.jpg", "pawn-base_color.webp"}) {
    std::ofstream(folder_ / name) << "picture";
    write_textured(folder_ / "pawn.obj");
    const auto model = read_obj((folder_ / "pawn.obj").string());
    ASSERT_TRUE(model);
    ASSERT_EQ(model->materials.size(), 3u);
    for (const SourceMaterial& material : model->materials) {
      EXPECT_EQ(material.diffuse_map, (folder_ / name).string());
      EXPECT_EQ(material.diffuse, glm::vec3(1.0f));
    }
    ASSERT_EQ(model->diagnostics.size(), 2u);
    EXPECT_EQ(model->diagnostics[0].id, "obj.missing-mtl");
    EXPECT_EQ(model->diagnostics[1].id, "model.texture-by-name");
    std::filesystem::remove(folder_ / name);
  }
}

TEST_F(MtlReader, APictureOfTheModelsOwnNameIsItsTextureIfItsSidesArePowersOfTwo) {
  const auto picture = [&](const char* name, std::uint32_t width, std::uint32_t height) {
    const RgbaImage image{width, height, std::vector<std::uint8_t>(4ULL * width * height, 200)};
    EXPECT_TRUE(write_png(image, (folder_ / name).string()));
  };
  const auto texture = [&](const ReadOptions& options = {}) {
    const auto model = read_model((folder_ / "pawn.obj").string(), options);
    return fs::path(model ? model->materials[1].diffuse_map : "none").filename().string();
  };
  write_textured(folder_ / "pawn.obj");
  picture("pawn.png", 48, 32);  // a photo, or the print that it is on
  EXPECT_EQ(texture(), "");
  picture("pawn.png", 64, 32);
  EXPECT_EQ(texture(), "pawn.png");
  EXPECT_EQ(texture({.own_picture = false}), "");
  picture("pawn_colour.png", 48, 32);
  EXPECT_EQ(texture(), "pawn_colour.png");
}

TEST_F(MtlReader, OtherPicturesAreNoTextures) {
  for (const char* name : {"pawn.png", "pawn_normal.png", "pawns_albedo.png", "pawnalbedo.png",
                           "pawn_albedo.txt", "pawn_.png", "rook_albedo.png"}) {
    std::ofstream(folder_ / name) << "picture";
  }
  write_textured(folder_ / "pawn.obj");
  const auto model = read_obj((folder_ / "pawn.obj").string());
  ASSERT_TRUE(model);
  EXPECT_EQ(model->materials[1].diffuse_map, "");
  EXPECT_EQ(model->diagnostics[1].id, "model.no-texture");
  // So that a project is baked again once it is there.
  EXPECT_EQ(model->files.back(), (folder_ / "pawn_texture.png").string());
  // A material file is the last word, and colours need no picture.
  std::ofstream(folder_ / "pawn_albedo.png") << "picture";
  std::ofstream(folder_ / "gone.mtl") << "newmtl red\nKd 1 0 0\n";
  const auto named = read_obj((folder_ / "pawn.obj").string());
  ASSERT_TRUE(named);
  EXPECT_EQ(named->materials[1].diffuse_map, "");
  std::filesystem::remove(folder_ / "gone.mtl");
  std::ofstream(folder_ / "pawn.obj") << "v 0 0 0 1 0 0\nv 1 0 0 0 1 0\nv 0 1 0 0 0 1\nvt 0 0\n"
                                         "f 1/1 2/1 3/1\n";
  const auto coloured = read_obj((folder_ / "pawn.obj").string());
  ASSERT_TRUE(coloured);
  EXPECT_EQ(coloured->materials[0].diffuse_map, "");
  EXPECT_TRUE(coloured->diagnostics.empty());
}

}  // namespace
}  // namespace modar
