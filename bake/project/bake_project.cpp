// Incremental build: bakes changed assets and relinks the bundles that contain them.
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstring>
#include <exception>
#include <filesystem>
#include <memory>
#include <numeric>
#include <optional>
#include <set>

#include "bake/bundle/link_bundles.hpp"
#include "bake/bundle/scene/scene_nodes.hpp"
#include "bake/bundle/scene/scene_placement.hpp"
#include "bake/import/read_model.hpp"
#include "bake/io/terminal.hpp"
#include "bake/json.hpp"
#include "bake/pattern/alike_patterns.hpp"
#include "bake/pattern/pattern.hpp"
#include "bake/project/file_digests.hpp"
#include "bake/project/folder_names.hpp"
#include "bake/project/interrupts.hpp"
#include "bake/project/part_cache.hpp"
#include "bake/project/project.hpp"
#include "bake/project/settings.hpp"
#include "bake/video/encode_video.hpp"
#include "formats/base/atomic_file.hpp"
#include "formats/base/parallel.hpp"
#include "formats/base/path.hpp"
#include "formats/base/ranges.hpp"
#include "formats/content_summary.hpp"

namespace modar {
namespace {

namespace fs = std::filesystem;

constexpr const char* kState = ".modar/state.json";  // what the last bake saw; may be removed

/// A file that went into an asset, with its digest.
struct Input {
  std::string path;
  std::string digest;
};

/// One asset under the settings of one tier; tiers that set nothing for it share it.
struct Task {
  const ProjectAsset* asset = nullptr;
  std::string tier;
  Settings settings;          ///< that concern it
  std::vector<Input> inputs;  ///< its own file first; the others only where they are known
  std::set<std::string>
      textures;        ///< pictures next to a model, that are its texture by their names
  std::string action;  ///< digest of its own file, settings and program
  std::optional<std::string> key;  ///< digest of all inputs; nothing: they are not known yet
  AssetOutcome::State state = AssetOutcome::State::kFresh;
  std::string reason;
  bool wanted = false;  ///< a bundle that is not up to date needs it
  std::optional<CachedPart> part;
  std::vector<Diagnostic> diagnostics;
  std::optional<Error> error;
};

/// One file to write.
struct Target {
  std::string path;
  const ProjectTier* tier = nullptr;
  std::vector<std::size_t> models;    ///< of the tasks
  std::vector<std::size_t> patterns;  ///< the same
  std::vector<const ProjectScene*> scenes;
  std::string link;  ///< digest of all that goes in; empty where an asset's key is not known
  bool fresh = false;
};

std::string joined(const Settings& settings) {
  std::string text;
  for (const auto& [key, value] : settings) text += key + " " + value + "\n";
  return text;
}

/// What of a file shows that it was written again: size, time and inode.
std::string stamp_of(const std::string& path) {
  struct stat status {};
  if (::stat(path.c_str(), &status) != 0) return "";
  return std::to_string(status.st_size) + " " + std::to_string(status.st_mtim.tv_sec) + "." +
         std::to_string(status.st_mtim.tv_nsec) + " " + std::to_string(status.st_ino);
}

/// What a bake calls a wrong command line was written in the project's file.
Error of_file(Error error) {
  if (error.exit == ExitCode::kUsage) error.exit = ExitCode::kInvalidInput;
  return error;
}

class ProjectBake {
 public:
  ProjectBake(const Project& project, const ProjectOptions& options, PartCache cache,
              const ProgressCallback& progress)
      : project_(project), options_(options), cache_(std::move(cache)), progress_(progress) {}

  Result<ProjectOutcome> run() {
    read_state();
    program_ = options_.tool_version + " " + digests_.of("/proc/self/exe");
    for (const ProjectTier& tier : project_.tiers) {
      for (const ProjectBundle& bundle : project_.bundles) add_target(bundle, tier);
    }
    for (Task& task : tasks_) plan(task);
    for (Target& target : targets_) plan(target);
    mark_wanted();
    if (auto done = options_.dry_run ? check_scenes() : bake_and_link(); !done) {
      return tl::unexpected(of_file(std::move(done.error())));
    }
    return outcome();
  }

 private:
  // Planning.

  std::size_t task_of(const ProjectAsset& asset, const ProjectTier& tier) {
    Settings settings = project_.settings;
    for (const auto& [key, value] : tier.settings) settings[key] = value;
    for (const auto& [key, value] : asset.settings) settings[key] = value;
    settings = settings_of(settings, asset.pattern ? OptionPart::kPattern : OptionPart::kModel);
    for (std::size_t i = 0; i < tasks_.size(); ++i) {
      if (tasks_[i].asset == &asset && tasks_[i].settings == settings) return i;
    }
    Task& task = tasks_.emplace_back();
    task.asset = &asset;
    task.tier = tier.name;
    task.settings = std::move(settings);
    return tasks_.size() - 1;
  }

