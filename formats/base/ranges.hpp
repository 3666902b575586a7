// Algorithms on whole ranges by the names and parameters of std::ranges, which libc++ 13 lacks.
#pragma once

#include <algorithm>
#include <functional>
#include <iterator>

namespace modar::ranges {

template <class Range, class Test>
bool any_of(const Range& range, Test test) {
  return std::any_of(std::begin(range), std::end(range), test);
}
template <class Range, class Test>
bool all_of(const Range& range, Test test) {
  return std::all_of(std::begin(range), std::end(range), test);
}
template <class Range, class Test>
bool none_of(const Range& range, Test test) {
  return std::none_of(std::begin(range), std::end(range), test);
}
template <class Range, class Test>
auto find_if(Range&& range, Test test) {
  return std::find_if(std::begin(range), std::end(range), test);
}
template <class Range, class Value, class Part = std::identity>
auto find(Range&& range, const Value& value, Part part = {}) {
  return ranges::find_if(range, [&](const auto& e) { return std::invoke(part, e) == value; });
}
template <class Range, class Value, class Part = std::identity>
auto count(const Range& range, const Value& value, Part part = {}) {
  return std::count_if(std::begin(range), std::end(range),
                       [&](const auto& e) { return std::invoke(part, e) == value; });
}
template <class Range, class Out, class Change>
void transform(const Range& range, Out out, Change change) {
  std::transform(std::begin(range), std::end(range), out, change);
}
template <class Range, class Less = std::less<>, class Part = std::identity>
void sort(Range&& range, Less less = {}, Part part = {}) {
  std::sort(std::begin(range), std::end(range), [&](const auto& a, const auto& b) {
    return less(std::invoke(part, a), std::invoke(part, b));
  });
}
template <class Range, class Less, class Part>
void stable_sort(Range&& range, Less less, Part part) {
  std::stable_sort(std::begin(range), std::end(range), [&](const auto& a, const auto& b) {
    return less(std::invoke(part, a), std::invoke(part, b));
  });
}

}  // namespace modar::ranges
