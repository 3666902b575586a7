// The rules that only a check of the contents finds broken: an object of its own, which a player
// does not link.
#include <array>

#include "formats/check.hpp"
#include "formats/rules.hpp"

namespace modar {
namespace {

constexpr const char* kContentRebake =
    "bake the bundle again; if that does not help, report it as a bug";
constexpr const char* kContentFetch = "copy or download the file again, or bake it again";

constexpr auto kContentKinds = std::to_array<IssueKind>({
    {"SECTION_PADDING", Severity::kError, "Bytes between sections are not zero", kContentFetch},
    {"META_TEXT", Severity::kError,
     "The bundle's description is not a JSON object in UTF-8, or its members are not as specified",
     kContentRebake},
    {"MODEL_PLACEMENT", Severity::kError,
     "A model's scale and diagonal cannot describe one box, or its chunks do not fit into that "
     "box",
     kContentRebake},
    {"MODEL_COUNTS", Severity::kError, "A model's counts differ from its contents", kContentRebake},
    {"MODEL_ERRORS", Severity::kError, "A model's mean error is greater than its maximum",
     kContentRebake},
    {"CHUNK_BOUNDS", Severity::kError, "A vertex is outside its chunk's box", kContentRebake},
    {"CHUNK_LOOSE", Severity::kError, "A chunk's box is larger than its vertices need",
     kContentRebake},
    {"CHUNK_OUTSIDE", Severity::kError, "A chunk's box extends past the unit cube", kContentRebake},
    {"CHUNK_CONE", Severity::kError,
     "A chunk's cone axis does not have unit length, or triangles face out of the cone",
     kContentRebake},
    {"CHUNK_GRID", Severity::kWarning,
     "Chunks of a model store integer positions on different grids: their borders may crack",
     kContentRebake},
    {"LEVEL_ORDER", Severity::kError,
     "Levels of detail do not get coarser, or level 0 has a non-zero error", kContentRebake},
    {"LEVEL_INDEX", Severity::kError, "An index refers to a vertex that its level lacks",
     kContentRebake},
    {"VERTEX_NOT_FINITE", Severity::kError, "A vertex attribute is infinite or not a number",
     kContentRebake},
    {"VERTEX_NORMAL", Severity::kError, "A normal does not have unit length", kContentRebake},
    {"MATERIAL_VALUES", Severity::kError, "A material's colour, shininess or opacity is unusable",
     "correct the material in the source and bake again"},
    {"TEXTURE_SIDES", Severity::kError,
     "A texture that repeats or has mipmaps has sides that are not powers of two (OpenGL ES 2.0)",
     kContentRebake},
    {"TEXTURE_OVERLAP", Severity::kError, "Levels of a texture share bytes", kContentRebake},
    {"TEXTURE_UNREFERENCED", Severity::kWarning, "Bytes of a texture belong to no level",
     kContentRebake},
    {"PARAMETER_VALUES", Severity::kError,
     "A parameter set has values that its detector cannot run with", kContentRebake},
    {"KEYPOINT_OUTSIDE", Severity::kError, "A keypoint is outside its pattern", kContentRebake},
    {"KEYPOINT_VALUES", Severity::kError, "A keypoint's size, angle or octave is impossible",
     kContentRebake},
    {"DESCRIPTOR_LENGTH", Severity::kError, "Descriptors do not have their detector's length",
     kContentRebake},
    {"PATTERN_WITHOUT_FEATURES", Severity::kWarning, "A pattern has too few features to be found",
     "use a pattern with more texture"},
    {"FEATURE_TEXT", Severity::kError,
     "A feature text is not an OpenCV FileStorage or has no mapped twin", kContentRebake},
    {"LOOP_RECORD", Severity::kError, "A pattern's tracker record is invalid", kContentRebake},
    {"STATEMENT_DIFFERS", Severity::kError,
     "The content summary differs from the records or payloads", kContentRebake},
    {"MEDIA_FILE", Severity::kError,
     "A video or sound is not what its record says, or not what every phone plays", kContentRebake},
    {"CAPTIONS", Severity::kError, "Captions are not a WebVTT file of the kind that bundles hold",
     kContentRebake},
    {"VERTEX_PADDING", Severity::kError, "Padding bytes of a vertex are not zero", kContentRebake},
    {"VERTEX_OCCLUSION", Severity::kError, "A vertex's occlusion is above 127", kContentRebake},
    {"VERTEX_BONES", Severity::kError,
     "A vertex names bones that its part lacks, or its weights do not sum to 255", kContentRebake},
    {"PATTERN_YML_DIFFERS", Severity::kError,
     "A feature text, read by OpenCV, differs from its mapped twin", kContentRebake},
    {"VERTICES_UNREFERENCED", Severity::kWarning, "Bytes of the vertex buffer belong to no level",
     kContentRebake},
    {"INDICES_UNREFERENCED", Severity::kWarning, "Bytes of the index buffer belong to no level",
     kContentRebake},
    {"TRIANGLE_DEGENERATE", Severity::kWarning, "A triangle uses one vertex twice", kContentRebake},
    {"LEVEL_EMPTY", Severity::kWarning, "A level of detail has no triangles", kContentRebake},
    {"BUNDLE_EMPTY", Severity::kWarning, "The bundle holds neither models nor patterns",
     "bake it with --model or --pattern"},
    {"NEVER_SHOWN", Severity::kWarning,
     "A model is on no pattern, or nothing is on a pattern: visitors download it and never see it",
     "add a scene of it, or leave it out"},
    {"NODE_TEXT", Severity::kWarning, "A label lacks a title in a language that others have",
     "write title.LANGUAGE for each language"},
    {"CAPTIONS_MISSING", Severity::kWarning,
     "Something is heard that has no captions, or none in a language that others have (WCAG 1.2.1, "
     "1.2.2)",
     "write captions.LANGUAGE = \"FILE.vtt\" for each language"},
    {"MEDIA_FLASHES", Severity::kWarning,
     "A video flashes more than three times in a second, which can cause seizures (WCAG 2.3.1)",
     "cut or darken what flashes, and bake again"},
    {"SECTION_UNKNOWN", Severity::kInfo, "An optional section of an unknown type is skipped",
     "update this program to use its contents"},
});
static_assert(static_cast<std::size_t>(Rule::kPadding) + kContentKinds.size() ==
              static_cast<std::size_t>(Rule::kCount));

}  // namespace

std::span<const IssueKind> content_issue_kinds() {
  return kContentKinds;
}

}  // namespace modar
