// Writes the description itself: a subset of USD that needs none of its libraries.
#include "bake/export/model_file.hpp"

#include <zlib.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <string>
#include <string_view>

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/gtc/matrix_transform.hpp>
#include <glm/gtc/quaternion.hpp>
#include <glm/matrix.hpp>

#include "bake/image/image.hpp"
#include "bake/mesh/pack/vertex_codec.hpp"
#include "formats/base/colour.hpp"
#include "formats/component.hpp"
#include "formats/texture_format.hpp"
#include "modar/clip_player.hpp"

namespace modar {
namespace {

// ---- numbers ----

void append(std::string& text, double number) {
  // Six digits: of a model of a metre, a micrometre.
  char digits[32];
  std::snprintf(digits, sizeof digits, "%.6g", number);
  text += digits;
}

std::string number_text(double number) {
  std::string text;
  append(text, number);
  return text;
}

template <class Vector>
std::string tuple(const Vector& v) {
  std::string text = "(";
  for (int i = 0; i < v.length(); ++i) {
    if (i != 0) text += ", ";
    append(text, v[i]);
  }
  return text + ")";
}

template <class List, class Write>
std::string array(const List& list, Write&& write) {
  std::string text = "[";
  for (const auto& each : list) {
    if (text.size() > 1) text += ", ";
    text += write(each);
  }
  return text + "]";
}

// ---- the archive ----

struct Entry {
  std::string name;
  std::vector<std::byte> bytes;
};

void put(std::vector<std::byte>& out, std::uint64_t value, int bytes) {
  for (int i = 0; i < bytes; ++i) out.push_back(static_cast<std::byte>(value >> (8 * i)));
}

/// What a ZIP's local and central headers have in common (APPNOTE 4.3.7 and 4.3.12), without a
/// time.
void put_header(std::vector<std::byte>& out, const Entry& entry, std::size_t padding) {
  const auto* data = reinterpret_cast<const Bytef*>(entry.bytes.data());
  put(out, 20, 2);    // version to extract with
  put(out, 0, 2);     // flags
  put(out, 0, 2);     // stored
  put(out, 0, 2);     // time
  put(out, 0x21, 2);  // date: 1980-01-01, the first that there is
  put(out, crc32_z(0, data, entry.bytes.size()), 4);
  put(out, entry.bytes.size(), 4);
  put(out, entry.bytes.size(), 4);
  put(out, entry.name.size(), 2);
  put(out, padding, 2);
}

void put_text(std::vector<std::byte>& out, std::string_view text) {
  const auto bytes = std::as_bytes(std::span(text.data(), text.size()));
  out.insert(out.end(), bytes.begin(), bytes.end());
}

std::vector<std::byte> zip(const std::vector<Entry>& entries) {
  constexpr std::size_t kAlignment = 64;  // of a file's bytes: USDZ specification
  constexpr std::size_t kLocalHeader = 30;
  constexpr std::size_t kExtraHeader = 4;
  std::vector<std::byte> out;
  std::vector<std::byte> directory;
  for (const Entry& entry : entries) {
    const std::size_t start = out.size();
    const std::size_t plain = start + kLocalHeader + entry.name.size() + kExtraHeader;
    const std::size_t padding = kExtraHeader + (kAlignment - plain % kAlignment) % kAlignment;
    put(out, 0x04034b50, 4);
    put_header(out, entry, padding);
    put_text(out, entry.name);
    put(out, 0x1986, 2);  // a field that readers skip, as Pixar's own writer has it
    put(out, padding - kExtraHeader, 2);
    out.resize(out.size() + padding - kExtraHeader);
    out.insert(out.end(), entry.bytes.begin(), entry.bytes.end());
    put(directory, 0x02014b50, 4);
    put(directory, 20, 2);  // made by
    put_header(directory, entry, 0);
    put(directory, 0, 2 + 2 + 2 + 4);  // comment, disk, attributes
    put(directory, start, 4);
    put_text(directory, entry.name);
  }
  const std::size_t start = out.size();
  out.insert(out.end(), directory.begin(), directory.end());
  put(out, 0x06054b50, 4);
  put(out, 0, 4);  // disks
  put(out, entries.size(), 2);
  put(out, entries.size(), 2);
  put(out, directory.size(), 4);
  put(out, start, 4);
  put(out, 0, 2);
  return out;
}

// ---- the description ----

constexpr int kPosesPerSecond = 30;  ///< between which viewers turn bones evenly

std::string matrix_text(const glm::dmat4& m) {
  return "(" + tuple(m[0]) + ", " + tuple(m[1]) + ", " + tuple(m[2]) + ", " + tuple(m[3]) + ")";
}

glm::dmat4 affine_of(const float (&rows)[12]) {
  glm::dmat4 m(1.0);
  for (int i = 0; i < 12; ++i) m[i % 4][i / 4] = static_cast<double>(rows[i]);
  return m;
}

/// Where a joint is in its parent.
struct Place {
  glm::dvec3 translation{0.0};
  glm::dquat rotation{1.0, 0.0, 0.0, 0.0};
  glm::dvec3 scale{1.0};

