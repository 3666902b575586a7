// Reads PLY: the header says what follows, so values are read one after the other and given to
// what they mean.
#include <algorithm>
#include <array>
#include <cstring>
#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <tuple>
#include <vector>

#include <fast_float/fast_float.h>

#include "bake/import/obj/mtl_reader.hpp"
#include "bake/import/ply/ply_header.hpp"
#include "bake/import/read_model.hpp"
#include "bake/import/texture_by_name.hpp"
#include "bake/import/up_comment.hpp"
#include "formats/base/ranges.hpp"
#include "modar/mapped_file.hpp"

namespace modar {
namespace {

constexpr std::uint64_t kMostElements = 0x3FFFFFFFu;  ///< vertices and corners, as of an OBJ

/// Values in file order, text or binary.
class PlyValues {
 public:
  PlyValues(std::string_view bytes, const PlyHeader& header)
      : bytes_(bytes), at_(header.bytes), encoding_(header.encoding) {
    if (!text()) return;
    // An element a line, as all programs write it, unless there are too few lines.
    std::uint64_t lines = 0;
    for (std::size_t i = at_; i < bytes.size(); ++i) {
      const bool ends = is_end(bytes[i]) || i + 1 == bytes.size();
      if (ends && (i == at_ || !is_end(bytes[i - 1]))) ++lines;
    }
    std::uint64_t elements = 0;
    for (const PlyElement& element : header.elements) {
      if (!element.properties.empty()) elements += std::min(element.count, kMostElements);
    }
    by_line_ = lines >= elements;
    strict_ = lines == elements;
  }

  [[nodiscard]] std::size_t offset() const { return at_; }
  [[nodiscard]] std::size_t left() const { return bytes_.size() - at_; }
  /// Whether each element is a line, so that one fault spoils one.
  [[nodiscard]] bool strict() const { return strict_; }
  [[nodiscard]] bool text() const { return encoding_ == PlyHeader::Encoding::kText; }

  /// Least bytes that an element takes, so that no count is believed beyond the file.
  [[nodiscard]] std::size_t least_bytes(const PlyElement& element) const {
    std::size_t bytes = 0;
    for (const PlyProperty& property : element.properties) {
      bytes += text() ? 2 : ply_bytes(property.list ? property.count_type : property.type);
    }
    return bytes == 0 || !text() ? bytes : bytes - 1;  // the last line may have no end
  }

  /// After an element: passes over what its line has beyond it. Returns whether there was anything.
  bool end_element() {
    starts_ = true;
    if (!by_line_) return false;
    bool more = false;
    for (; at_ < bytes_.size() && !is_end(bytes_[at_]); ++at_) more = more || bytes_[at_] > ' ';
    return more;
  }

  /// False at the end of the file or where the text is no number.
  bool take(PlyType type, double& value) {
    return text() ? take_text(value) : parse_binary(type, value);
  }

 private:
  static bool is_end(char c) { return c == '\n' || c == '\r'; }

  template <class T>
  double value_of(const char* from) const {
    std::array<char, sizeof(T)> raw{};
    std::memcpy(raw.data(), from, sizeof(T));
    if (encoding_ == PlyHeader::Encoding::kBig) std::reverse(raw.begin(), raw.end());
    return static_cast<double>(__builtin_bit_cast(T, raw));
  }

  bool parse_binary(PlyType type, double& value) {
    const std::size_t size = ply_bytes(type);
    if (left() < size) return false;
    const char* const from = bytes_.data() + at_;
    at_ += size;
    static constexpr double (PlyValues::*kReaders[])(const char*)
        const = {// of PlyType
                 &PlyValues::value_of<std::int8_t>,  &PlyValues::value_of<std::uint8_t>,
                 &PlyValues::value_of<std::int16_t>, &PlyValues::value_of<std::uint16_t>,
                 &PlyValues::value_of<std::int32_t>, &PlyValues::value_of<std::uint32_t>,
                 &PlyValues::value_of<float>,        &PlyValues::value_of<double>};
    value = (this->*kReaders[static_cast<std::size_t>(type)])(from);
    return true;
  }