  void add_target(const ProjectBundle& bundle, const ProjectTier& tier) {
    Target target;
    target.tier = &tier;
    const std::string suffix = tier.name.empty() ? "" : "-" + tier.name;
    target.path =
        (fs::path(project_.path(project_.out)) / (bundle.name + suffix + ".modar")).string();
    BundleAssets assets = assets_of(project_, bundle);
    for (const ProjectAsset* pattern : assets.patterns) {
      target.patterns.push_back(task_of(*pattern, tier));
    }
    for (const ProjectAsset* model : assets.models) target.models.push_back(task_of(*model, tier));
    target.scenes = std::move(assets.scenes);
    for (const NeverShown& what : assets.never_shown) {
      if (options_.only.empty()) notes_.push_back(finding_of(what, target.path));
    }
    targets_.push_back(std::move(target));
  }

  /// Path of a file that an asset names: relative to the asset's own folder.
  [[nodiscard]] std::string beside(const Task& task, const std::string& file) const {
    return names_.located(fs::path(project_.path(task.asset->file)).parent_path().string(), file);
  }

  /// Pictures stand alone; models and image targets name other files.
  [[nodiscard]] static bool names_files(const ProjectAsset& asset) {
    return !asset.pattern || is_target_file(asset.file) ||
           !files_of(asset.file, asset.shape).empty();
  }

  /// May a picture that is named as the model be its texture? Not where that name is a pattern's.
  [[nodiscard]] bool own_picture(const ProjectAsset& model) const {
    return std::none_of(project_.patterns.begin(), project_.patterns.end(),
                        [stem = file_stem(model.file)](const ProjectAsset& pattern) {
                          return is_own_picture(file_stem(pattern.file), stem);
                        });
  }

  /// Statements of the project about an asset, apart from its settings: the width, the shape and
  /// the copies of a pattern, what may be a model's texture.
  [[nodiscard]] std::string traits_of(const ProjectAsset& asset) const {
    if (!asset.pattern) return own_picture(asset) ? "" : "its name is a pattern's";
    return std::to_string(asset.width_mm) +
           (asset.shape.text.empty() ? "" : " " + asset.shape.text) +
           (asset.copies > 1 ? " copies " + std::to_string(asset.copies) : "");
  }

  [[nodiscard]] std::string key_of(const Task& task) const {
    std::string text = task.action + "\n";
    for (std::size_t i = 1; i < task.inputs.size(); ++i) {
      text += task.inputs[i].path + " " + task.inputs[i].digest + "\n";
    }
    return digest_of(text);
  }

  void plan(Task& task) {
    const std::string file = project_.path(task.asset->file);
    // What the reader will refuse at once may have gigabytes.
    const bool broken = !task.asset->pattern && is_broken_off(file);
    task.inputs = {{fs::path(task.asset->file).filename().string(),
                    broken ? std::string(kNoFile) : digests_.of(file)}};
    task.action = digest_of(std::string(task.asset->pattern ? "pattern" : "model") + "\n" +
                            program_ + "\n" + task.inputs[0].path + "\n" + task.inputs[0].digest +
                            "\n" + traits_of(*task.asset) + "\n" + joined(task.settings) +
                            (project_.outside ? "\noutside" : ""));
    if (!task.asset->pattern) task.textures = names_.textures_of(file, own_picture(*task.asset));
    const auto files =
        names_files(*task.asset) ? cache_.files_of(task.action) : std::vector<std::string>();
    if (files) take_inputs(task, *files);
    const bool there = task.key && cache_.has(*task.key);
    task.state = there ? AssetOutcome::State::kCached : AssetOutcome::State::kStale;
    if (!there) task.reason = reason_of(task);
  }

  void take_inputs(Task& task, const std::vector<std::string>& files) {
    std::set<std::string> named = task.textures;
    named.insert(files.begin(), files.end());
    task.inputs.resize(1);
    for (const std::string& file : named) {
      task.inputs.push_back({file, digests_.of(beside(task, file))});
    }
    task.key = key_of(task);
  }

