// Cosines and sines that are the same on every machine.
#pragma once

namespace modar {

/// Cosine and sine of an angle.
struct Turn {
  double cosine = 1;
  double sine = 0;
};
/// Computed from sums and products only: the last bit of a library's sine differs between machines,
/// and neither baked bytes nor poses may. Accurate to about 1e-15. radians: within +-1000.
Turn turn_of(double radians);

}  // namespace modar
