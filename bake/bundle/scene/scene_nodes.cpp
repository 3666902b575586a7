#include "bake/bundle/scene/scene_nodes.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include <glm/gtc/quaternion.hpp>
#include <glm/mat3x3.hpp>

#include "bake/bundle/scene/scene_placement.hpp"
#include "bake/image/image.hpp"
#include "bake/options/request_text.hpp"
#include "bake/process/process.hpp"
#include "bake/texture/texture_stage.hpp"
#include "bake/video/encode_video.hpp"
#include "formats/base/nearest.hpp"
#include "formats/base/path.hpp"
#include "formats/base/ranges.hpp"
#include "formats/rules.hpp"

namespace modar {
namespace {

/// A node of the request: a scene's model, or one of request.nodes.
struct NodeSource {
  std::string pattern;
  std::string name;
  std::string group;
  NodeKind kind = NodeKind::kModel;
  std::size_t index = 0;  ///< in request.scenes or request.nodes
  bool asked = false;     ///< its maker named, hid or grouped it, or an action does
};

std::string name_of(const SceneRequest& scene) {
  return scene.name.empty() ? scene.model : scene.name;
}

std::vector<NodeSource> known_nodes(const BakeRequest& request) {
  std::vector<NodeSource> known;
  for (std::size_t i = 0; i < request.scenes.size(); ++i) {
    const SceneRequest& scene = request.scenes[i];
    const bool asked = !scene.name.empty() || scene.hidden || !scene.group.empty();
    known.push_back({scene.pattern, name_of(scene), scene.group, NodeKind::kModel, i, asked});
  }
  for (std::size_t i = 0; i < request.nodes.size(); ++i) {
    const NodeRequest& node = request.nodes[i];
    known.push_back({node.place.pattern, node.place.name, node.place.group, node.kind, i, true});
  }
  return known;
}

/// The node that an action names.
Result<NodeSource*> find_node(std::vector<NodeSource>& known, const ActionRequest& action,
                              const std::string& name) {
  std::vector<std::string> names;
  NodeSource* found = nullptr;
  for (NodeSource& node : known) {
    if (node.pattern != action.pattern) continue;
    names.push_back(node.name);
    if (node.name != name) continue;
    if (found != nullptr) {
      return fail(ExitCode::kUsage, "node.same-name", action.where,
                  "two things on '" + action.pattern + "' are named '" + name + "'",
                  "give one of them another name = \"...\"");
    }
    found = &node;
  }
  if (found != nullptr) return found;
  return fail(ExitCode::kUsage, "action.unknown", action.where,
              "nothing on '" + action.pattern + "' is named '" + name + "'",
              cure_of_name(name, names));
}

tl::unexpected<Error> cannot(const ActionRequest& action, const std::string& cause,
                             const std::string& cure) {
  return fail(ExitCode::kUsage, "action.command", action.where, "'" + action.target + "' " + cause,
              cure);
}

/// Whether its target can do what an action asks for.
Result<void> check_command(const ActionRequest& action, const NodeSource& target) {
  const bool label = target.kind == NodeKind::kLabel;
  const bool play =
      action.command == ActionCommand::kPlay || action.command == ActionCommand::kPause;
  if (play && target.kind != NodeKind::kVideo && target.kind != NodeKind::kSound) {
    return cannot(action, "is not a video or sound",
                  "name one, [[scene.video]] or [[scene.sound]], or write play CLIP on MODEL");
  }
  if (action.command >= ActionCommand::kClip && target.kind != NodeKind::kModel) {
    return cannot(action, "is not a model", "name a model, which has clips");
  }
  if (!play && target.kind == NodeKind::kSound) {
    return cannot(action, "is a sound, which only plays and pauses", "write play or pause");
  }
  if (action.command == ActionCommand::kText && !label) {
    return cannot(action, "has no words to show", "name a label, [[scene.label]]");
  }
  if (action.command == ActionCommand::kTurn && label) {
    return cannot(action, "is a label, which does not turn", "name a model or a picture");
  }
  if (action.command == ActionCommand::kNext && target.group.empty()) {
    return cannot(action, "has no variants", "give each of them the same group = \"...\"");
  }
  return {};
}

/// Marks what actions name as asked for.
Result<void> check_actions(const BakeRequest& request, std::vector<NodeSource>& known) {
  for (const ActionRequest& action : request.actions) {
    if (action.event == ActionEvent::kTap) {
      MODAR_ASSIGN(NodeSource* const source, find_node(known, action, action.source));
      source->asked = true;
      if (!action.part.empty() && source->kind != NodeKind::kModel) {
        return fail(ExitCode::kUsage, "action.part", action.where,
                    "'" + action.source + "' is not a model and has no parts", "leave part out");
      }
    }
    if (action.command == ActionCommand::kLink) continue;
    MODAR_ASSIGN(NodeSource* const target, find_node(known, action, action.target));
    target->asked = true;
    MODAR_TRY(check_command(action, *target));
  }
  return {};
}

/// Refuses two requests of one name.
Result<void> check_names(const BakeRequest& request, const std::vector<NodeSource>& known) {
  std::set<std::pair<std::string, std::string>> names;
  for (const NodeSource& node : known) {
    if (!node.asked || names.insert({node.pattern, node.name}).second) continue;
    const bool model = node.kind == NodeKind::kModel;
    return fail(ExitCode::kUsage, "node.same-name",
                model ? "scene " + node.pattern : request.nodes[node.index].where,
                "two things on '" + node.pattern + "' are named '" + node.name + "'",
                "give one of them another name = \"...\"");
  }
  return {};
}

/// All that are to become nodes, each with a name of its own.
Result<std::vector<NodeSource>> asked_nodes(const BakeRequest& request) {
  std::vector<NodeSource> known = known_nodes(request);
  MODAR_TRY(check_names(request, known));
  MODAR_TRY(check_actions(request, known));
  std::erase_if(known, [](const NodeSource& node) { return !node.asked; });
  const auto too_many = [](const char* what, std::size_t count, std::uint32_t most) {
    return fail(ExitCode::kUsage, "node.too-many", what,
                "there are " + std::to_string(count) + " of them",
                "make several bundles, with " + std::to_string(most) + " at most");
  };
  if (known.size() > kMostNodes) return too_many("nodes", known.size(), kMostNodes);
  if (request.actions.size() > kMostActions) {
    return too_many("actions", request.actions.size(), kMostActions);
  }
  return known;
}

template <class Record>
std::uint32_t index_of(const BundleContent& content, const std::vector<Record>& records,
                       const std::string& name) {
  const auto named = [&](const Record& record) {
    return content.names.compare(record.name.offset, record.name.length, name) == 0;
  };
  return static_cast<std::uint32_t>(ranges::find_if(records, named) - records.begin());
}

class NodeMaker {
 public:
  NodeMaker(const BakeRequest& request, BundleContent& content, Report& report,
            const MediaSource& source)
      : request_(request), content_(content), report_(report), source_(source) {}

