// Kinds of issues that only a workstation can find: against a device, a source, a picture, a pose.
// Those that the bytes alone show are in formats/check.hpp.
#pragma once

#include <cstdint>
#include <span>

#include "formats/check.hpp"

namespace modar {

/// In the order of workstation_issue_kinds().
enum class WorkstationRule : std::uint8_t {
  kDeviceTextureSize,
  kDeviceAttributes,
  kDeviceUniforms,
  kDeviceGpuMemory,
  kDeviceRam,
  kDeviceStorage,
  kDeviceHalfFloat,
  kDeviceEtc1,
  kSourceMissing,
  kSourceBytes,
  kSourceSurface,
  kSourceColour,
  kSourceCounts,
  kPoseRange,
  kVisualDiffers,
  kCount
};

std::span<const IssueKind> workstation_issue_kinds();
const IssueKind& workstation_issue_kind(WorkstationRule rule);

}  // namespace modar
