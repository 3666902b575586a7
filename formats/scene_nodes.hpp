// A pattern's content other than plain models, and its actions: named nodes (models,
// planes, labels, sounds) and actions. action_machine.hpp runs them.
#pragma once

#include <cstdint>

#include "formats/layout.hpp"

namespace modar {

/// Bounds the work of a frame and the memory of a machine: a device of 2012 steps through this many
/// in less than 0.1 ms.
inline constexpr std::uint32_t kMostNodes = 1024;
inline constexpr std::uint32_t kMostActions = 256;
inline constexpr float kMostSeconds = 86400.0f;  ///< a day: longer delays were never meant
inline constexpr float kMostDegrees = 36000.0f;  ///< a hundred turns

enum class NodeKind : std::uint32_t {
  kModel = 1,    ///< a scene's model
  kPicture = 2,  ///< a rectangle that shows a texture
  kLabel = 3,    ///< a point with a mark, and words in the meta text
  kVideo = 4,    ///< a rectangle that shows a video
  kSound = 5,    ///< is heard, not seen
};

/// Where a video is seen through.
enum class VideoAlpha : std::uint32_t {
  kOpaque = 0,
  kBeside = 1,  ///< the right half of its pictures is the left half's alpha
  kKey = 2,     ///< where it has a colour near the key
};

enum class MediaKind : std::uint32_t { kVideo = 1, kSound = 2 };

/// A file that apps decode. Its bytes are in the kMediaData section.
struct MediaRecord {
  NameRef name;
  std::uint32_t kind;   ///< MediaKind
  std::uint32_t flags;  ///< MediaFlags
  std::uint32_t width;  ///< pixels; of a sound 0
  std::uint32_t height;
  float seconds;
  std::uint32_t poster;  ///< index of the texture that shows its first picture; of a sound kNone
  std::uint32_t reserved[4];
};
static_assert(sizeof(MediaRecord) == 48);
inline constexpr std::uint32_t kMostVideoWidth = 1280;  ///< of the tier `desktop`
inline constexpr std::uint32_t kMostVideoHeight = 720;

inline constexpr std::uint32_t kMaxMarkBytes = 32;  ///< of a label: a number or a short word

/// A named part of a pattern's content.
struct NodeRecord {
  NameRef name;  ///< not empty; no other node of the pattern has it
  std::uint32_t pattern;
  std::uint32_t kind;     ///< NodeKind
  std::uint32_t subject;  ///< index of a model's scene, a picture's texture, the record of a video
                          ///< or sound; else kNone
  std::uint32_t flags;    ///< NodeFlags
  std::uint32_t group;    ///< nodes of a pattern with one group are variants; 0: none
  float place[3];         ///< pattern units: a plane's middle, a label's point; of a model 0
  float rotation[4];      ///< unit quaternion x, y, z, w: plane axes to pattern axes
  float half_size[2];     ///< pattern units, of a plane; else 0
  NameRef mark;           ///< a label's number or short word; else empty
  std::uint32_t alpha;    ///< VideoAlpha of a video; else 0
  float key[3];           ///< red, green, blue of kKey, 0 to 1; else 0
  float reach;            ///< of kKey: how far from the key a colour may be, 0 to 1; else 0
  std::uint32_t reserved;
};
static_assert(sizeof(NodeRecord) == 96);

constexpr bool kind_is(const NodeRecord& node, NodeKind kind) {
  return node.kind == static_cast<std::uint32_t>(kind);
}

/// Has a file that is played.
constexpr bool plays_media(const NodeRecord& node) {
  return kind_is(node, NodeKind::kVideo) || kind_is(node, NodeKind::kSound);
}

enum class ActionEvent : std::uint32_t { kFound = 1, kLost = 2, kTap = 3, kAfter = 4 };
enum class ActionCommand : std::uint32_t {
  kPlay = 1,
  kPause = 2,
  kShow = 3,
  kHide = 4,
  kToggle = 5,
  kText = 6,  ///< the words of a label are shown
  kLink = 7,  ///< the visitor decides whether to go there
  kNext = 8,  ///< the next variant of the target's group takes the place of the one that is shown
  kTurn = 10,
  kClip = 11,      ///< since 1.4: the model of the target plays a clip, again and again
  kClipOnce = 12,  ///< the same, and its last pose stays
  kStop = 13,      ///< the present pose stays
};

/// Names a clip.
constexpr bool plays_clip(std::uint32_t command) {
  return command == static_cast<std::uint32_t>(ActionCommand::kClip) ||
         command == static_cast<std::uint32_t>(ActionCommand::kClipOnce);
}

/// The reaction to an event.
struct ActionRecord {
  std::uint32_t event;    ///< ActionEvent
  std::uint32_t command;  ///< ActionCommand
  std::uint32_t source;   ///< of a tap the node, else the pattern
  std::uint32_t target;   ///< node of the source's pattern; of a link kNone
  NameRef part;           ///< of a tap on a model: the material that is tapped; empty: any
  NameRef address;        ///< of a link: "https://..."; the name of a clip; else empty
  float seconds;          ///< of kAfter: the delay; else 0
  float duration;         ///< of a turn: seconds that it takes; else 0
  float axis[3];  ///< of a turn: unit length, pattern axes, through the node's place; else 0
  float degrees;  ///< of a turn; else 0
  std::uint32_t reserved[2];
};
static_assert(sizeof(ActionRecord) == 64);

}  // namespace modar
