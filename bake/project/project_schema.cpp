// The JSON schema of modar.toml: the keys of its tables, and the options of the bake from their
// table.
#include "bake/options/options.hpp"
#include "bake/project/project.hpp"

namespace modar {
namespace {

/// Keys that are not options of the bake.
constexpr const char* kTables = R"json({"$schema": "http://json-schema.org/draft-07/schema#",
 "title": "modar.toml: a project of ModAR",
 "type": "object", "additionalProperties": false,
 "properties": {
  "project": {"type": "object", "description": "Where things go", "additionalProperties": false,
    "properties": {
    "name": {"type": "string",
      "description": "Of the bundle, out/NAME.modar; without it, the folder's"},
    "out": {"type": "string", "default": "out", "description": "Folder of the bundles"},
    "cache": {"type": "string", "default": ".modar/cache",
      "description": "Folder of finished bakes; several machines may share it"}}},
  "bake": {"type": "object", "description": "Options for all models and patterns",
    "additionalProperties": false, "properties": {
}},
  "tier": {"type": "array", "items": {"type": "object",
    "description": "The same bundles once more, for other devices",
    "additionalProperties": false, "required": ["name"], "properties": {
    "name": {"type": "string", "description": "Part of the files' names"}}}},
  "model": {"type": "array", "items": {"type": "object",
    "description": "Models: OBJ, glTF, GLB", "additionalProperties": false,
    "required": ["file"], "properties": {
    "file": {"type": ["string", "array"], "items": {"type": "string"},
      "description": "Files, relative to this one: * ? [] match, **/ matches any folders, a ! before it leaves files out"},
    "name": {"type": "string",
      "description": "What scenes call it; without it, the file's without extension"}}}},
  "pattern": {"type": "array", "items": {"type": "object",
    "description": "Pictures of flat things, frontal", "additionalProperties": false,
    "required": ["file"], "properties": {
    "file": {"type": ["string", "array"], "items": {"type": "string"},
      "description": "Files, relative to this one: * ? [] match, **/ matches any folders, a ! before it leaves files out"},
    "name": {"type": "string",
      "description": "What scenes call it; without it, the file's without extension"},
    "width": {"type": "string",
      "description": "As printed, \"210mm\"; without it, what the file or the shape states"},
    "height": {"type": "string",
      "description": "With corners: as printed, \"297mm\"; without it, as the perspective tells"},
    "corners": {"type": "array", "minItems": 4, "maxItems": 4,
      "items": {"type": "array", "minItems": 2, "maxItems": 2, "items": {"type": "number"}},
      "description": "Of the picture in a photo, in pixels: [[212, 80], [905, 131], [870, 640], [190, 602]], from the top left corner clockwise; modar pattern rectify finds them"},
    "shape": {"type": "string", "pattern": "^(flat|(cylinder|cone|box),.*)",
      "description": "What it is printed on: cylinder,diameter=66mm,arc=120 or cone,top=80mm,bottom=60mm,arc=100 or box,size=120x180x40mm,right=right.png"},
    "copies": {"type": "integer", "minimum": 1, "maximum": 16, "default": 1,
      "description": "Most of this print that are tracked at once, each with its content"}}}},
  "scene": {"type": "array", "items": {"type": "object",
    "description": "Which model, pictures, videos and labels are on which pattern, which sounds, and what they do",
    "additionalProperties": false, "required": ["pattern"], "properties": {
    "pattern": {"type": "string"},
    "model": {"type": "string", "description": "May be left out where pictures or labels are"},
    "name": {"type": "string", "description": "What actions call it; without it, the model's"},
    "hidden": {"type": "boolean", "default": false,
      "description": "Not shown until an action shows it"},
    "group": {"type": "string",
      "description": "Variants: what has the same group, of which \"next\" shows one after the other"},
    "picture": {"type": "array", "items": {"type": "object",
      "description": "Pictures on the pattern, flat or upright", "additionalProperties": false,
      "required": ["file"], "properties": {
      "file": {"type": "string", "description": "PNG, JPEG, WebP or TIFF, relative to this file"}}}},
    "video": {"type": "array", "items": {"type": "object",
      "description": "Videos on the pattern, flat or upright; FFmpeg makes them H.264 in MP4, 854 x 480 at most (tier desktop: 1280 x 720)",
      "additionalProperties": false, "required": ["file"], "properties": {
      "alpha": {"type": "string", "pattern": "^(none|beside|#[0-9a-f]{6})$", "default": "none",
        "description": "`beside`: the right half of its pictures is the alpha of the left one; a colour: it is not seen"}}}},
    "sound": {"type": "array", "items": {"type": "object",
      "description": "Sounds; FFmpeg makes them AAC in MP4", "additionalProperties": false,
      "required": ["file"], "properties": {
      "name": {"type": "string",
        "description": "What actions call it; without it, the file's without extension"}}}},
    "label": {"type": "array", "items": {"type": "object",
      "description": "Points that describe a place", "additionalProperties": false,
      "properties": {
      "name": {"type": "string", "description": "What actions call it; without it, the mark"},
      "mark": {"type": "string",
        "description": "A number or a short word; without it, the labels are counted"},
      "offset": {"type": ["array", "string"], "items": {"type": "number"}, "minItems": 3,
        "maxItems": 3, "description": "Of the point, as of a model"},
      "hidden": {"type": "boolean", "default": false},
      "group": {"type": "string"},
      "title": {"type": "object", "additionalProperties": {"type": "string"},
        "description": "By language: title.en = \"The rim\""},
      "text": {"type": "object", "additionalProperties": {"type": "string"},
        "description": "By language"}}}},
    "action": {"type": "array", "items": {"type": "object",
      "description": "What happens on the pattern", "additionalProperties": false,
      "required": ["on", "do"], "properties": {
      "on": {"type": "string", "pattern": "^(found$|lost$|tap .|after [0-9.]+s$)",
        "description": "found, lost, tap NAME, after 3s"},
      "part": {"type": "string", "description": "Of a tapped model: the name of a material"},
      "do": {"type": "string",
        "pattern": "^((play|pause|show|hide|toggle|text|next) .|turn .+ by |link https://)",
        "description": "play, pause, show, hide, toggle, text or next NAME; turn NAME by 90 about x in 2s; link https://..."}}}},
    "scale": {"type": "number", "exclusiveMinimum": 0, "default": 1,
      "description": "Largest side of the model, in largest sides of the pattern"},
    "height": {"type": "string",
      "description": "Instead of a scale: from the lowest to the highest point, \"120mm\""},
    "width": {"type": "string",
      "description": "Instead of a scale: along the picture's width, \"80mm\""},
    "up": {"enum": ["x", "y", "z", "-x", "-y", "-z"],
      "description": "Axis of the model that points out of the pattern; without it, as its file and its geometry say"},
    "turn": {"type": ["number", "array"], "items": {"type": "number"}, "minItems": 3,
      "maxItems": 3,
      "description": "Degrees about the axis out of the pattern, or about its x, y and z"},
    "offset": {"type": ["array", "string"], "items": {"type": "number"}, "minItems": 3,
      "maxItems": 3,
      "description": "Right, up the picture, towards the camera: millimetres where the pattern's width is known, else its largest side; \"0:0:20mm\" names the unit"},
    "centred": {"type": "boolean", "default": false,
      "description": "The model's centre is in the pattern's plane; else its bottom is on it"},
    "light": {"type": "string",
      "description": "Radiance HDR panorama or photo of the room whose light falls on it; without it, a neutral room's"},
    "clip": {"type": "string",
      "description": "Of the model's clips the one that plays, \"none\" for no one; without it, the first"},
    "once": {"type": "boolean", "default": false, "description": "The clip does not loop"},
    "text": {"type": "object", "additionalProperties": {"type": "string"},
      "description": "Words about it, by language: text.en = \"A vase.\""},
    "alt": {"type": "object", "additionalProperties": {"type": "string"},
      "description": "A description for visitors who cannot see it, by language: alt.en = \"A red vase with two handles\""}}}},
  "bundle": {"type": "array", "items": {"type": "object",
    "description": "What goes into one file; models of the patterns' scenes come along",
    "additionalProperties": false, "required": ["name"], "properties": {
    "name": {"type": "string", "description": "Of the file, without extension"},
    "models": {"type": ["string", "array"], "items": {"type": "string"},
      "description": "Names, where * and ? match; keeps models that no scene shows"},
    "patterns": {"type": ["string", "array"], "items": {"type": "string"},
      "description": "Names, where * and ? match"}}}},
  "gates": {"type": "object", "description": "What a bundle has to reach to be written",
    "additionalProperties": false, "properties": {
    "min-psnr": {"type": "number", "minimum": 0, "description": "Of each texture, dB"},
    "min-ssim": {"type": "number", "minimum": 0, "maximum": 1, "description": "Of each texture"},
    "min-score": {"type": "number", "minimum": 0, "maximum": 100,
      "description": "Of each pattern"},
    "min-grade": {"enum": ["A", "B", "C", "D", "E"],
      "description": "Of each pattern, A the best: from where it is recognised"},
    "max-bytes": {"type": "integer", "minimum": 0, "description": "Of each file"}}}
}})json";

