// org.modar.Fetch over modar/fetch.hpp: the phone's own HTTP downloads the bytes, the installer
// does the rest.
#include <string>
#include <vector>

#include "modar/fetch.hpp"
#include "runtime/extensions/android/bridge.hpp"

namespace modar::android {
namespace {

void throw_fetch_error(JNIEnv* env, const Error& error) {
  throw_error(env, static_cast<int>(error.exit), error.code.c_str(), error.where.c_str(),
              error.cause.c_str(), error.cure.c_str());
}

/// org.modar.Transfer: its methods, and its buffer.
class Transfer {
 public:
  Transfer(JNIEnv* env, jobject object) : env_(env), object_(object) {
    jclass type = env->GetObjectClass(object);
    open_ = env->GetMethodID(type, "open", "(Ljava/lang/String;J)I");
    read_ = env->GetMethodID(type, "read", "()I");
    buffer_ = env->GetMethodID(type, "buffer", "()[B");
    close_ = env->GetMethodID(type, "close", "()V");
    progress_ = env->GetMethodID(type, "progress", "(JJ)V");
    first_ = env->GetMethodID(type, "first", "()V");
    env->DeleteLocalRef(type);
  }

  /// ByteSource's contract.
  Result<void> bring(const std::string& path, std::uint64_t from,
                     const std::function<bool(std::span<const std::byte>)>& take) {
    // A file's references go with it: a release has thousands of files.
    if (env_->PushLocalFrame(kReferences) != 0) return broken(path);
    auto done = bring_file(path, from, take);
    env_->CallVoidMethod(object_, close_);
    if (thrown()) done = broken(path);
    env_->PopLocalFrame(nullptr);
    return done;
  }

  void progress(const FetchProgress& now) {
    env_->CallVoidMethod(object_, progress_, static_cast<jlong>(now.bytes_done),
                         static_cast<jlong>(now.bytes_total));
    thrown();
  }

  void first() {
    env_->CallVoidMethod(object_, first_);
    thrown();
  }

 private:
  static constexpr jint kReferences = 8;

  Result<void> bring_file(const std::string& path, std::uint64_t from,
                          const std::function<bool(std::span<const std::byte>)>& take) {
    jstring name = env_->NewStringUTF(path.c_str());
    if (name == nullptr) return broken(path);
    const jint opened = env_->CallIntMethod(object_, open_, name, static_cast<jlong>(from));
    if (thrown() || opened > 1) return broken(path);
    if (opened == 1) {
      return fail(kExitMixed, "fetch.missing", path, "the server has no such file",
                  "publish the release again");
    }
    auto* buffer = static_cast<jbyteArray>(env_->CallObjectMethod(object_, buffer_));
    if (thrown() || buffer == nullptr) return broken(path);
    for (;;) {
      const jint size = env_->CallIntMethod(object_, read_);
      if (thrown() || size < 0 || size > env_->GetArrayLength(buffer)) return broken(path);
      if (size == 0) return {};
      jbyte* bytes = env_->GetByteArrayElements(buffer, nullptr);
      if (bytes == nullptr) return broken(path);
      const bool more = take(std::as_bytes(std::span(bytes, static_cast<std::size_t>(size))));
      env_->ReleaseByteArrayElements(buffer, bytes, JNI_ABORT);
      if (!more) return {};
    }
  }

  /// A Java exception ends one try, not the fetch.
  bool thrown() {
    if (!env_->ExceptionCheck()) return false;
    env_->ExceptionClear();
    return true;
  }

  static tl::unexpected<Error> broken(const std::string& path) {
    return fail(kExitNetwork, "fetch.network", path, "the connection failed or broke",
                "try again; the download is kept");
  }

  JNIEnv* env_;
  jobject object_;
  jmethodID open_ = nullptr;
  jmethodID read_ = nullptr;
  jmethodID buffer_ = nullptr;
  jmethodID close_ = nullptr;
  jmethodID progress_ = nullptr;
  jmethodID first_ = nullptr;
};

/// Null where Java has no memory.
jobjectArray array_of(JNIEnv* env, const std::vector<std::string>& texts) {
  jclass string = env->FindClass("java/lang/String");
  if (string == nullptr) return nullptr;
  const auto count = static_cast<jsize>(texts.size());
  jobjectArray array = env->NewObjectArray(count, string, nullptr);
  for (jsize i = 0; array != nullptr && i < count; ++i) {
    jstring text = env->NewStringUTF(texts[static_cast<std::size_t>(i)].c_str());
    if (text == nullptr) return nullptr;
    env->SetObjectArrayElement(array, i, text);
    env->DeleteLocalRef(text);
  }
  return array;
}

}  // namespace
}  // namespace modar::android

#define MODAR_FETCH(type, name) extern "C" JNIEXPORT type JNICALL Java_org_modar_Fetch_##name

MODAR_FETCH(jboolean, fetch)
(JNIEnv* env, jclass, jstring url, jstring store, jstring key, jobject transfer) {
  using namespace modar::android;
  if (transfer == nullptr) {
    throw_error(env, 1, "android.null", "transfer", "it is null", "pass one");
    return JNI_FALSE;
  }
  modar::FetchOptions options;
  options.url = text_of(env, url);
  options.store = text_of(env, store);
  options.trusted_key = text_of(env, key);
  Transfer java(env, transfer);
  options.source = [&java](const std::string& path, std::uint64_t from, const auto& take) {
    return java.bring(path, from, take);
  };
  options.progress = [&java](const modar::FetchProgress& now) { java.progress(now); };
  options.first = [&java](const std::string&) { java.first(); };
  const auto report = modar::fetch_release(options);
  if (report) return report->changed ? JNI_TRUE : JNI_FALSE;
  throw_fetch_error(env, report.error());
  return JNI_FALSE;
}

MODAR_FETCH(jobjectArray, installed)(JNIEnv* env, jclass, jstring store) {
  const auto release = modar::installed_release(modar::android::text_of(env, store));
  return modar::android::array_of(env, release ? release->bundles : std::vector<std::string>());
}

MODAR_FETCH(jobjectArray, first)(JNIEnv* env, jclass, jstring store) {
  return modar::android::array_of(env, modar::previews(modar::android::text_of(env, store)));
}

MODAR_FETCH(jstring, version)(JNIEnv* env, jclass, jstring store) {
  const auto release = modar::installed_release(modar::android::text_of(env, store));
  return env->NewStringUTF(release ? std::to_string(release->version).c_str() : "none");
}

MODAR_FETCH(jboolean, verify)(JNIEnv* env, jclass, jstring store) {
  const auto report = modar::verify_store(modar::android::text_of(env, store));
  if (report) return report->fell_back ? JNI_TRUE : JNI_FALSE;
  modar::android::throw_fetch_error(env, report.error());
  return JNI_FALSE;
}
