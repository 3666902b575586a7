// Writes the page from the bundle's records and pictures.
#include "bake/extensions/report/report_page.hpp"

#include <algorithm>
#include <cstdarg>
#include <cstdio>
#include <filesystem>
#include <map>
#include <optional>
#include <vector>

#include "bake/bundle/bundle_json.hpp"
#include "bake/bundle/scene/scene_placement.hpp"
#include "bake/check/content/content_check.hpp"
#include "bake/check/verdict.hpp"
#include "bake/extensions/report/model_pictures.hpp"
#include "bake/extensions/report/nodes_section.hpp"
#include "bake/extensions/report/treemap.hpp"
#include "bake/image/image.hpp"
#include "bake/io/terminal.hpp"
#include "bake/pattern/pattern.hpp"
#include "bake/process/process.hpp"
#include "bake/texture/texture_codec.hpp"
#include "formats/base/html.hpp"
#include "formats/tracker_record.hpp"
#include "modar/device_profile.hpp"
#include "modar/release.hpp"

namespace modar {
namespace {

constexpr const char* kStyle =
#include "report_style.inc"
    ;

// Pictures of a page weigh: beyond this many models they get smaller. A page of 60 models stays
// below some 10 MB with it.
constexpr std::size_t kManyModels = 20;
constexpr std::size_t kWireTriangles = 1500;     // a path of 50 bytes each
constexpr std::size_t kShownFeatures = 700;      // more hide the pattern
constexpr std::uint32_t kTextureSide = 256;      // of a thumbnail, pixels
constexpr std::uint32_t kComparisonSide = 1200;  // of three textures side by side: a page's width

[[gnu::format(printf, 1, 2)]] std::string print(const char* format, ...) {
  va_list arguments;
  va_start(arguments, format);
  char text[512];
  std::vsnprintf(text, sizeof text, format, arguments);
  va_end(arguments);
  return text;
}

/// "1,234,567".
std::string grouped(std::uint64_t number) {
  std::string digits = std::to_string(number);
  for (std::size_t at = digits.size(); at > 3;) digits.insert(at -= 3, ",");
  return digits;
}

/// "1 model", "2 models": the noun alone.
std::string noun(std::uint64_t count, const char* one) {
  return count == 1 ? one : std::string(one) + "s";
}

/// Begins with a capital and ends with a full stop.
std::string sentence(std::string words) {
  if (!words.empty() && words[0] >= 'a' && words[0] <= 'z')
    words[0] = static_cast<char>(words[0] - 'a' + 'A');
  return words.ends_with('.') ? words : words + ".";
}

/// At most this many bytes of a text, whole characters of UTF-8, and a sign that some are missing.
std::string shortened(const std::string& text, std::size_t room) {
  if (text.size() <= room) return text;
  std::size_t end = room - 1;
  while (end > 0 && (static_cast<unsigned char>(text[end]) & 0xC0U) == 0x80U) --end;
  return text.substr(0, end) + "…";
}

std::string row(const char* name, const std::string& value) {
  return std::string("<dt>") + name + "</dt><dd>" + escape_html(value) + "</dd>";
}

Result<std::string> data_uri(const RgbaImage& image) {
  MODAR_ASSIGN(const auto png, encode_png(image));
  return "data:image/png;base64," +
         to_base64({reinterpret_cast<const std::uint8_t*>(png.data()), png.size()});
}

/// A quarter of the width and height, by means of 4x4 pixels.
RgbaImage quartered(const RgbaImage& image) {
  RgbaImage small{image.width / 4, image.height / 4, {}};
  for (std::size_t y = 0; y < small.height; ++y) {
    for (std::size_t x = 0; x < 4 * std::size_t{small.width}; ++x) {
      unsigned sum = 0;
      for (std::size_t k = 0; k < 16; ++k) {
        sum += image.pixels[4 * ((4 * y + k / 4) * image.width + 4 * (x / 4) + k % 4) + x % 4];
      }
      small.pixels.push_back(static_cast<std::uint8_t>((sum + 8) / 16));
    }
  }
  return small;
}

Result<std::string> picture(const RgbaImage& image, const std::string& alt) {
  MODAR_ASSIGN(const std::string uri, data_uri(image));
  return print("<img width=\"%u\" height=\"%u\" loading=\"lazy\" alt=\"", image.width,
               image.height) +
         escape_html(alt) + "\" src=\"" + uri + "\">";
}

class Page {
 public:
  Page(const BundleView& bundle, const ReportOptions& options, const ProgressCallback& progress)
      : bundle_(bundle), options_(options), progress_(progress) {}

