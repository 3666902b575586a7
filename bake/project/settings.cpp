#include "bake/project/settings.hpp"

namespace modar {

Result<void> apply_settings(const Settings& settings, BakeRequest& request) {
  for (const BakeOption& option : bake_options()) {
    const auto found = settings.find(option.name);
    if (found == settings.end()) continue;
    if (auto taken = parse_option(option, found->second, request); !taken) {
      const Error& error = taken.error();
      return fail(ExitCode::kInvalidInput, "project.value", option.name, error.cause, error.cure);
    }
  }
  plan_request(request);
  return {};
}

Settings settings_of(const Settings& settings, OptionPart part) {
  Settings mine;
  for (const BakeOption& option : bake_options()) {
    const auto found = settings.find(option.name);
    if (option.part == part && found != settings.end()) mine.insert(*found);
  }
  return mine;
}

}  // namespace modar
