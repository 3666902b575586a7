// The one error type of the project, and the exit codes that programs answer with.
#pragma once

#include <cstdint>
#include <initializer_list>
#include <string>
#include <string_view>
#include <utility>

#include <tl/expected.hpp>

#include "formats/base/utf8.hpp"

namespace modar {

/// The exit code of our programs. Commands document their own codes from 10 up.
enum class ExitCode : int {
  kOk = 0,
  kUsage = 1,         ///< the command line is wrong
  kIo = 2,            ///< a file cannot be opened, read, written or renamed
  kInvalidInput = 3,  ///< a file was read and is invalid
  kInternal = 4,      ///< a defect of ModAR or of a library
  kUnsupported = 5,   ///< valid, but beyond this build, this device or this version
};

/// An error a person can act on. `code` is stable ("bundle.truncated"), `where` names the file with
/// its line or byte offset, `cause` states the finding, `cure` the remedy.
struct Error {
  ExitCode exit = ExitCode::kInternal;
  std::string code;
  std::string where;
  std::string cause;
  std::string cure;
};

template <class T>
using Result = tl::expected<T, Error>;

/// The text with each {} replaced by the next of the numbers.
std::string with_numbers(std::string_view text, std::initializer_list<std::uint64_t> numbers);

/// Shorthand for `return fail(ExitCode::kIo, "io.open", path, "...", "...");`
/// Takes views: a call that makes four strings itself takes 150 bytes more.
tl::unexpected<Error> fail(ExitCode exit, std::string_view code, std::string_view where,
                           std::string_view cause, std::string_view cure);

/// Becomes a Result of any type with this error.
struct PassedError {
  Error& error;
  template <class T>
  operator Result<T>() const {  // NOLINT(google-explicit-constructor): what a return needs
    return Result<T>(tl::unexpect, std::move(error));
  }
};

/// Returns the error of a Result from the calling function, which returns a Result too; discards a
/// value.
#define MODAR_TRY(...) MODAR_TRY_AS(MODAR_JOIN(modar_result_, __COUNTER__), (__VA_ARGS__))

/// The same, and declares the value otherwise: MODAR_ASSIGN(const Image image, read_image(path));
/// Not for the single statement of an `if` or a loop without braces.
#define MODAR_ASSIGN(declaration, ...) \
  MODAR_ASSIGN_AS(MODAR_JOIN(modar_result_, __COUNTER__), declaration, (__VA_ARGS__))

#define MODAR_JOIN(a, b) MODAR_JOIN_NOW(a, b)
#define MODAR_JOIN_NOW(a, b) a##b  // NOLINTBEGIN(bugprone-macro-parentheses): declarations
#define MODAR_TRY_AS(result, expression)                                                \
  do {                                                                                  \
    if (auto result = expression; !result) return ::modar::PassedError{result.error()}; \
  } while (false)
#define MODAR_ASSIGN_AS(result, declaration, expression)    \
  auto result = expression;                                 \
  if (!result) return ::modar::PassedError{result.error()}; \
  declaration = std::move(*result)  // NOLINTEND(bugprone-macro-parentheses)

/// One line for a terminal: "where: cause; cure [code]".
std::string to_line(const Error& error);

}  // namespace modar
