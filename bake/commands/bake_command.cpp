// `modar bake`: models and pattern images to one bundle.
#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <thread>

#include "bake/bundle/bundle_builder.hpp"
#include "bake/bundle/bundle_json.hpp"
#include "bake/bundle/files/sorted_files.hpp"
#include "bake/check/source/reproduce.hpp"
#include "bake/commands/bake_options.hpp"
#include "bake/commands/commands.hpp"
#include "bake/commands/project_command.hpp"
#include "bake/image/image.hpp"
#include "bake/import/read_model.hpp"
#include "bake/io/input.hpp"
#include "bake/io/output.hpp"
#include "bake/io/terminal.hpp"
#include "bake/memory/memory_limit.hpp"
#include "bake/options/request_text.hpp"
#include "formats/bundle_view.hpp"
#include "modar/mapped_file.hpp"

namespace modar {
namespace {

struct BakeCommand {
  BakeRequest request;
  std::string output;
  bool prove_reproducible = false;
  bool quiet = false;
  bool notes = false;
  bool json = false;
  bool progress_json = false;
  // Arguments as text, before they are parsed into the request.
  std::vector<std::string> files;
  std::vector<std::string> models;
  std::vector<std::string> patterns;
  std::vector<std::string> scenes;
  OptionTexts texts;
  std::vector<Diagnostic> said;  ///< of the files, before the bake
  ProjectCommand project;
};

/// Sorts the files that no option names into pictures and models. Of files that are not read the
/// rest is baked, as `modar init` does, unless they were the only ones of their kind.
Result<void> take_files(BakeCommand& command) {
  std::map<std::string, std::string> texts;  // by path
  std::vector<std::string> paths;
  for (const std::string& text : command.files) {
    std::error_code ignored;
    if (std::filesystem::is_directory(text, ignored)) {
      return fail(ExitCode::kUsage, "bake.folder", text, "a folder is baked as a project",
                  "run `modar init` and `modar bake` in it");
    }
    MODAR_ASSIGN(const PatternRequest picture, parse_pattern(text));
    texts[picture.path] = text;
    paths.push_back(picture.path);
  }
  const SortedFiles sorted = sort_files(paths);
  for (const std::string& path : paths) {
    if (std::error_code error; !std::filesystem::exists(path, error)) MODAR_TRY(read_file(path, 0));
  }
  for (const std::string& path : sorted.pictures) command.patterns.push_back(texts[path]);
  for (const auto* list : {&sorted.models, &sorted.others}) {
    for (const std::string& path : *list) {
      if (is_material_file(path)) continue;
      MODAR_TRY(require_model_format(path));
      command.models.push_back(texts[path]);
    }
  }
  for (const std::string& path : sorted.textures) {
    command.said.push_back({"bake.texture", DiagnosticSeverity::kInfo, path, 0,
                            "it is a model's texture, so no pattern", "--pattern makes it one"});
  }
  for (const LeftOut& one : sorted.left_out) {
    const bool picture = is_picture_file(one.file) || is_foreign_picture_file(one.file);
    const bool only = picture ? command.patterns.empty() : command.models.empty();
    if (only || one.error.exit != ExitCode::kUnsupported) return tl::unexpected(one.error);
    command.said.push_back({one.error.code, DiagnosticSeverity::kWarning, one.file, 0,
                            "left out: " + one.error.cause, one.error.cure});
  }
  return {};
}

/// Of a bake by --model and --pattern.
Result<void> refuse_project_options(const BakeCommand& command) {
  if (command.output.empty()) {
    return fail(ExitCode::kUsage, "bake.no-output", "-o", "the bundle has no name",
                "add -o OUT.modar");
  }
  const ProjectCommand& project = command.project;
  if (project.file.empty() && project.cache.empty() && project.asset.empty() &&
      project.depfile.empty() && !project.dry_run && !project.explain) {
    return {};
  }
  return fail(ExitCode::kUsage, "bake.project-option", "--model, --pattern",
              "options of projects do not go with them", "name the files in modar.toml instead");
}

/// Reads what the options say as text into the request.
Result<void> complete(BakeCommand& command) {
  BakeRequest& request = command.request;
  MODAR_TRY(take_texts(command.texts, request));
  for (const std::string& text : command.models) request.models.push_back(parse_model(text));
  for (const std::string& text : command.patterns) {
    MODAR_ASSIGN(PatternRequest pattern, parse_pattern(text));
    MODAR_TRY(find_picture(pattern, command.said));
    request.patterns.push_back(std::move(pattern));
  }
  for (const std::string& text : command.scenes) {
    MODAR_ASSIGN(SceneRequest scene, parse_scene(text));
    if (scene.light.empty()) scene.light = request.light;
    request.scenes.push_back(std::move(scene));
  }
  request.tool_version = MODAR_VERSION;
  return name_assets(request);
}

void print_summary(const BundleView& bundle, const Report& report, const std::string& path) {
  for (std::uint32_t m = 0; m < bundle.models().size(); ++m) {
    const ModelRecord& model = bundle.models()[m];
    std::fprintf(stderr, "model   %-16s %llu triangles, %llu vertices, %u %s, off by at most %s\n",
                 std::string(bundle.name(model.name)).c_str(),
                 static_cast<unsigned long long>(model.triangle_count),
                 static_cast<unsigned long long>(model.vertex_count), model.chunk_count,
                 model.chunk_count == 1 ? "chunk" : "chunks",
                 length_words(model.position_error_max, model).c_str());
    if (const auto topology = stated_topology(bundle, m)) {
      std::fprintf(stderr, "        %s\n", topology_words(*topology).c_str());
    }
    if (const auto repair = stated_repair(bundle, m)) {
      std::fprintf(stderr, "        %s\n", repair_words(*repair).c_str());
    }
    if (const std::string levels = level_words(bundle, m); !levels.empty()) {
      std::fprintf(stderr, "        %s\n", levels.c_str());
    }
  }
  for (const TextureRecord& texture : bundle.textures()) {
    std::fprintf(stderr, "texture %-16s %u x %u, %u levels, %.2f dB\n",
                 std::string(bundle.name(texture.name)).c_str(), texture.width, texture.height,
                 texture.level_count, static_cast<double>(texture.psnr_db));
  }
  for (std::uint32_t p = 0; p < bundle.patterns().size(); ++p) {
    const PatternRecord& pattern = bundle.patterns()[p];
    std::string counts;
    for (const ParameterSetRecord& set : bundle.parameter_sets()) {
      counts += " " + std::string(bundle.name(set.name)) + "=" +
                std::to_string(bundle.features(p, set.id).keypoints.size());
    }
    const auto range = stated_range(bundle, p);
    const std::string graded = range ? std::string(", grade ") + grade_of(*range) : "";
    std::fprintf(stderr, "pattern %-16s %u x %u%s%s%s\n",
                 std::string(bundle.name(pattern.name)).c_str(), pattern.width, pattern.height,
                 graded.c_str(), counts.empty() ? "" : ", keypoints", counts.c_str());
  }
  print_scenes(bundle);
  double ms = 0;
  for (const StageReport& stage : report.stages) ms += stage.ms;
  std::fprintf(stderr, "%s: %s, baked in %.1f s\n", path.c_str(),
               human_bytes(bundle.bytes().size()).c_str(), ms / 1000);
}

/// Says so where the limit was passed.
void report_memory(const BakeRequest& request, Report& report) {
  const std::uint64_t peak = process_cost().peak_rss_bytes;
  if (request.memory_bytes == 0 || peak <= request.memory_bytes) return;
  report.diagnostics.push_back({"bake.memory", DiagnosticSeverity::kWarning, "--memory", 0,
                                "the bake took " + human_bytes(peak) + ", more than requested",
                                "fewer --jobs, smaller textures or several bundles take less"});
}

Json bake_json(const BundleView& bundle, const Report& report) {
  const Json stages = Json::list(report.stages, [&](const StageReport& stage) -> Json {
    return {{"name", stage.name},
            {"ms", stage.ms},
            {"in", stage.in},
            {"out", stage.out},
            {"max_error", stage.max_error}};
  });
  Json half_edges = Json::array();
  for (const MeshTopology& topology : report.topologies) {
    if (!topology.half_edges) continue;
    half_edges.push_back({{"model", topology.model},
                          {"boundary_loops", topology.half_edges->boundary_loops},
                          {"copied_faces", topology.half_edges->copied_faces},
                          {"copied_vertices", topology.half_edges->copied_vertices}});
  }
  const Json defects = Json::list(report.defects, [](const MeshDefects& one) -> Json {
    Json json = defects_json(one);
    json.set("model", one.model);
    return json;
  });
  const auto fate = [](const Fate& one) -> Json {
    return {{"used", one.used}, {"changed", one.changed}, {"left_out", one.left_out}};
  };
  const Json account = Json::list(report.accounts, [&](const Account& one) -> Json {
    return {{"model", one.model},
            {"images", fate(one.images)},
            {"colours", fate(one.colours)},
            {"faces", fate(one.faces)},
            {"nodes", fate(one.nodes)},
            {"animations", fate(one.animations)},
            {"attributes", fate(one.attributes)}};
  });
  const ProcessCost cost = process_cost();
  return {{"bundle", bundle_json(bundle)},
          {"account", account},
          {"half_edges", half_edges},
          {"defects", defects},
          {"stages", stages},
          {"findings", diagnostics_json(report.diagnostics)},
          {"cpu_seconds", cost.cpu_seconds},
          {"peak_rss_bytes", cost.peak_rss_bytes}};
}

/// Bytes of an OBJ per byte of its bundle at most. Less free disk than that cannot hold any bundle
/// of it.
constexpr std::uint64_t kSourceBytesPerBundleByte = 8;

/// Refuses to write over a file that is no bundle by its name and its bytes, since textures and
/// material files, which the models name, are known only later; and a name of another format.
Result<void> keep_other_files(const std::string& output) {
  if (output.ends_with(".modar")) return {};
  MODAR_TRY(keep_other_kinds(output, "bundle", [](std::string_view start) {
    return std::equal(kMagic.begin(), kMagic.end(), start.begin(),
                      start.begin() + std::min(start.size(), kMagic.size()),
                      [](std::uint8_t a, char b) { return a == static_cast<std::uint8_t>(b); });
  }));
  if (!is_picture_file(output) && !is_foreign_picture_file(output) && !is_model_file(output) &&
      !is_material_file(output)) {
    return {};
  }
  const auto name = std::filesystem::path(output).replace_extension(".modar");
  return fail(ExitCode::kUsage, "out.name", output,
              "a bundle is written, and the name is that of another kind of file",
              "write -o " + name.string());
}

/// Tries what will be written, before the work.
Result<void> try_outputs(const BakeCommand& command) {
  std::vector<std::string> models;
  for (const ModelRequest& model : command.request.models) models.push_back(model.path);
  std::vector<std::string> inputs = models;
  for (const PatternRequest& pattern : command.request.patterns) inputs.push_back(pattern.path);
  MODAR_TRY(keep_inputs(command.output, inputs));
  MODAR_TRY(keep_other_files(command.output));
  MODAR_TRY(try_output(command.output, file_bytes(models) / kSourceBytesPerBundleByte));
  const std::string& folder = command.request.textures.picture_folder;
  return folder.empty() ? Result<void>() : make_output_folder(folder);
}

Result<ExitCode> run_bake(BakeCommand& command, const std::vector<std::string>& words) {
  MODAR_TRY(take_files(command));
  if (command.models.empty() && command.patterns.empty()) {
    return run_project(command.project,
                       {command.request.jobs, command.request.memory_bytes, command.quiet,
                        command.json, command.notes, command.progress_json},
                       words);
  }
  MODAR_TRY(refuse_project_options(command));
  MODAR_TRY(complete(command));
  MODAR_TRY(try_outputs(command));
  MODAR_TRY(require_shown(command.request));
  std::unique_ptr<MemoryLimit> limit;
  if (command.request.memory_bytes != 0) {
    const auto folder = std::filesystem::absolute(command.output).parent_path();
    MODAR_ASSIGN(auto started, MemoryLimit::start(folder.string(), command.request.memory_bytes));
    limit = std::move(started);
  }
  ProgressBar bar(command.quiet, command.progress_json);
  Report report;
  report.diagnostics = command.said;
  report.progress = [&](const std::string& stage, double done) { bar.show(stage, done); };

  Result<BundleContent> content = build_bundle(command.request, report);
  bar.clear();
  report_memory(command.request, report);
  if (!command.quiet) {
    print_findings(report.diagnostics, command.notes);
  }
  if (!content) return tl::unexpected(content.error());
  StageTimer writing(report, "write");
  MODAR_TRY(save_bundle(*content, command.output));

  // The report of the bundle is read back from the file, so that it is true of the file.
  MODAR_ASSIGN(auto file, MappedFile::open(command.output));
  MODAR_ASSIGN(auto bundle, BundleView::open(file.bytes()));
  if (command.prove_reproducible) {
    bar.show("bake again", 0);
    auto proven = prove_reproducible(command.request, words, file.bytes());
    bar.clear();
    MODAR_TRY(std::move(proven));
    if (!command.quiet) std::fprintf(stderr, "a second bake elsewhere gave the same bytes\n");
  }
  writing.done(content->models.size() + content->patterns.size(), file.bytes().size());
  bar.clear();
  if (!command.quiet) {
    print_summary(bundle, report, command.output);
    print_losses(report.diagnostics);
  }
  if (command.json) std::fputs(bake_json(bundle, report).dump().c_str(), stdout);
  return ExitCode::kOk;
}

void add_input_options(CommandLine& line, BakeCommand& command) {
  line.group("Input and output");
  line.option("files", &command.files, "Models and pictures: short for --model and --pattern",
              {.type = "FILE"});
  line.option("--model", &command.models,
              "OBJ, glTF, GLB, PLY or STL files; NAME=FILE gives the model another name",
              {.type = "[NAME=]FILE"});
  line.option(
      "--pattern", &command.patterns,
      "Pictures of flat things, or photos in which their corners are found (:shape=flat takes the "
      "whole file); :210mm, :21cm or :8.3in states the printed width; "
      ":shape=cylinder,diameter=66mm,arc=120 is a label around a bottle, "
      ":shape=cone,top=80mm,bottom=60mm,arc=100 one around a cup, "
      ":shape=box,size=120x180x40mm,right=FILE a box (also back, left, top and bottom); :copies=4 "
      "tracks up to four of it at once",
      {.type = "FILE[:WIDTH][:shape=...][:copies=N]"});
  line.option(
      "--scene", &command.scenes,
      "Which model is on which pattern (required if there are several of either), and how: "
      "height=120mm or width=80mm or scale=0.8 (of the pattern's longest side), up=x|y|z|-x|-y|-z, "
      "turn=DEGREES or turn=X:Y:Z, offset=X:Y:Z (in mm if the pattern's width is known, else in "
      "longest sides), centred, light=FILE, clip=NAME (of the model's; none: it keeps still), once "
      "(the clip does not loop)",
      {.type = "PATTERN=MODEL[,KEY=VALUE...]"});
  line.option("-o,--output", &command.output, "Bundle to write", {.type = "OUT.modar"});
}

void add_texture_gates(CommandLine& line, TextureOptions& textures) {
  line.option("--min-psnr", &textures.min_psnr_db, "Report textures below this PSNR, in dB");
  line.option("--min-ssim", &textures.min_ssim, "Report textures below this SSIM",
              {.least = 0, .most = 1});
  line.option("--texture-pictures", &textures.picture_folder,
              "Write each texture's source, decoded image and difference as PNG files",
              {.type = "DIR"});
}

void add_run_options(CommandLine& line, BakeCommand& command) {
  line.group("Run and report", Shown::kInFull);
  line.option("--jobs", &command.request.jobs, "Threads; the output does not depend on it",
              {.shows_default = true, .least = 1, .most = 256});
  line.size("--memory", command.request.memory_bytes,
            "Memory limit (1G, 800M): large arrays are kept in files next to the bundle",
            {.type = "SIZE"});
  line.flag("--prove-reproducible", command.prove_reproducible,
            "Bake again with other threads, paths, locale and time zone, and compare the bytes");
  line.flag("--quiet", command.quiet, "No progress, summary or diagnostics on stderr");
  line.flag("--notes", command.notes, "Show every note, not just the first of each kind");
  line.flag("--json", command.json, "Print contents, stages and diagnostics as JSON");
  line.flag("--progress-json", command.progress_json,
            "Print progress as lines of JSON on stderr, for programs");
}

}  // namespace

void add_bake(CommandLine& program) {
  CommandLine& line = program.command("bake", "Bake models and pattern images into one bundle");
  const auto command = std::make_shared<BakeCommand>();
  BakeRequest& request = command->request;
  request.jobs = std::max(1u, std::thread::hardware_concurrency());
  add_input_options(line, *command);
  add_project_options(line, command->project);
  line.group("Units, light and target devices");
  add_bake_options(line, OptionGroup::kTarget, request, command->texts);
  line.group("Geometry", Shown::kInFull);
  add_bake_options(line, OptionGroup::kGeometry, request, command->texts);
  line.group("Textures", Shown::kInFull);
  add_bake_options(line, OptionGroup::kTextures, request, command->texts);
  add_texture_gates(line, request.textures);
  line.group("Patterns", Shown::kInFull);
  add_bake_options(line, OptionGroup::kPatterns, request, command->texts);
  add_run_options(line, *command);
  line.footer(
      example("  modar bake spider.obj box.png:210mm -o spider.modar\n"
              "  modar bake spider.obj vase.glb box.png:210mm --scene box=spider,up=y,scale=0.8"
              " --scene box=vase,offset=0:40:0 -o both.modar\n"
              "  modar init && modar bake    # a whole folder; later only what changed\n"));
  line.run([command, &program] { return run_bake(*command, program.words()); });
}

}  // namespace modar
