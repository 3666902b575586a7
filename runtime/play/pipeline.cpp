// Reading, vision and rendering side by side; each ends when its neighbour does.
#include "pipeline.hpp"

#include <poll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdint>
#include <optional>
#include <thread>

namespace modar {

WakeEvent::WakeEvent() : event_(eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {}

WakeEvent::~WakeEvent() {
  if (event_ >= 0) close(event_);
}

void WakeEvent::stop() {
  const std::uint64_t one = 1;
  // It cannot fail but by a full counter, which is awake already.
  [[maybe_unused]] const ssize_t written = write(event_, &one, sizeof one);
}

WakeEvent::Event WakeEvent::wait(int descriptor, std::chrono::milliseconds limit) const {
  // Nobody reads the event: once stopped, it stays so. poll() skips negative descriptors.
  std::array<pollfd, 2> files = {{{event_, POLLIN, 0}, {descriptor, POLLIN, 0}}};
  int ready = 0;
  do {
    ready = poll(files.data(), files.size(), static_cast<int>(limit.count()));
  } while (ready < 0 && errno == EINTR);
  if (files[0].revents != 0) return Event::kStopped;
  // An end or an error is readable too: the read says which.
  return files[1].revents != 0 ? Event::kReadable : Event::kTimeout;
}

WakeEvent::Event WakeEvent::wait_for_stop(std::chrono::milliseconds limit) const {
  return wait(-1, limit);
}

namespace {

struct Lines {
  explicit Lines(Delivery delivery) : frames(delivery), jobs(delivery) {}
  Mailbox<Frame> frames;             ///< reader to vision
  Mailbox<Job> jobs;                 ///< vision to renderer
  Semaphore stopped{0};              ///< wakes a reader that waits for a frame's time
  std::optional<Error> read_error;   ///< written by the reader, read once it is joined
  std::optional<Error> track_error;  ///< the same of the vision thread
};

void read_frames(FrameSource& source, const PipelineOptions& options, Lines& lines) {
  Frame frame;
  const std::int64_t start = now_ns();
  for (;;) {
    const std::int64_t before = now_ns();
    const Result<bool> more = source.next(frame);
    if (!more) lines.read_error = more.error();
    if (!more || !*more) break;
    frame.read_ms = ms_since(before);
    if (options.paced) {
      const auto due = start + static_cast<std::int64_t>(frame.time_s * 1e9);
      const std::chrono::nanoseconds wait(due - now_ns());
      if (wait.count() > 0 && lines.stopped.acquire_for(wait)) break;
    }
    frame.arrived_ns = now_ns();
    if (!lines.frames.post(frame)) break;
  }
  lines.frames.close();
}

void track_frames(const TrackStep& track, Lines& lines) {
  Frame frame;
  Job job;
  while (lines.frames.take(frame)) {
    std::swap(job.frame, frame);
    if (Result<void> done = track(job); !done) {
      lines.track_error = done.error();
      break;
    }
    if (!lines.jobs.post(job)) break;
  }
  lines.frames.close();
  lines.jobs.close();
}

Result<void> show_jobs(const ShowStep& show, const PipelineOptions& options, Lines& lines) {
  using Box = Mailbox<Job>;
  Job job;
  for (;;) {
    Box::Taken taken = Box::Taken::kItem;
    if (options.idle) {
      taken = lines.jobs.take_for(job, options.idle_every);
    } else if (!lines.jobs.take(job)) {
      taken = Box::Taken::kClosed;
    }
    if (taken == Box::Taken::kClosed) return {};
    if (taken == Box::Taken::kNothingYet) {
      if (!options.idle()) return {};
      continue;
    }
    MODAR_ASSIGN(const bool more, show(job));
    if (!more) return {};
  }
}

}  // namespace

std::int64_t now_ns() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
             std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

double ms_since(std::int64_t start_ns) {
  return static_cast<double>(now_ns() - start_ns) * 1e-6;
}

Result<PipelineCounts> run_pipeline(FrameSource& source, const TrackStep& track,
                                    const ShowStep& show, const PipelineOptions& options) {
  Lines lines(options.delivery);
  std::thread reader([&] { read_frames(source, options, lines); });
  std::thread vision([&] { track_frames(track, lines); });
  const Result<void> shown = show_jobs(show, options, lines);
  // Whatever a neighbour waits for, one of these wakes it.
  lines.jobs.close();
  lines.frames.close();
  source.stop();
  lines.stopped.release();
  vision.join();
  reader.join();
  if (lines.read_error) return tl::unexpected(*lines.read_error);
  if (lines.track_error) return tl::unexpected(*lines.track_error);
  if (!shown) return tl::unexpected(shown.error());
  const auto skipped = source.skipped();
  return PipelineCounts{lines.frames.dropped() + lines.jobs.dropped(),
                        {skipped.begin(), skipped.end()}};
}

}  // namespace modar
