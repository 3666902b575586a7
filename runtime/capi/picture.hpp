// What modar.h asks of a camera frame.
#pragma once

#include "formats/base/error.hpp"
#include "modar/modar.h"

namespace modar {

/// Nothing, or the fault of a frame: its format, sides, planes or strides. picture: of this
/// version's size. Errors: kUsage "capi.picture", "capi.stride", "capi.null".
Result<void> check_picture(const modar_picture& picture);

}  // namespace modar