  Result<void> run() {
    MODAR_ASSIGN(known_, asked_nodes(request_));
    for (const NodeSource& node : known_) MODAR_TRY(add_node(node));
    for (const ActionRequest& action : request_.actions) MODAR_TRY(add_action(action));
    return {};
  }

 private:
  Result<void> add_node(const NodeSource& known) {
    NodeRecord node{};
    node.name = content_.intern(known.name);
    node.pattern = index_of(content_, content_.patterns, known.pattern);
    node.kind = static_cast<std::uint32_t>(known.kind);
    node.subject = kNone;
    node.group = group_number(known);
    node.rotation[3] = 1.0f;
    if (known.kind == NodeKind::kModel) {
      node.subject = static_cast<std::uint32_t>(known.index);
      node.flags = request_.scenes[known.index].hidden ? kNodeHidden : 0u;
    } else {
      const NodeRequest& request = request_.nodes[known.index];
      node.flags = request.place.hidden ? kNodeHidden : 0u;
      node.mark = content_.intern(request.mark);
      MODAR_TRY(place_node(request, node));
    }
    content_.nodes.push_back(node);
    return {};
  }

  /// Groups count from 1, by pattern and name.
  std::uint32_t group_number(const NodeSource& known) {
    if (known.group.empty()) return 0;
    const std::pair key(known.pattern, known.group);
    const auto found = std::find(groups_.begin(), groups_.end(), key);
    const auto number = static_cast<std::uint32_t>(found - groups_.begin()) + 1;
    if (found == groups_.end()) groups_.push_back(key);
    return number;
  }

