// What a bundle may say of itself: JSON by the RFC's letter, and the types that readers rely on.
#include "formats/meta_text.hpp"

#include <gtest/gtest.h>

#include <string>

#include "formats/captions.hpp"

namespace {

using modar::check_meta_text;

std::string said(const std::string& text) {
  const auto fault = check_meta_text(text);
  return fault ? std::to_string(fault->offset) + ": " + fault->cause : "";
}

TEST(MetaText, JsonOfEveryKindIsGood) {
  for (const char* text :
       {"{}", " \n\t\r{ } \n", R"({"a":[1,-0,0.5,-1.25e+3,2E5,1e-9,null,true,false,"",[],{}]})",
        R"({"tool":"\u00e9\"\\\/\b\f\n\r\t"})",
        "{\"tool\":\"\xC3\xA9 \xF0\x9F\x8F\xBA \xC2\x85 \x7F\"}",
        R"({"models":[{"file":5}],"patterns":[],"scenes":[{}],"options":{"lods":3}})",
        R"({"texts":[{"pattern":"p","model":"m","text":{"en":"A vase.","de":""},"more":1}]})",
        R"({"texts":[{"text":{},"pattern":""}]})",
        R"({"nodes":[{"pattern":"p","node":"n","title":{"en":"A rim"},"alt":{}}]})"}) {
    EXPECT_EQ(said(text), "") << text;
  }
}

TEST(MetaText, WhatIsNoJsonIsRefusedWhereItEnds) {
  EXPECT_EQ(said(""), "0: an object is missing");
  EXPECT_EQ(said("[]"), "0: an object is missing");
  EXPECT_EQ(said("{\"a\":1}x"), "7: something follows the object");
  EXPECT_EQ(said("{\"a\":1,}"), "7: a string is missing");
  EXPECT_EQ(said("{\"a\" 1}"), "5: a colon is missing");
  EXPECT_EQ(said("{\"a\":[1 2]}"), "8: a comma or a closing bracket is missing");
  EXPECT_EQ(said("{\"a\":\"x}"), "8: a string does not end");
  for (const char* value :
       {"01", "+1", ".5", "1.", "1e", "NaN", "Infinity", "tru", "-", "'a'", ""}) {
    EXPECT_NE(said(std::string("{\"a\":") + value + "}"), "") << value;
  }
  for (const char* inner : {"\\x41", "\\u12g4", "\\u12", "\\udee9", "\\ud800", "\\ud800\\u0041",
                            "\\", "\n", "\xFF", "\xC0\xAF", "\xED\xA0\x80", "\x1B"}) {
    EXPECT_NE(said(std::string("{\"a\":\"") + inner + "\"}"), "") << inner;
  }
  EXPECT_NE(said(std::string("{\"a\":\"\0\"}", 9)), "");
  EXPECT_NE(said(std::string("{}\0", 3)), "");
}

/// An infinity to JavaScript, an error to others.
TEST(MetaText, NumbersAreThoseOfAnF64) {
  for (const char* value : {"1e310", "-1e310", "1E+251", "1e0999",
                            "123456789012345678901234567890123456789012345678901234567890"}) {
    EXPECT_NE(said(std::string("{\"a\":") + value + "}"), "") << value;
  }
  for (const char* value : {"1e250", "-1.7976931348623157e+99", "1e-99", "4.9406564584124654e-324",
                            "18446744073709551615"}) {
    EXPECT_EQ(said(std::string("{\"a\":") + value + "}"), "") << value;
  }
}

TEST(MetaText, DepthHasABound) {
  const auto nested = [](int depth) {
    return "{\"a\":" + std::string(static_cast<std::size_t>(depth - 1), '[') +
           std::string(static_cast<std::size_t>(depth - 1), ']') + "}";
  };
  EXPECT_EQ(said(nested(modar::kMaxMetaDepth)), "");
  EXPECT_NE(said(nested(modar::kMaxMetaDepth + 1)), "");
  EXPECT_NE(said("{\"a\":" + std::string(1 << 20, '[')), "");
}

TEST(MetaText, KnownMembersHaveTheirTypes) {
  for (const char* text :
       {R"({"tool":1})", R"({"models":{}})", R"({"models":[1]})", R"({"patterns":"p"})",
        R"({"scenes":[[]]})", R"({"options":[]})", R"({"texts":{}})", R"({"texts":[5]})",
        R"({"nodes":[{"pattern":"p","title":{}}]})", R"({"nodes":[{"pattern":"p","node":"n"}]})",
        R"({"nodes":[{"pattern":"p","node":"n","title":{"en":1}}]})",
        R"({"texts":[{"pattern":"p"}]})", R"({"texts":[{"text":{}}]})",
        R"({"texts":[{"pattern":1,"text":{}}]})", R"({"texts":[{"pattern":"p","text":"A vase."}]})",
        R"({"texts":[{"pattern":"p","text":{"en":1890}}]})",
        R"({"texts":[{"pattern":"p","model":null,"text":{}}]})", R"({"\u0074exts":5})"}) {
    EXPECT_NE(said(text), "") << text;
  }
}

TEST(Captions, AreWordsAtATimeAndATranscript) {
  const std::string text =
      "WEBVTT\n\n00:00.500 --> 00:01.250 align:start\n<i>This</i> pot\nis old.\n\n"
      "00:01.000 --> 00:02.000\n[bell] &lt;&amp;&gt; 1 < 2\n\n01:00:00.000 --> 01:00:01.000\nEnd";
  ASSERT_FALSE(modar::check_captions(text));
  EXPECT_EQ(modar::words_at(text, 0.499), "");
  EXPECT_EQ(modar::words_at(text, 0.5), "This pot\nis old.");
  EXPECT_EQ(modar::words_at(text, 1.2), "This pot\nis old.\n[bell] <&> 1 < 2");
  EXPECT_EQ(modar::words_at(text, 1.25), "[bell] <&> 1 < 2");
  EXPECT_EQ(modar::words_at(text, 3600.999), "End");
  EXPECT_EQ(modar::words_at(text, 3601.0), "");
  EXPECT_EQ(modar::transcript(text), "This pot is old.\n[bell] <&> 1 < 2\nEnd");
}

}  // namespace