  [[nodiscard]] glm::dmat4 matrix() const {
    return glm::scale(glm::translate(glm::dmat4(1.0), translation) * glm::mat4_cast(rotation),
                      scale);
  }
};

/// Of nodes that nothing moves: scaled first, then turned.
Place place_of(const glm::dmat4& m) {
  glm::dmat3 turn(m);
  Place place;
  place.translation = glm::dvec3(m[3]);
  const double sign = glm::determinant(turn) < 0 ? -1 : 1;
  for (int axis = 0; axis < 3; ++axis) {
    place.scale[axis] = sign * glm::length(turn[axis]);
    if (place.scale[axis] != 0) turn[axis] /= place.scale[axis];
  }
  place.rotation = glm::normalize(glm::quat_cast(turn));
  return place;
}

Place rest_of(const JointRecord& joint) {
  const float* r = joint.rotation;
  Place place;
  place.rotation = glm::normalize(glm::dquat(r[3], r[0], r[1], r[2]));
  for (int i = 0; i < 3; ++i) {
    place.translation[i] = static_cast<double>(joint.translation[i]);
    place.scale[i] = static_cast<double>(joint.scale[i]);
  }
  return place;
}

/// Joints of a model at a sample of a clip.
std::vector<Place> places_at(const BundleView& bundle, RecordRange joints,
                             const ClipTracksView& view, double sample,
                             std::vector<std::uint32_t>& keys) {
  std::vector<Place> places;
  for (std::uint32_t j = 0; j < joints.count; ++j)
    places.push_back(rest_of(bundle.joints()[joints.first + j]));
  keys.resize(view.tracks.size());
  for (std::size_t t = 0; t < view.tracks.size(); ++t) {
    const TrackRecord& track = view.tracks[t];
    const TrackValue value = view.at(track, static_cast<float>(sample), keys[t]);
    const glm::dvec4 v(value[0], value[1], value[2], value[3]);
    Place& place = places[track.joint];
    switch (static_cast<TrackPath>(track.path)) {
      case TrackPath::kTranslation:
        place.translation = glm::dvec3(v);
        break;
      case TrackPath::kRotation:
        place.rotation = glm::normalize(glm::dquat(v.w, v.x, v.y, v.z));
        break;
      case TrackPath::kScale:
        place.scale = glm::dvec3(v);
        break;
    }
  }
  return places;
}

/// joint: of the model, whose tracks move it; kNone: it stays. bone: whose vertices it moves, and
/// how they are bound.
struct SkeletonJoint {
  std::string path;
  Place place;
  std::uint32_t joint = kNone;
  std::uint32_t bone = kNone;
};

class Description {
 public:
  Description(const BundleView& bundle, std::span<const GlbImage> images)
      : bundle_(bundle), images_(images) {}

  Result<void> add_model(const RoomModel& placed, double seconds);
  /// The description and its textures.
  std::vector<Entry> take_entries();

