// From reset to main, and the vector table.
#include <cstdint>

#include "platform/mps2/semihosting.hpp"

extern "C" {
// Of the linker script; their addresses are meant.
extern std::uint32_t data_begin, data_end, bss_begin, bss_end, stack_begin;
extern const std::uint32_t data_load;
using Constructor = void (*)();
extern const Constructor init_array_begin, init_array_end;
}

int main();

extern "C" [[noreturn]] void reset() {
  // Coprocessors 10 and 11 are the FPU: full access, before the first instruction of it.
  volatile auto& cpacr = *reinterpret_cast<std::uint32_t*>(0xE000ED88);
  cpacr = cpacr | (0xFU << 20);
  asm volatile("dsb\n isb" ::: "memory");

  const std::uint32_t* from = &data_load;
  for (std::uint32_t* to = &data_begin; to != &data_end; ++to) *to = *from++;
  for (std::uint32_t* to = &bss_begin; to != &bss_end; ++to) *to = 0;
  for (const Constructor* c = &init_array_begin; c != &init_array_end; ++c) (*c)();
  semihosting::exit(main());
}

[[noreturn]] void fault() {
  semihosting::print("fault\n");
  semihosting::exit(1);
}

namespace {

// ARMv7-M Architecture Reference Manual, B1.5.3: stack pointer, then handlers by exception number.
using Handler = void (*)();
struct Vectors {
  const void* stack;
  Handler reset, nmi, hard_fault, memory_fault, bus_fault, usage_fault;
};
[[gnu::section(".vectors"), gnu::used]] const Vectors kVectors{&stack_begin, reset, fault, fault,
                                                               fault,        fault, fault};

}  // namespace
