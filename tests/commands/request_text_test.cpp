// Text forms of options: accepted values, and those refused with a cure.
#include "bake/options/request_text.hpp"

#include <gtest/gtest.h>

#include "bake/bundle/bundle_builder.hpp"

namespace modar {
namespace {

TEST(Scene, DefaultsAndOptions) {
  const auto plain = parse_scene("cover=vase");
  ASSERT_TRUE(plain);
  EXPECT_EQ(plain->pattern, "cover");
  EXPECT_EQ(plain->model, "vase");
  EXPECT_EQ(plain->size.kind, SceneSize::Kind::kScale);
  EXPECT_EQ(plain->size.value, 1.0);
  EXPECT_FALSE(plain->up);
  EXPECT_FALSE(plain->centred);

  const auto full = parse_scene("a b=c.d,scale=2.5,up=-Y,turn=90,offset=0.5:-1:1e-1,centred");
  ASSERT_TRUE(full) << to_line(full.error());
  EXPECT_EQ(full->pattern, "a b");
  EXPECT_EQ(full->model, "c.d");
  EXPECT_EQ(full->size.value, 2.5);
  EXPECT_EQ(full->up, UpAxis::kMinusY);
  EXPECT_EQ(full->turn, (std::array<double, 3>{0, 0, 90}));
  EXPECT_EQ(full->offset.value, (std::array<double, 3>{0.5, -1.0, 0.1}));
  EXPECT_EQ(full->offset.unit, SceneOffset::Unit::kUsual);
  EXPECT_TRUE(full->centred);

  const auto sized = parse_scene("a=b,height=12cm,turn=10:20:-30,offset=0:0:1in");
  ASSERT_TRUE(sized) << to_line(sized.error());
  EXPECT_EQ(sized->size.kind, SceneSize::Kind::kHeight);
  EXPECT_DOUBLE_EQ(sized->size.value, 120);
  EXPECT_EQ(sized->turn, (std::array<double, 3>{10, 20, -30}));
  EXPECT_EQ(sized->offset.unit, SceneOffset::Unit::kMillimetres);
  EXPECT_DOUBLE_EQ(sized->offset.value[2], 25.4);

  const auto apart = parse_scene("a=b,offset=1in:2:3cm");
  ASSERT_TRUE(apart) << to_line(apart.error());
  EXPECT_EQ(apart->offset.unit, SceneOffset::Unit::kMillimetres);
  EXPECT_EQ(apart->offset.value, (std::array<double, 3>{25.4, 20, 30}));
}

TEST(Scene, Refused) {
  for (const char* text : {"",
                           "cover",
                           "=vase",
                           "cover=",
                           "a=b,scale=0",
                           "a=b,scale=-1",
                           "a=b,scale=nan",
                           "a=b,scale=1x",
                           "a=b,up=w",
                           "a=b,offset=1:2",
                           "a=b,offset=1:2:3:4",
                           "a=b,",
                           "a=b,fast",
                           "a=b,scale=1e39",
                           "a=b,height=120",
                           "a=b,height=nanmm",
                           "a=b,turn=1:2",
                           "a=b,turn=361",
                           "a=b,scale=1,height=5mm",
                           "a=b,offset=1:2:3furlong",
                           "a=b,offset=1mm:2:3",
                           "a=b,centred=no"}) {
    const auto scene = parse_scene(text);
    ASSERT_FALSE(scene) << text;
    EXPECT_EQ(scene.error().exit, ExitCode::kUsage);
    EXPECT_EQ(scene.error().code, "cli.scene");
  }
}

TEST(Scene, CuresSayWhatToWrite) {
  const auto cure = [](const char* text) { return parse_scene(text).error().cure; };
  EXPECT_EQ(cure("a=b,scale=80%"), "write scale=0.8");
  EXPECT_EQ(cure("a=b,scale=0"), "write a factor above 0, as in scale=0.8");
  EXPECT_EQ(cure("a=b,height=20"), "write 20mm, 20cm or 20in");
  EXPECT_EQ(cure("a=b,height=20inch"), "write 20in");
  EXPECT_EQ(cure("a=b,up=w"), "name one of x, y, z, -x, -y, -z");
}

TEST(Name, StandsBeforeAFile) {
  EXPECT_EQ(parse_model("bear=a/scene.gltf").name, "bear");
  EXPECT_EQ(parse_model("bear=a/scene.gltf").path, "a/scene.gltf");
  EXPECT_EQ(parse_model("a/b=c.obj").path, "a/b=c.obj");
  EXPECT_EQ(parse_model("scene.gltf").name, "");
  const auto pattern = parse_pattern("front=a/1.png:210mm");
  ASSERT_TRUE(pattern);
  EXPECT_EQ(pattern->name, "front");
  EXPECT_EQ(pattern->path, "a/1.png");
  EXPECT_EQ(pattern->width_mm, 210);
}

TEST(Pattern, CopiesComeLast) {
  const auto pattern = parse_pattern("front=a/1.png:210mm:shape=cylinder,diameter=66mm:copies=4");
  ASSERT_TRUE(pattern) << to_line(pattern.error());
  EXPECT_EQ(pattern->path, "a/1.png");
  EXPECT_EQ(pattern->width_mm, 210);
  EXPECT_EQ(pattern->shape.kind, ShapeRequest::Kind::kCylinder);
  EXPECT_EQ(pattern->copies, 4u);
  EXPECT_EQ(parse_pattern("a/1.png:copies=16")->copies, 16u);
  EXPECT_EQ(parse_pattern("a/1.png")->copies, 0u);
  for (const char* wrong : {"0", "17", "2.5", "two", "", "-1", "4:210mm"}) {
    const auto refused = parse_pattern(std::string("a/1.png:copies=") + wrong);
    ASSERT_FALSE(refused) << wrong;
    EXPECT_EQ(refused.error().code, "cli.copies") << wrong;
  }
}

TEST(Name, TheFoldersWhereFilesAreCalledAlike) {
  BakeRequest request;
  request.models = {ModelRequest("bear/scene.gltf"), ModelRequest("fox/scene.gltf"),
                    ModelRequest("owl.glb"), ModelRequest("a/b.obj", "cat")};
  ASSERT_TRUE(name_assets(request));
  EXPECT_EQ(request.models[0].name, "bear");
  EXPECT_EQ(request.models[1].name, "fox");
  EXPECT_EQ(request.models[2].name, "owl");
  EXPECT_EQ(request.models[3].name, "cat");
  request.models = {ModelRequest("a/x/scene.gltf"), ModelRequest("b/x/scene.gltf")};
  const auto refused = name_assets(request);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, "bake.same-name");
  EXPECT_EQ(refused.error().cure, "give one of them a name: --model NAME=b/x/scene.gltf");
  request.models = {ModelRequest("/usr"), ModelRequest("/usr/../usr")};  // any that is there
  const auto twice = name_assets(request);
  ASSERT_FALSE(twice);
  EXPECT_EQ(twice.error().cause, "the file is given twice");
}

TEST(Corners, EightNumbersAndNothingElse) {
  const auto corners = parse_corners("1,2,3.5,-4,5e1,6,7,8");
  ASSERT_TRUE(corners);
  EXPECT_EQ((*corners)[1].x, 3.5);
  EXPECT_EQ((*corners)[1].y, -4);
  EXPECT_EQ((*corners)[2].x, 50);
  for (const char* text : {"", "1,2,3,4,5,6,7", "1,2,3,4,5,6,7,8,9", "1,2,3,4,5,6,7,", "1;2;3"}) {
    EXPECT_FALSE(parse_corners(text)) << text;
  }
}

TEST(Pattern, WidthIsOptional) {
  const auto plain = parse_pattern("dir/cover.png");
  ASSERT_TRUE(plain);
  EXPECT_EQ(plain->path, "dir/cover.png");
  EXPECT_EQ(plain->width_mm, 0);
  const auto wide = parse_pattern("c:cover.png:148.5mm");
  ASSERT_TRUE(wide);
  EXPECT_EQ(wide->path, "c:cover.png");
  EXPECT_EQ(wide->width_mm, 148.5);
  EXPECT_DOUBLE_EQ(parse_pattern("p.png:210cm")->width_mm, 2100);
  EXPECT_DOUBLE_EQ(parse_pattern("p.png:0.5m")->width_mm, 500);
  EXPECT_DOUBLE_EQ(parse_pattern("p.png:2in")->width_mm, 50.8);
  EXPECT_DOUBLE_EQ(parse_pattern("p.png:210 mm")->width_mm, 210);
  EXPECT_EQ(parse_pattern("p.png:210cm")->path, "p.png");
  EXPECT_EQ(parse_pattern("odd:name.m")->path, "odd:name.m");
  EXPECT_FALSE(parse_pattern("cover.png:-3cm"));
  EXPECT_FALSE(parse_pattern("cover.png:-3mm"));
  EXPECT_FALSE(parse_pattern("cover.png:mm"));
  const auto cure = [](const char* text) { return parse_pattern(text).error().cure; };
  EXPECT_EQ(cure("cover.png:20"), "write 20mm, 20cm or 20in");
  EXPECT_EQ(cure("cover.png:20inch"), "write 20in");
  EXPECT_EQ(cure("cover.png:20 Zoll"), "name one of mm, cm, m, km, in, ft");
  EXPECT_EQ(cure("cover.png:21,0cm"), "write 21.0cm, with a point");
  EXPECT_FALSE(parse_pattern("cover.png:nanmm"));
}

TEST(Pattern, ShapeStandsBehindTheWidth) {
  const auto can = parse_pattern("label.png:shape=cylinder,diameter=66mm,arc=120");
  ASSERT_TRUE(can) << to_line(can.error());
  EXPECT_EQ(can->path, "label.png");
  EXPECT_EQ(can->shape.kind, ShapeRequest::Kind::kCylinder);
  EXPECT_EQ(can->shape.top_mm, 66);
  EXPECT_EQ(can->shape.bottom_mm, 66);
  EXPECT_EQ(can->shape.arc_deg, 120);
  const auto cup = parse_pattern("c:cup.png:7cm:shape=cone,top=8cm,bottom=60mm");
  ASSERT_TRUE(cup) << to_line(cup.error());
  EXPECT_EQ(cup->path, "c:cup.png");
  EXPECT_EQ(cup->width_mm, 70);
  EXPECT_EQ(cup->shape.kind, ShapeRequest::Kind::kCone);
  EXPECT_DOUBLE_EQ(cup->shape.top_mm, 80);
  EXPECT_EQ(cup->shape.bottom_mm, 60);
  EXPECT_EQ(cup->shape.text, "cone,top=8cm,bottom=60mm");
  EXPECT_TRUE(parse_pattern("p.png")->shape.flat());
  const auto box = parse_pattern("a/front.png:shape=box,size=12x18x4cm,top=t.png,right=r.png");
  ASSERT_TRUE(box) << to_line(box.error());
  EXPECT_EQ(box->shape.box_mm, (std::array<double, 3>{120, 180, 40}));
  EXPECT_EQ(box->shape.sides, (std::array<std::string, 5>{"r.png", "", "", "t.png", ""}));
  EXPECT_EQ(files_of(box->path, box->shape), (std::vector<std::string>{"a/r.png", "a/t.png"}));
  for (const char* bad :
       {"", "ball", "cylinder,diameter=66", "cylinder,arc=0", "cylinder,arc=361",
        "cylinder,top=66mm", "cone,top=66mm", "cone,top=66mm,bottom=-1mm",
        "cylinder,diameter=66mm,arc=120,", "cylinder,diameter=nanmm", "box", "box,size=120x180mm",
        "box,size=120x180x40", "box,size=1x2x3mm,front=f.png", "box,size=1x2x3mm,right="}) {
    EXPECT_FALSE(parse_shape(bad)) << bad;
  }
}

TEST(Unit, Metres) {
  EXPECT_EQ(parse_unit("mm").value(), 0.001);
  EXPECT_EQ(parse_unit("ft").value(), 0.3048);
  EXPECT_FALSE(parse_unit("parsec"));
}

TEST(MaxErrorText, NumberPercentageOrLength) {
  EXPECT_EQ(parse_max_error("0.25")->unit, MaxError::Unit::kSource);
  EXPECT_EQ(parse_max_error("0.25")->value, 0.25);
  EXPECT_EQ(parse_max_error("1e-3")->value, 0.001);
  EXPECT_EQ(parse_max_error("0.01%")->unit, MaxError::Unit::kPercent);
  EXPECT_EQ(parse_max_error("0.01%")->value, 0.01);
  EXPECT_EQ(parse_max_error("2mm")->unit, MaxError::Unit::kMetres);
  EXPECT_DOUBLE_EQ(parse_max_error("2mm")->value, 0.002);
  for (const char* bad : {"", "0", "-1", "mm", "%", "1 parsec", "nan", "1..2", "2mm3"}) {
    EXPECT_FALSE(parse_max_error(bad)) << bad;
  }
}

}  // namespace
}  // namespace modar
