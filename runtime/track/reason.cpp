// The words for why nothing is visible.
#include "modar/tracker.hpp"

namespace modar {

const char* to_string(Reason reason) {
  switch (reason) {
    case Reason::kVisible:
      return "visible";
    case Reason::kNoFeatures:
      return "no features";
    case Reason::kFewMatches:
      return "few matches";
    case Reason::kNoGeometry:
      return "no geometry";
    case Reason::kFailedVerification:
      return "failed verification";
    case Reason::kLostByBlur:
      return "lost by blur";
    case Reason::kOutOfView:
      return "out of view";
  }
  return "unknown";
}

}  // namespace modar
