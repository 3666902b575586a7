// Turns keys into choices, and choices into draw lists. Every model stays in its buffers: a
// model that comes back needs nothing but its index.
#include "controls.hpp"

#include <algorithm>
#include <utility>

#include "modar/pose.hpp"

namespace modar {
Controls::Controls(const BundleView& bundle, bool outline, bool display)
    : outline_(outline), display_(display) {
  load(bundle);
}

void Controls::apply(const UserAct& act) {
  constexpr float kVolume = 0.1f;
  switch (act.act) {
    case Act::kQuit:
      // While corners are taken, it means that none are wanted.
      if (frozen_) {
        frozen_ = false;
        corner_count_ = 0;
      } else {
        quit_ = true;
      }
      break;
    case Act::kNextModel:
      turn_model(1);
      break;
    case Act::kPreviousModel:
      turn_model(-1);
      break;
    case Act::kNextPattern: {
      const std::uint32_t count = bundle_.patterns().size();
      const std::uint32_t next = only_pattern_ == kNone ? 0 : only_pattern_ + 1;
      only_pattern_ = next < count ? next : kNone;
      break;
    }
    case Act::kLarger:
      machine_->press(MODAR_SIZE, 1);
      break;
    case Act::kSmaller:
      machine_->press(MODAR_SIZE, -1);
      break;
    case Act::kDisplay:
      display_ = !display_;
      break;
    case Act::kOutline:
      outline_ = !outline_;
      break;
    case Act::kPause:
      paused_ = !paused_;
      break;
    case Act::kFreeze:
      frozen_ = !frozen_;
      corner_count_ = 0;
      break;
    case Act::kSound:
      machine_->press(MODAR_SOUND, 1);
      break;
    case Act::kCaptions:
      machine_->press(MODAR_CAPTIONS_SHOWN, 1);
      break;
    case Act::kLouder:
      volume_ = std::min(1.0f, volume_ + kVolume);
      break;
    case Act::kQuieter:
      volume_ = std::max(0.0f, volume_ - kVolume);
      break;
    case Act::kDown:
    case Act::kMove:
    case Act::kUp:
      touch(act);
      break;
  }
}

/// A frozen frame takes corners, and nothing turns.
void Controls::touch(const UserAct& act) {
  if (frozen_) {
    if (act.act == Act::kUp && corner_count_ < corners_.size()) corners_[corner_count_++] = act.at;
    return;
  }
  const int kind = act.act == Act::kDown ? MODAR_TOUCH_DOWN
                   : act.act == Act::kUp ? MODAR_TOUCH_UP
                                         : MODAR_TOUCH_MOVE;
  const bool tapped = machine_->touch({sizeof(modar_touch), kind, 0, act.at.x, act.at.y, act.size.x,
                                       act.size.y}) == MODAR_TAPPED;
  if (tapped && tap_count_ < taps_.size()) taps_[tap_count_++] = act.at;
}

void Controls::load(const BundleView& bundle) {
  bundle_ = bundle;
  auto machine = std::make_unique<ScreenMachine>(bundle);
  if (machine_) machine->inherit(*machine_);
  machine_ = std::move(machine);
  // Each pattern, the tapped node, and each node that ends.
  events_.reserve(bundle.patterns().size() + taps_.size() + bundle.nodes().size());
  if (model_ != kNone && model_ >= bundle.models().size()) model_ = kNone;
  if (only_pattern_ != kNone && only_pattern_ >= bundle.patterns().size()) only_pattern_ = kNone;
}

/// Through all models and "as the scenes say", which comes after the last.
void Controls::turn_model(int step) {
  const auto places = static_cast<std::int64_t>(bundle_.models().size()) + 1;
  const std::int64_t place = model_ == kNone ? places - 1 : std::int64_t{model_};
  const std::int64_t next = (place + step + places) % places;
  model_ = next == places - 1 ? kNone : static_cast<std::uint32_t>(next);
}

std::span<const SceneCommand> Controls::act(std::span<const Hysteresis::State> states,
                                            double time_s, std::span<const SceneEvent> events) {
  events_.assign(events.begin(), events.end());
  // Copies of a pattern act as one.
  const std::uint32_t count = bundle_.patterns().size();
  for (std::uint32_t pattern = 0; pattern < count; ++pattern) {
    bool shown = false;
    for (std::size_t i = pattern; i < states.size(); i += count) shown = shown || states[i].shown;
    if (wants(pattern) && shown) events_.push_back({SceneEvent::Kind::kSeen, pattern, kNone});
  }
  return machine_->step(time_s, events_);
}

std::span<const SceneCommand> Controls::collect(std::span<const Hysteresis::State> states,
                                                double time_s, std::span<const SceneEvent> events,
                                                std::vector<DrawItem>& items) {
  const auto commands = act(states, time_s, events);
  items.clear();
  for (std::size_t i = 0; i < states.size(); ++i) {
    const auto pattern = static_cast<std::uint32_t>(i % bundle_.patterns().size());
    if (!wants(pattern) || !states[i].shown) continue;
    if (model_ != kNone) {
      add_standard(states[i], model_, items);
    } else {
      machine_->add_items(pattern, gl_view(states[i].pose, states[i].stretch), items);
    }
  }
  return commands;
}

void Controls::collect_spot(std::span<const Hysteresis::State> states,
                            std::vector<DrawItem>& items) const {
  items.clear();
  if (bundle_.models().empty()) return;
  for (const Hysteresis::State& state : states) {
    add_standard(state, model_ == kNone ? 0 : model_, items);
  }
}

/// The model at a scene's default placement.
void Controls::add_standard(const Hysteresis::State& state, std::uint32_t model,
                            std::vector<DrawItem>& items) const {
  if (!state.shown) return;
  SceneRecord standard{};
  standard.scale = 1;
  standard.rotation[3] = 1;
  items.push_back({model, scene_matrix(standard), kNone, {}});
  machine_->place(gl_view(state.pose, state.stretch), std::span(items).last(1));
}

std::span<const glm::dvec2> Controls::take_taps() {
  return {taps_.data(), std::exchange(tap_count_, 0)};
}

bool Controls::take_corners(std::array<glm::dvec2, 4>& corners) {
  if (!frozen_ || corner_count_ < corners_.size()) return false;
  corners = corners_;
  frozen_ = false;
  corner_count_ = 0;
  return true;
}

}  // namespace modar