  /// Why a task is baked: what differs from the last time.
  std::string reason_of(const Task& task) const {
    const std::optional<Json> before = last_of(task);
    if (!before) return "it is new";
    const auto text = [&](const char* key) {
      return before->find(key).value_or("").text().value_or("");
    };
    if (text("program") != program_) return "modar itself changed";
    if (text("settings") != joined(task.settings) || text("traits") != traits_of(*task.asset)) {
      return "its settings in " + fs::path(project_.file).filename().string() + " changed";
    }
    std::set<std::string> come = task.textures;
    const Json files = before->find("files").value_or(Json());
    for (std::size_t i = 0; i + 1 < files.size(); i += 2) {
      const std::string file = files.at(i)->text().value_or("");
      come.erase(file);
      const std::string digest = files.at(i + 1)->text().value_or("");
      const std::string path = i == 0 ? project_.path(task.asset->file) : beside(task, file);
      const std::string now = digests_.of(path);
      if (now == digest) continue;
      return path + (now == kNoFile      ? " is gone"
                     : digest == kNoFile ? " is there now"
                                         : " changed");
    }
    if (!come.empty()) return beside(task, *come.begin()) + " is there now";
    return "it is not in the cache";
  }

  [[nodiscard]] std::optional<Json> last_of(const Task& task) const {
    const auto found =
        last_assets_.find(task.asset->name + (task.asset->pattern ? "\np" : "\nm") + task.tier);
    return found == last_assets_.end() ? std::nullopt : std::optional(found->second);
  }

  void plan(Target& target) {
    target.link = link_of(target);
    const auto last = last_bundles_.find(relative(target));
    target.fresh = !target.link.empty() && last != last_bundles_.end() &&
                   last->second == target.link + " " + stamp_of(target.path);
  }

  /// Its path as the state has it, from wherever the bake is run.
  [[nodiscard]] std::string relative(const Target& target) const {
    return target.path.substr(project_.folder.size());
  }

  /// Empty where the key of an asset is not known yet.
  [[nodiscard]] std::string link_of(const Target& target) const {
    std::string text =
        program_ + "\n" + joined(settings_in(target)) + gates_text() + project_.light + "\n";
    for (const auto* list : {&target.models, &target.patterns}) {
      for (const std::size_t index : *list) {
        const Task& task = tasks_[index];
        if (!task.key) return "";
        text += task.asset->name + " " + *task.key + "\n";
      }
    }
    for (const ProjectScene* scene : target.scenes) text += scene_text(*scene);
    return digest_of(text);
  }

  [[nodiscard]] Settings settings_in(const Target& target) const {
    Settings settings = project_.settings;
    for (const auto& [key, value] : target.tier->settings) settings[key] = value;
    return settings;
  }

  [[nodiscard]] std::string gates_text() const {
    const ProjectGates& gates = project_.gates;
    return std::to_string(gates.min_psnr_db) + " " + std::to_string(gates.min_ssim) + " " +
           std::to_string(gates.min_score) + gates.min_grade + " " +
           std::to_string(gates.max_bytes) + "\n";
  }

  [[nodiscard]] std::string scene_text(const ProjectScene& scene) const {
    const SceneRequest& request = scene.request;
    std::string text = request.pattern + "\n" + request.model + "\n" +
                       std::string(request.up ? up_axis_name(*request.up) : "") +
                       (request.centred ? " c" : " s") + (request.size.usual ? "u" : "") +
                       std::to_string(static_cast<int>(request.size.kind)) +
                       std::to_string(static_cast<int>(request.offset.unit));
    const auto add = [&text](double number) {
      char digits[32];
      std::snprintf(digits, sizeof digits, " %.17g", number);
      text += digits;
    };
    add(request.size.value);
    for (const double number : request.turn) add(number);
    for (const double number : request.offset.value) add(number);
    if (!request.light.empty()) {
      text += "\n" + request.light + " " + digests_.of(project_.path(request.light));
    }
    for (const auto& [language, words] : scene.texts) text += "\n" + language + " " + words;
    for (const auto& [language, words] : scene.alts) text += "\nalt " + language + " " + words;
    text += "\n" + request.name + (request.hidden ? " h " : " ") + request.group;
    text += "\n" + request.clip + (request.once ? " once" : "");
    for (const NodeRequest& node : scene.nodes) text += node_text(node);
    for (const ActionRequest& action : scene.actions) text += action_text(action);
    return text + "\n";
  }

  /// With what its file holds.
  [[nodiscard]] std::string node_text(const NodeRequest& node) const {
    ProjectScene placed;
    placed.request = node.place;
    placed.texts = node.texts;
    placed.alts = node.alts;
    std::string text = "\nnode " + node.mark + scene_text(placed) + (node.plays ? "p" : "") +
                       (node.loops ? "l" : "") + std::to_string(static_cast<unsigned>(node.alpha));
    for (const float part : node.key) text += " " + std::to_string(part);
    if (!node.file.empty()) text += node.file + " " + digests_.of(project_.path(node.file));
    for (const auto& [language, words] : node.titles) text += "\ntitle " + language + " " + words;
    for (const auto& [language, file] : node.captions) {
      text += "\ncaptions " + language + " " + digests_.of(project_.path(file));
    }
    return text;
  }