  bool take_text(double& value) {
    const auto space = [](char c) {
      return c == ' ' || c == '\n' || c == '\r' || c == '\t' || c == '\v' || c == '\f';
    };
    while (at_ < bytes_.size() && space(bytes_[at_])) {
      if (strict_ && !starts_ && is_end(bytes_[at_])) return false;
      ++at_;
    }
    starts_ = false;
    std::size_t end = at_;
    while (end < bytes_.size() && !space(bytes_[end])) ++end;
    const std::size_t start = at_ < end && bytes_[at_] == '+' ? at_ + 1 : at_;
    const char* const last = bytes_.data() + end;
    const auto [stop, error] = fast_float::from_chars(bytes_.data() + start, last, value);
    if (start == end || stop != last || error != std::errc()) return false;
    at_ = end;
    return true;
  }

  std::string_view bytes_;
  std::size_t at_;
  PlyHeader::Encoding encoding_;
  bool by_line_ = false;
  bool strict_ = false;  // and there are no other lines
  bool starts_ = true;   // an element does here
};

/// What a vertex's property is.
enum class Role : std::uint8_t { kNone, kX, kY, kZ, kNx, kNy, kNz, kU, kV, kRed, kGreen, kBlue };
constexpr std::size_t kRoles = 12;

Role role_of(std::string_view name) {
  constexpr std::pair<std::string_view, Role> kNames[] = {{"x", Role::kX},
                                                          {"y", Role::kY},
                                                          {"z", Role::kZ},
                                                          {"nx", Role::kNx},
                                                          {"ny", Role::kNy},
                                                          {"nz", Role::kNz},
                                                          {"u", Role::kU},
                                                          {"v", Role::kV},
                                                          {"s", Role::kU},
                                                          {"t", Role::kV},
                                                          {"texture_u", Role::kU},
                                                          {"texture_v", Role::kV},
                                                          {"red", Role::kRed},
                                                          {"green", Role::kGreen},
                                                          {"blue", Role::kBlue},
                                                          {"r", Role::kRed},
                                                          {"g", Role::kGreen},
                                                          {"b", Role::kBlue},
                                                          {"diffuse_red", Role::kRed},
                                                          {"diffuse_green", Role::kGreen},
                                                          {"diffuse_blue", Role::kBlue}};
  for (const auto& [known, role] : kNames) {
    if (name == known) return role;
  }
  return Role::kNone;
}

/// What full intensity of a colour is.
double full_of(PlyType type) {
  if (type == PlyType::kU8 || type == PlyType::kI8) return 255;
  if (type == PlyType::kU16 || type == PlyType::kI16) return 65535;
  return 1;
}

class PlyReader {
 public:
  PlyReader(std::string_view bytes, const PlyHeader& header, const std::string& label)
      : header_(header), values_(bytes, header), label_(label) {}

  Result<SourceModel> run() {
    for (const PlyElement& element : header_.elements) {
      const std::size_t least = values_.least_bytes(element);
      const std::uint64_t room = least > 0 ? values_.left() / least : kMostElements;
      if (element.count > std::min(room, kMostElements)) {
        return fail(ExitCode::kInvalidInput, "ply.short",
                    label_ + ": byte " + std::to_string(values_.offset()),
                    "the header states " + std::to_string(element.count) + " elements '" +
                        element.name + "' and the file has room for " + std::to_string(room),
                    "the file is truncated; copy or export it again");
      }
      if (least == 0) continue;
      // Of several elements of that name, which no program writes, the first holds the vertices.
      if (element.name == "vertex" && model_.positions.empty()) {
        MODAR_TRY(read_vertices(element));
      } else {
        MODAR_TRY(read_faces(element));
      }
    }
    return finish();
  }

 private:
  [[nodiscard]] tl::unexpected<Error> cut_short(const PlyElement& element,
                                                std::uint64_t index) const {
    return fail(ExitCode::kInvalidInput, values_.left() == 0 ? "ply.short" : "ply.number",
                label_ + ": byte " + std::to_string(values_.offset()),
                "the file ends, or has no number, at " + element.name + " " +
                    std::to_string(index) + " of " + std::to_string(element.count),
                "the file is truncated or damaged; copy or export it again");
  }

  /// Colours in [0,1]. Floats beyond, and 16 bits of which 8 are used, are of programs that write 0
  /// to 255.
  template <class It>
  static void finish_colours(It begin, It end, double stated) {
    float most = 0;
    for (It c = begin; c != end; ++c) most = std::max({most, c->x, c->y, c->z});
    float full = most > 2.0f && most <= 255.0f ? 255.0f : 1.0f;
    if (stated > 255 && most * static_cast<float>(stated) < 255.5f) full = 255.0f / 65535.0f;
    for (It c = begin; c != end; ++c) *c = glm::clamp(*c / full, 0.0f, 1.0f);
  }

