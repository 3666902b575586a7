// libFuzzer target: any bytes as a store's state.json give a state that is written and read again
// as the same: a damaged file is one without what it lost.
#include <cstddef>
#include <cstdint>

#include "runtime/fetch/store.hpp"
#include "tests/fuzz/input_file.hpp"
#include "tests/fuzz/need.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using modar::test::need;
  static modar::test::InputFile file("state.json");
  const std::string& path = file.write(data, size);
  static const auto store = modar::fetch::Store::open(path.substr(0, path.rfind('/')));
  need(store.has_value());
  const modar::fetch::StoreState state = store->state();
  need(store->save_state(state).has_value());
  const modar::fetch::StoreState again = store->state();
  need(again.version == state.version && again.root_key == state.root_key &&
       again.trusted_key == state.trusted_key && again.key_serial == state.key_serial);
  return 0;
}