  Result<std::string> run() {
    check_all(bundle_.bytes(), nullptr, options_.jobs,
              [&](const Issue& issue) { verdict_.add(issue); });
    many_ = bundle_.models().size() + bundle_.scenes().size() > kManyModels;
    auto camera = ModelCamera::create(bundle_, many_ ? 320 : 640, many_ ? 240 : 480);
    if (camera) camera_ = std::move(*camera);
    if (!camera) no_pictures_ = camera.error().cause;
    head();
    MODAR_TRY(scenes());
    html_ += acting_section(bundle_);
    MODAR_TRY(models());
    MODAR_TRY(textures());
    MODAR_TRY(patterns());
    sizes();
    MODAR_TRY(timings());
    devices();
    issues();
    html_ +=
        "</main>\n<footer>Made by modar " + escape_html(options_.tool_version) +
        " from the bundle alone. Lengths are in source units of each model; errors are measured "
        "on the packed bytes.</footer>\n</body>\n</html>\n";
    return std::move(html_);
  }

 private:
  [[nodiscard]] std::string name(const NameRef& ref) const {
    return std::string(bundle_.name(ref));
  }

  void told(const char* stage, std::size_t done, std::size_t all) {
    if (progress_)
      progress_(stage,
                static_cast<double>(done) / static_cast<double>(std::max<std::size_t>(all, 1)));
  }

  void section(const char* id, const char* title) {
    html_ += print("<section aria-labelledby=\"%s\">\n<h2 id=\"%s\">%s</h2>\n", id, id, title);
  }

  void head() {
    html_ =
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
        "<meta name=\"generator\" content=\"modar report\">\n"
        "<meta name=\"viewport\" content=\"width=device-width,initial-scale=1\">\n<title>" +
        escape_html(options_.title) + "</title>\n<link rel=\"icon\" href=\"data:,\">\n<style>" +
        kStyle + "</style>\n</head>\n<body>\n<header><div>\n<h1>" + escape_html(options_.title) +
        "</h1>\n<div class=\"lead\">" +
        print("<span class=\"chip %s\">%s</span>", verdict_.good() ? "good" : "bad",
              verdict_.good() ? "Good" : "Bad") +
        "<span>" + std::to_string(verdict_.errors()) + " " + noun(verdict_.errors(), "error") +
        ", " + std::to_string(verdict_.warnings()) + " " + noun(verdict_.warnings(), "warning") +
        "</span>" + weakest_pattern() +
        print("<span>bundle version %u.%u</span></div>\n<ul class=\"counts\">",
              bundle_.header().major, bundle_.header().minor);
    std::uint64_t triangles = 0;
    for (const ModelRecord& model : bundle_.models()) triangles += model.triangle_count;
    html_ += "<li><b>" + human_bytes(bundle_.bytes().size()) + "</b>in one file</li>";
    const auto count = [&](std::uint64_t number, const char* what) {
      html_ += "<li><b>" + grouped(number) + "</b>" + noun(number, what) + "</li>";
    };
    count(bundle_.scenes().size(), "scene");
    count(bundle_.models().size(), "model");
    count(triangles, "triangle");
    count(bundle_.textures().size(), "texture");
    count(bundle_.patterns().size(), "pattern");
    html_ += "</ul>\n</div></header>\n<main>\n";
  }

