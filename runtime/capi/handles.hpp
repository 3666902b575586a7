// What stands behind the opaque handles of modar.h, and how our errors and matrices cross over.
#pragma once

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

#include <glm/gtc/type_ptr.hpp>

#include "formats/bundle_view.hpp"
#include "modar/camera.hpp"
#include "modar/camera_yml.hpp"
#include "modar/mapped_file.hpp"
#include "modar/modar.h"

struct modar_bundle {
  modar::MappedFile file;           ///< empty where the bytes are the caller's
  std::vector<std::uint64_t> copy;  ///< of bytes that were not aligned; else empty
  modar::BundleView view;
};

namespace modar {

/// Cuts the text to what the array holds; at most a part of the last UTF-8 letter is lost.
template <std::size_t kSize>
void copy_text(const std::string& text, char (&to)[kSize]) {
  const std::size_t length = std::min(text.size(), kSize - 1);
  std::memcpy(to, text.data(), length);
  to[length] = '\0';
}

/// Tells the caller, who may not want to know; answers the exit code.
inline int hand_over(const Error& error, modar_error* to) {
  const int exit = static_cast<int>(error.exit);
  if (to == nullptr) return exit;
  to->exit_code = exit;
  copy_text(error.code, to->code);
  copy_text(error.where, to->where);
  copy_text(error.cause, to->cause);
  copy_text(error.cure, to->cure);
  return exit;
}

inline int hand_over(const Result<void>& result, modar_error* to) {
  return result ? 0 : hand_over(result.error(), to);
}

/// The caller's options in a structure of this version's size: what an older caller did not know is
/// 0.
template <class Options>
Options grown(const Options& options) {
  Options ours{};
  std::memcpy(&ours, &options, std::min(options.size, sizeof ours));
  return ours;
}

/// What a caller forgot.
inline Error missing(const char* what) {
  return {ExitCode::kUsage, "capi.null", what, "is NULL", "pass it"};
}

inline Camera camera_of(const modar_camera& camera) {
  Camera ours{camera.width, camera.height, camera.fx, camera.fy, camera.cx, camera.cy, {}};
  std::copy_n(camera.distortion, ours.distortion.size(), ours.distortion.begin());
  return ours;
}

inline void copy_matrix(const glm::mat4& from, float* to) {
  std::copy_n(glm::value_ptr(from), 16, to);
}

}  // namespace modar