/// What pictures and videos have in common.
constexpr const char* kPlane = R"json({
  "name": {"type": "string",
    "description": "What actions call it; without it, the file's without extension"},
  "scale": {"type": "number", "exclusiveMinimum": 0, "default": 1,
    "description": "Its longer side, in longer sides of the pattern"},
  "width": {"type": "string", "description": "Instead of a scale: \"80mm\""},
  "height": {"type": "string", "description": "Instead of a scale: \"80mm\""},
  "turn": {"type": ["number", "array"], "items": {"type": "number"}, "minItems": 3, "maxItems": 3,
    "description": "Degrees about the axis out of the pattern, or about its x, y and z: [90, 0, 0] stands"},
  "offset": {"type": ["array", "string"], "items": {"type": "number"}, "minItems": 3,
    "maxItems": 3, "description": "As of a model"},
  "centred": {"type": "boolean", "default": false,
    "description": "Its middle is in the pattern's plane; else its bottom is on it"},
  "hidden": {"type": "boolean", "default": false},
  "group": {"type": "string"},
  "alt": {"type": "object", "additionalProperties": {"type": "string"},
    "description": "A description of it, by language"}
})json";

/// What videos and sounds have in common.
constexpr const char* kPlayed = R"json({
  "file": {"type": "string", "description": "What FFmpeg reads, relative to this file"},
  "play": {"type": "boolean", "default": true,
    "description": "From when the pattern is found; else an action plays it"},
  "loop": {"type": "boolean", "default": false, "description": "It begins again where it ends"},
  "captions": {"type": "object", "additionalProperties": {"type": "string"},
    "description": "Files of captions, WebVTT or SubRip, by language: captions.en = \"film.en.vtt\""}
})json";

