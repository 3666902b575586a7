// The videos and sounds of a bundle, as its actions start and pause them. Desks only: the build of
// the device decodes nothing.
#pragma once

#include <memory>
#include <span>
#include <string_view>

#include "formats/action_machine.hpp"
#include "formats/bundle_view.hpp"
#include "screen.hpp"

namespace modar {

/// Plays by the time of frames, not by a clock: the same frames show the same pictures in each run.
class SceneMedia {
 public:
  SceneMedia() = default;
  SceneMedia(const SceneMedia&) = delete;
  SceneMedia& operator=(const SceneMedia&) = delete;
  virtual ~SceneMedia() = default;

  /// To a frame's time, seconds. Answers what came to its end (SceneEvent::kEnded), for the
  /// actions' step of that frame; valid until the next call.
  virtual std::span<const SceneEvent> advance(double time_s) = 0;
  /// What that step asked for. tapped: a click of the user was among its events, who may hear it.
  virtual void obey(std::span<const SceneCommand> commands, bool tapped) = 0;
  /// Brings the pictures of now to the screen. Errors: those of the library of media.
  virtual Result<void> show(Screen& screen) = 0;
  /// What is heard now, in one language; lines end with a line feed but the last.
  [[nodiscard]] virtual std::string_view caption() const = 0;
  /// The user's pause: nothing sounds. Time does not go on by itself.
  virtual void hold(bool on) = 0;
  /// What sounds, on or off; it is off at first. Nothing without setup.audible.
  virtual void set_sound(bool on) = 0;
  [[nodiscard]] virtual bool sound() const = 0;
  /// 0 to 1.
  virtual void set_volume(float volume) = 0;
};

struct SceneMediaSetup {
  bool audible = false;  ///< frames come at their own time: what is heard fits them
  bool sound = false;    ///< from the start
};

/// Null where the bundle has no videos and sounds, and in the build of the device. The bundle's
/// bytes outlive it.
std::unique_ptr<SceneMedia> open_scene_media(const BundleView& bundle,
                                             const SceneMediaSetup& setup);

}  // namespace modar
