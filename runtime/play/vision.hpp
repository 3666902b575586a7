// The vision thread's work: which tracker with which parameters.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <glm/vec3.hpp>

#include "formats/base/error.hpp"
#include "formats/bundle_view.hpp"
#include "live_bundle.hpp"
#include "pipeline.hpp"
#include "spot_pattern.hpp"

namespace modar {

struct VisionOptions {
  bool ours = true;                 ///< our pose loop; false: the ModAR paper's method
  std::uint32_t parameter_set = 0;  ///< id, see choose_parameter_set()
  std::optional<Camera> camera;     ///< calibrated; else ours estimates it from the default
  SpotSlot* spot = nullptr;         ///< patterns made on the spot come here; may be null
  LiveSlot* live = nullptr;         ///< newer versions of the bundle come here; may be null
  bool apart = false;               ///< our loop searches on a thread of its own (PoseLoopOptions)
  bool extended = false;            ///< ours continues from the surroundings (PoseLoopOptions)
  int copies = 0;                   ///< PoseLoopOptions::max_instances
  std::vector<glm::dvec3> turns;    ///< of a gyroscope, by frame; see read_gyroscope()
  bool stills = false;              ///< SourceInfo::stills: a new scene is searched anew
};

/// The method that is meant: the named one; "paper" where parameters of it are named or no pattern
/// has a record for our loop, else "ours".
std::string choose_method(const BundleView& bundle, const std::string& method,
                          const std::string& parameters);

/// The id of the bundle's parameter set of that name; of an empty name: "orb-2000" where it is
/// there, else the first; 0 where it has none and the method is "ours", which needs none. Errors:
/// kUsage "parameters.unknown" (lists what the bundle has), kInvalidInput "tracker.no-patterns"
/// where the paper's method has none.
Result<std::uint32_t> choose_parameter_set(const BundleView& bundle, const std::string& method,
                                           const std::string& name);

/// The record of a set that is there; of id 0 an empty one.
ParameterSetRecord parameter_set(const BundleView& bundle, std::uint32_t id);

/// The camera for frames of that size.
Camera camera_for(const std::optional<Camera>& calibrated, int width, int height);

/// Our loop or the paper's method as a step of the pipeline; patterns made on the spot are found
/// by the paper's. The bundle's bytes must outlive it. A frame of another size than the one
/// before sets the tracker up anew. Errors: those of PoseLoop and PaperTracker; kUnsupported
/// "method.unsupported" for the paper's method in a build without OpenCV.
Result<TrackStep> open_vision(const BundleView& bundle, const VisionOptions& options);

/// Our loop alone, of `options` camera, apart, extended and turns. The jobs' camera is that by
/// which their frame was measured. Errors: those of PoseLoop.
TrackStep our_vision(const BundleView& bundle, const VisionOptions& options);

}  // namespace modar
