// Nodes and actions: what they refer to is there, and fits their kind.
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <set>
#include <string>
#include <string_view>

#include "formats/base/address.hpp"
#include "formats/captions.hpp"
#include "formats/check_rules.hpp"
#include "formats/meta_text.hpp"
#include "formats/mp4.hpp"
#include "formats/validate.hpp"

namespace modar {
namespace {

std::string_view text_of(const BundleParts& parts, NameRef ref) {
  return {reinterpret_cast<const char*>(parts.names.data()) + ref.offset, ref.length};
}

template <std::size_t N>
bool zero(const float (&parts)[N]) {
  return std::all_of(std::begin(parts), std::end(parts), [](float part) { return part == 0.0f; });
}

bool plays(const BundleParts& parts, const NodeRecord& node, MediaKind kind) {
  return node.subject < parts.media.size() &&
         parts.media[node.subject].kind == static_cast<std::uint32_t>(kind);
}

/// The fields of its kind; those of others are 0.
bool fits_kind(const BundleParts& parts, const NodeRecord& node) {
  const bool no_size = zero(node.half_size);
  switch (static_cast<NodeKind>(node.kind)) {
    case NodeKind::kModel:
      return node.subject < parts.scenes.size() &&
             parts.scenes[node.subject].pattern == node.pattern && node.mark.length == 0 &&
             no_size && zero(node.place) && node.rotation[3] == 1.0f;
    case NodeKind::kPicture:
      return node.subject < parts.textures.size() && node.mark.length == 0 &&
             node.half_size[0] > 0.0f && node.half_size[1] > 0.0f;
    case NodeKind::kVideo:
      return plays(parts, node, MediaKind::kVideo) && node.mark.length == 0 &&
             node.half_size[0] > 0.0f && node.half_size[1] > 0.0f;
    case NodeKind::kSound:
      return plays(parts, node, MediaKind::kSound) && node.mark.length == 0 && no_size &&
             zero(node.place) && node.rotation[3] == 1.0f && node.group == 0 &&
             (node.flags & kNodeHidden) == 0;
    case NodeKind::kLabel:
      return node.subject == kNone && no_size && node.mark.length > 0 &&
             node.mark.length <= kMaxMarkBytes && node.rotation[3] == 1.0f;
  }
  return false;
}

/// What only a video or sound has is 0 of others, and a key's numbers without a key.
bool video_fields_fit(const NodeRecord& node) {
  const bool key = node.alpha == static_cast<std::uint32_t>(VideoAlpha::kKey);
  return (kind_is(node, NodeKind::kVideo) || node.alpha == 0) &&
         (plays_media(node) || (node.flags & (kNodePlays | kNodeLoops)) == 0) &&
         (key || (zero(node.key) && node.reach == 0.0f));
}

void check_media(const RecordCheck& check, const BundleParts& parts, std::uint32_t index,
                 const FaultLog& log) {
  const MediaRecord& media = parts.media[index];
  const std::uint64_t before = log.errors();
  check.name(media.name);
  check.flags(media.flags, known_flags("MediaRecord"));
  check.reserved(media.reserved, sizeof(media.reserved));
  check.number(media.seconds, "seconds", 0.0, static_cast<double>(kMostSeconds));
  if (log.errors() != before) return;
  const bool video = media.kind == static_cast<std::uint32_t>(MediaKind::kVideo);
  if (!video && media.kind != static_cast<std::uint32_t>(MediaKind::kSound)) {
    if (newer_minor(parts)) return;
    return check.fault(Rule::kEnum, &media.kind, "its kind is not known");
  }
  const bool seen = std::min(media.width, media.height) >= 1 && media.width <= kMostVideoWidth &&
                    media.height <= kMostVideoHeight && media.poster < parts.textures.size();
  const bool heard =
      media.width == 0 && media.height == 0 && media.poster == kNone && media.flags == kMediaSound;
  if (!(video ? seen : heard) || !(media.seconds > 0.0f) ||
      find_section(parts.sections, SectionType::kMediaData, index, 0) == nullptr) {
    check.fault(Rule::kNode, &media.width,
                "its size, data, duration or poster does not fit its kind");
  }
}

/// No node before it has its name on its pattern, nor its scene.
bool alone(const BundleParts& parts, std::uint32_t index) {
  const NodeRecord& node = parts.nodes[index];
  for (std::uint32_t i = 0; i < index; ++i) {
    const NodeRecord& other = parts.nodes[i];
    if (other.pattern != node.pattern) continue;
    const bool scene = node.kind == static_cast<std::uint32_t>(NodeKind::kModel) &&
                       other.kind == node.kind && other.subject == node.subject;
    if (scene || text_of(parts, other.name) == text_of(parts, node.name)) return false;
  }
  return true;
}

void check_node(const RecordCheck& check, const BundleParts& parts, std::uint32_t index,
                const FaultLog& log) {
  const NodeRecord& node = parts.nodes[index];
  const std::uint64_t before = log.errors();
  check.name(node.name);
  check.name(node.mark);
  check.flags(node.flags, known_flags("NodeRecord"));
  check.reserved(&node.reserved, sizeof(node.reserved));
  check.numbers(node.key, "key", 0.0, 1.0);
  check.number(node.reach, "reach", 0.0, 1.0);
  check.numbers(node.place, "place", -kMostSceneNumber, kMostSceneNumber);
  check.numbers(node.half_size, "half_size", 0.0, kMostSceneNumber);
  if (log.errors() != before) return;  // its name may be anywhere
  const bool known = node.kind >= static_cast<std::uint32_t>(NodeKind::kModel) &&
                     node.kind <= static_cast<std::uint32_t>(NodeKind::kSound) &&
                     node.alpha <= static_cast<std::uint32_t>(VideoAlpha::kKey);
  if (!known && !newer_minor(parts)) {
    return check.fault(Rule::kEnum, &node.kind, "its kind or alpha is not known");
  }
  if (node.pattern >= parts.patterns.size() ||
      (known && !(fits_kind(parts, node) && video_fields_fit(node)))) {
    check.fault(Rule::kNode, &node.pattern, "a field does not fit its kind");
  }
  if (!unit_length(node.rotation)) {
    check.fault(Rule::kNode, node.rotation, "its rotation is not a unit quaternion");
  }
  if (node.name.length == 0 || !alone(parts, index)) {
    check.fault(Rule::kNode, &node.name, "its name is empty, or it is there twice");
  }
}

bool known_action(const ActionRecord& action) {
  using enum ActionCommand;
  constexpr ActionCommand kCommands[] = {kPlay, kPause, kShow, kHide, kToggle,   kText,
                                         kLink, kNext,  kTurn, kClip, kClipOnce, kStop};
  return action.event >= static_cast<std::uint32_t>(ActionEvent::kFound) &&
         action.event <= static_cast<std::uint32_t>(ActionEvent::kAfter) &&
         std::find(std::begin(kCommands), std::end(kCommands),
                   static_cast<ActionCommand>(action.command)) != std::end(kCommands);
}

/// The pattern on which the action happens; kNone: its source is not there.
std::uint32_t pattern_of(const BundleParts& parts, const ActionRecord& action) {
  if (action.event != static_cast<std::uint32_t>(ActionEvent::kTap)) {
    return action.source < parts.patterns.size() ? action.source : kNone;
  }
  return action.source < parts.nodes.size() ? parts.nodes[action.source].pattern : kNone;
}

/// Whether the model of a model's node has a clip of that name.
bool has_clip(const BundleParts& parts, const NodeRecord& node, NameRef name) {
  const std::uint32_t model =
      node.subject < parts.scenes.size() ? parts.scenes[node.subject].model : kNone;
  for (const ClipRecord& clip : parts.clips) {
    if (clip.model == model && text_of(parts, clip.name) == text_of(parts, name)) return true;
  }
  return false;
}

/// Whether its command can be done to its target.
bool fits_command(const BundleParts& parts, const ActionRecord& action) {
  const auto command = static_cast<ActionCommand>(action.command);
  if (command == ActionCommand::kLink) return action.target == kNone;
  if (action.target >= parts.nodes.size()) return false;
  const NodeRecord& target = parts.nodes[action.target];
  if (target.pattern != pattern_of(parts, action)) return false;
  const bool play = command == ActionCommand::kPlay || command == ActionCommand::kPause;
  if (play || kind_is(target, NodeKind::kSound)) return play && plays_media(target);
  if (command >= ActionCommand::kClip)
    return kind_is(target, NodeKind::kModel) &&
           (command == ActionCommand::kStop || has_clip(parts, target, action.address));
  if (command == ActionCommand::kText) return kind_is(target, NodeKind::kLabel);
  if (command == ActionCommand::kNext) return target.group != 0;
  if (command == ActionCommand::kTurn) return !kind_is(target, NodeKind::kLabel);
  return true;
}

/// Fields that its event or command does not use are 0.
bool idle_fields_are_zero(const BundleParts& parts, const ActionRecord& action) {
  const auto event = static_cast<ActionEvent>(action.event);
  const bool turn = action.command == static_cast<std::uint32_t>(ActionCommand::kTurn);
  const bool link = action.command == static_cast<std::uint32_t>(ActionCommand::kLink);
  const bool part =
      event == ActionEvent::kTap && kind_is(parts.nodes[action.source], NodeKind::kModel);
  const bool addressed = link || plays_clip(action.command);
  return (part || action.part.length == 0) && (addressed || action.address.length == 0) &&
         (event == ActionEvent::kAfter || action.seconds == 0.0f) &&
         (turn ? unit_length(action.axis)
               : zero(action.axis) && action.duration == 0.0f && action.degrees == 0.0f);
}

void check_action(const RecordCheck& check, const BundleParts& parts, const ActionRecord& action,
                  const FaultLog& log) {
  const std::uint64_t before = log.errors();
  check.name(action.part);
  check.name(action.address);
  check.reserved(action.reserved, sizeof(action.reserved));
  check.number(action.seconds, "seconds", 0.0, static_cast<double>(kMostSeconds));
  check.number(action.duration, "duration", 0.0, static_cast<double>(kMostSeconds));
  check.number(action.degrees, "degrees", -static_cast<double>(kMostDegrees),
               static_cast<double>(kMostDegrees));
  if (log.errors() != before) return;
  const bool placed = pattern_of(parts, action) != kNone;
  if (!known_action(action)) {
    if (newer_minor(parts) &&
        (placed || action.event > static_cast<std::uint32_t>(ActionEvent::kAfter))) {
      return;
    }
    return check.fault(Rule::kEnum, &action.event, "its event or command is not known");
  }
  if (!placed || !fits_command(parts, action) || !idle_fields_are_zero(parts, action)) {
    return check.fault(Rule::kAction, &action.source, "a field does not fit event and command");
  }
  if (action.command != static_cast<std::uint32_t>(ActionCommand::kLink)) return;
  const std::string_view address = text_of(parts, action.address);
  const char* const fault =
      address.starts_with("https://") ? address_fault(address) : "it has no https://";
  if (fault != nullptr) check.fault(Rule::kActionLink, &action.address, fault);
}

}  // namespace

void validate_nodes(FaultLog& log, const BundleParts& parts) {
  if (parts.nodes.size() > kMostNodes || parts.media.size() > kMostNodes ||
      parts.actions.size() > kMostActions) {
    return RecordCheck(log, parts, "nodes", 0)
        .fault(Rule::kNode, parts.bytes.data(),
               "there are more than 1024, or more than 256 actions");
  }
  // What refers to records that are wrong cannot be looked at.
  const std::uint64_t before = log.errors();
  for (std::uint32_t i = 0; i < parts.media.size() && log.errors() == before; ++i) {
    check_media(RecordCheck(log, parts, "media", i), parts, i, log);
  }
  for (std::uint32_t i = 0; i < parts.nodes.size() && log.errors() == before; ++i) {
    check_node(RecordCheck(log, parts, "node", i), parts, i, log);
  }
  for (std::uint32_t i = 0; i < parts.actions.size() && log.errors() == before; ++i) {
    check_action(RecordCheck(log, parts, "action", i), parts, parts.actions[i], log);
  }
}

void check_media_files(FaultLog& log, const BundleParts& parts) {
  constexpr double kRounding = 0.1;  // seconds: tracks end with a frame each
  for (std::uint32_t i = 0; i < parts.media.size(); ++i) {
    const MediaRecord& media = parts.media[i];
    const bool video = media.kind == static_cast<std::uint32_t>(MediaKind::kVideo);
    if (!video && media.kind != static_cast<std::uint32_t>(MediaKind::kSound)) continue;
    const SectionEntry& entry = *find_section(parts.sections, SectionType::kMediaData, i, 0);
    const std::string where = label(parts, video ? "video" : "sound", media.name);
    if ((media.flags & kMediaFlashes) != 0) {
      log.add(Rule::kMediaFlashes, offset_of(parts, &media), where,
              "it flashes more than three times in a second");
    }
    Mp4Info info;
    if (const auto fault = view_mp4(section_bytes(parts, entry), info)) {
      log.add(Rule::kMediaFile, entry.offset + fault->offset, where, fault->cause);
      continue;
    }
    const bool sound = (media.flags & kMediaSound) != 0;
    const bool same = info.width == media.width && info.height == media.height &&
                      std::fabs(info.seconds - static_cast<double>(media.seconds)) <= kRounding &&
                      info.sound_tracks == (sound ? 1 : 0) && info.video_tracks == (video ? 1 : 0);
    const bool fit = (!video || (std::string_view(info.video_codec.data()) == "avc1" &&
                                 info.profile == kBaselineProfile)) &&
                     info.index_first &&
                     (!sound || std::string_view(info.sound_codec.data()) == "mp4a");
    if (same && fit) continue;
    log.add(Rule::kMediaFile, entry.offset, where,
            std::string(info.video_codec.data()) + " of profile " + std::to_string(info.profile) +
                ", " + std::to_string(info.width) + " x " + std::to_string(info.height) + ", " +
                number_text(info.seconds) + " s, " + std::to_string(info.sound_tracks) +
                " sound tracks " + info.sound_codec.data() +
                (info.index_first ? "" : ", its index at the end"));
  }
}

namespace {

/// Pattern, node and language of the texts of a kind.
using NodeTexts = std::set<std::array<std::string, 3>>;

NodeTexts texts_of(std::string_view meta, MetaText::Kind kind) {
  NodeTexts texts;
  visit_node_texts(meta, [&](const MetaText& each) {
    if (each.kind == kind) texts.insert({each.pattern, each.node, each.language});
  });
  return texts;
}

/// Says which of the nodes that `asked` picks lack a text in a language in which another has one,
/// and, if `needed`, which have none at all.
void check_languages(FaultLog& log, const BundleParts& parts, const NodeTexts& texts,
                     const std::function<bool(const NodeRecord&)>& asked, Rule rule,
                     const char* what, bool needed) {
  const auto has = [&](const NodeRecord& node, const std::string& language) {
    const NameRef pattern = parts.patterns[node.pattern].name;
    return texts.contains(
        {std::string(text_of(parts, pattern)), std::string(text_of(parts, node.name)), language});
  };
  std::set<std::string> languages;
  for (const auto& text : texts) {
    for (const NodeRecord& each : parts.nodes) {
      if (asked(each) && has(each, text[2])) languages.insert(text[2]);
    }
  }
  for (const NodeRecord& node : parts.nodes) {
    if (!asked(node)) continue;
    const std::string where = label(parts, what, node.name);
    const char* text = rule == Rule::kNodeText ? "title" : "captions";
    if (needed && languages.empty()) {
      log.add(rule, offset_of(parts, &node), where, std::string("it has no ") + text);
    }
    for (const std::string& language : languages) {
      if (has(node, language)) continue;
      log.add(rule, offset_of(parts, &node), where,
              std::string("it has no ") + text + " in '" + language + "'");
    }
  }
}

}  // namespace

void check_node_texts(FaultLog& log, const BundleParts& parts) {
  const SectionEntry* entry = find_section(parts.sections, SectionType::kMeta, kNone, 0);
  if (parts.nodes.empty()) return;
  const auto bytes = entry == nullptr ? std::span<const std::byte>() : section_bytes(parts, *entry);
  const std::string_view meta(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  check_languages(
      log, parts, texts_of(meta, MetaText::Kind::kTitle),
      [](const NodeRecord& node) { return kind_is(node, NodeKind::kLabel); }, Rule::kNodeText,
      "label", false);
  const auto sounds = [&parts](const NodeRecord& node) {
    return plays_media(node) && (parts.media[node.subject].flags & kMediaSound) != 0;
  };
  check_languages(log, parts, texts_of(meta, MetaText::Kind::kCaptions), sounds,
                  Rule::kCaptionsMissing, "sound of", true);
  visit_node_texts(meta, [&](const MetaText& each) {
    if (each.kind != MetaText::Kind::kCaptions) return;
    if (const auto fault = check_captions(each.words)) {
      log.add(Rule::kCaptions, entry->offset,
              "captions of '" + each.node + "' in '" + each.language + "'",
              "line " + std::to_string(fault->line) + ": " + fault->cause);
    }
  });
}

}  // namespace modar
