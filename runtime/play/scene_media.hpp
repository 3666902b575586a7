// Requests of a bundle's actions other than drawing: its videos and sounds, and words for the
// user. Desks only: the build of the device decodes and tells nothing.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "controls.hpp"
#include "formats/action_machine.hpp"
#include "formats/bundle_view.hpp"
#include "frame_report.hpp"
#include "screen.hpp"

namespace modar {

/// Plays by the time of frames, not by a clock: the same frames show the same pictures in each run.
class SceneMedia {
 public:
  SceneMedia() = default;
  SceneMedia(const SceneMedia&) = delete;
  SceneMedia& operator=(const SceneMedia&) = delete;
  virtual ~SceneMedia() = default;

  /// To a frame's time, seconds: appends what came to its end for the actions' step of that frame.
  virtual void advance(double time_s, std::vector<SceneEvent>& events) = 0;
  /// What that step asked for, and what the user asks of sounds and captions. Answers the frame's
  /// log, which lives until the next call.
  virtual const SceneState& execute(std::span<const SceneCommand> commands,
                                    const Controls& controls) = 0;
  /// Updates the pictures and the caption on the screen. Errors: those of the library of
  /// media.
  virtual Result<void> show(Screen& screen) = 0;
  /// The user's pause: nothing sounds. Time does not advance by itself.
  virtual void hold(bool on) = 0;
};

struct SceneMediaSetup {
  bool audible = false;  ///< frames come at their own time: the sound fits them
  bool sound = false;    ///< from the start
};

/// Null where the bundle has no nodes, and in the build of the device. The bundle's bytes outlive
/// it.
std::unique_ptr<SceneMedia> open_scene_media(const BundleView& bundle,
                                             const SceneMediaSetup& setup);

}  // namespace modar
