// Gestures, and what they do to a pattern's items.
#include "modar/screen_machine.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

namespace modar {
namespace {

constexpr double kDegree = 3.14159265358979323846 / 180;
/// A finger that moves less than this share of the screen's smaller side taps.
constexpr double kSlip = 0.015;
/// Radians a press.
constexpr double kTurnStep = 10 * kDegree;
constexpr double kSizeStep = 0.1;
constexpr double kLeastZoom = 0.2;
constexpr double kMostZoom = 5;
/// Radians: not from below the pattern, and not so high that "up" is lost.
constexpr double kLeastTilt = 8 * kDegree;
constexpr double kMostTilt = 86 * kDegree;
/// Seconds of the first turn. Anything that moves longer needs a button to pause it.
constexpr double kPresentSeconds = 4;
/// Seconds without a pattern until the visitor reads why. Shorter ones flicker.
constexpr double kPatience = 0.9;
/// Seconds of searching after which "go closer" is the likeliest advice.
constexpr double kFar = 5;
/// Mean gray value below which a room is called dark.
constexpr double kDarkRoom = 35;

/// Squares of screens do not overflow: without the care, and the bytes, of hypot().
double length(double x, double y) {
  return std::sqrt(x * x + y * y);
}

/// By reason; LOOK becomes CLOSER in time.
constexpr std::uint8_t kHints[] = {
    MODAR_HINT_LOOK,    MODAR_HINT_LOOK,    MODAR_HINT_LOOK,   MODAR_HINT_LOOK,   MODAR_HINT_HOLD,
    MODAR_HINT_BLURRED, MODAR_HINT_OUTSIDE, MODAR_HINT_LOOK,   MODAR_HINT_FLAT,   MODAR_HINT_CLOSER,
    MODAR_HINT_DARK,    MODAR_HINT_BLURRED, MODAR_HINT_BRIGHT, MODAR_HINT_BRIGHT, MODAR_HINT_WHOLE};
static_assert(std::size(kHints) == MODAR_REASON_AT_THE_EDGE + 1);

int hint_for(int reason, double unseen) {
  const bool known = reason >= 0 && reason <= MODAR_REASON_AT_THE_EDGE;
  const int hint = kHints[known ? reason : MODAR_REASON_NOT_IN_VIEW];
  const bool far = hint == MODAR_HINT_LOOK && reason != MODAR_REASON_ANOTHER_PRINT && unseen > kFar;
  return far ? MODAR_HINT_CLOSER : hint;
}

}  // namespace

ScreenMachine::ScreenMachine(const BundleView& bundle) : bundle_(bundle), actions_(bundle) {
  if (bundle.moving_parts().empty()) return;
  for (const SceneRecord& scene : bundle.scenes()) {
    motions_.push_back({ClipPlayer(bundle, scene.model)});
  }
}

int ScreenMachine::touch(const modar_touch& touch) {
  const auto has = [&touch](const Finger& each) {
    return each.down && each.number == touch.finger;
  };
  const bool second = has(fingers_[1]) || (!has(fingers_[0]) && fingers_[0].down);
  Finger& finger = fingers_[second ? 1 : 0];
  const Finger& other = fingers_[second ? 0 : 1];
  const bool known = has(finger);
  const bool down = touch.kind == MODAR_TOUCH_DOWN;
  const bool moved = touch.kind == MODAR_TOUCH_MOVE;
  if (down) tap_ = !other.down;
  if (known == down) return MODAR_NOTHING;  // it came twice, or never
  if (down) {
    if (!finger.down) finger = first_ = {true, touch.finger, touch.x, touch.y};
    return MODAR_NOTHING;
  }
  const double slip = kSlip * std::min(touch.width, touch.height);
  tap_ = tap_ && length(touch.x - first_.x, touch.y - first_.y) <= slip;
  if (!moved) {
    finger.down = false;
    return std::exchange(tap_, false) && touch.kind == MODAR_TOUCH_UP ? MODAR_TAPPED
                                                                      : MODAR_NOTHING;
  }
  if (tap_) return MODAR_NOTHING;
  const double before = length(finger.x - other.x, finger.y - other.y);
  if (!other.down) {
    turntable_.turn += 360 * kDegree * (touch.x - finger.x) / touch.width;
    turntable_.tilt += 180 * kDegree * (touch.y - finger.y) / touch.height;
  } else if (before > 0) {
    turntable_.zoom *= length(touch.x - other.x, touch.y - other.y) / before;
  }
  finger.x = touch.x;
  finger.y = touch.y;
  limit();
  return MODAR_MOVED;
}

void ScreenMachine::press(int button, double steps) {
  const double change = 1 + kSizeStep * std::abs(steps);
  if (button == MODAR_TURN) turntable_.turn += kTurnStep * steps;
  if (button == MODAR_TILT) turntable_.tilt += kTurnStep * steps;
  if (button == MODAR_SIZE) turntable_.zoom *= steps > 0 ? change : 1 / change;
  if (button == MODAR_RESET) turntable_ = start();
  if (button <= MODAR_RESET) return limit();
  asked_ = asked_ || button == MODAR_SOUND;
  int& state = button == MODAR_SOUND    ? status_.sound
               : button == MODAR_PAUSED ? status_.paused
                                        : status_.captions;
  state = 1 - state;
}

/// Nothing moves by itself any more.
void ScreenMachine::limit() {
  presents_ = false;
  turntable_.turn -= 360 * kDegree * std::floor(turntable_.turn / (360 * kDegree));
  turntable_.tilt = std::clamp(turntable_.tilt, kLeastTilt, kMostTilt);
  turntable_.zoom = std::clamp(turntable_.zoom, kLeastZoom, kMostZoom);
}

/// Switches stay as the visitor has set them.
void ScreenMachine::reset() {
  actions_.reset();
  for (Motion& motion : motions_) {
    motion.player.reset();
    motion.begun = motion.seen = false;
  }
  turntable_ = start();
  fingers_ = {};
  tap_ = presents_ = false;
  status_.state = MODAR_STATE_START;
  status_.hint = MODAR_HINT_LOOK;
  status_.pattern = 0;
}

void ScreenMachine::look_around(std::uint32_t pattern, double time_s, bool presents) {
  reset();
  status_.state = MODAR_STATE_AROUND;
  status_.pattern = pattern + 1;
  presents_ = presents;
  since_ = time_s;
}

void ScreenMachine::follow(double time_s, std::uint32_t number, int reason, double brightness) {
  if (status_.state == MODAR_STATE_AROUND) return;  // a late frame
  if (status_.state == MODAR_STATE_START || number != 0) since_ = time_s;
  status_.state = number != 0 ? MODAR_STATE_SEEN : MODAR_STATE_LOOKING;
  const double unseen = time_s - since_;
  if (number != 0 || unseen > kPatience) status_.pattern = number;
  if (number != 0) return;
  if (brightness < kDarkRoom) {
    status_.hint = MODAR_HINT_DARK;
  } else if (unseen >= kPatience) {
    status_.hint = hint_for(reason, unseen);
  }
}

std::span<const SceneCommand> ScreenMachine::step(double time_s,
                                                  std::span<const SceneEvent> events) {
  const auto commands = actions_.step(time_s, events);
  const bool tapped = std::any_of(events.begin(), events.end(), [](const SceneEvent& event) {
    return event.kind == SceneEvent::Kind::kTap;
  });
  const bool plays = std::any_of(commands.begin(), commands.end(), [](const auto& command) {
    return command.command == ActionCommand::kPlay;
  });
  if (tapped && plays && !asked_) press(MODAR_SOUND, 1);
  if (motions_.empty()) return commands;
  const double seconds = time_s - std::exchange(clip_time_, time_s);
  for (Motion& motion : motions_) {
    if (!std::exchange(motion.fresh, false) && status_.paused == 0) motion.player.advance(seconds);
  }
  for (const std::uint32_t action : actions_.clips()) act_clip(bundle_.actions()[action]);
  step_clips(events);
  return commands;
}

/// Validated: the target is a scene's model, which has that clip.
void ScreenMachine::act_clip(const ActionRecord& action) {
  const std::uint32_t scene = bundle_.nodes()[action.target].subject;
  if (!plays_clip(action.command)) return stop(scene);
  const bool loops = action.command == static_cast<std::uint32_t>(ActionCommand::kClip);
  for (std::uint32_t i = 0; i < bundle_.clips().size(); ++i) {
    if (bundle_.name(bundle_.clips()[i].name) == bundle_.name(action.address) &&
        motions_[scene].player.play(i, loops, kClipBlendSeconds))
      return;
  }
}

bool ScreenMachine::shows(const SceneEvent& event, std::uint32_t scene) const {
  const std::uint32_t baked = bundle_.patterns().size();
  if (event.kind != SceneEvent::Kind::kSeen) return false;
  if (event.subject < baked) return bundle_.scenes()[scene].pattern == event.subject;
  return event.subject - baked < own_.size() && own_[event.subject - baked] == scene;
}

void ScreenMachine::step_clips(std::span<const SceneEvent> events) {
  for (std::uint32_t scene = 0; scene < motions_.size(); ++scene) {
    Motion& motion = motions_[scene];
    motion.seen = std::any_of(events.begin(), events.end(),
                              [&](const SceneEvent& event) { return shows(event, scene); });
    if (!motion.seen) continue;
    if (!std::exchange(motion.begun, true)) begin_clip(scene);
    motion.player.pose();
  }
}

/// An app may have begun another one before.
void ScreenMachine::begin_clip(std::uint32_t scene) {
  for (const SceneClipRecord& clip : bundle_.scene_clips()) {
    ClipPlayer& player = motions_[scene].player;
    if (clip.scene == scene && player.bones().empty())
      player.play(clip.clip, (clip.flags & kSceneClipLoops) != 0, 0);
  }
}

bool ScreenMachine::play(std::uint32_t scene, std::uint32_t clip, bool loops, double blend_s) {
  if (scene >= motions_.size() || !motions_[scene].player.play(clip, loops, blend_s)) return false;
  motions_[scene].fresh = true;
  return true;
}

void ScreenMachine::stop(std::uint32_t scene) {
  if (scene < motions_.size()) motions_[scene].player.stop();
}

std::uint32_t ScreenMachine::playing(std::uint32_t scene) const {
  return scene < motions_.size() ? motions_[scene].player.playing() : kNone;
}

std::span<const BoneMatrix> ScreenMachine::bones(std::uint32_t scene) const {
  if (scene >= motions_.size()) return {};
  return motions_[scene].player.bones();
}

bool ScreenMachine::waiting() const {
  const auto moves = [this](const Motion& motion) {
    return motion.seen && status_.paused == 0 && motion.player.moves();
  };
  return presents_ || actions_.waiting() || std::any_of(motions_.begin(), motions_.end(), moves);
}

/// Once around, slower towards the end.
modar_turntable ScreenMachine::turntable(double time_s) {
  if (presents_) {
    const double rest = 1 - std::clamp((time_s - since_) / kPresentSeconds, 0.0, 1.0);
    turntable_.turn = 360 * kDegree * (1 - rest * rest * rest);
    presents_ = rest > 0;
  }
  return turntable_;
}

void ScreenMachine::add_items(std::uint32_t pattern, const glm::mat4& view,
                              std::vector<DrawItem>& items) const {
  const std::size_t first = items.size();
  const std::uint32_t baked = bundle_.patterns().size();
  if (pattern < baked) {
    modar::add_items(bundle_, actions_, pattern, items);
  } else if (pattern - baked < own_.size()) {
    const std::uint32_t scene = own_[pattern - baked];
    const SceneRecord& record = bundle_.scenes()[scene];
    items.push_back({record.model, scene_matrix(record), scene, {}});
  }
  for (DrawItem& item : std::span(items).subspan(first)) item.bones = bones(item.scene).data();
  place(view, std::span(items).subspan(first));
}

void ScreenMachine::place(const glm::mat4& view, std::span<DrawItem> items) const {
  const auto angle = static_cast<float>(turntable_.turn);
  const auto zoom = static_cast<float>(turntable_.zoom);
  const float cosine = zoom * std::cos(angle);
  const float sine = zoom * std::sin(angle);
  for (DrawItem& item : items) {
    const bool moves = status_.state != MODAR_STATE_AROUND &&
                       item.model != kNone;  // pictures stay on their patterns
    for (int column = 0; moves && column < 4; ++column) {
      glm::vec4& at = item.to_eye[column];
      at.z *= zoom;
      if (column == 3) break;  // the foot stays
      at = {cosine * at.x - sine * at.y, sine * at.x + cosine * at.y, at.z, at.w};
    }
    item.to_eye = view * item.to_eye;
    item.world_to_eye = view;
  }
}

}  // namespace modar
