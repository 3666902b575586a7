// OBJ text to SourceModel: against tinyobjloader on real files, and on written cases where readers
// differ.
#include "bake/import/read_model.hpp"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <random>
#include <set>
#include <sstream>

#include "tests/import/samples.hpp"
#include "tests/import/tiny_obj.hpp"

namespace modar {
namespace {

const std::string kTriangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";

SourceModel parse(const std::string& text) {
  auto model = parse_obj(text, "", "test.obj");
  EXPECT_TRUE(model) << (model ? "" : to_line(model.error())) << "\n" << text;
  return model ? std::move(*model) : SourceModel();
}

std::string error_code(const std::string& text) {
  auto model = parse_obj(text, "", "test.obj");
  return model ? "none" : model.error().code;
}

/// "id:line" of each diagnostic.
std::multiset<std::string> diagnostics(const SourceModel& model) {
  std::multiset<std::string> all;
  for (const Diagnostic& f : model.diagnostics) all.insert(f.id + ":" + std::to_string(f.line));
  return all;
}

/// One value a face.
std::vector<std::uint32_t> by_face(const SourceModel& model, const std::vector<FaceRun>& runs) {
  std::vector<std::uint32_t> values;
  RunCursor cursor(runs);
  for (std::size_t f = 0; f < model.face_count(); ++f) values.push_back(cursor.at(f));
  return values;
}

std::vector<std::uint32_t> position_indices(const SourceModel& model) {
  std::vector<std::uint32_t> indices;
  for (std::size_t i = 0; i < model.corner_count(); ++i)
    indices.push_back(model.corner(i).position);
  return indices;
}

void expect_same_as_tinyobj(const std::string& path) {
  const testing::TinyModel theirs = testing::load_with_tinyobj(path);
  const auto ours = read_obj(path);
  if (!theirs.loaded || theirs.face_sizes.empty()) return;
  ASSERT_TRUE(ours) << path << " " << to_line(ours.error());
  EXPECT_EQ(ours->positions.size(), theirs.positions.size()) << path;
  EXPECT_EQ(ours->uvs.size(), theirs.uvs.size()) << path;
  EXPECT_EQ(ours->normals.size(), theirs.normals.size()) << path;
  ASSERT_EQ(ours->face_count(), theirs.face_sizes.size()) << path;
  ASSERT_EQ(ours->corner_count(), theirs.corners.size()) << path;
  for (std::size_t i = 0; i < std::min(ours->positions.size(), theirs.positions.size()); ++i) {
    for (int axis = 0; axis < 3; ++axis) {
      // Its own number parser is off by a few units in the last place.
      const double a = ours->positions[i][axis];
      const double b = theirs.positions[i][axis];
      ASSERT_NEAR(a, b, 1e-14 * std::max(1.0, std::fabs(b))) << path << " v " << i;
    }
  }
  for (std::size_t f = 0; f < theirs.face_sizes.size(); ++f) {
    ASSERT_EQ(ours->face_size(f), theirs.face_sizes[f]) << path;
  }
  for (std::size_t i = 0; i < theirs.corners.size(); ++i) {
    const auto index = [](std::uint32_t x) { return x == kNoIndex ? -1 : static_cast<int>(x); };
    ASSERT_EQ(index(ours->corner(i).position), theirs.corners[i].position) << path << " " << i;
    ASSERT_EQ(index(ours->corner(i).uv), theirs.corners[i].uv) << path << " " << i;
    ASSERT_EQ(index(ours->corner(i).normal), theirs.corners[i].normal) << path << " " << i;
  }
}

TEST(ObjReader, EqualsTinyObjLoaderOnDebiansFiles) {
  if (!testing::has_tinyobj()) GTEST_SKIP() << "libtinyobjloader-dev is not installed";
  const auto files = testing::assimp_obj_files();
  if (files.empty()) GTEST_SKIP() << "assimp-testmodels is not installed";
  for (const std::string& path : files) {
    // The one holds words that are no numbers, the other a face of 936 corners, which tinyobjloader
    // counts in 8 bits.
    if (path.find("number_formats") != std::string::npos) continue;
    if (path.find("box_longline") != std::string::npos) continue;
    expect_same_as_tinyobj(path);
  }
}

TEST(ObjReader, CoordinatesOfAMapKeepTheirDigits) {
  const SourceModel m = parse(
      "v 349011.8489 6648378.3181 9.7628 0.8627 0.8902 0.9137\n"
      "v 349011.9 6648378.3 9.8 1 1 1\nv 349012 6648378.4 9.8 1 1 1\nf 1 2 3\n");
  EXPECT_EQ(m.positions[0], glm::dvec3(349011.8489, 6648378.3181, 9.7628));
  ASSERT_EQ(m.colours.size(), m.positions.size());
  EXPECT_FLOAT_EQ(m.colours[0].z, 0.9137f);
}

TEST(ObjReader, NegativeIndicesCountBack) {
  const SourceModel m = parse(
      "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvn 0 0 1\nf -3/-1/-1 -2//-1 -1/-1\n"
      "v 2 2 2\nf -1 -2 -3\n");
  EXPECT_EQ(position_indices(m), (std::vector<std::uint32_t>{0, 1, 2, 3, 2, 1}));
  EXPECT_EQ(m.corner(0).uv, 0u);
  EXPECT_EQ(m.corner(1).uv, kNoIndex);
  EXPECT_EQ(m.corner(1).normal, 0u);
}

TEST(ObjReader, BadIndicesAreLeftOutAndTheirLinesNamed) {
  const SourceModel m = parse(kTriangle +
                              "vt 0 0\nf 1 2 3\nf 1 2 9\nf 1 2 -9\nf 0 1 2\nf 1 2\n"
                              "f 1/7 2/1 3/1\nf /1 /1 /1\nf 1 2 x\nf 3 2 1\n");
  EXPECT_EQ(m.face_count(), 3u);
  EXPECT_EQ(diagnostics(m),
            (std::multiset<std::string>{"obj.index-range:6", "obj.zero-index:8", "obj.short-face:9",
                                        "obj.attribute-range:10", "obj.no-position:11",
                                        "obj.bad-number:12"}));
  EXPECT_EQ(m.corner(3).uv, kNoIndex);
  EXPECT_EQ(m.corner(4).uv, 0u);
}

TEST(ObjReader, ForwardReferencesAreFine) {
  EXPECT_EQ(parse("f 1 2 3\n" + kTriangle).face_count(), 1u);
}

TEST(ObjReader, ContinuedLinesTabsAndCarriageReturns) {
  const SourceModel m = parse(
      "v\t0 0\t0\r\nv 1 \\\r\n 0 \\\n0\r\n  v 0 1 0 \r\nf              \\\n"
      "\t1          \\\n 2\\\n 3\nf 3 2 1 # a comment");
  EXPECT_EQ(position_indices(m), (std::vector<std::uint32_t>{0, 1, 2, 2, 1, 0}));
  EXPECT_EQ(m.positions[1], glm::dvec3(1, 0, 0));
  EXPECT_TRUE(m.diagnostics.empty());
  EXPECT_EQ(parse("v 0 0 0\rv 1 0 0\rv 0 1 0\rf 1 2 3\r").face_count(), 1u);
}

TEST(ObjReader, ABackslashBeforeALoneCarriageReturnContinues) {
  // Found by mutation: the second face was read for ever.
  const SourceModel model = parse("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nf 1 2 \\\r3\nf 3 2 1\n");
  EXPECT_EQ(model.face_count(), 3u);
}

TEST(ObjReader, LinesAreCountedThroughContinuationsAndComments) {
  const SourceModel m = parse(
      "# ends in a backslash \\\nv 0 0 0\nv 1 \\\n0 \\\n0\nv 0 1 0\n\nf 1 2 3\n"
      "blah\n");
  EXPECT_EQ(diagnostics(m), (std::multiset<std::string>{"obj.unknown:9"}));
}

TEST(ObjReader, ByteOrderMarksAndUtf16) {
  EXPECT_EQ(parse("\xEF\xBB\xBF" + kTriangle + "f 1 2 3").face_count(), 1u);
  std::string wide;
  for (const char c : kTriangle) wide += std::string(1, c) + '\0';
  EXPECT_EQ(error_code(wide), "obj.utf16");
  EXPECT_EQ(error_code("\xFE\xFF" + wide), "obj.utf16");
}

TEST(ObjReader, NothingToBakeIsAnError) {
  for (const std::string& text :
       {std::string(), kTriangle, kTriangle + "l 1 2\np 1\n", std::string("f 1 2 3\n")}) {
    EXPECT_EQ(error_code(text), "obj.no-faces") << text;
  }
  EXPECT_EQ(error_code(std::string(64, '\0')), "obj.not-text");
  EXPECT_EQ(error_code(kTriangle + "f 1 2 3\n" + std::string(2 << 20, '\0')), "obj.not-text");
  EXPECT_EQ(error_code(kTriangle + "f 1 2 3\n" + std::string(80 << 20, 'x')), "obj.too-large");
  EXPECT_EQ(read_obj("/nonexistent/x.obj").error().code, "io.open");
  EXPECT_EQ(read_obj("/usr").error().code, "io.open");
}

TEST(ObjReader, ColoursOfSomeOrAllVertices) {
  const SourceModel some = parse("v 0 0 0\nv 1 0 0 0.25 0.5 1\nv 0 1 0\nf 1 2 3\n");
  ASSERT_EQ(some.colours.size(), 3u);
  EXPECT_EQ(some.colours[0], glm::vec3(1));
  EXPECT_EQ(some.colours[1], glm::vec3(0.25f, 0.5f, 1));
  EXPECT_EQ(diagnostics(some), (std::multiset<std::string>{"obj.partial-colours:0"}));
  const SourceModel bytes = parse("v 0 0 0 255 0 51\nv 1 0 0 0 0 0\nv 0 1 0 0 0 0\nf 1 2 3\n");
  EXPECT_EQ(bytes.colours[0], glm::vec3(1, 0, 0.2f));
  const SourceModel dark = parse("v 0 0 0 -0.5 0 1\nv 1 0 0 0 0.5 0\nv 0 1 0 0 0 0\nf 1 2 3\n");
  EXPECT_EQ(dark.colours[0], glm::vec3(0, 0, 1));
  EXPECT_EQ(dark.colours[1], glm::vec3(0, 0.5f, 0));
  EXPECT_TRUE(parse("v 0 0 0 1\nv 1 0 0 1\nv 0 1 0 1\nf 1 2 3\n").colours.empty());
}

// ZBrush: a mask and a colour of each vertex, hexadecimal, several a comment.
TEST(ObjReader, ColoursInCommentsOfZBrush) {
  const SourceModel m =
      parse(kTriangle + "#MRGB FFFF0000ff00ff33\n# note\n#MRGB 000000FF\nf 1 2 3\n");
  ASSERT_EQ(m.colours.size(), 3u);
  EXPECT_EQ(m.colours[0], glm::vec3(1, 0, 0));
  EXPECT_EQ(m.colours[1], glm::vec3(0, 1, 0.2f));
  EXPECT_EQ(m.colours[2], glm::vec3(0, 0, 1));
  EXPECT_TRUE(m.diagnostics.empty());
  const SourceModel other = parse(kTriangle + "#MRGB FFFF0000FF00FF\nf 1 2 3\n");
  EXPECT_TRUE(other.colours.empty());
  EXPECT_EQ(diagnostics(other), (std::multiset<std::string>{"obj.painted:0"}));
}

TEST(ObjReader, LinesPointsAndCurvesAreSkippedAndTheirLinesNamed) {
  const SourceModel m = parse(kTriangle +
                              "g a b\no thing\np 1 2\nf 1 2 3\nl 1 2 3\nl 2 3\n"
                              "cstype bezier\ndeg 3\ncurv 0 1 1 2 3\nend\nf 3 2 1\n");
  EXPECT_EQ(position_indices(m), (std::vector<std::uint32_t>{0, 1, 2, 2, 1, 0}));
  EXPECT_EQ(diagnostics(m),
            (std::multiset<std::string>{"obj.points:6", "obj.lines:8", "obj.free-form:10"}));
}

TEST(ObjReader, LinesOfAnyLength) {
  // A face of many corners in a line of 1.4 MB, and a comment that is longer than any block.
  constexpr std::uint32_t kCorners = 200000;
  std::string text = "#" + std::string(9'000'000, 'x') + "\n";
  std::string face = "f";
  for (std::uint32_t i = 1; i <= kCorners; ++i) {
    text += "v " + std::to_string(i) + " 0 1\n";
    face += " " + std::to_string(i);
  }
  const SourceModel m = parse(text + face + "\nnonsense\n");
  ASSERT_EQ(m.face_count(), 1u);
  EXPECT_EQ(m.face_size(0), kCorners);
  EXPECT_EQ(m.corner(kCorners - 1).position, kCorners - 1);
  EXPECT_EQ(m.positions[kCorners - 1], glm::dvec3(kCorners, 0, 1));
  EXPECT_EQ(diagnostics(m), (std::multiset<std::string>{"obj.unknown:200003"}));
}

TEST(ObjReader, EveryFindingNamesFileLineCauseAndCure) {
  const SourceModel m =
      parse(kTriangle +
            "vt 0 0\nf 1 2 3\nf 1 2 9\nf 0 1 2\nf 1 2\nf 1/7 2/1 3/1\nf /1 /1 /1\n"
            "f 1 2 x\nv nan 0 0\nv 1 0x 2\nv 5\nv 0 0 0 0.5\nv 1 1 1 255 0 0\nl 1 2\n"
            "p 1\ncurv 0 1 1 2\nblah\nf 1 2 3\n");
  std::set<std::string> ids;
  for (const Diagnostic& f : m.diagnostics) {
    ids.insert(f.id);
    EXPECT_EQ(f.file, "test.obj") << f.id;
    EXPECT_FALSE(f.message.empty()) << f.id;
    EXPECT_FALSE(f.cure.empty()) << f.id;
    // Colours are judged over all vertices.
    EXPECT_EQ(f.line == 0, f.id == "obj.partial-colours" || f.id == "obj.byte-colours") << f.id;
  }
  for (const char* id :
       {"obj.index-range", "obj.zero-index", "obj.short-face", "obj.attribute-range",
        "obj.no-position", "obj.bad-number", "obj.not-finite", "obj.short-vertex", "obj.weight",
        "obj.lines", "obj.points", "obj.free-form", "obj.unknown", "obj.partial-colours"}) {
    EXPECT_TRUE(ids.contains(id)) << id;
  }
}

TEST(ObjReader, SmoothingGroupsAndMaterialsApplyToWhatFollows) {
  const SourceModel m = parse(kTriangle +
                              "f 1 2 3\ns 1\nusemtl a\nf 1 2 3\ns off\nusemtl b c \nf 1 2 3\n"
                              "usemtl a\ns 4\nf 1 2 3\n");
  EXPECT_EQ(by_face(m, m.smoothing_runs),
            (std::vector<std::uint32_t>{kUnstatedSmoothing, 1, 0, 4}));
  EXPECT_EQ(by_face(m, m.material_runs), (std::vector<std::uint32_t>{0, 1, 2, 1}));
  EXPECT_EQ(m.materials[2].name, "b c");
}

TEST(ObjReader, OddNumbersAreFindings) {
  const SourceModel m = parse("v nan 0 0\nv 1 0 1e999\nv 0 1 0x\nv 5\nv 0 0 0 0.5\nf 1 2 3 4\n");
  EXPECT_TRUE(std::isnan(m.positions[0].x));
  EXPECT_EQ(m.positions[3], glm::dvec3(5, 0, 0));
  EXPECT_EQ(diagnostics(m), (std::multiset<std::string>{"obj.not-finite:1", "obj.bad-number:3",
                                                        "obj.short-vertex:4", "obj.weight:5"}));
}

TEST(ObjReader, BlocksJoinWithoutASeam) {
  // Long enough for several blocks; every third index counts back, across the seams.
  std::string text;
  std::vector<std::uint32_t> expected;
  for (std::uint32_t i = 0; i < 60000; ++i) {
    text += "v " + std::to_string(i) + " 0.5 -1.25e0\n";
    if (i < 2) continue;
    text += "f " + std::to_string(i + 1) + " -2 " + std::to_string(i - 1) + "\n";
    expected.insert(expected.end(), {i, i - 1, i - 2});
    if (i % 20000 == 0) text += "s " + std::to_string(i) + "\nnonsense\n";
  }
  const SourceModel m = parse(text);
  EXPECT_EQ(position_indices(m), expected);
  for (std::uint32_t i = 0; i < 60000; ++i) {
    ASSERT_EQ(m.positions[i], glm::dvec3(i, 0.5, -1.25));
  }
  const auto smoothing = by_face(m, m.smoothing_runs);
  EXPECT_EQ(smoothing[30000], 20000u);
  EXPECT_EQ(smoothing.back(), 40000u);
  ASSERT_EQ(m.diagnostics.size(), 1u);
  EXPECT_EQ(m.diagnostics[0].message.substr(0, 2), "2 ");
  // 2 lines a step but for the first two, the statements at 20000 (with its own face) and up.
  EXPECT_EQ(m.diagnostics[0].line, 2u + 2u * 19999u + 2u);
}

/// Random plain lines, as exporters write them.
class PlainLines {
 public:
  explicit PlainLines(std::uint64_t seed) : random_(seed) {}

