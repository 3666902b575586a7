// Runs a bundle's actions: detections and taps in, the nodes' looks and the app's commands out.
// *Nodes and actions* of bundle.md specifies it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "formats/bundle_view.hpp"

namespace modar {

/// A pattern counts as lost when it was not seen for so long, seconds: a hand before the camera
/// stops nothing.
inline constexpr double kLostAfterSeconds = 1.0;

/// What happened since the last step.
struct SceneEvent {
  enum class Kind : std::uint8_t {
    kSeen,  ///< the pattern is on the screen
    kTap,   ///< the visitor tapped a node
    kEnded  ///< a video or sound that does not loop is at its end
  };
  Kind kind = Kind::kSeen;
  std::uint32_t subject = 0;       ///< index of the pattern, or of the node
  std::uint32_t material = kNone;  ///< of a tap on a model: the one that is there, absolute
};

/// What the app has to do; shown() and turn_of() return the nodes' own state.
struct SceneCommand {
  ActionCommand command = ActionCommand::kText;  ///< kPlay, kPause, kText or kLink
  std::uint32_t node = kNone;                    ///< the video or sound, the label
  std::uint32_t action = kNone;                  ///< index of the action; kNone: a label's own
};

/// A unit quaternion.
struct NodeTurn {
  float x = 0.0f;
  float y = 0.0f;
  float z = 0.0f;
  float w = 1.0f;
};

class ActionMachine {
 public:
  /// bundle: opened; its bytes outlive the machine.
  explicit ActionMachine(const BundleView& bundle);

  /// To time_s, seconds, which must not fall: an earlier one counts as the last one. The answer
  /// lives until the next step. Allocates nothing. Events of subjects that are not there do
  /// nothing.
  std::span<const SceneCommand> step(double time_s, std::span<const SceneEvent> events);

  /// Of the last step: actions that begin or stop clips, in their order. ScreenMachine does that.
  [[nodiscard]] std::span<const std::uint32_t> clips() const { return clips_; }

  /// As at the start.
  void reset();

  /// node < bundle.nodes().size().
  [[nodiscard]] bool shown(std::uint32_t node) const { return nodes_[node].shown; }
  /// How actions have turned it, about its place, in pattern axes.
  [[nodiscard]] NodeTurn turn_of(std::uint32_t node) const;
  /// A turn is under way, or a delay of a pattern that is there: the nodes change though no frame
  /// comes.
  [[nodiscard]] bool waiting() const;

 private:
  struct Pattern {
    bool present = false;
    double seen = 0;   ///< time of the last detection
    double since = 0;  ///< time at which it was found
  };
  struct Node {
    bool shown = true;
    bool wanted = false;         ///< a video or sound is to play while its pattern is there
    bool playing = false;        ///< as reported to the app
    bool told = false;           ///< its words, in this step
    NodeTurn base;               ///< where its last turn began
    double start = 0;            ///< of that turn, seconds
    std::uint32_t turn = kNone;  ///< the action of that turn
  };

  void fire(ActionEvent event, std::uint32_t source, std::uint32_t material);
  void tap(const SceneEvent& event);
  void play();
  void perform(std::uint32_t action);
  void show_next(std::uint32_t target);
  [[nodiscard]] bool named(const ActionRecord& action, std::uint32_t material) const;
  [[nodiscard]] double turned_share(const Node& node) const;

  BundleView bundle_;
  std::vector<Pattern> patterns_;
  std::vector<Node> nodes_;
  /// One an action: 1 in the step in which it fires; of delays, since the pattern was found.
  std::vector<std::uint8_t> fired_;
  std::vector<std::uint32_t> clips_;
  std::vector<SceneCommand> commands_;  ///< room for all actions, each node twice
  std::size_t command_count_ = 0;
  double now_ = 0;
};

}  // namespace modar