  [[nodiscard]] static std::string action_text(const ActionRequest& action) {
    char numbers[128];
    std::snprintf(numbers, sizeof numbers, "\naction %u %u %d %.17g %.17g %.17g ",
                  static_cast<unsigned>(action.event), static_cast<unsigned>(action.command),
                  action.axis, action.seconds, action.degrees, action.duration);
    return numbers + action.source + "\n" + action.part + "\n" + action.target + "\n" +
           action.address;
  }

  void mark_wanted() {
    for (Target& target : targets_) {
      if (target.fresh) continue;
      for (const auto* list : {&target.models, &target.patterns}) {
        for (const std::size_t index : *list) tasks_[index].wanted = true;
      }
    }
    for (Task& task : tasks_) {
      if (!options_.only.empty()) task.wanted = task.asset->name == options_.only;
      if (!task.wanted) task.state = AssetOutcome::State::kFresh;
    }
  }

  // Baking.

  Result<void> bake_and_link() {
    std::vector<std::size_t> wanted;
    for (std::size_t i = 0; i < tasks_.size(); ++i) {
      if (tasks_[i].wanted) wanted.push_back(i);
    }
    if (wanted.empty() && std::all_of(targets_.begin(), targets_.end(),
                                      [](const Target& target) { return target.fresh; })) {
      return digests_.learnt() ? write_state() : Result<void>();
    }
    MODAR_TRY(check_scenes());
    interrupts_ = std::make_unique<Interrupts>();
    bake(wanted);
    if (options_.only.empty()) {
      for (Target& target : targets_) {
        if (target.fresh) continue;
        if (auto linked = link(target); !linked) errors_.push_back(linked.error());
      }
      MODAR_TRY(write_state());
    }
    interrupts_.reset();
    return {};
  }

  /// A fault of a scene costs no bake.
  Result<void> check_scenes() const {
    for (const Target& target : targets_) {
      if (target.fresh || !options_.only.empty()) continue;
      if (target.models.empty() && target.patterns.empty()) {
        return fail(ExitCode::kInvalidInput, "project.empty-bundle", target.path,
                    "it would contain neither a model nor a pattern", "name existing ones");
      }
      BakeRequest described;
      MODAR_TRY(describe_scenes(target, described));
      for (const SceneRequest& scene : described.scenes) {
        if (lacks_width(scene)) return no_width(scene);
      }
      for (const NodeRequest& node : described.nodes) {
        if (!lacks_width(node.place)) continue;
        Error error = no_width(node.place).value();
        error.where = node.where;
        return tl::unexpected(std::move(error));
      }
      MODAR_TRY(check_nodes(described));
    }
    return {};
  }

  /// Does it give a length on a pattern of unknown width? The bake says what cannot be read.
  [[nodiscard]] bool lacks_width(const SceneRequest& scene) const {
    if (!needs_width(scene)) return false;
    const auto pattern = ranges::find(project_.patterns, scene.pattern, &ProjectAsset::name);
    if (pattern == project_.patterns.end() || pattern->width_mm > 0) return false;
    const auto shaped = load_shaped(project_.path(pattern->file), 0, pattern->shape);
    return shaped && !(shaped->width_mm > 0);
  }

  /// Large files first, so that no thread is left alone with one at the end.
  void bake(std::vector<std::size_t>& wanted) {
    const auto bytes = [&](std::size_t index) {
      std::error_code error;
      const auto size = fs::file_size(project_.path(tasks_[index].asset->file), error);
      return error ? std::uintmax_t{0} : size;
    };
    std::vector<std::uintmax_t> sizes(tasks_.size());
    for (const std::size_t index : wanted) sizes[index] = bytes(index) + 1;
    std::stable_sort(wanted.begin(), wanted.end(),
                     [&](std::size_t a, std::size_t b) { return sizes[a] > sizes[b]; });
    const double total =
        static_cast<double>(std::accumulate(sizes.begin(), sizes.end(), std::uintmax_t{0}));
    const auto stale =
        static_cast<unsigned>(std::count_if(wanted.begin(), wanted.end(), [&](std::size_t i) {
          return tasks_[i].state == AssetOutcome::State::kStale;
        }));
    const unsigned workers = options_.memory_limited ? 1 : std::clamp(stale, 1U, options_.jobs);
    const unsigned jobs = std::max(1U, options_.jobs / workers);
    const std::string stage =
        "bake " + (stale == tasks_.size() ? "" : std::to_string(stale) + " of ") +
        std::to_string(tasks_.size()) + (tasks_.size() == 1 ? " asset" : " assets");
    double done = 0;
    parallel_rows(static_cast<std::uint32_t>(wanted.size()), workers, [&](std::uint32_t row) {
      Task& task = tasks_[wanted[row]];
      if (auto got = obtain_guarded(task, jobs); !got) {
        task.error = got.error();
        task.state = AssetOutcome::State::kFailed;
      }
      const std::lock_guard lock(mutex_);
      done += static_cast<double>(sizes[wanted[row]]);
      if (stale != 0 && progress_) progress_(stage, done / total);
    });
    for (const Task& task : tasks_) {
      if (task.error) errors_.push_back(*task.error);
    }
  }