  /// Positions with or without colours, uvs, normals, faces of each kind.
  std::string text() {
    const std::size_t vertices = 4 + below(30);
    const std::size_t triple = below(2) == 0 ? 3 : 6;
    const unsigned wide = below(2) == 0 ? 7 : 4;
    std::string text;
    for (std::size_t i = 0; i < vertices; ++i) text += "v" + decimals(triple, wide);
    for (std::size_t i = 0; i < vertices; ++i) text += "vt" + decimals(2, wide);
    for (std::size_t i = 0; i < vertices; ++i) text += "vn" + decimals(3, wide);
    for (std::size_t kind = below(4), i = 0; i < 2 * vertices; ++i) {
      if (below(8) == 0) kind = below(4);
      text += face(kind, below(6) == 0 ? 4 : 3, vertices);
    }
    return text;
  }

  /// The text with a few bytes changed to others that numbers and faces might hold.
  std::string damaged(std::string text) {
    static const std::string kBytes = "0019.-+/: eE#x\t\r\n\\";
    for (std::size_t i = below(6); i > 0; --i) {
      text[below(text.size())] = kBytes[below(kBytes.size())];
    }
    return text;
  }

 private:
  std::size_t below(std::size_t bound) { return random_() % bound; }

  std::string digits(std::size_t count) {
    std::string text;
    for (; count > 0; --count) text += static_cast<char>('0' + below(10));
    return text;
  }

