// Draws and applies mutations.
#include "bake/lab/mutator.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>

#define XXH_INLINE_ALL
#include <xxhash.h>

namespace modar {
namespace {

constexpr std::size_t kMaxExtension = 64;

template <class T>
T load(const std::byte* place) {
  T value;
  std::memcpy(&value, place, sizeof(T));
  return value;
}

template <class T>
void store(std::byte* place, T value) {
  std::memcpy(place, &value, sizeof(T));
}

template <class T>
void set_extreme(std::byte* place, std::uint64_t pick) {
  using Limits = std::numeric_limits<T>;
  if constexpr (Limits::is_iec559) {
    const std::array<T, 8> values = {0,
                                     1,
                                     -1,
                                     Limits::infinity(),
                                     Limits::quiet_NaN(),
                                     Limits::max(),
                                     Limits::lowest(),
                                     Limits::denorm_min()};
    store(place, values[pick % values.size()]);
  } else {
    const std::array<T, 5> values = {0, 1, Limits::max(), static_cast<T>(Limits::max() - 1),
                                     static_cast<T>(Limits::max() / 2 + 1)};
    store(place, values[pick % values.size()]);
  }
}

template <class T>
void step(std::byte* place, std::uint64_t pick) {
  const T value = load<T>(place);
  const bool up = pick % 2 == 0;
  if constexpr (std::numeric_limits<T>::is_iec559) {
    const T far = std::numeric_limits<T>::infinity();
    store(place, std::nextafter(value, up ? far : -far));
  } else {
    store(place, static_cast<T>(up ? value + T{1} : value - T{1}));
  }
}

/// Calls `work` with a value of the field's type.
template <class Work>
void with_type(FieldType type, Work work) {
  switch (type) {
    case FieldType::kU8:
      return work(std::uint8_t{});
    case FieldType::kU16:
      return work(std::uint16_t{});
    case FieldType::kU32:
    case FieldType::kI32:
      return work(std::uint32_t{});
    case FieldType::kF32:
      return work(float{});
    case FieldType::kF64:
      return work(double{});
    default:
      return work(std::uint64_t{});
  }
}

}  // namespace

Mutator::Mutator(std::span<const std::byte> bytes, std::uint64_t seed)
    : bytes_(bytes.begin(), bytes.end()), size_(bytes.size()), whole_(bytes.size()), random_(seed) {
  const Result<BundleView> view = BundleView::open(bytes);
  section_count_ = view->sections().size();
  fields_ = mutation_fields(*view);
  head_.assign(bytes.begin(),
               bytes.begin() + static_cast<std::ptrdiff_t>(sizeof(FileHeader) +
                                                           section_count_ * sizeof(SectionEntry)));
  bytes_.resize(whole_ + kMaxExtension);
}

SectionEntry& Mutator::entry(std::size_t i) {
  return *reinterpret_cast<SectionEntry*>(bytes_.data() + sizeof(FileHeader) +
                                          i * sizeof(SectionEntry));
}

/// Makes the hashes of sections that touch [from, to) true, and then that of the header.
void Mutator::rehash(std::uint64_t from, std::uint64_t to) {
  auto& header = *reinterpret_cast<FileHeader*>(bytes_.data());
  const bool table = from < head_.size();
  for (std::size_t i = 0; i < section_count_; ++i) {
    SectionEntry& section = entry(i);
    if (section.offset > size_ || section.size > size_ - section.offset) continue;
    if (!table && (to <= section.offset || from >= section.offset + section.size)) continue;
    section.hash = XXH64(bytes_.data() + section.offset, section.size, 0);
  }
  XXH64_state_t state;
  XXH64_reset(&state, 0);
  XXH64_update(&state, bytes_.data(), offsetof(FileHeader, hash));
  const std::size_t room = (size_ - std::min(size_, sizeof(FileHeader))) / sizeof(SectionEntry);
  XXH64_update(&state, bytes_.data() + sizeof(FileHeader),
               std::min<std::size_t>(header.section_count, room) * sizeof(SectionEntry));
  header.hash = XXH64_digest(&state);
}

Mutation Mutator::next(bool rehashed) {
  // Fields are the many, the file as a whole is one thing.
  const std::uint64_t pick = draw(rehashed ? 32 : 8);
  Mutation mutation = pick == 0                ? truncate(rehashed)
                      : pick == 1              ? swap_sections(rehashed)
                      : !rehashed && pick == 2 ? extend()
                      : !rehashed && pick < 6  ? flip_bit()
                                               : edit_field(rehashed);
  mutation.rehashed = rehashed;
  if (!rehashed) mutation.kind += " unhashed";
  return mutation;
}

void Mutator::undo() {
  size_ = whole_;
  std::copy(saved_.begin(), saved_.end(), bytes_.begin() + static_cast<std::ptrdiff_t>(saved_at_));
  saved_.clear();
  std::copy(head_.begin(), head_.end(), bytes_.begin());
}

/// Changes one element and names the kind of change.
const char* Mutator::change(const MutationField& field, std::uint64_t place) {
  std::byte* at = bytes_.data() + place;
  const std::size_t size = field_element_bytes(field.type);
  const std::vector<std::byte> before(at, at + size);
  const char* kind = "field bit";
  const std::uint64_t pick = draw(5);
  if (pick == 1) {
    kind = "field extreme";
    with_type(field.type, [&](auto zero) { set_extreme<decltype(zero)>(at, random_()); });
  } else if (pick == 2) {
    kind = "field step";
    with_type(field.type, [&](auto zero) { step<decltype(zero)>(at, random_()); });
  } else if (pick == 3) {
    kind = "field random";
    store(at, static_cast<std::uint8_t>(random_()));
    for (std::size_t i = 1; i < size; ++i) store(at + i, static_cast<std::uint8_t>(random_()));
  } else if (pick == 4) {
    kind = "field copied";
    std::memcpy(at, bytes_.data() + field.place(draw(field.elements())), size);
  }
  if (!std::equal(before.begin(), before.end(), at)) return kind;
  const std::uint64_t bit = draw(8 * size);
  at[bit / 8] ^= std::byte{static_cast<unsigned char>(1u << (bit % 8))};
  return "field bit";
}

Mutation Mutator::edit_field(bool rehashed) {
  const MutationField* field = nullptr;
  do {
    field = &fields_[draw(fields_.size())];
  } while (rehashed && field->hash);
  Mutation mutation;
  mutation.field = field->name;
  mutation.offset = field->place(draw(field->elements()));
  const std::size_t size = field_element_bytes(field->type);
  const std::byte* at = bytes_.data() + mutation.offset;
  saved_at_ = mutation.offset;
  saved_.assign(at, at + size);
  mutation.before = saved_;
  mutation.kind = change(*field, mutation.offset);
  mutation.after.assign(at, at + size);
  if (rehashed) rehash(mutation.offset, mutation.offset + size);
  return mutation;
}

Mutation Mutator::flip_bit() {
  const std::uint64_t bit = draw(8 * std::uint64_t{whole_});
  Mutation mutation{"bit", "", bit / 8, {}, {}, false};
  std::byte& byte = bytes_[bit / 8];
  saved_at_ = bit / 8;
  saved_ = mutation.before = {byte};
  byte ^= std::byte{static_cast<unsigned char>(1u << (bit % 8))};
  mutation.after = {byte};
  return mutation;
}

/// Cuts the file; rehashed, header and section table state what is left.
Mutation Mutator::truncate(bool rehashed) {
  size_ = draw(whole_);
  Mutation mutation{"truncation", "", size_, {}, {}, false};
  if (!rehashed || size_ < head_.size()) return mutation;
  auto& header = *reinterpret_cast<FileHeader*>(bytes_.data());
  std::uint32_t kept = 0;
  std::uint64_t end = head_.size();
  for (std::size_t i = 0; i < section_count_; ++i) {
    SectionEntry& section = entry(i);
    if (section.offset >= size_) {
      section = SectionEntry{};
      continue;
    }
    section.size = std::min<std::uint64_t>(section.size, size_ - section.offset);
    end = section.offset + section.size;
    ++kept;
  }
  header.section_count = kept;
  header.file_size = size_ = end;
  rehash(0, size_);
  return mutation;
}

Mutation Mutator::extend() {
  const std::size_t more = 1 + draw(kMaxExtension);
  size_ = whole_ + more;
  return {"longer file", "", whole_, {}, {}, false};
}

/// Exchanges the bytes of two sections: in place where their sizes allow it, else their places.
Mutation Mutator::swap_sections(bool rehashed) {
  if (section_count_ < 2) return edit_field(rehashed);
  Mutation mutation{"sections swapped", "", 0, {}, {}, false};
  const std::size_t a = draw(section_count_);
  const std::size_t b = (a + 1 + draw(section_count_ - 1)) % section_count_;
  SectionEntry& one = entry(a);
  SectionEntry& two = entry(b);
  mutation.offset = one.offset;
  mutation.field = std::to_string(one.type) + " and " + std::to_string(two.type);
  std::swap(one.offset, two.offset);
  std::swap(one.size, two.size);
  if (draw(2) == 0) std::swap(one, two);  // the table stays in the order of places
  if (rehashed) rehash(0, size_);
  return mutation;
}

}  // namespace modar