  /// From where visitors have a chance: the pattern that is recognised worst.
  [[nodiscard]] std::string weakest_pattern() const {
    std::optional<ScoreRange> worst;
    std::uint32_t index = 0;
    for (std::uint32_t p = 0; p < bundle_.patterns().size(); ++p) {
      const auto range = stated_range(bundle_, p);
      if (!range || (worst && range_value(*range) >= range_value(*worst))) continue;
      worst = range;
      index = p;
    }
    if (!worst) return "";
    const PatternRecord& record = bundle_.patterns()[index];
    const std::string who = bundle_.patterns().size() == 1
                                ? "pattern"
                                : "weakest pattern " + escape_html(name(record.name));
    return "<span>" + who + ": grade " + grade_of(*worst) + ", " +
           range_sentence(*worst, record.width_mm) + "</span>";
  }

  Result<void> scenes() {
    if (bundle_.scenes().empty()) return {};
    section("scenes", "Scenes");
    if (camera_ == nullptr)
      html_ += "<p class=\"note\">No pictures: " + escape_html(no_pictures_) + "</p>";
    html_ += "<div class=\"grid wide\">\n";
    for (std::uint32_t s = 0; s < bundle_.scenes().size(); ++s) {
      told("scenes", s, bundle_.scenes().size());
      const SceneRecord& scene = bundle_.scenes()[s];
      const std::string model = name(bundle_.models()[scene.model].name);
      const std::string pattern = name(bundle_.patterns()[scene.pattern].name);
      html_ += "<article class=\"card\">";
      if (camera_ != nullptr) {
        MODAR_ASSIGN(const std::string image,
                     picture(camera_->scene(s), model + " on the pattern " + pattern));
        html_ += image;
      }
      html_ += "<div><h3>" + escape_html(model) + " on " + escape_html(pattern) + "</h3><dl>" +
               row("Stands", scene_words(bundle_, s)) +
               row("Scale", print("%.3g", static_cast<double>(scene.scale))) + "</dl>";
      MODAR_TRY(other_turns(s));
      html_ += "</div></article>\n";
    }
    html_ += "</div>\n</section>\n";
    return {};
  }

  /// The other ways in which a scene's model could stand, small: one of them is right where this
  /// one is wrong.
  Result<void> other_turns(std::uint32_t index) {
    const auto placement = stated_placement(bundle_, index);
    if (camera_ == nullptr || !placement || many_) return {};
    html_ += "<p class=\"note\">With another axis up:</p><div class=\"turns\">";
    for (const UpAxis up : {UpAxis::kY, UpAxis::kZ, UpAxis::kMinusY, UpAxis::kMinusZ, UpAxis::kX}) {
      if (up == placement->up) continue;
      const std::string word = "up=" + std::string(up_axis_name(up));
      const RgbaImage image =
          camera_->standing(bundle_.scenes()[index].model, rotation_of(up, placement->turn));
      MODAR_ASSIGN(const std::string shown, picture(quartered(image), "with " + word));
      html_ += "<figure>" + shown + "<figcaption>" + word + "</figcaption></figure>";
    }
    html_ += "</div>";
    return {};
  }

  Result<void> models() {
    if (bundle_.models().empty()) return {};
    section("models", "Models");
    html_ += "<div class=\"grid wide\">\n";
    for (std::uint32_t m = 0; m < bundle_.models().size(); ++m) {
      told("models", m, bundle_.models().size());
      const std::string title = name(bundle_.models()[m].name);
      std::size_t drawn = 0;
      const std::string wires = wireframe_svg(bundle_, m, kWireTriangles, drawn);
      html_ += "<article class=\"card\"><div class=\"pair\">";
      if (camera_ != nullptr) {
        MODAR_ASSIGN(const std::string image,
                     picture(camera_->model(m), title + " as the device draws it"));
        html_ += image;
      }
      html_ += "<svg viewBox=\"0 0 400 300\" role=\"img\" aria-label=\"" + escape_html(title) +
               ": its triangles, each chunk in its own colour\" stroke=\"#fff\" "
               "stroke-width=\".25\" "
               "stroke-linejoin=\"round\">" +
               wires + "</svg></div><div><h3>" + escape_html(title) + "</h3><dl>" + model_rows(m) +
               "</dl>";
      for (std::uint32_t c = 0; c < bundle_.clips().size(); ++c) {
        if (bundle_.clips()[c].model == m) MODAR_TRY(clip(c));
      }
      html_ += "</div></article>\n";
    }
    html_ += "</div>\n</section>\n";
    return {};
  }

