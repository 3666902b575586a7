// Shortest decimal text of floating-point numbers, as std::to_chars() writes it: for C++ libraries
// that have no such function (libc++ of Android's NDKs and of Debian 12's emscripten).
#pragma once

#include <string>

namespace modar {

/// The fewest digits that read back as the same number, in the shorter of fixed and scientific
/// notation. value: finite.
std::string shortest_text(float value);
std::string shortest_text(double value);

}  // namespace modar
