#include "formats/action_machine.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace modar {
namespace {

constexpr double kPi = 3.14159265358979323846;  // older NDKs have no <numbers>

/// First b, then a.
NodeTurn combined(const NodeTurn& a, const NodeTurn& b) {
  const NodeTurn both = {
      a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y, a.w * b.y - a.x * b.z + a.y * b.w + a.z * b.x,
      a.w * b.z + a.x * b.y - a.y * b.x + a.z * b.w, a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z};
  // Else rounding would grow from tap to tap.
  const float length =
      std::sqrt(both.x * both.x + both.y * both.y + both.z * both.z + both.w * both.w);
  return {both.x / length, both.y / length, both.z / length, both.w / length};
}

NodeTurn about(const float (&axis)[3], double degrees) {
  const double half = degrees * kPi / 360.0;
  const auto sine = static_cast<float>(std::sin(half));
  return {sine * axis[0], sine * axis[1], sine * axis[2], static_cast<float>(std::cos(half))};
}

}  // namespace

ActionMachine::ActionMachine(const BundleView& bundle)
    : bundle_(bundle),
      patterns_(bundle.patterns().size()),
      nodes_(bundle.nodes().size()),
      fired_(bundle.actions().size()) {
  commands_.resize(2 * nodes_.size() + fired_.size());
  clips_.reserve(fired_.size());
  reset();
}

void ActionMachine::reset() {
  std::fill(patterns_.begin(), patterns_.end(), Pattern());
  std::fill(fired_.begin(), fired_.end(), std::uint8_t{0});
  for (std::uint32_t i = 0; i < nodes_.size(); ++i) {
    nodes_[i] = Node();
    nodes_[i].shown = (bundle_.nodes()[i].flags & kNodeHidden) == 0;
    nodes_[i].wanted = (bundle_.nodes()[i].flags & kNodePlays) != 0;
  }
  command_count_ = 0;
  now_ = 0;
}

std::span<const SceneCommand> ActionMachine::step(double time_s,
                                                  std::span<const SceneEvent> events) {
  now_ = time_s > now_ ? time_s : now_;
  command_count_ = 0;
  clips_.clear();
  for (Node& node : nodes_) node.told = false;
  for (const SceneEvent& event : events) {
    if (event.kind != SceneEvent::Kind::kEnded || event.subject >= nodes_.size()) continue;
    nodes_[event.subject].wanted = nodes_[event.subject].playing = false;
  }
  for (std::uint32_t i = 0; i < fired_.size(); ++i) {
    if (bundle_.actions()[i].event != static_cast<std::uint32_t>(ActionEvent::kAfter)) {
      fired_[i] = 0;
    }
  }
  for (std::uint32_t p = 0; p < patterns_.size(); ++p) {
    Pattern& pattern = patterns_[p];
    const bool seen = std::any_of(events.begin(), events.end(), [p](const SceneEvent& event) {
      return event.kind == SceneEvent::Kind::kSeen && event.subject == p;
    });
    if (seen) pattern.seen = now_;
    if (seen && !pattern.present) {
      pattern.present = true;
      pattern.since = now_;
      fire(ActionEvent::kFound, p, kNone);
    } else if (pattern.present && now_ - pattern.seen > kLostAfterSeconds) {
      pattern.present = false;
      for (std::uint32_t i = 0; i < fired_.size(); ++i) {
        const ActionRecord& action = bundle_.actions()[i];
        const bool delayed = action.event == static_cast<std::uint32_t>(ActionEvent::kAfter);
        if (delayed && action.source == p) fired_[i] = 0;
      }
      fire(ActionEvent::kLost, p, kNone);
    }
    if (pattern.present) fire(ActionEvent::kAfter, p, kNone);
  }
  for (const SceneEvent& event : events) {
    if (event.kind == SceneEvent::Kind::kTap) tap(event);
  }
  play();
  return {commands_.data(), command_count_};
}

/// Tells which videos begin or stop.
void ActionMachine::play() {
  for (std::uint32_t i = 0; i < nodes_.size(); ++i) {
    Node& node = nodes_[i];
    const bool plays = node.wanted && node.shown && patterns_[bundle_.nodes()[i].pattern].present;
    if (plays == node.playing) continue;
    node.playing = plays;
    commands_[command_count_++] = {plays ? ActionCommand::kPlay : ActionCommand::kPause, i, kNone};
  }
}

