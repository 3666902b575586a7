// `modar adopt`: a page for MindAR or 8th Wall's image targets, with a bundle of its pictures.
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <map>
#include <memory>
#include <regex>
#include <set>
#include <thread>

#include "bake/bundle/bundle_builder.hpp"
#include "bake/commands/commands.hpp"
#include "bake/io/input.hpp"
#include "bake/io/output.hpp"
#include "bake/io/terminal.hpp"
#include "bake/options/request_text.hpp"
#include "formats/base/atomic_file.hpp"
#include "formats/bundle_writer.hpp"

namespace modar {
namespace {

namespace fs = std::filesystem;

/// Of a page's text: enough for any that people write.
constexpr std::size_t kMostPageBytes = std::size_t{16} << 20U;

struct AdoptCommand {
  std::string page;
  std::vector<std::string> images;
  std::string output;
  std::string script = "modar/adapters/aframe.js";
  bool write = false;
  bool quiet = false;
};

/// What a page says of its targets.
struct Targets {
  bool mindar = false;
  std::string mind;                ///< address of MindAR's compiled file
  std::size_t count = 1;           ///< of MindAR's targets, by the largest index
  std::vector<std::string> names;  ///< of 8th Wall's targets, in the page's order
};

/// The texts of the first group of all matches.
std::vector<std::string> matches(const std::string& text, const std::string& pattern) {
  std::vector<std::string> found;
  const std::regex expression(pattern, std::regex::icase);
  for (std::sregex_iterator at(text.begin(), text.end(), expression), end; at != end; ++at) {
    found.push_back((*at)[1].str());
  }
  return found;
}

Result<Targets> targets_of(const std::string& page, const std::string& text) {
  Targets targets;
  if (const auto minds = matches(text, R"(imageTargetSrc\s*:\s*([^;"']+))"); !minds.empty()) {
    targets.mindar = true;
    targets.mind = minds.front();
    for (const std::string& index : matches(text, R"(targetIndex\s*:\s*(\d{1,3})\b)")) {
      targets.count = std::max(targets.count, std::size_t{1} + std::stoul(index));
    }
    return targets;
  }
  if (matches(text, R"(<a-scene[^>]*(\bxrweb\b))").empty()) {
    return fail(ExitCode::kUsage, "adopt.page", page,
                "it has neither mindar-image with an imageTargetSrc nor xrweb of 8th Wall",
                "name the HTML file with <a-scene>");
  }
  const std::string name =
      R"re(<[^>]*\bxrextras-named-image-target(?:\s+|=")[^>]*?\bname[=:]\s*"?)re"
      R"re(([^";>]+))re";
  for (const std::string& each : matches(text, name)) {
    if (std::count(targets.names.begin(), targets.names.end(), each) == 0) {
      targets.names.push_back(each);
    }
  }
  return targets;
}

/// The file of a picture with this stem in a folder; empty: none. MindAR and 8th Wall take these.
std::string picture_of(const fs::path& folder, const std::string& stem, bool json) {
  for (const char* ending : {".json", ".png", ".jpg", ".jpeg", ".webp"}) {
    if (!json && std::string_view(ending) == ".json") continue;
    const std::string path = (folder / (stem + ending)).lexically_normal().string();
    if (is_regular_file(path)) return path;
  }
  return {};
}

