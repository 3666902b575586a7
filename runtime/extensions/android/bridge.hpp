// What both halves of the bridge share: Java's exceptions out of our errors, Java's strings and
// arrays.
#pragma once

#include <string>

#include <jni.h>

#include "modar/modar.h"

namespace modar::android {

/// Throws org.modar.ModarException with the error's parts; Java sees it when the native call
/// returns.
void throw_error(JNIEnv* env, const modar_error& error);
void throw_error(JNIEnv* env, int status, const char* code, const char* where, const char* cause,
                 const char* cure);

/// Modified UTF-8, which is UTF-8 for what paths and names hold; empty for null.
std::string text_of(JNIEnv* env, jstring text);

}  // namespace modar::android
