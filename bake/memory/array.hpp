// An array for very many plain elements, which grows without holding two copies of itself.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <initializer_list>
#include <type_traits>
#include <utility>

namespace modar {

/// Blocks of at least this many bytes have their own pages, which are remapped as they grow;
/// smaller ones are the heap's.
inline constexpr std::size_t kLargeBlock = std::size_t{4} << 20;

namespace detail {
/// Throws std::bad_alloc; ends the program where exceptions are off.
[[noreturn]] void out_of_memory();
/// Memory of `size` bytes with the first bytes of `block` (nullptr: none), which had `old_size`.
void* resize_block(void* block, std::size_t old_size, std::size_t size);
void free_block(void* block, std::size_t size);
/// Makes the pages of bytes [from, to) of a block resident, and some behind them, with one call of
/// the system where writing to each would interrupt the program. Changes nothing else, and nothing
/// at all where the system or the block's kind do not allow it.
void touch_pages(void* block, std::size_t size, std::size_t from, std::size_t to);
}  // namespace detail

/// Like std::vector for trivially copyable elements, with two differences that large models need:
/// growing remaps pages instead of copying them where the system can, and resize() leaves new
/// elements uninitialised. Out of memory is std::bad_alloc.
template <class T>
class Array {
  static_assert(std::is_trivially_copyable_v<T>);
  static_assert(alignof(T) <= alignof(std::max_align_t));

 public:
  using value_type = T;
  using iterator = T*;
  using const_iterator = const T*;

  Array() = default;
  explicit Array(std::size_t size) { resize(size); }
  Array(std::size_t size, const T& value) { assign(size, value); }
  Array(std::initializer_list<T> values) { append(values.begin(), values.size()); }
  Array(const Array& other) { append(other.data(), other.size()); }
  Array(Array&& other) noexcept { swap(other); }
  Array& operator=(Array other) noexcept {
    swap(other);
    return *this;
  }
  ~Array() { detail::free_block(static_cast<void*>(data_), capacity_ * sizeof(T)); }

  [[nodiscard]] std::size_t size() const { return size_; }
  [[nodiscard]] bool empty() const { return size_ == 0; }
  [[nodiscard]] T* data() { return data_; }
  [[nodiscard]] const T* data() const { return data_; }
  T& operator[](std::size_t i) { return data_[i]; }
  const T& operator[](std::size_t i) const { return data_[i]; }
  T& back() { return data_[size_ - 1]; }
  const T& back() const { return data_[size_ - 1]; }
  T* begin() { return data_; }
  T* end() { return data_ + size_; }
  const T* begin() const { return data_; }
  const T* end() const { return data_ + size_; }

  void reserve(std::size_t capacity) {
    if (capacity > capacity_) reallocate(capacity);
  }
  /// New elements are not initialised.
  void resize(std::size_t size) {
    if (size > capacity_) reallocate(std::max(size, capacity_ + capacity_ / 2));
    size_ = size;
  }
  void assign(std::size_t size, const T& value) {
    size_ = 0;
    resize(size);
    std::fill_n(data_, size, value);
  }
  void push_back(const T& value) {
    const T copy = value;
    resize(size_ + 1);
    data_[size_ - 1] = copy;
  }
  /// values must not be in this array.
  void append(const T* values, std::size_t count) {
    if (count == 0) return;
    resize(size_ + count);
    detail::touch_pages(static_cast<void*>(data_), capacity_ * sizeof(T),
                        (size_ - count) * sizeof(T), size_ * sizeof(T));
    std::memcpy(static_cast<void*>(data_ + size_ - count), values, count * sizeof(T));
  }
  void append(std::size_t count, const T& value) {
    resize(size_ + count);
    std::fill_n(data_ + size_ - count, count, value);
  }
  /// Releases the memory beyond the last element.
  void shrink() {
    if (size_ == 0) {
      Array().swap(*this);
    } else if (capacity_ != size_) {
      reallocate(size_);
    }
  }
  /// Clears the array and releases its memory.
  void release() { Array().swap(*this); }
  /// The same memory as fewer, larger elements: T is an array of U.
  template <class U>
  static Array regroup(Array<U>&& small) {
    static_assert(sizeof(T) % sizeof(U) == 0 && alignof(T) == alignof(U));
    constexpr std::size_t kEach = sizeof(T) / sizeof(U);
    Array result;
    // The capacity has to stay the block's size in bytes.
    small.reallocate((small.capacity_ + kEach - 1) / kEach * kEach);
    result.size_ = small.size_ / kEach;
    result.capacity_ = small.capacity_ / kEach;
    result.data_ = reinterpret_cast<T*>(std::exchange(small.data_, nullptr));
    small.size_ = small.capacity_ = 0;
    return result;
  }
  /// The same memory as more, smaller elements, whose values the caller has put there.
  template <class U>
  static Array split(Array<U>&& large) {
    static_assert(sizeof(U) % sizeof(T) == 0 && alignof(T) <= alignof(U));
    constexpr std::size_t kEach = sizeof(U) / sizeof(T);
    Array result;
    result.size_ = large.size_ * kEach;
    result.capacity_ = large.capacity_ * kEach;
    result.data_ = reinterpret_cast<T*>(std::exchange(large.data_, nullptr));
    large.size_ = large.capacity_ = 0;
    return result;
  }
  void swap(Array& other) noexcept {
    std::swap(data_, other.data_);
    std::swap(size_, other.size_);
    std::swap(capacity_, other.capacity_);
  }

  friend bool operator==(const Array& a, const Array& b) {
    return a.size_ == b.size_ && std::equal(a.begin(), a.end(), b.begin());
  }

 private:
  template <class U>
  friend class Array;

  void reallocate(std::size_t capacity) {
    if (capacity > static_cast<std::size_t>(-1) / 2 / sizeof(T)) detail::out_of_memory();
    data_ = static_cast<T*>(detail::resize_block(static_cast<void*>(data_), capacity_ * sizeof(T),
                                                 capacity * sizeof(T)));
    capacity_ = capacity;
  }

  T* data_ = nullptr;
  std::size_t size_ = 0;
  std::size_t capacity_ = 0;
};

}  // namespace modar