/// The picture from which a .mind file was compiled: next to it, or an <img> of the page.
std::string original_of(const AdoptCommand& command, const std::string& text,
                        const std::string& mind) {
  const fs::path folder = fs::path(command.page).parent_path();
  const std::string stem = fs::path(mind).stem().string();
  if (const std::string path = picture_of(folder / fs::path(mind).parent_path(), stem, false);
      !path.empty()) {
    return path;
  }
  for (const std::string& image : matches(text, R"re(<img[^>]*\bsrc="([^"]+)")re")) {
    const fs::path path = folder / image;
    if (path.stem() == stem && is_regular_file(path.string())) return path.string();
  }
  return {};
}

tl::unexpected<Error> ask(const std::string& where, const std::string& cause,
                          const std::string& cure) {
  return fail(ExitCode::kUsage, "adopt.image", where, cause, cure);
}

Result<std::vector<std::string>> pictures_of(const AdoptCommand& command, const Targets& targets,
                                             const std::string& text) {
  std::vector<std::string> pictures = command.images;
  const fs::path folder = fs::path(command.page).parent_path();
  if (targets.mindar) {
    if (pictures.empty()) {
      const std::string one = original_of(command, text, targets.mind);
      if (targets.count == 1 && !one.empty()) pictures = {one};
    }
    if (pictures.size() < targets.count) {
      return ask(targets.mind, "a .mind file has no usable picture, and the page names no original",
                 "pass the " + std::to_string(targets.count) +
                     " pictures in the compiler's order: --image first.jpg --image second.jpg");
    }
    return pictures;
  }
  if (!pictures.empty()) return pictures;
  for (const std::string& name : targets.names) {
    for (const char* place : {"image-targets", "targets", "assets/image-targets", "assets", "."}) {
      const std::string path = picture_of(folder / place, name, true);
      if (path.empty()) continue;
      pictures.push_back(path);
      break;
    }
  }
  if (pictures.size() != targets.names.size() || pictures.empty()) {
    return ask(
        command.page, "not every image target has a picture in image-targets/ or targets/",
        "pass the pictures or the exported NAME.json files: --image image-targets/NAME.json");
  }
  return pictures;
}

Result<void> bake_pictures(const AdoptCommand& command, const std::vector<std::string>& pictures) {
  BakeRequest request;
  request.jobs = std::max(1U, std::thread::hardware_concurrency());
  request.tool_version = MODAR_VERSION;
  for (const std::string& picture : pictures) {
    MODAR_ASSIGN(PatternRequest pattern, parse_pattern(picture));
    request.patterns.push_back(std::move(pattern));
  }
  MODAR_TRY(name_assets(request));
  MODAR_TRY(keep_inputs(command.output, pictures));
  Report report;
  ProgressBar bar(command.quiet);
  report.progress = [&](const std::string& stage, double done) { bar.show(stage, done); };
  Result<BundleContent> content = build_bundle(request, report);
  bar.clear();
  if (!command.quiet) print_findings(report.diagnostics, false);
  if (!content) return tl::unexpected(content.error());
  return save_bundle(*content, command.output);
}

/// The page's text with the bundle and our script in place of theirs.
std::string adopted(const AdoptCommand& command, const Targets& targets, std::string text) {
  const auto replace = [&](const char* pattern, const std::string& by) {
    text = std::regex_replace(text, std::regex(pattern, std::regex::icase), by);
  };
  const fs::path folder = fs::path(command.page).parent_path();
  const std::string bundle = fs::path(command.output).lexically_proximate(folder).generic_string();
  if (targets.mindar) {
    replace(R"re((<script[^>]*\bsrc=")[^"]*(?:mindar-image[^"/]*|image-target/aframe)\.js("))re",
            "$1" + command.script + "$2");
    replace(R"((imageTargetSrc\s*:\s*)[^;"']+)", "$1" + bundle);
    return text;
  }
  // Components have to be there before <a-scene>: without async.
  replace(R"re(<script[^>]*\bsrc=["'][^"']*(?:/xrweb\b|/xr\.js\b)[^>]*>)re",
          "<script src=\"" + command.script + "\" data-bundle=\"" + bundle + "\">");
  replace(R"re((<script[^>]*\bsrc=["'])[^"']*8frame-(\d+\.\d+\.\d+)[^"']*(["']))re",
          "$1https://aframe.io/releases/$2/aframe.min.js$3");
  replace(
      R"re([ \t]*<script[^>]*\bsrc=["'][^"']*(?:xrextras|landing-page)\.js["'][^>]*></script>\r?\n?)re",
      "");
  return text;
}

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  for (const std::string_view line : split(text, '\n')) lines.emplace_back(line);
  return lines;
}

/// The lines that differ, as diff prints them. Lines are removed and changed, never added.
void print_changes(const std::string& before, const std::string& after) {
  const std::vector<std::string> old_lines = lines_of(before), new_lines = lines_of(after);
  std::size_t at = 0;
  const auto remaining = [&](std::size_t line) { return old_lines.size() - line; };
  for (std::size_t line = 0; line < old_lines.size(); ++line) {
    if (at < new_lines.size() && old_lines[line] == new_lines[at]) {
      ++at;
      continue;
    }
    std::printf("%zu: - %s\n", line + 1, old_lines[line].c_str());
    const bool removed = remaining(line) > new_lines.size() - at &&
                         (line + 1 == old_lines.size() || old_lines[line + 1] == new_lines[at]);
    if (!removed && at < new_lines.size()) {
      std::printf("%zu: + %s\n", line + 1, new_lines[at++].c_str());
    }
  }
}

Result<ExitCode> run_adopt(AdoptCommand& command) {
  MODAR_ASSIGN(const std::string text, read_file(command.page, kMostPageBytes));
  MODAR_ASSIGN(const Targets targets, targets_of(command.page, text));
  MODAR_ASSIGN(const auto pictures, pictures_of(command, targets, text));
  if (command.output.empty()) {
    command.output = fs::path(command.page).replace_extension(".modar").string();
  }
  const std::string page = adopted(command, targets, text);
  const std::string kept = command.page + ".orig";
  if (command.write && fs::exists(kept)) {
    return fail(ExitCode::kUsage, "adopt.kept", kept, "the page was adopted before",
                "move this original elsewhere first");
  }
  MODAR_TRY(bake_pictures(command, pictures));
  print_changes(text, page);
  if (command.write) {
    MODAR_TRY(write_file(kept, std::string_view(text)));
    MODAR_TRY(write_file(command.page, std::string_view(page)));
  }
  if (!command.quiet) {
    std::fprintf(stderr, "%s: %zu pictures\n", command.output.c_str(), pictures.size());
  }
  return ExitCode::kOk;
}

}  // namespace

void add_adopt(CommandLine& program) {
  CommandLine& line = program.command(
      "adopt", "Bake the pictures of a page for MindAR or 8th Wall, and show what to change in it");
  const auto command = std::make_shared<AdoptCommand>();
  line.option("page", &command->page, "Page with <a-scene>",
              {.type = "PAGE.html", .required = true});
  line.option("--image", &command->images,
              "Picture of a target, or 8th Wall's NAME.json, in the order of the targets",
              {.type = "FILE", .repeatable = true});
  line.option("-o,--output", &command->output, "Bundle to write; without: PAGE.modar",
              {.type = "FILE.modar"});
  line.option("--script", &command->script, "Address of the npm package's adapters/aframe.js",
              {.type = "URL", .shows_default = true});
  line.flag("--write", command->write, "Change the page; the original becomes PAGE.html.orig");
  line.flag("--quiet", command->quiet, "No progress or findings on stderr");
  line.footer(example("  modar adopt index.html --write\n"));
  line.run([command] { return run_adopt(*command); });
}

}  // namespace modar