  /// Place, and a picture's texture, size and turn.
  Result<void> place_node(const NodeRequest& request, NodeRecord& node) {
    if (request.kind == NodeKind::kSound) return add_player(request, node);
    const PatternRecord& pattern = content_.patterns[node.pattern];
    if (needs_width(request.place) && !(pattern.width_mm > 0)) {
      Error error = no_width(request.place).value();
      error.where = request.where;
      return tl::unexpected(std::move(error));
    }
    // Units of the plane in a millimetre, and in the unit of a plain offset.
    const double mm = pattern.width_mm > 0
                          ? 2.0 * static_cast<double>(pattern.half_width) / pattern.width_mm
                          : 0.0;
    const bool sides = request.place.offset.unit == SceneOffset::Unit::kSide ||
                       (request.place.offset.unit == SceneOffset::Unit::kUsual && !(mm > 0));
    for (std::size_t i = 0; i < 3; ++i) {
      node.place[i] = static_cast<float>(request.place.offset.value[i] * (sides ? 2.0 : mm));
    }
    if (request.kind == NodeKind::kLabel) return {};
    if (request.kind == NodeKind::kVideo) {
      MODAR_TRY(add_player(request, node));
      set_alpha(request, node);
      const MediaRecord& media = content_.media[node.subject];
      // Its alpha is next to it.
      const double width = media.width / (request.alpha == VideoAlpha::kBeside ? 2.0 : 1.0);
      return size_picture(request, mm, width, media.height, node);
    }
    MODAR_ASSIGN(node.subject, add_picture(request.file, request_.textures, content_, report_));
    const TextureRecord& texture = content_.textures[node.subject];
    return size_picture(request, mm, static_cast<double>(texture.source_width),
                        static_cast<double>(texture.source_height), node);
  }

  static void set_alpha(const NodeRequest& request, NodeRecord& node) {
    node.alpha = static_cast<std::uint32_t>(request.alpha);
    if (request.alpha != VideoAlpha::kKey) return;
    std::copy(request.key.begin(), request.key.end(), node.key);
    node.reach = request.reach;
  }

  /// Of a video or sound: its media, and when it plays.
  Result<void> add_player(const NodeRequest& request, NodeRecord& node) {
    node.flags |= (request.plays ? kNodePlays : 0u) | (request.loops ? kNodeLoops : 0u);
    const std::pair key(request.kind, request.file);
    const auto known = media_of_file_.find(key);
    if (known != media_of_file_.end()) {
      node.subject = known->second;
      return {};
    }
    MODAR_ASSIGN(node.subject, add_media(request));
    media_of_file_.emplace(key, node.subject);
    return {};
  }

  /// The index of a file's media: of those whose bytes are the same, where there are some.
  Result<std::uint32_t> add_media(const NodeRequest& request) {
    MODAR_ASSIGN(const BundleContent part,
                 source_ ? source_(request) : bake_media(request, request_, report_));
    const auto same = ranges::find(content_.media_data, part.media_data[0]);
    const auto index = static_cast<std::uint32_t>(same - content_.media_data.begin());
    if (same != content_.media_data.end()) return index;
    MediaRecord media = part.media[0];
    media.name = content_.intern(part.names.substr(media.name.offset, media.name.length));
    if (!part.textures.empty()) media.poster = adopt_picture(part, content_);
    content_.media.push_back(media);
    content_.media_data.push_back(part.media_data[0]);
    return index;
  }

