// Which axis of a model points up, and how that is known.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

namespace modar {

/// An axis of the model's own coordinates.
enum class UpAxis : std::uint8_t { kX, kY, kZ, kMinusX, kMinusY, kMinusZ };

inline constexpr std::string_view kUpAxisNames[] = {"x", "y", "z", "-x", "-y", "-z"};

constexpr std::string_view up_axis_name(UpAxis axis) {
  return kUpAxisNames[static_cast<std::size_t>(axis)];
}

/// "y", "-z", "+y" and "Y"; nothing for other texts.
constexpr std::optional<UpAxis> up_axis_of(std::string_view name) {
  if (name.starts_with('+')) name.remove_prefix(1);
  for (std::size_t i = 0; i < std::size(kUpAxisNames); ++i) {
    const std::string_view known = kUpAxisNames[i];
    if (name.size() != known.size() || name.starts_with('-') != known.starts_with('-')) continue;
    if ((name.back() | 0x20) == known.back()) return static_cast<UpAxis>(i);
  }
  return std::nullopt;
}

/// How the axis is known, from the surest to the least sure.
enum class UpReason : std::uint8_t {
  kAsked,          ///< the user says it
  kStandard,       ///< the format prescribes it (glTF)
  kHeader,         ///< a comment of the file says it
  kGeoreferenced,  ///< map coordinates: two axes are far from the origin, the third is the height
  kGround,         ///< open ground, seen from above
  kBase,           ///< tall, and only one end is a base
  kConvention      ///< nothing says it: what most files of the format have
};

/// The axis that points up, as far as the file and its geometry say.
struct Upright {
  UpAxis axis = UpAxis::kY;
  UpReason reason = UpReason::kConvention;
};

/// For messages: "the geometry: a flat base".
constexpr std::string_view up_reason_words(UpReason reason) {
  constexpr std::string_view kWords[] = {"as asked",
                                         "the glTF standard",
                                         "the file's header",
                                         "map coordinates",
                                         "geometry: open ground",
                                         "geometry: a base",
                                         "the convention of its format"};
  return kWords[static_cast<std::size_t>(reason)];
}

}  // namespace modar
