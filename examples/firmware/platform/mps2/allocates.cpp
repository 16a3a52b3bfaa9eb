// A program that must not link: it allocates, as C++ does behind `new` and the containers.
#include <memory>

#include "platform/mps2/semihosting.hpp"

int main() {
  const auto on_heap = std::make_unique<int>(0);
  semihosting::print(*on_heap == 0 ? "allocated\n" : "");
}
