// Text forms of options: what is taken, and what is refused with a cure.
#include "bake/bundle/request_text.hpp"

#include <gtest/gtest.h>

namespace modar {
namespace {

TEST(Scene, DefaultsAndOptions) {
  const auto plain = parse_scene("cover=vase");
  ASSERT_TRUE(plain);
  EXPECT_EQ(plain->pattern, "cover");
  EXPECT_EQ(plain->model, "vase");
  EXPECT_EQ(plain->scale, 1.0);
  EXPECT_EQ(plain->up, UpAxis::kZ);
  EXPECT_FALSE(plain->centred);

  const auto full = parse_scene("a b=c.d,scale=2.5,up=-y,offset=0.5:-1:1e-1,centred");
  ASSERT_TRUE(full);
  EXPECT_EQ(full->pattern, "a b");
  EXPECT_EQ(full->model, "c.d");
  EXPECT_EQ(full->scale, 2.5);
  EXPECT_EQ(full->up, UpAxis::kMinusY);
  EXPECT_EQ(full->offset, (std::array<double, 3>{0.5, -1.0, 0.1}));
  EXPECT_TRUE(full->centred);
}

TEST(Scene, Refused) {
  for (const char* text :
       {"", "cover", "=vase", "cover=", "a=b,scale=0", "a=b,scale=-1", "a=b,scale=nan",
        "a=b,scale=1x", "a=b,up=w", "a=b,offset=1:2", "a=b,offset=1:2:3:4", "a=b,", "a=b,fast"}) {
    const auto scene = parse_scene(text);
    ASSERT_FALSE(scene) << text;
    EXPECT_EQ(scene.error().exit, ExitCode::kUsage);
    EXPECT_EQ(scene.error().code, "cli.scene");
  }
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
  EXPECT_EQ(parse_pattern("p.png:210cm")->path, "p.png");
  EXPECT_EQ(parse_pattern("odd:name.m")->path, "odd:name.m");
  EXPECT_FALSE(parse_pattern("cover.png:-3cm"));
  EXPECT_FALSE(parse_pattern("cover.png:-3mm"));
  EXPECT_FALSE(parse_pattern("cover.png:mm"));
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