  /// mm: units of the plane in a millimetre. width, height: pixels.
  static Result<void> size_picture(const NodeRequest& request, double mm, double width,
                                   double height, NodeRecord& node) {
    const SceneRequest& place = request.place;
    double unit = place.size.value / std::max(width, height);  // plane units in half a pixel
    if (place.size.kind == SceneSize::Kind::kWidth) unit = place.size.value * mm / 2 / width;
    if (place.size.kind == SceneSize::Kind::kHeight) unit = place.size.value * mm / 2 / height;
    if (!(unit * std::max(width, height) <= kMostScale)) {
      return fail(ExitCode::kUsage, "scene.size", request.where,
                  "it would be " + rough_number_text(unit * std::max(width, height)) +
                      " times as large as the pattern",
                  "compare its size with the pattern's printed width, and their units");
    }
    node.half_size[0] = static_cast<float>(unit * width);
    node.half_size[1] = static_cast<float>(unit * height);
    const glm::dquat turn = rotation_of(UpAxis::kZ, place.turn);
    node.rotation[0] = static_cast<float>(turn.x);
    node.rotation[1] = static_cast<float>(turn.y);
    node.rotation[2] = static_cast<float>(turn.z);
    node.rotation[3] = static_cast<float>(turn.w);
    if (place.centred) return {};
    // It is on the plane, as models are.
    const glm::dmat3 axes = glm::mat3_cast(turn);
    node.place[2] +=
        static_cast<float>(unit * (std::fabs(axes[0].z) * width + std::fabs(axes[1].z) * height));
    return {};
  }

  std::uint32_t node_index(const ActionRequest& action, const std::string& name) const {
    const auto found = std::find_if(known_.begin(), known_.end(), [&](const NodeSource& node) {
      return node.pattern == action.pattern && node.name == name;
    });
    return static_cast<std::uint32_t>(found - known_.begin());
  }

  Result<void> add_action(const ActionRequest& request) {
    ActionRecord action{};
    action.event = static_cast<std::uint32_t>(request.event);
    action.command = static_cast<std::uint32_t>(request.command);
    action.source = request.event == ActionEvent::kTap
                        ? node_index(request, request.source)
                        : index_of(content_, content_.patterns, request.pattern);
    action.target =
        request.command == ActionCommand::kLink ? kNone : node_index(request, request.target);
    if (!request.part.empty()) {
      MODAR_TRY(check_part(request, content_.nodes[action.source]));
      action.part = content_.intern(request.part);
    }
    if (plays_clip(action.command)) MODAR_TRY(check_clip(request, content_.nodes[action.target]));
    action.address = content_.intern(request.address);
    action.seconds = static_cast<float>(request.seconds);
    if (request.command == ActionCommand::kTurn) {
      action.axis[request.axis] = 1.0f;
      action.degrees = static_cast<float>(request.degrees);
      action.duration = static_cast<float>(request.duration);
    }
    content_.actions.push_back(action);
    return {};
  }

  [[nodiscard]] Result<void> check_clip(const ActionRequest& action, const NodeRecord& node) const {
    std::string names;
    for (const ClipRecord& clip : content_.clips) {
      if (clip.model != content_.scenes[node.subject].model) continue;
      const std::string name = content_.names.substr(clip.name.offset, clip.name.length);
      if (name == action.address) return {};
      names += (names.empty() ? "" : ", ") + name;
    }
    return cannot(action, "has no clip '" + action.address + "'",
                  names.empty() ? "its file has no animation" : "name one of " + names);
  }

  [[nodiscard]] Result<void> check_part(const ActionRequest& action, const NodeRecord& node) const {
    const ModelRecord& model = content_.models[content_.scenes[node.subject].model];
    std::vector<std::string> names;
    for (std::uint32_t m = 0; m < model.material_count; ++m) {
      const NameRef name = content_.materials[model.first_material + m].name;
      names.push_back(content_.names.substr(name.offset, name.length));
    }
    if (std::find(names.begin(), names.end(), action.part) != names.end()) return {};
    return fail(ExitCode::kUsage, "action.part", action.where,
                "the model '" + action.source + "' has no material '" + action.part + "'",
                cure_of_name(action.part, names));
  }

