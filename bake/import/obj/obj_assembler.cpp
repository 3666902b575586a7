// Appends blocks to the model; an attribute's indices are stored only once they differ from the
// rule.
#include "bake/import/obj/obj_assembler.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>

#include <glm/common.hpp>

namespace modar {
namespace {

struct NoteText {
  const char* id;
  DiagnosticSeverity severity;
  const char* message;  ///< follows the count
  const char* cure;
};

/// In the order of ObjNote.
constexpr NoteText kNoteTexts[] = {
    {"obj.not-finite", DiagnosticSeverity::kWarning, "numbers are not finite (nan, inf)",
     "export again; faces that use such a vertex are left out"},
    {"obj.bad-number", DiagnosticSeverity::kWarning, "words are not the number they should be",
     "export again; what could be read of them is used, faces with such corners are left out"},
    {"obj.short-vertex", DiagnosticSeverity::kWarning, "vertices have fewer than three coordinates",
     "the missing ones are taken as 0"},
    {"obj.weight", DiagnosticSeverity::kInfo, "vertices have a weight other than 1",
     "weights are ignored: only curves use them"},
    {"obj.lines", DiagnosticSeverity::kInfo, "line elements are skipped", "only faces are baked"},
    {"obj.points", DiagnosticSeverity::kInfo, "point elements are skipped", "only faces are baked"},
    {"obj.free-form", DiagnosticSeverity::kWarning, "statements of curves and surfaces are skipped",
     "convert the model to polygons before export"},
    {"obj.unknown", DiagnosticSeverity::kWarning, "statements have an unknown keyword",
     "remove them if they are not meant as comments"},
    {"obj.short-face", DiagnosticSeverity::kWarning, "faces have fewer than three corners",
     "they are left out"},
    {"obj.zero-index", DiagnosticSeverity::kWarning, "corners have index 0; OBJ counts from 1",
     "their faces are left out; export again"},
    {"obj.index-range", DiagnosticSeverity::kWarning, "corners refer to vertices that do not exist",
     "their faces are left out; is the file cut short?"},
    {"obj.no-position", DiagnosticSeverity::kWarning, "corners have no vertex index",
     "their faces are left out"},
    {"obj.attribute-range", DiagnosticSeverity::kWarning,
     "corners refer to a uv or normal that does not exist", "the attribute is left out"},
};
static_assert(std::size(kNoteTexts) == static_cast<std::size_t>(ObjNote::kCount));

/// How a block's indices of one attribute relate to its positions'.
IndexPlane::Kind kind_of(const Scratch<std::uint32_t>& positions,
                         const Scratch<std::uint32_t>& indices) {
  bool same = true;
  bool absent = true;
  for (std::size_t i = 0; i < indices.size(); ++i) {
    same = same && indices[i] == positions[i];
    absent = absent && indices[i] == kNoIndex;
    if (!same && !absent) return IndexPlane::Kind::kOwn;
  }
  return absent ? IndexPlane::Kind::kAbsent : IndexPlane::Kind::kSame;
}

template <class T>
void append(Array<T>& to, const Scratch<T>& from) {
  to.append(from.data(), from.size());
}

}  // namespace

bool ObjAssembler::needs_careful_pass() const {
  return bad_relative_ || highest_.positions > counts_.positions || highest_.uvs > counts_.uvs ||
         highest_.normals > counts_.normals;
}

bool ObjAssembler::too_large() const {
  return counts_.positions > kMaxElements || counts_.uvs > kMaxElements ||
         counts_.normals > kMaxElements || model_.corner_count() > kMaxElements;
}

void ObjAssembler::add(ObjBlock& block) {
  resolve_relative(block);
  add_colours(block);
  add_plane(block, block.corner_uvs, model_.corner_uvs);
  add_plane(block, block.corner_normals, model_.corner_normals);
  add_faces(block);
  append(model_.corner_positions, block.corner_positions);
  append(model_.positions, block.positions);
  append(model_.uvs, block.uvs);
  append(model_.normals, block.normals);
  counts_.positions += block.positions.size();
  counts_.uvs += block.uvs.size();
  counts_.normals += block.normals.size();
  highest_.positions = std::max(highest_.positions, block.highest.positions);
  highest_.uvs = std::max(highest_.uvs, block.highest.uvs);
  highest_.normals = std::max(highest_.normals, block.highest.normals);
  for (std::size_t i = 0; i < notes_.size(); ++i) {
    if (notes_[i].count == 0 && block.notes[i].count != 0) {
      notes_[i].first_line = lines_ + block.notes[i].first_line;
    }
    notes_[i].count += block.notes[i].count;
  }
  lines_ += block.lines;
}

void ObjAssembler::resolve_relative(ObjBlock& block) {
  const std::uint64_t base[3] = {counts_.positions, counts_.uvs, counts_.normals};
  for (const std::uint32_t entry : block.relative) {
    const std::uint32_t component = entry % 3;
    Scratch<std::uint32_t>& plane = component == 0   ? block.corner_positions
                                    : component == 1 ? block.corner_uvs
                                                     : block.corner_normals;
    const std::int64_t value =
        static_cast<std::int64_t>(base[component]) + static_cast<std::int32_t>(plane[entry / 3]);
    if (value < 0) bad_relative_ = true;
    plane[entry / 3] = static_cast<std::uint32_t>(value);
  }
}

void ObjAssembler::add_colours(const ObjBlock& block) {
  if (block.colours.size() == 0 && model_.colours.empty()) return;
  const glm::vec3 none(std::numeric_limits<float>::quiet_NaN());
  model_.colours.append(model_.positions.size() - model_.colours.size(), none);
  append(model_.colours, block.colours);
  model_.colours.append(block.positions.size() - block.colours.size(), none);
}

void ObjAssembler::add_plane(const ObjBlock& block, const Scratch<std::uint32_t>& indices,
                             IndexPlane& plane) {
  if (indices.size() == 0) return;
  if (plane.kind != IndexPlane::Kind::kOwn) {
    const IndexPlane::Kind kind = kind_of(block.corner_positions, indices);
    if (model_.corner_count() == 0 && kind != IndexPlane::Kind::kOwn) plane.kind = kind;
    if (plane.kind == kind) return;
    // The rule broke: what it stood for is written out.
    if (plane.kind == IndexPlane::Kind::kSame) {
      plane.own = model_.corner_positions;
    } else {
      plane.own.assign(model_.corner_count(), kNoIndex);
    }
    plane.kind = IndexPlane::Kind::kOwn;
  }
  append(plane.own, indices);
}

void ObjAssembler::add_faces(const ObjBlock& block) {
  if (faces_ == 0 && model_.material_runs.empty()) {
    model_.material_runs.push_back({0, 0});
    model_.smoothing_runs.push_back({0, kUnstatedSmoothing});
  }
  const std::size_t count = block.face_corners.size();
  bool triangles = true;
  for (std::size_t f = 0; f < count; ++f) triangles = triangles && block.face_corners[f] == 3;
  if (!triangles && model_.first_corner.empty()) {
    model_.first_corner.resize(faces_ + 1);
    for (std::size_t f = 0; f <= faces_; ++f) {
      model_.first_corner[f] = static_cast<std::uint32_t>(3 * f);
    }
  }
  if (!model_.first_corner.empty()) {
    for (std::size_t f = 0; f < count; ++f) {
      model_.first_corner.push_back(model_.first_corner.back() + block.face_corners[f]);
    }
  }
  for (const ObjStatement& s : block.statements) apply(s, faces_ + s.face);
  faces_ += count;
}

void ObjAssembler::apply(const ObjStatement& statement, std::uint64_t face) {
  const auto start_run = [&](std::vector<FaceRun>& runs, std::uint32_t value) {
    if (runs.back().first_face == face) runs.pop_back();
    if (runs.empty() || runs.back().value != value) runs.push_back({face, value});
  };
  switch (statement.kind) {
    case ObjStatement::Kind::kMaterial:
      start_run(model_.material_runs, materials_.use(statement.text, lines_ + statement.line));
      break;
    case ObjStatement::Kind::kSmoothing:
      start_run(model_.smoothing_runs, statement.group);
      break;
    case ObjStatement::Kind::kLibrary:
      materials_.add_library(statement.text, lines_ + statement.line);
      break;
  }
}

/// Vertices without a colour among coloured ones are white; colours of 0 to 255 become 0 to 1.
void ObjAssembler::finish_colours(const std::string& label) {
  std::uint64_t missing = 0;
  float greatest = 0.0f;
  for (const glm::vec3& c : model_.colours) {
    if (std::isnan(c.x)) {
      ++missing;
    } else {
      greatest = std::max({greatest, c.x, c.y, c.z});
    }
  }
  const bool bytes = greatest > 2.0f && greatest <= 255.0f;
  for (glm::vec3& c : model_.colours) {
    c = std::isnan(c.x) ? glm::vec3(1.0f) : (bytes ? c / 255.0f : c);
    c = glm::clamp(c, 0.0f, 1.0f);
  }
  if (missing != 0) {
    model_.findings.push_back({"obj.partial-colours", DiagnosticSeverity::kInfo, label, 0,
                               std::to_string(missing) + " vertices have no colour while others do",
                               "they are white"});
  }
  if (bytes) {
    model_.findings.push_back({"obj.byte-colours", DiagnosticSeverity::kInfo, label, 0,
                               "vertex colours go beyond 1", "they are taken as 0 to 255"});
  }
}

void ObjAssembler::finish(const std::string& folder, const std::string& label) {
  finish_colours(label);
  for (std::size_t i = 0; i < notes_.size(); ++i) {
    if (notes_[i].count == 0) continue;
    const NoteText& text = kNoteTexts[i];
    model_.findings.push_back({text.id, text.severity, label, notes_[i].first_line,
                               std::to_string(notes_[i].count) + " " + text.message, text.cure});
  }
  model_.materials = materials_.resolve(folder, model_.name, label, model_.findings);
}

}  // namespace modar
