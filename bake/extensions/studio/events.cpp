#include "bake/extensions/studio/events.hpp"

#include <algorithm>

namespace modar {
namespace {

constexpr std::size_t kKept = 256;  // events: minutes of a bake's progress

}  // namespace

void Events::publish(const std::string& name, const Json& data) {
  Event event;
  event.name = name;
  event.data = data.dump();
  // Texts have their line breaks escaped: those of the layout are left.
  std::replace(event.data.begin(), event.data.end(), '\n', ' ');
  const std::lock_guard lock(mutex_);
  event.number = ++last_;
  events_.push_back(std::move(event));
  if (events_.size() > kKept) events_.pop_front();
  changed_.notify_all();
}

std::vector<Event> Events::wait(std::uint64_t number, std::chrono::milliseconds most) {
  std::unique_lock lock(mutex_);
  changed_.wait_for(lock, most, [&] { return closed_ || last_ > number; });
  std::vector<Event> found;
  for (const Event& event : events_) {
    if (event.number > number) found.push_back(event);
  }
  return found;
}

std::uint64_t Events::last() const {
  const std::lock_guard lock(mutex_);
  return last_;
}

void Events::close() {
  const std::lock_guard lock(mutex_);
  closed_ = true;
  changed_.notify_all();
}

bool Events::closed() const {
  const std::lock_guard lock(mutex_);
  return closed_;
}

}  // namespace modar