  const BakeRequest& request_;
  BundleContent& content_;
  Report& report_;
  const MediaSource& source_;
  std::vector<NodeSource> known_;
  std::vector<std::pair<std::string, std::string>> groups_;
  // A file is encoded once.
  std::map<std::pair<NodeKind, std::string>, std::uint32_t> media_of_file_;
};

}  // namespace

Result<void> check_nodes(const BakeRequest& request) {
  MODAR_TRY(asked_nodes(request));
  std::set<std::string> read;
  for (const NodeRequest& node : request.nodes) {
    if (node.file.empty() || !read.insert(node.file).second) continue;
    if (node.kind == NodeKind::kPicture) MODAR_TRY(read_image(node.file));
    if (node.kind == NodeKind::kVideo) MODAR_TRY(check_video(node.file));
    if (node.kind == NodeKind::kSound) MODAR_TRY(check_sound(node.file));
  }
  return {};
}

Result<BundleContent> bake_media(const NodeRequest& node, const BakeRequest& request,
                                 Report& report) {
  const VideoSize most =
      request.tier == "desktop" ? VideoSize{kMostVideoWidth, kMostVideoHeight} : VideoSize();
  const bool video = node.kind == NodeKind::kVideo;
  MODAR_ASSIGN(EncodedMedia encoded,
               video ? encode_video(node.file, most) : encode_sound(node.file));
  BundleContent part;
  MediaRecord media{};
  media.name = part.intern(file_name(node.file));
  media.kind = static_cast<std::uint32_t>(video ? MediaKind::kVideo : MediaKind::kSound);
  media.flags = encoded.info.sound_tracks > 0 ? kMediaSound : 0u;
  media.width = encoded.info.width;
  media.height = encoded.info.height;
  media.seconds = static_cast<float>(encoded.info.seconds);
  media.poster = kNone;
  if (video) {
    const TemporaryFolder folder;
    const std::string png = folder.path() + "/" + file_stem(node.file) + ".png";
    MODAR_TRY(write_poster(node.file, png));
    MODAR_ASSIGN(media.poster, add_picture(png, request.textures, part, report));
    MODAR_ASSIGN(const bool dangerous, flashes(node.file));
    if (dangerous) media.flags |= kMediaFlashes;
  }
  part.media.push_back(media);
  part.media_data.push_back(std::move(encoded.bytes));
  return part;
}

BundleContent media_content(const BundleView& part) {
  const auto bytes = [](std::span<const std::byte> data) {
    return std::vector<std::byte>(data.begin(), data.end());
  };
  BundleContent content;
  MediaRecord media = part.media()[0];
  media.name = content.intern(part.name(media.name));
  content.media.push_back(media);
  content.media_data.push_back(bytes(part.media_data(0)));
  for (std::uint32_t i = 0; i < part.textures().size(); ++i) {
    TextureRecord texture = part.textures()[i];
    texture.name = content.intern(part.name(texture.name));
    content.textures.push_back(texture);
    content.texture_data.push_back(bytes(part.texture_data(i)));
  }
  for (const TextureLevelRecord& level : part.texture_levels()) {
    content.texture_levels.push_back(level);
  }
  return content;
}

Result<void> add_nodes(const BakeRequest& request, BundleContent& content, Report& report,
                       const MediaSource& source) {
  return NodeMaker(request, content, report, source).run();
}

std::vector<Diagnostic> never_shown(const BundleContent& content) {
  std::vector<Diagnostic> found;
  for (std::uint32_t n = 0; n < content.nodes.size(); ++n) {
    const NodeRecord& node = content.nodes[n];
    const auto shows = [&](const ActionRecord& action) {
      const auto command = static_cast<ActionCommand>(action.command);
      if (command == ActionCommand::kNext) {
        return node.group != 0 && content.nodes[action.target].group == node.group;
      }
      return action.target == n &&
             (command == ActionCommand::kShow || command == ActionCommand::kToggle);
    };
    if ((node.flags & kNodeHidden) == 0 || ranges::any_of(content.actions, shows)) continue;
    const std::string name = content.names.substr(node.name.offset, node.name.length);
    found.push_back({"node.never-shown", DiagnosticSeverity::kWarning, name, 0,
                     "it is hidden, and no action shows it",
                     "add an action such as do = \"show " + name + "\", or leave hidden out"});
  }
  return found;
}

Json node_texts(const BakeRequest& request) {
  Json nodes = Json::array();
  for (const NodeRequest& node : request.nodes) {
    Json entry = {{"pattern", node.place.pattern}, {"node", node.place.name}};
    bool told = false;
    for (const auto& [key, words] : {std::pair("title", &node.titles),
                                     {"text", &node.texts},
                                     {"alt", &node.alts},
                                     {"captions", &node.captions}}) {
      if (words->empty()) continue;
      Json by_language = Json::object();
      for (const auto& [language, text] : *words) by_language.set(language, text);
      entry.set(key, std::move(by_language));
      told = true;
    }
    if (told) nodes.push_back(std::move(entry));
  }
  return nodes.size() == 0 ? Json() : nodes;
}

}  // namespace modar
