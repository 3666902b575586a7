// Of org.modar.Native: photos of visitors' own pictures, from pixels to the tracker's record. Needs
// no session, and runs on any thread.
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "runtime/extensions/android/bridge.hpp"

#define MODAR_NATIVE(type, name) extern "C" JNIEXPORT type JNICALL Java_org_modar_Native_##name

namespace {

using modar::android::throw_error;

constexpr jsize kCornerFloats = 8;

/// A Bitmap's pixels as R, G, B and alpha; empty and an exception where they are too few.
std::vector<std::uint8_t> rgba_of(JNIEnv* env, jintArray argb, jint width, jint height) {
  std::vector<std::uint8_t> rgba;
  const std::int64_t count = std::int64_t{width} * height;
  if (argb == nullptr || width < 1 || height < 1 || count > env->GetArrayLength(argb)) {
    throw_error(env, MODAR_USAGE, "android.buffer", "argb", "it is null or too small",
                "pass width * height pixels");
    return rgba;
  }
  jint* const pixels = env->GetIntArrayElements(argb, nullptr);
  if (pixels == nullptr) return rgba;
  rgba.reserve(static_cast<std::size_t>(4 * count));
  for (std::int64_t i = 0; i < count; ++i) {
    const auto pixel = static_cast<std::uint32_t>(pixels[i]);
    for (const std::uint32_t shift : {16u, 8u, 0u, 24u}) {
      rgba.push_back(static_cast<std::uint8_t>(pixel >> shift));
    }
  }
  env->ReleaseIntArrayElements(argb, pixels, JNI_ABORT);
  return rgba;
}

modar_picture picture_of(const std::vector<std::uint8_t>& rgba, int width, int height) {
  auto picture = modar::sized<modar_picture>();
  picture.format = MODAR_RGBA;
  picture.width = width;
  picture.height = height;
  picture.planes[0] = rgba.data();
  picture.strides[0] = 4 * std::ptrdiff_t{width};
  return picture;
}

}  // namespace

MODAR_NATIVE(jboolean, photoCorners)
(JNIEnv* env, jclass, jintArray argb, jint width, jint height, jfloatArray corners) {
  const std::vector<std::uint8_t> rgba = rgba_of(env, argb, width, height);
  std::array<jfloat, kCornerFloats> found{};
  const modar_picture photo = picture_of(rgba, width, height);
  if (modar_photo_corners(&photo, found.data()) == 0) {
    return JNI_FALSE;
  }
  env->SetFloatArrayRegion(corners, 0, kCornerFloats, found.data());
  return JNI_TRUE;
}

MODAR_NATIVE(jbyteArray, photoRecord)
(JNIEnv* env, jclass, jintArray argb, jint width, jint height, jfloatArray corners) {
  const std::vector<std::uint8_t> rgba = rgba_of(env, argb, width, height);
  if (rgba.empty()) return nullptr;
  std::array<jfloat, kCornerFloats> points{};
  env->GetFloatArrayRegion(corners, 0, kCornerFloats, points.data());
  if (env->ExceptionCheck() == JNI_TRUE) return nullptr;
  std::vector<std::uint8_t> gray(std::size_t{MODAR_FLAT_SIDE} * MODAR_FLAT_SIDE);
  int flat_width = 0;
  int flat_height = 0;
  const modar_picture photo = picture_of(rgba, width, height);
  if (modar_photo_flat(&photo, points.data(), gray.data(), &flat_width, &flat_height) == 0) {
    throw_error(env, MODAR_USAGE, "android.corners", "corners",
                "they are not a convex quadrilateral", "drag them onto the picture's");
    return nullptr;
  }
  auto error = modar::sized<modar_error>();
  const std::unique_ptr<modar_record, decltype(&modar_record_close)> record(
      modar_record_create(gray.data(), static_cast<std::size_t>(flat_width), flat_width,
                          flat_height, &error),
      modar_record_close);
  if (!record) {
    throw_error(env, error);
    return nullptr;
  }
  std::size_t size = 0;
  const auto* const bytes = static_cast<const jbyte*>(modar_record_bytes(record.get(), &size));
  const jbyteArray array = env->NewByteArray(static_cast<jsize>(size));
  if (array != nullptr) env->SetByteArrayRegion(array, 0, static_cast<jsize>(size), bytes);
  return array;
}