  /// Threads must not throw; what libraries throw ends one asset.
  Result<void> obtain_guarded(Task& task, unsigned jobs) {
    try {
      return obtain(task, jobs);
    } catch (const std::bad_alloc&) {
      return fail(ExitCode::kIo, "modar.memory", task.asset->file, "there is not enough memory",
                  "use fewer --jobs, or a --memory below the machine's");
    } catch (const std::exception& error) {
      return fail(ExitCode::kInternal, "modar.bug", task.asset->file, error.what(),
                  "internal error: please report it with the file");
    }
  }

  Result<void> obtain(Task& task, unsigned jobs) {
    const std::string name = task.inputs[0].path;
    std::string reason;
    if (task.key) task.part = cache_.read(*task.key, name, reason);
    if (task.part) {
      task.state = AssetOutcome::State::kCached;
    } else {
      if (!reason.empty()) task.reason = reason;
      MODAR_TRY(bake_part(task, jobs));
      task.part = cache_.read(*task.key, name, reason);
      if (!task.part) {
        return fail(ExitCode::kIo, "cache.folder", task.asset->file,
                    "an entry written to the cache cannot be read back", "check the disk");
      }
      task.state = AssetOutcome::State::kBaked;
    }
    task.diagnostics = task.part->notes.diagnostics;
    return {};
  }

  Result<void> bake_part(Task& task, unsigned jobs) {
    const std::string file = project_.path(task.asset->file);
    BakeRequest request;
    MODAR_TRY(apply_settings(task.settings, request));
    request.tool_version = options_.tool_version;
    request.jobs = jobs;
    if (!project_.outside) request.within = project_.folder.empty() ? "." : project_.folder;
    if (task.asset->pattern) {
      request.patterns = {{file, task.asset->width_mm, task.asset->shape, {}, task.asset->copies}};
    } else {
      request.models = {file};
      request.models[0].own_picture = own_picture(*task.asset);
    }
    Report report;
    BakeTrace trace;
    MODAR_ASSIGN(const BundleContent content, build_bundle(request, report, &trace));
    if (digests_.of(file) != task.inputs[0].digest) {
      return fail(ExitCode::kIo, "project.changing", file, "it changed during the bake",
                  "bake again");
    }
    // Files outside the folder are not read, but searched next to the asset.
    for (std::string& named : trace.files) {
      if (project_.may_use(named)) continue;
      named = (fs::path(file).parent_path() / fs::path(named).filename()).string();
    }
    take_inputs(task, named_files(task, trace.files));
    PartNotes notes;
    if (!trace.model_sides.empty()) notes.model_sides = trace.model_sides[0];
    notes.diagnostics = std::move(report.diagnostics);
    const auto lock = interrupts_->writing();
    MODAR_TRY(cache_.write(*task.key, task.inputs[0].path, content, notes));
    if (!names_files(*task.asset)) return {};
    std::vector<std::string> files;
    for (std::size_t i = 1; i < task.inputs.size(); ++i) files.push_back(task.inputs[i].path);
    return cache_.write_files(task.action, files);
  }

  /// Each once, relative to the asset's folder, in byte order.
  [[nodiscard]] std::vector<std::string> named_files(const Task& task,
                                                     const std::vector<std::string>& paths) const {
    const fs::path folder =
        (fs::path(project_.path(task.asset->file)).parent_path() / "").lexically_normal();
    std::set<std::string> files;
    for (const std::string& path : paths) {
      const fs::path whole = fs::path(path).lexically_normal();
      const fs::path relative = whole.is_absolute() == folder.is_absolute()
                                    ? whole.lexically_relative(folder.empty() ? "." : folder)
                                    : whole;
      files.insert(relative.empty() ? whole.string() : relative.string());
    }
    return {files.begin(), files.end()};
  }

