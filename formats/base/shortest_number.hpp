// Shortest decimal text of floating-point numbers, as std::to_chars() writes it: for C++ libraries
// that have no such function (libc++ of Android's NDKs and of Debian 12's emscripten).
#pragma once

#include <string>

namespace modar {

/// The fewest digits that read back as the same number, in the shorter of fixed and scientific
/// notation. value: finite.
std::string shortest_text(float value);
std::string shortest_text(double value);

/// Digits in scientific notation, `digits` behind the point ("1.250e+01"), in no locale.
/// value: finite; digits: 1 to 16.
std::string scientific_text(double value, int digits);

}  // namespace modar