  /// Three stills.
  Result<void> clip(std::uint32_t index) {
    const ClipRecord& record = bundle_.clips()[index];
    const std::string title = "Clip \u201c" + name(record.name) + "\u201d";
    const auto seconds = static_cast<double>(record.seconds);
    html_ += "<p class=\"note\">" + escape_html(title) + print(", %.3g s</p>", seconds);
    if (camera_ == nullptr) return {};
    html_ += "<div class=\"turns\">";
    for (const double share : {1.0 / 6, 0.5, 5.0 / 6}) {
      const std::string time = print("%.2f s", share * seconds);
      MODAR_ASSIGN(const std::string shown,
                   picture(quartered(camera_->moving(index, share)), title + " at " + time));
      html_ += "<figure>" + shown + "<figcaption>" + time + "</figcaption></figure>";
    }
    html_ += "</div>";
    return {};
  }

  [[nodiscard]] std::string model_rows(std::uint32_t index) const {
    const ModelRecord& model = bundle_.models()[index];
    const double mm = model.unit_metres * 1000;
    std::string error = print("%.3g", model.position_error_max);
    if (mm > 0) error += print(" (%.3g mm)", model.position_error_max * mm);
    std::string rows =
        row("Triangles", grouped(model.triangle_count)) +
        row("Vertices", grouped(model.vertex_count)) +
        row("Chunks", std::to_string(model.chunk_count)) +
        row("Diagonal", print("%.6g", model.diagonal)) + row("Greatest position error", error) +
        row("of the diagonal", print("%.4f %%", 100 * model.position_error_max / model.diagonal)) +
        row("Greatest normal error",
            print("%.2f°", static_cast<double>(model.normal_error_max_deg)));
    if (model.uv_error_max_texels > 0) {
      rows += row("Greatest texture error",
                  print("%.3g texels", static_cast<double>(model.uv_error_max_texels)));
    }
    if (const std::string levels = level_words(bundle_, index); !levels.empty()) {
      rows += row("Detail", levels);
    }
    if (const auto topology = stated_topology(bundle_, index)) {
      rows += row("Shape", topology_words(*topology));
    }
    if (const auto repair = stated_repair(bundle_, index)) {
      rows += row("Repair", repair_words(*repair));
    }
    return rows;
  }

  /// The finest mip level that is no larger than a thumbnail.
  [[nodiscard]] RgbaImage texture_image(std::uint32_t index) const {
    const TextureRecord& texture = bundle_.textures()[index];
    std::uint32_t l = 0;
    const auto level = [&]() -> const TextureLevelRecord& {
      return bundle_.texture_levels()[texture.first_level + l];
    };
    while (l + 1 < texture.level_count && std::max(level().width, level().height) > kTextureSide)
      ++l;
    return decode_texture(static_cast<TextureFormat>(texture.format),
                          bundle_.texture_data(index).subspan(level().offset, level().size),
                          level().width, level().height);
  }

  Result<void> textures() {
    if (bundle_.textures().empty()) return {};
    section("textures", "Textures");
    html_ += "<div class=\"grid small\">\n";
    for (std::uint32_t t = 0; t < bundle_.textures().size(); ++t) {
      told("textures", t, bundle_.textures().size());
      const TextureRecord& texture = bundle_.textures()[t];
      const std::string title = name(texture.name);
      MODAR_ASSIGN(const std::string image,
                   picture(texture_image(t), "The texture " + title + ", decoded"));
      html_ += "<article class=\"card\">" + image + "<div><h3>" + escape_html(title) + "</h3><dl>" +
               row("Size", print("%u × %u", texture.width, texture.height)) +
               row("Source", print("%u × %u", texture.source_width, texture.source_height)) +
               row("PSNR", print("%.1f dB", static_cast<double>(texture.psnr_db))) +
               row("SSIM", print("%.3f", static_cast<double>(texture.ssim))) +
               row("Bytes", human_bytes(bundle_.texture_data(t).size())) +
               row("Alpha", (texture.flags & kTextureAlpha) != 0 ? "yes" : "no") +
               "</dl></div></article>\n";
      MODAR_TRY(comparison(title));
    }
    html_ += "</div>\n</section>\n";
    return {};
  }