  /// Reads a list into list_. False at the end.
  bool parse_list(const PlyProperty& property) {
    double count = 0;
    if (!values_.take(property.count_type, count) || !(count >= 0)) return false;
    const std::size_t least = values_.text() ? 1 : ply_bytes(property.type);
    if (count > static_cast<double>(values_.left() / least)) return false;
    list_.resize(static_cast<std::size_t>(count));
    for (double& value : list_) {
      if (!values_.take(property.type, value)) return false;
    }
    return true;
  }

  Result<void> read_vertices(const PlyElement& element) {
    std::vector<Role> roles;
    bool has[kRoles] = {};
    double full = 1;
    for (const PlyProperty& property : element.properties) {
      roles.push_back(property.list ? Role::kNone : role_of(property.name));
      has[static_cast<std::size_t>(roles.back())] = true;
      if (roles.back() == Role::kRed) full = full_of(property.type);
    }
    const auto all = [&](Role first, std::size_t count) {
      const auto start = static_cast<std::size_t>(first);
      return std::all_of(has + start, has + start + count, [](bool one) { return one; });
    };
    const bool normals = all(Role::kNx, 3);
    const bool uvs = all(Role::kU, 2);
    const bool colours = all(Role::kRed, 3);
    model_.positions.reserve(element.count);
    for (std::uint64_t i = 0; i < element.count; ++i) {
      std::array<double, kRoles> value{};
      for (std::size_t p = 0; p < roles.size(); ++p) {
        const PlyProperty& property = element.properties[p];
        const bool good =
            property.list ? parse_list(property)
                          : values_.take(property.type, value[static_cast<std::size_t>(roles[p])]);
        if (!good) return cut_short(element, i);
      }
      values_.end_element();
      model_.positions.push_back({value[1], value[2], value[3]});
      if (normals) {
        model_.normals.push_back(glm::vec3(glm::dvec3(value[4], value[5], value[6])));
      }
      if (uvs) model_.uvs.push_back({value[7], value[8]});
      if (colours) {
        model_.colours.push_back(glm::vec3(glm::dvec3(value[9], value[10], value[11]) / full));
      }
    }
    finish_colours(model_.colours.begin(), model_.colours.end(), full);
    return {};
  }

  /// Faces, and what no reader needs, which is passed over.
  Result<void> read_faces(const PlyElement& element) {
    const bool strips = element.name == "tristrips";
    const bool faces = element.name == "face" || strips;
    std::vector<double> corners;
    std::vector<double> uvs;
    for (std::uint64_t i = 0; i < element.count; ++i) {
      corners.clear();
      uvs.clear();
      double texture = 0;
      std::array<double, kRoles> colour{};
      int colours = 0;
      bool whole = true;
      for (const PlyProperty& property : element.properties) {
        double value = 0;
        whole = property.list ? parse_list(property) : values_.take(property.type, value);
        if (!whole) break;
        if (property.list &&
            (property.name == "vertex_indices" || property.name == "vertex_index")) {
          corners.swap(list_);
        } else if (property.list && property.name == "texcoord") {
          uvs.swap(list_);
        } else if (property.name == "texnumber") {
          texture = value;
        } else if (const Role role = role_of(property.name); !property.list && role >= Role::kRed) {
          colour[static_cast<std::size_t>(role)] = value / full_of(property.type);
          ++colours;
        }
      }
      // MeshLab's header calls lists of corners' colours single ones.
      colours_fit_ = !values_.end_element() && colours_fit_;
      if (!whole && !values_.strict()) return cut_short(element, i);
      if (!whole) corners.clear();
      if (!faces) continue;
      if (strips) {
        add_strip(corners);
      } else {
        const std::uint64_t before = faces_;
        add_face(corners, uvs, texture);
        if (colours == 3 && faces_ != before) {
          face_colours_.push_back(glm::vec3(glm::dvec3(colour[9], colour[10], colour[11])));
        }
      }
      if (model_.corner_count() > kMostElements) return cut_short(element, i);
    }
    return {};
  }