void ActionMachine::tap(const SceneEvent& event) {
  if (event.subject >= nodes_.size()) return;
  const NodeRecord& record = bundle_.nodes()[event.subject];
  Node& node = nodes_[event.subject];
  if (!node.shown || !patterns_[record.pattern].present) return;
  bool own = false;
  for (std::uint32_t i = 0; i < fired_.size(); ++i) {
    const ActionRecord& action = bundle_.actions()[i];
    own |= action.event == static_cast<std::uint32_t>(ActionEvent::kTap) &&
           action.source == event.subject;
  }
  if (own) return fire(ActionEvent::kTap, event.subject, event.material);
  if (record.kind != static_cast<std::uint32_t>(NodeKind::kLabel) || node.told) return;
  node.told = true;
  commands_[command_count_++] = {ActionCommand::kText, event.subject, kNone};
}

bool ActionMachine::named(const ActionRecord& action, std::uint32_t material) const {
  if (action.part.length == 0) return true;
  return material < bundle_.materials().size() &&
         bundle_.name(bundle_.materials()[material].name) == bundle_.name(action.part);
}

/// Each action once a step, in the order of the table: none can cause another.
void ActionMachine::fire(ActionEvent event, std::uint32_t source, std::uint32_t material) {
  for (std::uint32_t i = 0; i < fired_.size(); ++i) {
    const ActionRecord& action = bundle_.actions()[i];
    if (action.event != static_cast<std::uint32_t>(event) || action.source != source) continue;
    const bool early = event == ActionEvent::kAfter &&
                       now_ - patterns_[source].since < static_cast<double>(action.seconds);
    if (fired_[i] != 0 || early || !named(action, material)) continue;
    fired_[i] = 1;
    perform(i);
  }
}

void ActionMachine::perform(std::uint32_t index) {
  const ActionRecord& action = bundle_.actions()[index];
  Node* target = action.target < nodes_.size() ? &nodes_[action.target] : nullptr;
  switch (static_cast<ActionCommand>(action.command)) {
    case ActionCommand::kPlay:
      target->wanted = true;
      break;
    case ActionCommand::kPause:
      target->wanted = false;
      break;
    case ActionCommand::kShow:
      target->shown = true;
      break;
    case ActionCommand::kHide:
      target->shown = false;
      break;
    case ActionCommand::kToggle:
      target->shown = !target->shown;
      break;
    case ActionCommand::kNext:
      show_next(action.target);
      break;
    case ActionCommand::kTurn:
      // A turn that is under way ends: that sums are exact counts for more than a jump.
      target->start = -std::numeric_limits<double>::infinity();
      target->base = turn_of(action.target);
      target->start = now_;
      target->turn = index;
      break;
    case ActionCommand::kText:
      if (!target->told) commands_[command_count_++] = {ActionCommand::kText, action.target, index};
      target->told = true;
      break;
    case ActionCommand::kClip:
    case ActionCommand::kClipOnce:
    case ActionCommand::kStop:
      clips_.push_back(index);
      break;
    case ActionCommand::kLink:
      commands_[command_count_++] = {ActionCommand::kLink, kNone, index};
      break;
  }
}

void ActionMachine::show_next(std::uint32_t target) {
  const NodeRecord& like = bundle_.nodes()[target];
  std::uint32_t first = kNone;
  std::uint32_t next = kNone;
  bool passed = false;  // the first that is shown
  for (std::uint32_t i = 0; i < nodes_.size(); ++i) {
    const NodeRecord& other = bundle_.nodes()[i];
    if (other.pattern != like.pattern || other.group != like.group) continue;
    if (first == kNone) first = i;
    if (passed && next == kNone) next = i;
    passed |= nodes_[i].shown;
    nodes_[i].shown = false;
  }
  nodes_[next != kNone ? next : first].shown = true;
}

double ActionMachine::turned_share(const Node& node) const {
  const auto duration = static_cast<double>(bundle_.actions()[node.turn].duration);
  return duration > 0.0 ? std::clamp((now_ - node.start) / duration, 0.0, 1.0) : 1.0;
}

NodeTurn ActionMachine::turn_of(std::uint32_t index) const {
  const Node& node = nodes_[index];
  if (node.turn == kNone) return node.base;
  const ActionRecord& action = bundle_.actions()[node.turn];
  return combined(about(action.axis, turned_share(node) * static_cast<double>(action.degrees)),
                  node.base);
}

bool ActionMachine::waiting() const {
  const auto turns = [this](const Node& node) {
    return node.turn != kNone && turned_share(node) < 1.0;
  };
  if (std::any_of(nodes_.begin(), nodes_.end(), turns)) return true;
  for (std::uint32_t i = 0; i < fired_.size(); ++i) {
    const ActionRecord& action = bundle_.actions()[i];
    if (action.event == static_cast<std::uint32_t>(ActionEvent::kAfter) && fired_[i] == 0 &&
        patterns_[action.source].present) {
      return true;
    }
  }
  return false;
}

}  // namespace modar
