// Three threads a run: one reads frames, one looks for patterns, the caller's renders. Mailboxes
// join them; no lock is held while any of them works.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>

#include "formats/error.hpp"
#include "frame_source.hpp"
#include "mailbox.hpp"
#include "modar/camera.hpp"
#include "modar/focal_finder.hpp"
#include "modar/tracker.hpp"

namespace modar {

struct SpotPattern;

/// What travels from thread to thread.
struct Job {
  Frame frame;
  Camera camera;  ///< of this frame's size
  TrackResult track;
  double track_ms = 0;
  FocalProgress focal;                      ///< of the search for it, while it goes on
  std::shared_ptr<const SpotPattern> spot;  ///< what `track` is about; null: the bundle's patterns
};

/// Runs on the vision thread: fills camera, track and track_ms.
using TrackStep = std::function<Result<void>(Job&)>;
/// Runs on the caller's thread. Answers false to end the run.
using ShowStep = std::function<Result<bool>(const Job&)>;
/// Runs on the caller's thread while no frame comes, to keep a window alive. False ends the run.
using IdleStep = std::function<bool()>;

struct PipelineOptions {
  Delivery delivery = Delivery::kInOrder;
  bool paced = false;  ///< frames come no earlier than their time_s (a file played like a camera)
  IdleStep idle;       ///< may be empty
  std::chrono::milliseconds idle_every{20};
};

struct PipelineCounts {
  std::uint64_t dropped = 0;  ///< frames that a newer one replaced
};

/// Runs until the source ends, a step fails or the show step ends it; the threads are joined then.
/// Errors: the first one of reading, tracking, showing.
Result<PipelineCounts> run_pipeline(FrameSource& source, const TrackStep& track,
                                    const ShowStep& show, const PipelineOptions& options);

/// Milliseconds of the steady clock since `start_ns`, and that clock in nanoseconds.
std::int64_t now_ns();
double ms_since(std::int64_t start_ns);

}  // namespace modar
