// Answers of the studio and the status codes of its errors.
#include "bake/extensions/studio/http_reply.hpp"

#include <algorithm>
#include <cstdlib>
#include <iterator>
#include <string_view>

namespace modar {
namespace {

struct CodeStatus {
  std::string_view code;
  int status;
};

/// Codes whose status does not follow from their exit code.
constexpr CodeStatus kStatuses[] = {
    {"studio.unknown", 404},   {"io.open", 404},           {"studio.changed", 409},
    {"studio.busy", 409},      {"studio.nothing", 409},    {"studio.too-large", 413},
    {"io.write", 507},         {"io.space", 507},          {"studio.request", 400},
    {"studio.not-baked", 404}, {"studio.unavailable", 503}};

int status_of(const Error& error) {
  const auto* found = std::find_if(std::begin(kStatuses), std::end(kStatuses),
                                   [&](const CodeStatus& one) { return one.code == error.code; });
  if (found != std::end(kStatuses)) return found->status;
  switch (error.exit) {
    case ExitCode::kUsage:
    case ExitCode::kInvalidInput:
      return 422;
    case ExitCode::kUnsupported:
      return 501;
    default:
      return 500;
  }
}

}  // namespace

Answer answer_of(const Json& json, int status) {
  Answer answer;
  answer.status = status;
  answer.body = json.dump();
  return answer;
}

Answer jpeg_answer(std::string bytes) {
  Answer answer;
  answer.type = "image/jpeg";
  answer.body = std::move(bytes);
  return answer;
}

Json json_of(const Error& error) {
  Json json = {
      {"error", error.cause}, {"cure", error.cure}, {"code", error.code}, {"where", error.where}};
  // "FILE:LINE:COLUMN", as readers of text write it.
  const std::size_t column = error.where.rfind(':');
  const std::size_t line = column == 0 || column == std::string::npos
                               ? std::string::npos
                               : error.where.rfind(':', column - 1);
  if (line == std::string::npos) return json;
  const int number = std::atoi(error.where.c_str() + line + 1);
  if (number <= 0) return json;
  json.set("file", error.where.substr(0, line));
  json.set("line", number);
  return json;
}

Answer answer_of(const Error& error) {
  return answer_of(json_of(error), status_of(error));
}

Error unknown_verb(const Call& call) {
  return {ExitCode::kUsage, "studio.unknown", call.path, "the studio has nothing with this name",
          "reload the page"};
}

}  // namespace modar