  // Linking.

  Result<void> link(Target& target) {
    BakeRequest described;
    MODAR_TRY(apply_settings(settings_in(target), described));
    std::vector<LinkPart> models;
    std::vector<LinkPart> patterns;
    for (auto [from, to] :
         {std::pair(&target.models, &models), std::pair(&target.patterns, &patterns)}) {
      for (const std::size_t index : *from) {
        const Task& task = tasks_[index];
        if (!task.part) return {};  // its own error is reported
        // A pattern is baked once for all tiers, those of a device included.
        const bool keypoints = described.device.empty() || task.settings.contains("parameters");
        to->push_back(
            {task.part->bundle, task.asset->name, task.part->notes.model_sides, keypoints});
      }
    }
    described.tool_version = options_.tool_version;
    if (!project_.light.empty()) described.light = project_.path(project_.light);
    MODAR_TRY(describe_scenes(target, described));
    const auto media = [&](const NodeRequest& node) { return media_of(node, target, described); };
    MODAR_ASSIGN(BundleContent content, link_bundles(models, patterns, described, media));
    add_texts(target, content);
    add_baked_apart(target, content);
    MODAR_TRY(hold_gates(target, content));
    note_budget(target, described, content);
    for (Diagnostic& alike : alike_patterns(content)) notes_.push_back(std::move(alike));
    for (Diagnostic& doubt : doubtful_scenes(content)) notes_.push_back(std::move(doubt));
    for (Diagnostic& hidden : never_shown(content)) notes_.push_back(std::move(hidden));
    return write(target, content);
  }

  /// A video or sound is encoded once, whatever bundle it goes into: the cache has it by its bytes
  /// and the settings that concern it, as it has models.
  Result<BundleContent> media_of(const NodeRequest& node, const Target& target,
                                 const BakeRequest& described) {
    const std::string name = fs::path(node.file).filename().string();
    const std::string digest = digests_.of(node.file);
    const std::string key = digest_of("media\n" + program_ + "\n" + name + "\n" + digest + "\n" +
                                      std::to_string(static_cast<unsigned>(node.kind)) + "\n" +
                                      joined(settings_of(settings_in(target), OptionPart::kModel)));
    std::string reason;
    if (const auto part = cache_.read(key, name, reason)) {
      if (part->bundle.media().size() == 1) return media_content(part->bundle);
    }
    Report report;
    MODAR_ASSIGN(BundleContent content, bake_media(node, described, report));
    if (digests_.of(node.file) != digest) {
      return fail(ExitCode::kIo, "project.changing", node.file, "it changed during the bake",
                  "bake again");
    }
    MODAR_TRY(cache_.write(key, name, content, {{}, std::move(report.diagnostics)}));
    return content;
  }

  Result<void> describe_scenes(const Target& target, BakeRequest& described) const {
    for (const ProjectScene* scene : target.scenes) {
      for (const NodeRequest& asked : scene->nodes) {
        NodeRequest node = project_.located(asked);
        for (auto& [language, captions] : node.captions) {
          MODAR_ASSIGN(captions, read_captions(captions));
        }
        described.nodes.push_back(std::move(node));
      }
      described.actions.insert(described.actions.end(), scene->actions.begin(),
                               scene->actions.end());
      if (scene->request.model.empty()) continue;
      described.scenes.push_back(scene->request);
      std::string& light = described.scenes.back().light;
      if (!light.empty()) light = project_.path(light);
    }
    return {};
  }

  static void add_texts(const Target& target, BundleContent& content) {
    Json texts = Json::array();
    for (const ProjectScene* scene : target.scenes) {
      if (scene->texts.empty() && scene->alts.empty()) continue;
      Json entry = {{"pattern", scene->request.pattern}};
      if (!scene->request.model.empty()) entry.set("model", scene->request.model);
      for (const auto& [key, words] : {std::pair("text", &scene->texts), {"alt", &scene->alts}}) {
        if (words->empty()) continue;
        Json by_language = Json::object();
        for (const auto& [language, text] : *words) by_language.set(language, text);
        entry.set(key, std::move(by_language));
      }
      texts.push_back(std::move(entry));
    }
    if (texts.size() != 0) add_to_meta("texts", std::move(texts), content);
  }

