// libFuzzer target: any bytes as a store's own files. state.json gives nothing, or a state that is
// written and read again as the same; the pointer file names one of the two slots, or none.
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "runtime/fetch/store.hpp"
#include "tests/fuzz/input_file.hpp"
#include "tests/fuzz/need.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using modar::test::need;
  static modar::test::InputFile pointer("current");
  const std::string& path = pointer.write(data, size);
  const std::string folder = path.substr(0, path.rfind('/'));
  static const auto store = modar::fetch::Store::open(folder);
  need(store.has_value());
  const std::string slot = modar::fetch::active_slot(store->folder());
  need(slot.empty() || slot == "slots/a" || slot == "slots/b");
  need(store->spare_folder().path() != folder + "/" + slot);

  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const auto state = modar::fetch::parse_state(text);
  if (!state) return 0;
  need(store->save_state(*state).has_value());
  const modar::fetch::StoreState again = store->state();
  need(!again.fresh && again.epoch == state->epoch && again.version == state->version &&
       again.root_key == state->root_key && again.trusted_key == state->trusted_key &&
       again.key_serial == state->key_serial && again.roots == state->roots &&
       again.root_serial == state->root_serial && again.time == state->time);
  return 0;
}