  void add_face(const std::vector<double>& corners, const std::vector<double>& uvs,
                double texture) {
    const auto vertices = static_cast<double>(model_.positions.size());
    const auto inside = [&](double index) { return index >= 0 && index < vertices; };
    if (corners.size() < 3 || !std::all_of(corners.begin(), corners.end(), inside)) {
      ++left_out_;
      return;
    }
    const auto last = static_cast<double>(std::max<std::size_t>(header_.textures.size(), 1) - 1);
    // MeshLab's -1: no picture, which is the material behind those of the pictures.
    const auto material = static_cast<std::uint32_t>(
        texture < 0 && !header_.textures.empty() ? last + 1 : std::clamp(texture, 0.0, last));
    if (model_.material_runs.empty() || model_.material_runs.back().value != material) {
      model_.material_runs.push_back({faces_, material});
    }
    const bool own_uvs = uvs.size() == 2 * corners.size();
    if (own_uvs && corner_uvs_.size() < model_.corner_count()) {
      corner_uvs_.resize(model_.corner_count(), kNoIndex);
    }
    for (std::size_t k = 0; k < corners.size(); ++k) {
      model_.corner_positions.push_back(static_cast<std::uint32_t>(corners[k]));
      if (!own_uvs) continue;
      corner_uvs_.push_back(static_cast<std::uint32_t>(face_uvs_.size()));
      face_uvs_.push_back({uvs[2 * k], uvs[2 * k + 1]});
    }
    first_corner_.push_back(static_cast<std::uint32_t>(model_.corner_count()));
    ++faces_;
  }

  /// Gives the corners of faces with a colour positions of that colour.
  void colour_faces() {
    const auto vary = [](const auto& colours) {
      return ranges::any_of(colours, [&](const glm::vec3& c) { return c != colours[0]; });
    };
    if (face_colours_.size() != faces_ || !colours_fit_ || vary(model_.colours)) return;
    if (!model_.colours.empty() && !vary(face_colours_)) return;
    model_.colours = Array<glm::vec3>();
    finish_colours(face_colours_.begin(), face_colours_.end(), 1);
    const Array<glm::dvec3> positions = std::move(model_.positions);
    const Array<glm::dvec2> uvs = std::move(model_.uvs);
    const Array<glm::vec3> normals = std::move(model_.normals);
    model_.positions = Array<glm::dvec3>();
    model_.uvs = Array<glm::dvec2>();
    model_.normals = Array<glm::vec3>();
    std::map<std::tuple<std::uint32_t, float, float, float>, std::uint32_t> known;
    std::size_t corner = 0;
    for (std::uint64_t f = 0; f < faces_; ++f) {
      const glm::vec3& colour = face_colours_[f];
      for (; corner < first_corner_[f]; ++corner) {
        std::uint32_t& p = model_.corner_positions[corner];
        const auto number = static_cast<std::uint32_t>(model_.positions.size());
        const auto [found, added] = known.try_emplace({p, colour.x, colour.y, colour.z}, number);
        if (added) {
          model_.positions.push_back(positions[p]);
          model_.colours.push_back(colour);
          if (!uvs.empty()) model_.uvs.push_back(uvs[p]);
          if (!normals.empty()) model_.normals.push_back(normals[p]);
        }
        p = found->second;
      }
    }
  }

  void add_strip(const std::vector<double>& corners) {
    std::size_t start = 0;
    for (std::size_t i = 0; i < corners.size(); ++i) {
      if (corners[i] < 0) {
        start = i + 1;
      } else if (i >= start + 2) {
        const bool odd = (i - start) % 2 != 0;
        add_face({corners[i - 2], corners[odd ? i : i - 1], corners[odd ? i - 1 : i]}, {}, 0);
      }
    }
  }

  /// Whether the vertices have the scales and turns of 3D Gaussians.
  [[nodiscard]] bool is_splat() const {
    return ranges::any_of(header_.elements, [](const PlyElement& element) {
      const auto has = [&](const char* name) {
        return ranges::any_of(element.properties,
                              [&](const PlyProperty& p) { return p.name == name; });
      };
      return (has("scale_0") && has("rot_0")) || has("f_dc_0") || has("packed_rotation");
    });
  }

