// Joins parsed OBJ blocks, in file order, into one SourceModel.
#pragma once

#include <cstdint>
#include <string>

#include "bake/import/obj/obj_block.hpp"
#include "bake/import/obj/obj_materials.hpp"
#include "bake/import/source_model.hpp"

namespace modar {

inline constexpr std::uint64_t kMaxElements = 0x3FFFFFFFu;  ///< of each kind, and corners

class ObjAssembler {
 public:
  /// model: filled; outlives this.
  explicit ObjAssembler(SourceModel& model) : model_(model) {}

  /// Appends a block; changes it on the way.
  void add(ObjBlock& block);
  /// What has been added so far.
  [[nodiscard]] const ObjCounts& counts() const { return counts_; }
  /// Is there a corner that refers to nothing? Then the file must be parsed again with ObjLimits.
  [[nodiscard]] bool needs_careful_pass() const;
  [[nodiscard]] bool too_large() const;
  /// Reads the materials, turns tallies into findings, gives spare memory back.
  void finish(const std::string& folder, const std::string& label);

 private:
  void resolve_relative(ObjBlock& block);
  void add_colours(const ObjBlock& block);
  void add_plane(const ObjBlock& block, const Scratch<std::uint32_t>& indices, IndexPlane& plane);
  void add_faces(const ObjBlock& block);
  void apply(const ObjStatement& statement, std::uint64_t face);
  void finish_colours(const std::string& label);

  SourceModel& model_;
  ObjMaterials materials_;
  ObjCounts counts_;
  ObjCounts highest_;
  NoteTallies notes_{};
  std::uint64_t faces_ = 0;
  std::uint64_t lines_ = 0;
  bool bad_relative_ = false;
};

}  // namespace modar