 private:
  Result<std::string> texture_file(std::uint32_t texture);
  Result<void> add_material(std::uint32_t index, bool coloured);
  Result<void> add_chunk(const RoomModel& placed, const ChunkRecord& chunk);
  void add_skin(const ModelRecord& model, const PartRecord& part, const DecodedLevel& level);
  void find_joints(std::uint32_t model);
  [[nodiscard]] std::string joint_names() const;
  [[nodiscard]] std::string skeleton_text() const;
  void add_skeleton(const RoomModel& placed, double seconds);

  const BundleView& bundle_;
  std::span<const GlbImage> images_;
  std::vector<Entry> textures_;
  std::vector<std::pair<std::uint32_t, std::string>> names_;  // of textures' files; empty: none
  std::vector<std::uint32_t> materials_;
  std::string material_text_;
  std::string mesh_text_;
  std::string root_;  ///< of the model that is written, where it moves
  int meshes_ = 0;
  RecordRange joints_;
  std::uint32_t first_bone_ = 0;
  std::vector<SkeletonJoint> skeleton_;
  std::vector<std::uint32_t> bone_joints_;  ///< in the skeleton, of the model's bones
  int poses_ = 0;                           ///< of the longest clip, without the last
};

/// The name of a texture's file in the archive; empty where its pixels are not there.
Result<std::string> Description::texture_file(std::uint32_t texture) {
  for (const auto& [known, name] : names_) {
    if (known == texture) return name;
  }
  names_.emplace_back(texture, "");
  for (const GlbImage& image : images_) {
    if (image.texture != texture) continue;
    constexpr int kQuality = 85;
    const bool opaque = is_opaque(image.pixels);
    Entry file;
    file.name = "textures/" + std::to_string(texture) + (opaque ? ".jpg" : ".png");
    MODAR_ASSIGN(file.bytes,
                 opaque ? encode_jpeg(image.pixels, kQuality) : encode_png(image.pixels));
    names_.back().second = file.name;
    textures_.push_back(std::move(file));
  }
  return names_.back().second;
}

/// A node of a material: what it is, and its lines.
std::string shader(const char* name, const char* id, const std::string& lines) {
  return std::string("            def Shader \"") + name +
         "\"\n            {\n                uniform token info:id = \"" + id + "\"\n" + lines +
         "            }\n";
}

std::string line(const std::string& text) {
  return "                " + text + "\n";
}

Result<void> Description::add_material(std::uint32_t index, bool coloured) {
  const MaterialRecord& source = bundle_.materials()[index];
  const std::string path = "/Model/Materials/m" + std::to_string(index);
  glm::dvec3 diffuse;
  glm::dvec3 emission;
  for (int i = 0; i < 3; ++i) {
    diffuse[i] = exported_diffuse(bundle_, source, static_cast<std::size_t>(i));
    emission[i] = std::clamp(linear_of_srgb(static_cast<double>(source.emission[i])), 0.0, 1.0);
  }
  std::string file;
  if (source.texture != kNone) {
    MODAR_ASSIGN(file, texture_file(source.texture));
  }
  std::string opacity = "float inputs:opacity = ";
  append(opacity, static_cast<double>(source.opacity));
  std::string surface;
  std::string others;
  if (!file.empty()) {
    const TextureRecord& texture = bundle_.textures()[source.texture];
    constexpr const char* kWays[] = {"clamp", "repeat", "mirror"};  // of Wrap
    const auto wrap = [&](std::size_t axis) {
      return kWays[static_cast<std::size_t>(texture_wrap(texture.flags)[axis])];
    };
    if ((texture.flags & kTextureAlpha) != 0) {
      opacity = "float inputs:opacity.connect = <" + path + "/Colour.outputs:a>";
    }
    if ((texture.flags & kTextureCutOut) != 0) {
      surface += line("float inputs:opacityThreshold = 0.5");
    }
    surface += line("color3f inputs:diffuseColor.connect = <" + path + "/Colour.outputs:rgb>");
    others = shader("Uv", "UsdPrimvarReader_float2",
                    line("string inputs:varname = \"st\"") + line("float2 outputs:result")) +
             shader("Colour", "UsdUVTexture",
                    line("asset inputs:file = @" + file + "@") +
                        line("float2 inputs:st.connect = <" + path + "/Uv.outputs:result>") +
                        line("float4 inputs:scale = " +
                             tuple(glm::dvec4(diffuse, static_cast<double>(source.opacity)))) +
                        line("token inputs:sourceColorSpace = \"sRGB\"") +
                        line(std::string("token inputs:wrapS = \"") + wrap(0) + "\"") +
                        line(std::string("token inputs:wrapT = \"") + wrap(1) + "\"") +
                        line("float3 outputs:rgb") + line("float outputs:a"));
  } else if (coloured) {
    surface += line("color3f inputs:diffuseColor.connect = <" + path + "/Colour.outputs:result>");
    others =
        shader("Colour", "UsdPrimvarReader_float3",
               line("string inputs:varname = \"displayColor\"") + line("float3 outputs:result"));
  } else {
    surface += line("color3f inputs:diffuseColor = " + tuple(diffuse));
  }
  if (emission != glm::dvec3(0.0)) {
    surface += line("color3f inputs:emissiveColor = " + tuple(emission));
  }
  std::string roughness = "float inputs:roughness = ";
  append(roughness, roughness_of(source.shininess));
  std::string metallic = "float inputs:metallic = ";
  append(metallic, static_cast<double>(material_share(source.flags, kMaterialMetalness)));
  surface += line(roughness) + line(metallic) + line(opacity) + line("token outputs:surface");
  material_text_ += "        def Material \"m" + std::to_string(index) +
                    "\"\n        {\n            token outputs:surface.connect = <" + path +
                    "/Surface.outputs:surface>\n" +
                    shader("Surface", "UsdPreviewSurface", surface) + others + "        }\n";
  return {};
}

Result<void> Description::add_chunk(const RoomModel& placed, const ChunkRecord& chunk) {
  const ModelRecord& model = bundle_.models()[placed.model];
  MODAR_ASSIGN(const DecodedLevel level,
               decode_level(bundle_, bundle_.layouts()[model.layout], chunk));
  if (level.indices.empty()) return {};
  const MaterialRecord& material = bundle_.materials()[chunk.material];
  if ((material.flags & kMaterialOccluder) != 0) return {};
  if (std::find(materials_.begin(), materials_.end(), chunk.material) == materials_.end()) {
    materials_.push_back(chunk.material);
    MODAR_TRY(add_material(chunk.material, !level.colours.empty()));
  }
  std::string& text = mesh_text_;
  const std::uint32_t part = root_.empty() ? kNone : part_of(bundle_, chunk.material);
  const glm::dmat4 place = root_.empty() ? placed.place : glm::dmat4(1.0);
  const glm::dmat3 turn(place);
  text += "    def Mesh \"c" + std::to_string(meshes_) +
          "\" (\n        prepend apiSchemas = [\"MaterialBindingAPI\"" +
          (part != kNone ? ", \"SkelBindingAPI\"" : "") + "]\n    )\n    {\n";
  if (part != kNone) add_skin(model, bundle_.moving_parts()[part], level);
  ++meshes_;
  const std::vector<int> threes(level.indices.size() / 3, 3);
  const auto number = [](auto value) { return std::to_string(value); };
  text += "        int[] faceVertexCounts = " + array(threes, number) + "\n";
  text += "        int[] faceVertexIndices = " + array(level.indices, number) + "\n";
  text +=
      "        rel material:binding = </Model/Materials/m" + std::to_string(chunk.material) + ">\n";
  text +=
      "        point3f[] points = " +
      array(level.positions,
            [&](const glm::dvec3& p) { return tuple(glm::dvec3(place * glm::dvec4(p, 1.0))); }) +
      "\n";
  text +=
      "        normal3f[] normals = " +
      array(level.normals, [&](const glm::dvec3& n) { return tuple(glm::normalize(turn * n)); }) +
      " (\n            interpolation = \"vertex\"\n        )\n";
  if (!level.uvs.empty()) {
    text +=
        "        texCoord2f[] primvars:st = " +
        array(level.uvs, [](const glm::dvec2& uv) { return tuple(glm::dvec2(uv.x, 1.0 - uv.y)); }) +
        " (\n            interpolation = \"vertex\"\n        )\n";
  }
  if (!level.colours.empty()) {
    text += "        color3f[] primvars:displayColor = " +
            array(level.colours,
                  [](const glm::dvec4& c) {
                    return tuple(
                        glm::dvec3(linear_of_srgb(c.r), linear_of_srgb(c.g), linear_of_srgb(c.b)));
                  }) +
            " (\n            interpolation = \"vertex\"\n        )\n";
  }
  text += "        uniform token subdivisionScheme = \"none\"\n";
  if ((material.flags & kMaterialTwoSided) != 0) text += "        uniform bool doubleSided = 1\n";
  text += "    }\n";
  return {};
}

/// Names with the numbers of bones.
std::string numbered(const char* name, const std::vector<std::uint32_t>& bones) {
  return array(bones, [name](std::uint32_t b) { return "\"" + (name + std::to_string(b)) + "\""; });
}

/// Bones and morph targets of a part.
void Description::add_skin(const ModelRecord& model, const PartRecord& part,
                           const DecodedLevel& level) {
  const LayoutRecord& layout = bundle_.layouts()[model.layout];
  const auto [bones, shares] = vertex_shares(layout, part, level);
  const std::string four =
      " (\n            elementSize = 4\n            interpolation = \"vertex\"\n        )\n";
  std::string& text = mesh_text_;
  text += "        rel skel:skeleton = <" + root_ + "/Skeleton>\n";
  text += "        int[] primvars:skel:jointIndices = " +
          array(bones,
                [&](std::uint32_t b) {
                  return std::to_string(bone_joints_[part.first_bone + b - first_bone_]);
                }) +
          four;
  text += "        float[] primvars:skel:jointWeights = " + array(shares, number_text) + four;
  if (part.target_count == 0) return;
  std::vector<std::uint32_t> targets;
  for (std::uint32_t t = 0; t < part.target_count; ++t)
    targets.push_back(part.first_bone + part.bone_count + t - first_bone_);
  const std::string mesh = root_ + "/c" + std::to_string(meshes_);
  text += "        uniform token[] skel:blendShapes = " + numbered("t", targets) + "\n";
  text +=
      "        rel skel:blendShapeTargets = " +
      array(targets, [&](std::uint32_t t) { return "<" + mesh + "/t" + std::to_string(t) + ">"; }) +
      "\n";
  for (std::uint32_t t = 0; t < part.target_count; ++t) {
    text += "        def BlendShape \"t" + std::to_string(targets[t]) +
            "\"\n        {\n            uniform vector3f[] offsets = " +
            array(level.vertices,
                  [&](const std::byte* vertex) {
                    glm::dvec3 way;
                    for (int axis = 0; axis < 3; ++axis)
                      way[axis] = morph_part(layout, vertex, axis, t);
                    return tuple(way);
                  }) +
            "\n        }\n";
  }
}

/// What the skeleton has for the model's joints, and for bones of one joint that differ.
void Description::find_joints(std::uint32_t model) {
  joints_ = {};
  while (bundle_.joints()[joints_.first].model != model) ++joints_.first;
  skeleton_.clear();
  std::vector<std::size_t> own;
  for (std::uint32_t j = joints_.first;
       j < bundle_.joints().size() && bundle_.joints()[j].model == model; ++j, ++joints_.count) {
    const JointRecord& joint = bundle_.joints()[j];
    const std::string number = std::to_string(joints_.count);
    std::string path =
        joint.parent == kNone ? "" : skeleton_[own[joint.parent - joints_.first]].path + "/";
    const glm::dmat4 before = affine_of(joint.before);
    if (before != glm::dmat4(1.0)) {
      skeleton_.push_back({path + "p" + number, place_of(before), kNone, kNone});
      path = skeleton_.back().path + "/";
    }
    own.push_back(skeleton_.size());
    skeleton_.push_back({path + "j" + number, rest_of(joint), joints_.count, kNone});
  }
  const RecordRange bones = bones_of(bundle_, model);
  first_bone_ = bones.first;
  bone_joints_.clear();
  for (std::uint32_t b = bones.first; b < bones.first + bones.count; ++b) {
    const BoneRecord& bone = bundle_.bones()[b];
    std::size_t joint = own[bone.joint - joints_.first];
    std::uint32_t& binds = skeleton_[joint].bone;
    if (binds == kNone) binds = b;
    if (!std::equal(bone.inverse, bone.inverse + 12, bundle_.bones()[binds].inverse)) {
      const std::string path = skeleton_[joint].path + "/b" + std::to_string(b - bones.first);
      joint = skeleton_.size();
      skeleton_.push_back({path, {}, kNone, b});
    }
    bone_joints_.push_back(static_cast<std::uint32_t>(joint));
  }
}

/// Its joints, and where their vertices are bound.
std::string Description::skeleton_text() const {
  const auto bind = [this](const SkeletonJoint& joint) {
    return matrix_text(joint.bone == kNone
                           ? glm::dmat4(1.0)
                           : glm::inverse(affine_of(bundle_.bones()[joint.bone].inverse)));
  };
  return "    def Skeleton \"Skeleton\" (\n        prepend apiSchemas = "
         "[\"SkelBindingAPI\"]\n    )\n    {\n" +
         joint_names() + "        uniform matrix4d[] bindTransforms = " + array(skeleton_, bind) +
         "\n        uniform matrix4d[] restTransforms = " +
         array(skeleton_,
               [](const SkeletonJoint& joint) { return matrix_text(joint.place.matrix()); }) +
         "\n        rel skel:animationSource = <" + root_ + "/Clip>\n    }\n";
}

std::string Description::joint_names() const {
  return "        uniform token[] joints = " +
         array(skeleton_, [](const SkeletonJoint& joint) { return "\"" + joint.path + "\""; }) +
         "\n";
}

void Description::add_skeleton(const RoomModel& placed, double seconds) {
  find_joints(placed.model);
  ClipTracksView view = bundle_.clip_tracks(placed.clip);
  const auto length = static_cast<double>(bundle_.clips()[placed.clip].seconds);
  std::vector<std::uint32_t> bones;
  for (std::uint32_t b = 0; b < bone_joints_.size(); ++b) bones.push_back(b);
  std::vector<std::uint32_t> keys;
  std::array<std::string, 4> samples;
  const int poses = static_cast<int>(std::ceil(seconds * kPosesPerSecond));
  for (int i = 0; i <= poses; ++i) {
    const double at = i * seconds / poses;
    const double time = at > length ? std::fmod(at, length) : at;
    const std::vector<Place> places =
        places_at(bundle_, joints_, view, time / length * (view.header->sample_count - 1), keys);
    for (SkeletonJoint& joint : skeleton_) {
      if (joint.joint == kNone) continue;
      const glm::dquat before = joint.place.rotation;
      joint.place = places[joint.joint];
      if (glm::dot(before, joint.place.rotation) < 0) joint.place.rotation *= -1.0;
    }
    const std::string code = "            " + std::to_string(i) + ": ";
    const auto add = [&](std::size_t of, const auto& write) {
      samples[of] += code + array(skeleton_, [&](const auto& j) { return write(j.place); }) + ",\n";
    };
    add(0, [](const Place& p) { return tuple(p.translation); });
    add(1, [](const Place& p) {
      const glm::dquat& q = p.rotation;
      return tuple(glm::dvec4(q.w, q.x, q.y, q.z));
    });
    add(2, [](const Place& p) { return tuple(p.scale); });
    samples[3] +=
        code +
        array(bones,
              [&](std::uint32_t b) {
                const std::uint32_t joint = bundle_.bones()[first_bone_ + b].joint;
                const glm::dmat4 before = affine_of(bundle_.joints()[joint].before);
                return number_text((before * places[joint - joints_.first].matrix())[3].x);
              }) +
        ",\n";
  }
  poses_ = std::max(poses_, poses);
  mesh_text_ += skeleton_text() + "    def SkelAnimation \"Clip\"\n    {\n" + joint_names() +
                "        uniform token[] blendShapes = " + numbered("t", bones) + "\n";
  constexpr const char* kNames[] = {"float3[] translations", "quatf[] rotations", "half3[] scales",
                                    "float[] blendShapeWeights"};
  for (std::size_t i = 0; i < 4; ++i) {
    mesh_text_ +=
        std::string("        ") + kNames[i] + ".timeSamples = {\n" + samples[i] + "        }\n";
  }
  mesh_text_ += "    }\n";
}

Result<void> Description::add_model(const RoomModel& placed, double seconds) {
  const ModelRecord& model = bundle_.models()[placed.model];
  root_.clear();
  if (placed.clip != kNone) {
    const std::string name = "Moving" + std::to_string(meshes_);
    root_ = "/Model/" + name;
    glm::dvec3 low(1e300);
    glm::dvec3 high(-1e300);
    visit_boxes(bundle_, model, [&](const auto& least, const auto& most) {
      low = glm::min(low, glm::dvec3(least[0], least[1], least[2]));
      high = glm::max(high, glm::dvec3(most[0], most[1], most[2]));
    });
    mesh_text_ += "    def SkelRoot \"" + name + "\"\n    {\n        float3[] extent = [" +
                  tuple(low) + ", " + tuple(high) +
                  "]\n        matrix4d xformOp:transform = " + matrix_text(placed.place) +
                  "\n        uniform token[] xformOpOrder = [\"xformOp:transform\"]\n";
    add_skeleton(placed, seconds);
  }
  for (std::uint32_t c = 0; c < model.chunk_count; ++c) {
    MODAR_TRY(add_chunk(placed, bundle_.chunks()[model.first_chunk + c]));
  }
  if (!root_.empty()) mesh_text_ += "    }\n";
  return {};
}

std::vector<Entry> Description::take_entries() {
  const std::string text =
      "#usda 1.0\n(\n    defaultPrim = \"Model\"\n    metersPerUnit = 1\n    upAxis = \"Y\"\n" +
      (poses_ > 0 ? "    startTimeCode = 0\n    endTimeCode = " + std::to_string(poses_) +
                        "\n    timeCodesPerSecond = " + std::to_string(kPosesPerSecond) + "\n"
                  : "") +
      ")\n\n"
      "def Xform \"Model\" (\n    kind = \"component\"\n)\n{\n    def Scope \"Materials\"\n    "
      "{\n" +
      material_text_ + "    }\n" + mesh_text_ + "}\n";
  Entry description{"Model.usda", {}};
  put_text(description.bytes, text);
  std::vector<Entry> entries;
  entries.push_back(std::move(description));  // the first file is what viewers open
  for (Entry& texture : textures_) entries.push_back(std::move(texture));
  return entries;
}

}  // namespace

Result<std::vector<std::byte>> encode_usdz(const BundleView& bundle,
                                           std::span<const RoomModel> models,
                                           std::span<const GlbImage> images) {
  Description description(bundle, images);
  double seconds = 0;
  for (const RoomModel& placed : models) {
    if (placed.clip != kNone)
      seconds = std::max(seconds, static_cast<double>(bundle.clips()[placed.clip].seconds));
  }
  for (const RoomModel& placed : models) MODAR_TRY(description.add_model(placed, seconds));
  const std::vector<Entry> entries = description.take_entries();
  std::uint64_t bytes = 0;
  for (const Entry& entry : entries) bytes += entry.bytes.size() + 1024;
  if (bytes > 0xF0000000u) {
    return fail(ExitCode::kUnsupported, "usdz.too-large", "",
                "the models need more than the 4 GB that a USDZ file can hold",
                "bake smaller ones: --tier phone");
  }
  return zip(entries);
}

}  // namespace modar
