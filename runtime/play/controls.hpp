// What the user asked for with keys and clicks while the player runs.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include <glm/vec2.hpp>

#include "formats/bundle_view.hpp"
#include "modar/screen_machine.hpp"
#include "modar/tracker.hpp"

namespace modar {

enum class Act : std::uint8_t {
  kQuit,
  kNextModel,
  kPreviousModel,
  kNextPattern,
  kLarger,
  kSmaller,
  kDisplay,  ///< the on-screen display, on or off
  kOutline,  ///< outlines of patterns, on or off
  kPause,
  kFreeze,    ///< hold the frame and take four corners of a new pattern
  kSound,     ///< of videos and sounds, on or off
  kCaptions,  ///< on or off
  kLouder,
  kQuieter,
  kDown,  ///< the mouse's button
  kMove,  ///< with it
  kUp,
};

struct UserAct {
  Act act = Act::kQuit;
  glm::dvec2 at{0.0};    ///< of the mouse: picture pixels
  glm::dvec2 size{1.0};  ///< the picture's
};

class Controls {
 public:
  /// outline, display: what the command line says at the start.
  Controls(const BundleView& bundle, bool outline, bool display);

  void apply(const UserAct& act);
  /// Another version of the bundle: choices that it has no longer fall back to its scenes.
  void load(const BundleView& bundle);

  /// What to draw: each shown pattern's scenes and nodes, as its actions have left them, or the
  /// model that the user chose for it. events: taps, and what ended. states: one a pattern and
  /// copy, as Hysteresis answers. items: those of the frame before, on which clicks fall. Answers
  /// what the actions ask for. Allocates nothing once `items` has its room.
  std::span<const SceneCommand> collect(std::span<const Hysteresis::State> states, double time_s,
                                        std::span<const SceneEvent> events,
                                        std::vector<DrawItem>& items);
  /// Clicks since the last call, picture pixels; they live until the next one that is applied.
  std::span<const glm::dvec2> take_taps();
  /// The same where one pattern made on the spot is tracked: it bears the chosen model, else the
  /// first.
  void collect_spot(std::span<const Hysteresis::State> states, std::vector<DrawItem>& items) const;
  /// False for a pattern that the user switched away from.
  [[nodiscard]] bool wants(std::uint32_t pattern) const {
    return only_pattern_ == kNone || only_pattern_ == pattern;
  }

  [[nodiscard]] bool quit() const { return quit_; }
  [[nodiscard]] bool outline() const { return outline_; }
  [[nodiscard]] bool display() const { return display_; }
  /// Whether there are sound and captions.
  [[nodiscard]] const modar_status& status() const { return machine_->status(); }
  [[nodiscard]] float volume() const { return volume_; }  ///< 0 to 1
  /// The picture stands still: paused, or frozen for corners.
  [[nodiscard]] bool holds() const { return paused_ || frozen_; }
  [[nodiscard]] bool frozen() const { return frozen_; }
  [[nodiscard]] std::span<const glm::dvec2> corners() const {
    return {corners_.data(), corner_count_};
  }
  /// True once four corners stand: they are in corners(), and the picture continues.
  bool take_corners(std::array<glm::dvec2, 4>& corners);

 private:
  void touch(const UserAct& act);
  void turn_model(int step);
  void add_standard(const Hysteresis::State& state, std::uint32_t model,
                    std::vector<DrawItem>& items) const;

  std::span<const SceneCommand> act(std::span<const Hysteresis::State> states, double time_s,
                                    std::span<const SceneEvent> events);

  BundleView bundle_;
  std::unique_ptr<ScreenMachine> machine_;
  std::vector<SceneEvent> events_;
  std::array<glm::dvec2, 8> taps_{};  ///< in one frame's time
  std::size_t tap_count_ = 0;
  bool quit_ = false;
  bool outline_;
  bool display_;
  float volume_ = 1;
  bool paused_ = false;
  bool frozen_ = false;
  std::uint32_t model_ = kNone;         ///< kNone: as the scenes say
  std::uint32_t only_pattern_ = kNone;  ///< kNone: all of them
  std::array<glm::dvec2, 4> corners_{};
  std::size_t corner_count_ = 0;
};

}  // namespace modar