  /// Source, decoded and difference, as the bake has written them side by side.
  Result<void> comparison(const std::string& texture) {
    const std::string path = options_.texture_pictures + "/" + texture + ".png";
    std::error_code error;
    if (options_.texture_pictures.empty() || !std::filesystem::exists(path, error)) return {};
    MODAR_ASSIGN(RgbaImage image, read_image(path));
    if (image.width > kComparisonSide) {
      for (RgbaImage& level : mip_chain(image)) {
        image = std::move(level);
        if (image.width <= kComparisonSide) break;
      }
    }
    MODAR_ASSIGN(const std::string shown,
                 picture(image, "Source, decoded and difference of " + texture));
    html_ += "<article class=\"card triple\">" + shown + "<div><h3>" + escape_html(texture) +
             ": source, decoded, difference</h3></div></article>\n";
    return {};
  }

  /// What each stage of the bake took.
  Result<void> timings() {
    if (options_.bake_json.empty()) return {};
    const Json json = Json::parse(options_.bake_json);
    if (!json["stages"].is_array()) {
      return fail(ExitCode::kInvalidInput, "report.bake", "--bake",
                  "the file contains no stages of a bake",
                  "pass the output of `modar bake --model ... --json`");
    }
    section("timings", "Time of the bake");
    html_ +=
        "<div class=\"scroll\"><table class=\"figures\"><thead><tr><th scope=\"col\">Stage</th><th "
        "scope=\"col\">Seconds</th><th scope=\"col\">In</th><th scope=\"col\">Out</th></tr></thead>"
        "<tbody>\n";
    for (const Json& stage : json["stages"].elements()) {
      html_ += "<tr><th scope=\"row\">" + escape_html(stage.text_at("name")) + "</th><td>" +
               print("%.2f", stage.number_at("ms") / 1000) + "</td><td>" +
               grouped(static_cast<std::uint64_t>(stage.number_at("in"))) + "</td><td>" +
               grouped(static_cast<std::uint64_t>(stage.number_at("out"))) + "</td></tr>\n";
    }
    html_ += "</tbody></table></div>\n<p class=\"note\">" +
             print("%.1f CPU seconds in all.", json.number_at("cpu_seconds")) +
             "</p>\n</section>\n";
    account(json["account"]);
    return {};
  }

  /// What became of everything that the files name, a row for each model and kind.
  void account(const Json& models) {
    if (models.size() == 0) return;
    section("account", "What became of the files' content");
    html_ +=
        "<div class=\"scroll\"><table class=\"figures\"><thead><tr><th scope=\"col\">Model</th><th "
        "scope=\"col\">Of its</th><th scope=\"col\">Used</th><th scope=\"col\">Changed</th><th "
        "scope=\"col\">Left out</th></tr></thead><tbody>\n";
    for (const Json& model : models.elements()) {
      const std::string title = model.text_at("model");
      for (const char* kind : {"images", "colours", "faces", "nodes", "animations", "attributes"}) {
        std::string cells;
        double all = 0;
        for (const char* fate : {"used", "changed", "left_out"}) {
          const double number = model.number_at(std::string(kind) + "/" + fate);
          cells += "<td>" + grouped(static_cast<std::uint64_t>(number)) + "</td>";
          all += number;
        }
        if (all == 0) continue;
        html_ += "<tr><th scope=\"row\">" + escape_html(title) + "</th><td>" + kind + "</td>" +
                 cells + "</tr>\n";
      }
    }
    html_ += "</tbody></table></div>\n</section>\n";
  }

