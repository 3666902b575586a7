// What happens when memory runs out.
#include "bake/model/array.hpp"

#include <new>

namespace modar::detail {

void out_of_memory() {
  throw std::bad_alloc();
}

}  // namespace modar::detail
