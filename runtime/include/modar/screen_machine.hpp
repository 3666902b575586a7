// The screen of modar.h, whose functions and structures of the same names apply: the same on the
// page, in the app and in the player.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "formats/action_machine.hpp"
#include "modar/modar.h"
#include "modar/renderer.hpp"

namespace modar {

class ScreenMachine {
 public:
  /// bundle: opened; its bytes outlive the machine.
  explicit ScreenMachine(const BundleView& bundle);
  /// What the visitor has chosen with a machine of another version of the bundle.
  void inherit(const ScreenMachine& before) {
    turntable_ = before.turntable_;
    status_ = before.status_;
    asked_ = before.asked_;
  }

  /// Numbers are finite, structures of this version's size.
  int touch(const modar_touch& touch);
  void press(int button, double steps);
  void reset();
  void look_around(std::uint32_t pattern, double time_s, bool presents);
  void follow(double time_s, std::uint32_t number, int reason, double brightness);
  modar_turntable turntable(double time_s);
  [[nodiscard]] const modar_status& status() const { return status_; }
  std::span<const SceneCommand> step(double time_s, std::span<const SceneEvent> events);
  [[nodiscard]] bool waiting() const;
  [[nodiscard]] bool shown(std::uint32_t node) const { return actions_.shown(node); }

  /// Of a scene of the bundle; false for a clip that is not of its model.
  bool play(std::uint32_t scene, std::uint32_t clip, bool loops, double blend_s);
  void stop(std::uint32_t scene);
  /// The clip that moves a scene's model, or kNone.
  [[nodiscard]] std::uint32_t playing(std::uint32_t scene) const;
  /// As ClipPlayer::bones(), at the time of the last step.
  [[nodiscard]] std::span<const BoneMatrix> bones(std::uint32_t scene) const;

  void add_pattern(std::uint32_t scene) { own_.push_back(scene); }
  void forget_patterns() { own_.clear(); }
  /// What of a pattern is shown, as add_items(), and placed.
  void add_items(std::uint32_t pattern, const glm::mat4& view, std::vector<DrawItem>& items) const;
  /// Turns and sizes models about their feet on the pattern, as the visitor wants them, and sets
  /// them before the eye. items: with to_eye to the pattern's space.
  void place(const glm::mat4& view, std::span<DrawItem> items) const;

 private:
  struct Finger {
    bool down = false;
    int number = 0;
    double x = 0;
    double y = 0;
  };

  /// The clip of a scene's model.
  struct Motion {
    ClipPlayer player;
    bool begun = false;  ///< its pattern was seen
    bool fresh = false;  ///< the app has begun a clip since the last step
    bool seen = false;   ///< in the last step
  };

  void limit();
  void act_clip(const ActionRecord& action);
  void step_clips(std::span<const SceneEvent> events);
  void begin_clip(std::uint32_t scene);
  [[nodiscard]] bool shows(const SceneEvent& event, std::uint32_t scene) const;

  BundleView bundle_;
  ActionMachine actions_;
  std::vector<std::uint32_t> own_;  ///< scenes of further patterns
  std::vector<Motion> motions_;     ///< one a scene; none at all where nothing moves
  double clip_time_ = 0;            ///< seconds: the last step's
  modar_turntable turntable_ = start();
  modar_status status_{sizeof status_, MODAR_STATE_START, MODAR_HINT_LOOK, 0, 0, 0, 1};
  std::array<Finger, 2> fingers_;
  Finger first_;           ///< as it came down
  bool tap_ = false;       ///< a single finger is where it came down
  bool asked_ = false;     ///< the visitor has said whether there is to be sound
  bool presents_ = false;  ///< the first turn is under way
  double since_ = 0;       ///< seconds: it began, or a pattern was shown last

  /// As the page shows things on a table: from 32 degrees.
  static modar_turntable start() { return {sizeof(modar_turntable), 0, 0.5585053606381855, 1}; }
};

}  // namespace modar