  Result<void> patterns() {
    if (bundle_.patterns().empty()) return {};
    section("patterns", "Patterns");
    html_ += "<div class=\"grid\">\n";
    for (std::uint32_t p = 0; p < bundle_.patterns().size(); ++p) {
      told("patterns", p, bundle_.patterns().size());
      MODAR_TRY(pattern(p));
    }
    html_ +=
        "</div>\n<p class=\"note\">Dots are the features that the tracker uses: dense and "
        "even is good.</p>\n</section>\n";
    return {};
  }

  Result<void> pattern(std::uint32_t index) {
    const PatternRecord& record = bundle_.patterns()[index];
    const std::string title = name(record.name);
    const RgbaImage image = pattern_image(bundle_, index);
    html_ += "<article class=\"card\">";
    if (image.width != 0) {
      MODAR_ASSIGN(const std::string shown,
                   picture(image, "The pattern " + title + ", as the tracker sees it"));
      html_ += "<div class=\"over\">" + shown + feature_dots(index, image, title) + "</div>";
    }
    html_ += "<div><h3>" + escape_html(title) + "</h3><dl>" +
             row("Picture", print("%u × %u", record.width, record.height)) +
             row("Printed width",
                 record.width_mm > 0 ? print("%.4g mm", record.width_mm) : "not stated");
    if (record.score >= 0) {
      MODAR_TRY(score(index, image, title));
    } else {
      html_ += "</dl>";
    }
    if (options_.range && image.width != 0) MODAR_TRY(range(index, image));
    html_ += "</div></article>\n";
    return {};
  }

  [[nodiscard]] std::string feature_dots(std::uint32_t index, const RgbaImage& image,
                                         const std::string& title) const {
    TrackerRecordView record;
    if (view_tracker_record(bundle_.section(SectionType::kTrackerRecord, index), record)) return "";
    std::string dots;
    const std::size_t step = std::max<std::size_t>(1, record.features.size() / kShownFeatures);
    for (std::size_t f = 0; f < record.features.size(); f += step) {
      dots += print("M%.0f %.0fh0", record.features[f].x / 64.0, record.features[f].y / 64.0);
    }
    return print("<svg viewBox=\"0 0 %u %u\" role=\"img\" aria-label=\"", image.width,
                 image.height) +
           print("%zu features of ", record.features.size()) + escape_html(title) +
           "\"><path d=\"" + dots +
           "\" stroke=\"#00d68f\" stroke-opacity=\".75\" stroke-linecap=\"round\" stroke-width=\"" +
           print("%u", std::max(2U, image.width / 110)) + "\"/></svg>";
  }

  /// Score and grade as the last rows of a list, then the working range and what the causes advise.
  Result<void> score(std::uint32_t index, const RgbaImage& image, const std::string& title) {
    const PatternRecord& record = bundle_.patterns()[index];
    std::vector<std::uint8_t> gray;
    for (std::size_t i = 0; i < image.pixels.size(); i += 4) gray.push_back(image.pixels[i]);
    const GrayImage view{gray.data(), static_cast<int>(image.width), static_cast<int>(image.height),
                         static_cast<std::ptrdiff_t>(image.width)};
    const auto shape = bundle_.section(SectionType::kPatternShape, index);
    MODAR_ASSIGN(const PatternScore score,
                 score_pattern(view, bundle_.section(SectionType::kTrackerRecord, index),
                               options_.jobs, {shape.begin(), shape.end()}));
    const auto stored = static_cast<double>(record.score);
    html_ += row("Grade, A to E", {score.grade}) + row("Score", print("%.0f of 100", stored)) +
             "</dl>" +
             print(
                 "<meter min=\"0\" max=\"100\" low=\"44\" high=\"72\" optimum=\"100\" "
                 "value=\"%.0f\" aria-label=\"Score of ",
                 stored) +
             escape_html(title) + "\"></meter><p class=\"note\">" +
             escape_html(sentence(range_sentence(score.range, record.width_mm))) + "</p>";
    std::string list;
    for (const ScoreCause& cause : score.causes) {
      if (*cause.advice != 0) list += "<li>" + escape_html(sentence(cause.advice)) + "</li>";
    }
    html_ += list.empty() ? "<p class=\"note\">Nothing to improve.</p>"
                          : "<ul class=\"advice\">" + list + "</ul>";
    return {};
  }