  /// States that one bake of all sources by the stated options would give something else: assets
  /// with settings of their own, and textures that several models share.
  void add_baked_apart(const Target& target, BundleContent& content) const {
    bool apart = false;
    std::set<std::string_view> textures;
    for (const auto* indices : {&target.models, &target.patterns}) {
      for (const std::size_t index : *indices) {
        const Task& task = tasks_[index];
        apart |= !task.asset->settings.empty();
        for (const TextureRecord& texture : task.part->bundle.textures()) {
          apart |= !textures.insert(task.part->bundle.name(texture.name)).second;
        }
      }
    }
    if (apart) add_to_meta("baked_apart", true, content);
  }

  static void add_to_meta(const char* key, Json value, BundleContent& content) {
    Json meta = Json::parse(content.meta);
    meta.set(key, std::move(value));
    content.meta = meta.dump();
    content.summary = content_summary_of(content);  // it states the meta's hash
  }

  [[nodiscard]] Result<void> hold_gates(const Target& target, const BundleContent& content) const {
    const ProjectGates& gates = project_.gates;
    const auto failed = [&](const NameRef& name, const char* what, double value, double least) {
      char text[160];
      std::snprintf(text, sizeof text, "%s: its %s is %.4g, and [gates] asks for %.4g",
                    content.names.substr(name.offset, name.length).c_str(), what, value, least);
      return fail(ExitCode::kInvalidInput, "project.gate", target.path, text,
                  "fix the source, or lower the gate; the bundle is not written");
    };
    for (const TextureRecord& texture : content.textures) {
      const double psnr = static_cast<double>(texture.psnr_db);
      const double ssim = static_cast<double>(texture.ssim);
      if (psnr < gates.min_psnr_db) return failed(texture.name, "PSNR", psnr, gates.min_psnr_db);
      if (ssim < gates.min_ssim) return failed(texture.name, "SSIM", ssim, gates.min_ssim);
    }
    for (const PatternRecord& pattern : content.patterns) {
      const double score = static_cast<double>(pattern.score);
      if (gates.min_score > 0 && score < gates.min_score)
        return failed(pattern.name, "score", score, gates.min_score);
      if (gates.min_grade != 0 && score < least_score(gates.min_grade)) {
        return fail(ExitCode::kInvalidInput, "project.gate", target.path,
                    content.names.substr(pattern.name.offset, pattern.name.length) +
                        ": its grade is below " + gates.min_grade + ", which [gates] asks for",
                    "take a better picture (`modar pattern score` reports its faults), or "
                    "lower the gate; the bundle is not written");
      }
    }
    return {};
  }

  void note_budget(const Target& target, const BakeRequest& described,
                   const BundleContent& content) {
    std::uint64_t bytes = 0;
    for (const auto& data : content.texture_data) bytes += data.size();
    if (described.texture_budget == 0 || bytes <= described.texture_budget) return;
    notes_.push_back({"project.texture-budget", DiagnosticSeverity::kWarning, target.path, 0,
                      "its textures take " + human_bytes(bytes) + " of the GPU memory, and " +
                          described.device + " should give " +
                          human_bytes(described.texture_budget) + " at most",
                      "lower max-texture, or make several bundles"});
  }

  Result<void> write(Target& target, const BundleContent& content) {
    std::error_code error;
    fs::create_directories(fs::path(target.path).parent_path(), error);
    const auto lock = interrupts_->writing();
    const std::string own = target.path + "." + std::to_string(::getpid());
    MODAR_TRY(save_bundle(content, own));
    const std::uintmax_t bytes = fs::file_size(own, error);
    if (project_.gates.max_bytes != 0 && bytes > project_.gates.max_bytes) {
      ::unlink(own.c_str());
      return fail(ExitCode::kInvalidInput, "project.gate", target.path,
                  "it takes " + human_bytes(bytes) + ", and [gates] allows " +
                      human_bytes(project_.gates.max_bytes),
                  "make several bundles, or raise max-bytes; the bundle is not written");
    }
    if (std::rename(own.c_str(), target.path.c_str()) != 0) {
      const std::string cause = std::strerror(errno);
      ::unlink(own.c_str());
      return fail(ExitCode::kIo, "io.commit", target.path, "cannot rename: " + cause,
                  "name another folder as out in [project]");
    }
    target.link = link_of(target);
    written_.insert(target.path);
    return {};
  }

  // What the next bake wants to know.

