// Calls from the board to the debugger or emulator that it is connected to (ARM, "Semihosting for
// AArch32 and AArch64").
#pragma once

#include <cstdint>

namespace semihosting {

inline std::uint32_t call(std::uint32_t operation, const void* argument) {
  register std::uint32_t r0 asm("r0") = operation;
  register const void* r1 asm("r1") = argument;
  asm volatile("bkpt 0xAB" : "+r"(r0) : "r"(r1) : "memory");
  return r0;
}

inline void print(const char* text) { call(0x04, text); }  // SYS_WRITE0

// The emulator ends with this exit code.
[[noreturn]] inline void exit(int code) {
  const std::uint32_t block[] = {0x20026, std::uint32_t(code)};  // ADP_Stopped_ApplicationExit
  for (;;) call(0x20, block);                                    // SYS_EXIT_EXTENDED
}

}  // namespace semihosting