/// An object whose member at "a/b", which is there, has another value.
Json with(Json object, const std::string& path, Json value) {
  const std::size_t slash = path.find('/');
  const std::string key = path.substr(0, slash);
  if (slash != std::string::npos) {
    value = with(*object.find(key), path.substr(slash + 1), std::move(value));
  }
  object.set(key, std::move(value));
  return object;
}

/// A scene whose tables of a name have more properties.
Json with_properties(Json scene, const std::string& table, const char* more) {
  const std::string path = "items/properties/" + table + "/items/properties";
  Json properties = *scene.find(path);
  const Json added = Json::parse(more);
  for (const std::string& key : added.keys()) properties.set(key, *added.find(key));
  return with(std::move(scene), path, std::move(properties));
}

/// What a value of modar.toml is.
Json schema_of(const BakeOption& option) {
  Json schema = Json::object();
  const auto* word = std::get_if<WordOption>(&option.value);
  const std::vector<std::string> choices = option_choices(option);
  if (std::holds_alternative<WordsOption>(option.value)) {
    schema = {{"type", Json::array({"string", "array"})},
              {"minItems", 1},
              {"items", {{"type", "string"}}}};
  } else if (const auto* number = std::get_if<NumberOption>(&option.value)) {
    schema.set("type", "integer");
    schema.set("minimum", number->least);
    schema.set("maximum", number->most);
  } else if (!choices.empty()) {
    schema.set("enum", Json::list(choices));
  } else {
    const bool truth =
        std::holds_alternative<TruthOption>(option.value) || (word != nullptr && word->truth);
    schema.set("type", truth ? "boolean" : "string");
  }
  if (Json usual = option_default(option); !usual.is_null()) {
    schema.set("default", std::move(usual));
  }
  schema.set("description", option.help);
  return schema;
}

/// Whether a table of the file may set an option.
bool takes(const std::string& table, OptionPart part) {
  if (table == "model") return part == OptionPart::kModel;
  if (table == "pattern") return part == OptionPart::kPattern;
  if (table == "project") return part == OptionPart::kProject;
  return (table == "bake" || table == "tier") && part != OptionPart::kProject;
}

/// Adds the options of a table to its properties.
Json with_options(Json table, const std::string& name) {
  if (const auto items = table.find("items")) {
    table.set("items", with_options(*items, name));
    return table;
  }
  Json properties = table.find("properties").value_or(Json::object());
  for (const BakeOption& option : bake_options()) {
    if (!takes(name, option.part)) continue;
    properties.set(option.name, {{"$ref", std::string("#/definitions/") + option.name}});
  }
  table.set("properties", std::move(properties));
  return table;
}

}  // namespace

std::string project_schema() {
  Json schema = Json::parse(kTables);
  Json tables = *schema.find("properties");
  Json scene = *tables.find("scene");
  for (const char* table : {"picture", "video"}) scene = with_properties(scene, table, kPlane);
  for (const char* table : {"video", "sound"}) scene = with_properties(scene, table, kPlayed);
  tables.set("scene", std::move(scene));
  for (const std::string& name : tables.keys()) {
    tables.set(name, with_options(*tables.find(name), name));
  }
  Json definitions = Json::object();
  for (const BakeOption& option : bake_options()) definitions.set(option.name, schema_of(option));
  schema.set("properties", std::move(tables));
  schema.set("definitions", std::move(definitions));
  return schema.dump();
}

}  // namespace modar