  Result<SourceModel> finish() {
    if (faces_ == 0) {
      return fail(ExitCode::kInvalidInput, "ply.no-faces", label_,
                  "the file has " + std::to_string(model_.positions.size()) +
                      " vertices but no usable face",
                  is_splat()
                      ? "this is a Gaussian splat, which has no surface: bake a mesh that was "
                        "made from the same photos"
                      : "mesh the point cloud first, in MeshLab or CloudCompare");
    }
    model_.lost_faces = left_out_;
    for (const PlyElement& element : header_.elements) {
      if (element.name != "vertex") continue;
      model_.account.attributes.left_out = static_cast<std::uint64_t>(
          std::count_if(element.properties.begin(), element.properties.end(),
                        [](const PlyProperty& p) { return role_of(p.name) == Role::kNone; }));
    }
    if (left_out_ != 0) {
      model_.diagnostics.push_back({"ply.left-out", DiagnosticSeverity::kWarning, label_, 0,
                                    std::to_string(left_out_) +
                                        " faces have fewer than three corners, lack numbers or "
                                        "name vertices that do not exist",
                                    "they are left out; export the model again"});
    }
    colour_faces();
    if (model_.corner_count() != 3 * faces_) {
      model_.first_corner.push_back(0);
      for (const std::uint32_t corner : first_corner_) model_.first_corner.push_back(corner);
    }
    if (!face_uvs_.empty()) {
      corner_uvs_.resize(model_.corner_count(), kNoIndex);
      model_.uvs = Array<glm::dvec2>();
      model_.uvs.append(face_uvs_.data(), face_uvs_.size());
      model_.corner_uvs.kind = IndexPlane::Kind::kOwn;
      model_.corner_uvs.own.append(corner_uvs_.data(), corner_uvs_.size());
    } else if (!model_.uvs.empty()) {
      model_.corner_uvs.kind = IndexPlane::Kind::kSame;
    }
    if (!model_.normals.empty()) model_.corner_normals.kind = IndexPlane::Kind::kSame;
    model_.smoothing_runs = {{0, kUnstatedSmoothing}};
    return std::move(model_);
  }

  const PlyHeader& header_;
  PlyValues values_;
  const std::string& label_;
  SourceModel model_;
  std::vector<double> list_;
  std::vector<std::uint32_t> first_corner_;  // of the face after each
  std::vector<std::uint32_t> corner_uvs_;    // of faces with uvs of their own
  std::vector<glm::dvec2> face_uvs_;
  std::vector<glm::vec3> face_colours_;
  bool colours_fit_ = true;  // the lines of faces have nothing beyond what the header says
  std::uint64_t faces_ = 0;
  std::uint64_t left_out_ = 0;
};

/// One material a picture that the header names, or one without.
void add_materials(const PlyHeader& header, const ModelFolder& folder, const std::string& label,
                   bool own_picture, SourceModel& model) {
  for (const std::string& statement : header.textures) {
    SourceMaterial& material = model.materials.emplace_back();
    bool transformed = false;
    material.diffuse = glm::vec3(1.0f);
    material.diffuse_map = find_map_file(statement, folder, material.name, transformed);
    if (!material.diffuse_map.empty()) continue;
    model.files.push_back(folder.path + material.name);
    model.diagnostics.push_back(not_read("ply.missing-texture", label, 0,
                                         "texture '" + statement + "'", material.name, folder,
                                         "put it into the model's folder"));
  }
  const auto plain = ranges::any_of(
      model.material_runs, [&](const auto& run) { return run.value >= model.materials.size(); });
  if (!model.materials.empty() && !plain) return;
  model.materials.emplace_back();
  if (!header.textures.empty()) return;
  assign_texture_by_name(folder, label, own_picture, model);
}

Result<SourceModel> parse(std::string_view bytes, const ModelFolder& folder,
                          const std::string& label, const ReadOptions& options = {}) {
  MODAR_ASSIGN(const PlyHeader header, parse_ply_header(bytes, label));
  MODAR_ASSIGN(SourceModel model, PlyReader(bytes, header, label).run());
  model.name = std::filesystem::path(label).stem().string();
  const std::string_view head = bytes.substr(0, header.bytes);
  if (const auto up = up_in_comments(head)) {
    model.up = {*up, UpReason::kHeader};
  } else if (head.find("comment Created by Blender") != std::string_view::npos ||
             head.find("comment Created in Blender") != std::string_view::npos) {
    model.up = {UpAxis::kZ, UpReason::kHeader};  // as its exporter writes by default
  }
  add_materials(header, folder, label, options.own_picture, model);
  return model;
}

}  // namespace

Result<SourceModel> parse_ply(std::string_view bytes, const std::string& label) {
  return parse(bytes, std::string(), label);
}

Result<SourceModel> read_ply(const std::string& path, const ReadOptions& options) {
  MODAR_ASSIGN(const MappedFile file, MappedFile::open(path));
  const std::size_t slash = path.rfind('/');
  return file.settle(
      parse({reinterpret_cast<const char*>(file.bytes().data()), file.bytes().size()},
            {slash == std::string::npos ? "./" : path.substr(0, slash + 1), options.within}, path,
            options));
}

}  // namespace modar
