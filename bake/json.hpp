// JSON of the workstation: a value that is built like a literal, written as text and read back.
// nlohmann/json is known to json.cpp alone: a file that includes it takes seconds to compile.
#pragma once

#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

namespace modar {

/// null, a truth value, a number, a text, an array, or an object whose keys keep their order.
class Json {
 public:
  using Member = std::pair<std::string, Json>;

  Json(std::nullptr_t = nullptr);  // NOLINT: literals convert to values
  Json(std::string_view text);     // NOLINT
  Json(const std::string& text) : Json(std::string_view(text)) {}  // NOLINT
  Json(const char* text) : Json(std::string_view(text)) {}         // NOLINT
  template <class T>
  requires std::is_arithmetic_v<T> Json(T number) : Json(Number{}, widest(number)) {}  // NOLINT
  /// An object: {{"key", value}, ...}.
  Json(std::initializer_list<Member> members);
  Json(const Json& other);
  Json(Json&& other) noexcept;
  Json& operator=(Json other) noexcept;
  ~Json();

  static Json object();
  static Json array(std::initializer_list<Json> elements = {});
  /// An array of a container's elements.
  template <class Range>
  static Json list(const Range& range) {
    Json elements = array();
    for (const auto& element : range) elements.push_back(element);
    return elements;
  }

  /// An array of what `make` makes of each.
  template <class Range, class Make>
  static Json list(const Range& range, const Make& make) {
    Json elements = array();
    for (const auto& element : range) elements.push_back(make(element));
    return elements;
  }

  /// To an array.
  void push_back(Json element);
  /// To an object, in place of what the key had.
  void set(std::string_view key, Json value);

  [[nodiscard]] bool is_null() const;
  /// Elements of an array, members of an object; else 0.
  [[nodiscard]] std::size_t size() const;
  /// Of an object's members; empty for anything else.
  [[nodiscard]] std::vector<std::string> keys() const;
  /// An element of an array. Nothing: it is absent, or this is no array.
  [[nodiscard]] std::optional<Json> at(std::size_t index) const;
  /// A member of an object; "a/b" is b of a. Nothing: it is absent.
  [[nodiscard]] std::optional<Json> find(std::string_view path) const;
  /// The same two, null where it is absent.
  Json operator[](std::size_t index) const { return at(index).value_or(nullptr); }
  Json operator[](std::string_view path) const { return find(path).value_or(nullptr); }
  /// Of an array; empty for anything else.
  [[nodiscard]] std::vector<Json> elements() const;
  /// A member's text or number; "" and 0 where it is absent or of another type.
  [[nodiscard]] std::string text_at(std::string_view path) const;
  [[nodiscard]] double number_at(std::string_view path) const;
  /// Nothing where this is of another type; a count is a number without sign or fraction.
  [[nodiscard]] std::optional<double> number() const;
  [[nodiscard]] std::optional<std::uint64_t> count() const;
  [[nodiscard]] std::optional<std::string> text() const;
  [[nodiscard]] std::optional<bool> truth() const;
  [[nodiscard]] bool is_array() const;

  /// Indented, with a line break at its end. Infinities become null, bytes that are no UTF-8 are
  /// replaced: nothing is thrown at.
  [[nodiscard]] std::string dump() const;
  /// null where the text is no JSON.
  static Json parse(std::string_view text);
  static Json parse(std::span<const std::byte> text) {
    return parse(std::string_view(reinterpret_cast<const char*>(text.data()), text.size()));
  }

 private:
  struct Value;
  struct Number {};
  template <class T>
  static auto widest(T number) {
    if constexpr (std::is_same_v<T, bool>) {
      return number;
    } else if constexpr (std::is_floating_point_v<T>) {
      return static_cast<double>(number);
    } else if constexpr (std::is_signed_v<T>) {
      return static_cast<std::int64_t>(number);
    } else {
      return static_cast<std::uint64_t>(number);
    }
  }
  Json(Number, bool truth);
  Json(Number, double number);
  Json(Number, std::int64_t number);
  Json(Number, std::uint64_t number);

  std::unique_ptr<Value> value_;  ///< never empty, except after a move
};

}  // namespace modar
