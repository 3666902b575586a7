// The words for why nothing is visible, and how far that is from visible.
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

int progress(Reason reason) {
  switch (reason) {
    case Reason::kVisible:
      return 6;
    case Reason::kLostByBlur:
    case Reason::kOutOfView:
      return 5;
    case Reason::kFailedVerification:
      return 4;
    case Reason::kNoGeometry:
      return 3;
    case Reason::kFewMatches:
      return 2;
    default:
      return 1;
  }
}

}  // namespace modar