  std::string decimals(std::size_t count, unsigned wide) {
    std::string text;
    for (; count > 0; --count) {
      text += below(2) == 0 ? " " : " -";
      text += digits(1 + below(wide)) + "." + digits(1 + below(wide));
    }
    return text + "\n";
  }

  std::string face(std::size_t kind, std::size_t corners, std::size_t vertices) {
    const auto index = [&] { return std::to_string(1 + below(vertices)); };
    std::string text = "f";
    for (; corners > 0; --corners) {
      text += " " + index();
      if (kind == 1) text += "/" + index();
      if (kind == 2) text += "//" + index();
      if (kind == 3) text += "/" + index() + "/" + index();
    }
    return text + "\n";
  }

  std::mt19937_64 random_;
};

/// What of a model can differ, as bytes where numbers are not compared by value.
std::string content_of(const std::string& text) {
  const auto model = parse_obj(text, "", "test.obj");
  if (!model) return to_line(model.error());
  std::ostringstream out;
  out << std::hexfloat;
  for (const glm::dvec3& p : model->positions) out << p.x << ' ' << p.y << ' ' << p.z << '\n';
  for (const glm::vec3& c : model->colours) out << c.x << ' ' << c.y << ' ' << c.z << '\n';
  for (const glm::dvec2& uv : model->uvs) out << uv.x << ' ' << uv.y << '\n';
  for (const glm::vec3& n : model->normals) out << n.x << ' ' << n.y << ' ' << n.z << '\n';
  for (std::size_t f = 0; f < model->face_count(); ++f) out << model->face_size(f) << ' ';
  for (std::size_t i = 0; i < model->corner_count(); ++i) {
    const Corner c = model->corner(i);
    out << c.position << '/' << c.uv << '/' << c.normal << ' ';
  }
  for (const Diagnostic& d : model->diagnostics) out << d.id << d.line << d.message << '\n';
  return out.str();
}

/// The same statements in a spelling that exporters do not use.
std::string indented(const std::string& text) {
  std::string wider = " ";
  for (const char c : text) {
    wider += c;
    if (c == '\n') wider += ' ';
  }
  return wider;
}

TEST(ObjReader, PlainLinesReadAsIndentedOnesDo) {
  PlainLines lines(5);
  for (int i = 0; i < 3000; ++i) {
    const std::string text = lines.damaged(lines.text());
    // A backslash in front of a line end would continue the blank, too: the same statement.
    ASSERT_EQ(content_of(text), content_of(indented(text))) << text;
  }
}

TEST(ObjReader, CornersOfManyDigitsAreReadAsTheyStand) {
  // Lines of 8 to 166 bytes: leading zeros are as good as large models.
  std::string text = kTriangle + "vt 0.5 0.5\nvt 0.25 0.5\nvn 0.0 0.0 1.0\n";
  std::vector<Corner> wanted;
  std::mt19937 random(9);
  for (int f = 0; f < 2000; ++f) {
    const std::size_t kind = random() % 4;
    text += "f";
    for (std::size_t k = 3 + random() % 3; k > 0; --k) {
      Corner corner;
      const auto index = [&](std::uint32_t count, std::uint32_t& to) {
        to = static_cast<std::uint32_t>(random() % count);
        return std::string(random() % 10, '0') + std::to_string(to + 1);
      };
      text += " " + index(3, corner.position);
      if (kind == 1 || kind == 2) text += "/" + index(2, corner.uv);
      if (kind > 1) text += (kind == 2 ? "/" : "//") + index(1, corner.normal);
      wanted.push_back(corner);
    }
    text += "\n";
  }
  const SourceModel model = parse(text);
  ASSERT_EQ(model.face_count(), 2000u);
  ASSERT_EQ(model.corner_count(), wanted.size());
  for (std::size_t i = 0; i < wanted.size(); ++i) {
    ASSERT_EQ(model.corner(i).position, wanted[i].position) << i;
    ASSERT_EQ(model.corner(i).uv, wanted[i].uv) << i;
    ASSERT_EQ(model.corner(i).normal, wanted[i].normal) << i;
  }
}

TEST(ObjReader, PlainNumbersAreCorrectlyRounded) {
  PlainLines lines(6);
  for (int i = 0; i < 300; ++i) {
    std::istringstream text(lines.text());
    const SourceModel model = parse(text.str());
    std::size_t position = 0;
    std::size_t uv = 0;
    for (std::string line; std::getline(text, line);) {
      char* next = line.data() + 2;
      if (line.starts_with("v ")) {
        for (int k = 0; k < 3; ++k) {
          const double value = std::strtod(next, &next);
          const double ours = model.positions[position][k];
          ASSERT_EQ(std::bit_cast<std::uint64_t>(ours), std::bit_cast<std::uint64_t>(value))
              << line;
        }
        ++position;
      } else if (line.starts_with("vt")) {
        for (int k = 0; k < 2; ++k) ASSERT_EQ(model.uvs[uv][k], std::strtod(next, &next)) << line;
        ++uv;
      }
    }
    ASSERT_EQ(position, model.positions.size());
    ASSERT_EQ(uv, model.uvs.size());
  }
}

TEST(ObjReader, TruncatedAnywhereItAnswers) {
  const std::string text =
      "mtllib a\nv 0 0 0 1 1 1\nv 1 0 0 1 0 0\nv 0 1 0\nvt 0 1\nvn 0 0 1\ns 1\nusemtl m\n"
      "f 1/1/1 2/1/1 3/-1/-1\nl 1 2\nf -1 -2 \\\n -3\n";
  for (std::size_t size = 0; size <= text.size(); ++size) {
    const auto model = parse_obj(text.substr(0, size), "", "cut.obj");
    EXPECT_EQ(model ? "obj.no-faces" : model.error().code, "obj.no-faces") << size;
  }
}

}  // namespace
}  // namespace modar