  void read_state() {
    const auto file = MappedFile::open(project_.path(kState));
    if (!file) return;
    const Json json =
        Json::parse({reinterpret_cast<const char*>(file->bytes().data()), file->bytes().size()});
    digests_.read(json.find("digests").value_or(Json()), project_.folder);
    const Json assets = json.find("assets").value_or(Json());
    for (std::size_t i = 0; i < assets.size(); ++i) {
      const Json one = *assets.at(i);
      last_assets_[one.find("id").value_or("").text().value_or("")] = one;
    }
    const Json bundles = json.find("bundles").value_or(Json());
    for (std::size_t i = 0; i < bundles.size(); ++i) {
      const Json one = *bundles.at(i);
      last_bundles_[one.at(0).value_or("").text().value_or("")] =
          one.at(1).value_or("").text().value_or("");
    }
  }

  Result<void> write_state() {
    std::unique_lock<std::mutex> lock;
    if (interrupts_ != nullptr) lock = interrupts_->writing();
    Json assets = Json::array();
    for (const Task& task : tasks_) {
      if (!task.key || task.error) continue;
      Json files = Json::array();
      for (const Input& input : task.inputs) {
        files.push_back(input.path);
        files.push_back(input.digest);
      }
      assets.push_back(
          {{"id", task.asset->name + (task.asset->pattern ? "\np" : "\nm") + task.tier},
           {"program", program_},
           {"settings", joined(task.settings)},
           {"traits", traits_of(*task.asset)},
           {"files", std::move(files)}});
    }
    Json bundles = Json::array();
    for (const Target& target : targets_) {
      if (!target.fresh && written_.count(target.path) == 0) continue;
      bundles.push_back(Json::array({relative(target), target.link + " " + stamp_of(target.path)}));
    }
    std::error_code error;
    const std::string path = project_.path(kState);
    fs::create_directories(fs::path(path).parent_path(), error);
    return write_file(path, std::string_view(Json({{"digests", digests_.json(project_.folder)},
                                                   {"assets", std::move(assets)},
                                                   {"bundles", std::move(bundles)}})
                                                 .dump()));
  }

  ProjectOutcome outcome() {
    ProjectOutcome outcome;
    std::set<std::string> inputs = {project_.file};
    for (const Task& task : tasks_) {
      outcome.assets.push_back({task.asset->name, task.tier, task.state, task.reason});
      const bool told =
          task.state == AssetOutcome::State::kFresh || task.state == AssetOutcome::State::kCached;
      if (told) outcome.assets.back().reason.clear();
      outcome.diagnostics.insert(outcome.diagnostics.end(), task.diagnostics.begin(),
                                 task.diagnostics.end());
      if (!options_.only.empty() && !task.wanted) continue;
      inputs.insert(project_.path(task.asset->file));
      for (std::size_t i = 1; i < task.inputs.size(); ++i) {
        if (task.inputs[i].digest != kNoFile) inputs.insert(beside(task, task.inputs[i].path));
      }
    }
    for (const ProjectScene& scene : project_.scenes) {
      if (!options_.only.empty()) continue;
      if (!scene.request.light.empty()) inputs.insert(project_.path(scene.request.light));
      for (const NodeRequest& node : scene.nodes) add_files(project_.located(node), inputs);
    }
    outcome.inputs.assign(inputs.begin(), inputs.end());
    outcome.diagnostics.insert(outcome.diagnostics.end(), notes_.begin(), notes_.end());
    if (options_.only.empty()) {
      for (const Target& target : targets_) {
        std::error_code error;
        const std::uintmax_t bytes = fs::file_size(target.path, error);
        outcome.bundles.push_back(
            {target.path, error ? 0 : bytes, written_.count(target.path) != 0, target.fresh});
      }
    }
    ranges::transform(errors_, std::back_inserter(outcome.errors), of_file);
    return outcome;
  }

  const Project& project_;
  const ProjectOptions& options_;
  PartCache cache_;
  const ProgressCallback& progress_;
  mutable FileDigests digests_;
  mutable FolderNames names_;
  std::string program_;  ///< version and digest of this very program
  std::vector<Task> tasks_;
  std::vector<Target> targets_;
  std::map<std::string, Json> last_assets_;
  std::map<std::string, std::string> last_bundles_;
  std::unique_ptr<Interrupts> interrupts_;
  std::mutex mutex_;  ///< of the progress
  std::set<std::string> written_;
  std::vector<Diagnostic> notes_;
  std::vector<Error> errors_;
};

}  // namespace

Result<ProjectOutcome> bake_project(const Project& project, const ProjectOptions& options,
                                    const ProgressCallback& progress) {
  const std::string own = project.cache.empty() ? kCacheFolder : project.cache;
  MODAR_ASSIGN(auto signer, read_cache_key(options.cache_key));
  PartCache cache(options.cache.empty() ? project.path(own) : options.cache, std::move(signer));
  return ProjectBake(project, options, std::move(cache), progress).run();
}

}  // namespace modar