  Result<void> range(std::uint32_t index, const RgbaImage& image) {
    const TemporaryFolder folder;
    const std::string path = folder.path() + "/pattern.png";
    MODAR_TRY(write_png(image, path, bundle_.patterns()[index].width_mm));
    SimulateOptions simulation;
    simulation.jobs = options_.jobs;
    simulation.width_mm = bundle_.patterns()[index].width_mm;
    MODAR_ASSIGN(const Simulation simulated, simulate(path, simulation, {}));
    html_ += "<p class=\"note\">" + escape_html(sentence(range_sentence(simulated))) + "</p>";
    return {};
  }

  /// Bytes by what they belong to, largest first.
  [[nodiscard]] std::vector<TreemapItem> size_items() const {
    std::vector<TreemapItem> items;
    double rest = static_cast<double>(bundle_.bytes().size());
    const auto add = [&](const std::string& label, const char* kind, double bytes) {
      if (bytes <= 0) return;
      items.push_back({label, kind, bytes});
      rest -= bytes;
    };
    const Json models = bundle_json(bundle_)["models"];
    for (std::uint32_t m = 0; m < bundle_.models().size(); ++m) {
      add(name(bundle_.models()[m].name), "model", models[m].number_at("bytes"));
    }
    for (std::uint32_t t = 0; t < bundle_.textures().size(); ++t) {
      add(name(bundle_.textures()[t].name), "texture",
          static_cast<double>(bundle_.texture_data(t).size()));
    }
    std::vector<double> patterns(bundle_.patterns().size());
    for (const SectionEntry& section : bundle_.sections()) {
      const bool of_pattern =
          section.type >= static_cast<std::uint32_t>(SectionType::kMappedFeatures) &&
          section.type <= static_cast<std::uint32_t>(SectionType::kTrackerRecord);
      if (of_pattern && section.owner < patterns.size())
        patterns[section.owner] += static_cast<double>(section.size);
    }
    for (std::uint32_t p = 0; p < patterns.size(); ++p) {
      add(name(bundle_.patterns()[p].name), "pattern", patterns[p]);
    }
    add("tables, names, padding", "rest", rest);
    std::stable_sort(items.begin(), items.end(),
                     [](const TreemapItem& a, const TreemapItem& b) { return a.size > b.size; });
    return items;
  }

  void sizes() {
    section("sizes", "Where the bytes are");
    const std::vector<TreemapItem> items = size_items();
    const std::vector<TreemapBox> boxes = treemap(items, 1000, 420);
    std::string label = "Bytes by what they belong to; the largest: ";
    html_ += "<div class=\"map\"><svg viewBox=\"0 0 1000 420\" role=\"img\" aria-label=\"";
    for (std::size_t i = 0; i < std::min<std::size_t>(items.size(), 5); ++i) {
      label += (i == 0 ? "" : ", ") + items[i].label + " " +
               human_bytes(static_cast<std::uint64_t>(items[i].size));
    }
    html_ += escape_html(label) + "\">";
    for (std::size_t i = 0; i < items.size(); ++i) {
      const TreemapBox& box = boxes[i];
      const std::string bytes = human_bytes(static_cast<std::uint64_t>(items[i].size));
      html_ += print(
                   "<g><rect class=\"%s\" x=\"%.1f\" y=\"%.1f\" width=\"%.1f\" height=\"%.1f\" "
                   "stroke=\"#fff\"/><title>",
                   items[i].kind.c_str(), box.x, box.y, box.width, box.height) +
               escape_html(items[i].label) + ", " + bytes + "</title>";
      const auto room = static_cast<std::size_t>(std::max(0.0, (box.width - 14) / 8));
      if (box.height > 40 && room >= 6) {
        html_ += print("<text x=\"%.1f\" y=\"%.1f\">", box.x + 8, box.y + 20) +
                 escape_html(shortened(items[i].label, room)) + "</text>" +
                 print("<text class=\"bytes\" x=\"%.1f\" y=\"%.1f\">", box.x + 8, box.y + 37) +
                 bytes + "</text>";
      }
      html_ += "</g>";
    }
    html_ += "</svg></div>\n<ul class=\"key\">";
    // With bytes: on a phone, the boxes' own are too small to be read.
    for (const auto& [kind, words] : std::map<std::string, std::string>{{"model", "models"},
                                                                        {"texture", "textures"},
                                                                        {"pattern", "patterns"},
                                                                        {"rest", "the rest"}}) {
      double bytes = 0;
      for (const TreemapItem& item : items) bytes += item.kind == kind ? item.size : 0;
      html_ += "<li><svg viewBox=\"0 0 1 1\" aria-hidden=\"true\"><rect class=\"" + kind +
               "\" width=\"1\" height=\"1\"/></svg>" + words + " " +
               human_bytes(static_cast<std::uint64_t>(bytes)) + "</li>";
    }
    html_ += "</ul>\n</section>\n";
  }

