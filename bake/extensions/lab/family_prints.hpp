// Prints of one family, which differ in little: a title in another language, another fruit on the
// same label; and a hand that holds a print.
#pragma once

#include "bake/pattern/pattern.hpp"

namespace modar {

/// Two prints of one layout.
struct FamilyPrints {
  GrayPicture own;
  GrayPicture other;
};

/// A picture with a title of two lines, a quarter of its height at most, in one of four types; the
/// other print's words differ.
FamilyPrints titled_prints(const GrayImage& picture, Random& random);
/// A picture with a round one in it, 30 to 42 % of its shorter side wide, and a word below that;
/// the other print has another one and another word. first, second: pictures to cut these from.
FamilyPrints fruit_prints(const GrayImage& picture, const GrayImage& first, const GrayImage& second,
                          Random& random);
/// A print with two thumbs on it, one from each side: they move with it.
GrayPicture held_print(const GrayImage& print, Random& random);

}  // namespace modar
