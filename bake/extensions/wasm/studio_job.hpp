// The job of a studio without a server; see studio_calls.cpp.
#pragma once

#include <functional>
#include <string>

namespace modar {

/// That this instance of the program runs; 0: it answers the page.
extern unsigned this_job;
/// Receives what the program prints while it runs as a job: stream 1 or 2, and a line of it.
extern std::function<void(int stream, const std::string& line)> job_line;

}  // namespace modar
