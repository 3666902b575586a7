// Our errors as Java exceptions, and Java's strings.
#include <array>

#include "runtime/extensions/android/bridge.hpp"

namespace modar::android {

void throw_error(JNIEnv* env, int status, const char* code, const char* where, const char* cause,
                 const char* cure) {
  jclass type = env->FindClass("org/modar/ModarException");
  if (type == nullptr) return;  // NoClassDefFoundError is pending
  jmethodID constructor = env->GetMethodID(
      type, "<init>",
      "(ILjava/lang/String;Ljava/lang/String;Ljava/lang/String;Ljava/lang/String;)V");
  if (constructor != nullptr) {
    std::array<jstring, 4> texts{};
    const std::array<const char*, 4> parts = {code, where, cause, cure};
    for (std::size_t i = 0; i < parts.size(); ++i) {
      texts[i] = env->NewStringUTF(parts[i]);
      if (texts[i] == nullptr) return;  // OutOfMemoryError is pending
    }
    auto* thrown = static_cast<jthrowable>(
        env->NewObject(type, constructor, jint{status}, texts[0], texts[1], texts[2], texts[3]));
    if (thrown != nullptr) env->Throw(thrown);
    for (jstring text : texts) env->DeleteLocalRef(text);
  }
  env->DeleteLocalRef(type);
}

void throw_error(JNIEnv* env, const modar_error& error) {
  throw_error(env, error.status, error.code, error.where, error.cause, error.cure);
}

std::string text_of(JNIEnv* env, jstring text) {
  if (text == nullptr) return {};
  const char* letters = env->GetStringUTFChars(text, nullptr);
  if (letters == nullptr) return {};
  std::string copy(letters);
  env->ReleaseStringUTFChars(text, letters);
  return copy;
}

}  // namespace modar::android