  void devices() {
    section("devices", "Devices");
    html_ +=
        "<div class=\"scroll\"><table><thead><tr><th scope=\"col\">Device</th><th "
        "scope=\"col\">Holds it</th>"
        "<th scope=\"col\">Why not</th></tr></thead><tbody>\n";
    for (const DeviceProfile& device : device_profiles()) {
      std::string why;
      const Verdict verdict = device_verdict(bundle_, device);
      for (const WeighedIssue& weighed : verdict.issues()) {
        if (weighed.severity == Severity::kInfo) continue;
        if (!why.empty()) why += "; ";
        why += std::string(weighed.issue.kind->message) + " (" + weighed.issue.detail + ")";
      }
      html_ += "<tr><th scope=\"row\">" + escape_html(device.title) +
               print("</th><td><span class=\"chip %s\">%s</span></td><td>",
                     verdict.good() ? (why.empty() ? "good" : "warn") : "bad",
                     verdict.good() ? (why.empty() ? "yes" : "with care") : "no") +
               escape_html(why) + "</td></tr>\n";
    }
    html_ += "</tbody></table></div>\n</section>\n";
  }

  void issues() {
    section("check", "What the checker says");
    if (verdict_.issues().empty()) {
      html_ += "<p>Nothing: every rule of `modar check` holds.</p>\n</section>\n";
      return;
    }
    html_ +=
        "<div class=\"scroll\"><table><thead><tr><th scope=\"col\">Rule</th><th "
        "scope=\"col\">Where</th>"
        "<th scope=\"col\">What</th><th scope=\"col\">Cure</th></tr></thead><tbody>\n";
    for (const WeighedIssue& weighed : verdict_.issues()) {
      const Issue& issue = weighed.issue;
      html_ += print("<tr><th scope=\"row\"><span class=\"chip %s\">%s</span><br>",
                     weighed.severity == Severity::kError ? "bad" : "warn",
                     severity_name(weighed.severity)) +
               escape_html(issue.kind->id) + "</th><td>" + escape_html(issue.where) + "</td><td>" +
               escape_html(std::string(issue.kind->message) +
                           (issue.detail.empty() ? "" : ": " + issue.detail)) +
               "</td><td>" + escape_html(issue.kind->cure) + "</td></tr>\n";
    }
    html_ += "</tbody></table></div>\n</section>\n";
  }

  const BundleView& bundle_;
  const ReportOptions& options_;
  const ProgressCallback& progress_;
  Verdict verdict_;
  bool many_ = false;  ///< models and scenes: pictures are small
  std::unique_ptr<ModelCamera> camera_;
  std::string no_pictures_;
  std::string html_;
};

}  // namespace

Result<std::string> report_page(const BundleView& bundle, const ReportOptions& options,
                                const ProgressCallback& progress) {
  return Page(bundle, options, progress).run();
}

}  // namespace modar
