// The replay on a board.
//
// Costs: with `-icount shift=0` QEMU takes 1 ns of its virtual time per instruction, and SysTick,
// which every Cortex-M has, counts that time at the board's 25 MHz: 40 instructions a count.
#include <cstdint>

#include "platform/mps2/semihosting.hpp"
#include "platform/platform.hpp"
#include "replay/line.hpp"
#include "replay/methods.hpp"

extern "C" {
extern std::uint32_t stack_begin, stack_end;  // their addresses are meant
extern const std::uint8_t recording_begin[], recording_end[];
}

namespace {

constexpr std::uint32_t kCounterMask = 0xFFFFFF;
constexpr std::uint32_t kInstructionsPerCount = 40;
constexpr std::uint32_t kPaint = 0xC5C5C5C5;

struct SysTick {
  volatile std::uint32_t control, reload, value;
};
SysTick& systick() { return *reinterpret_cast<SysTick*>(0xE000E010); }

void start_counter() {
  systick().reload = kCounterMask;
  systick().value = 0;
  systick().control = 0b101;  // processor clock, no interrupt, enabled
}

// A loop of known length, to check that counts are instructions.
void print_calibration() {
  constexpr std::uint32_t kTurns = 100000;
  std::uint32_t turns = kTurns;
  const std::uint32_t begin = platform::now();
  asm volatile("1: subs %0, #1\n bne 1b" : "+r"(turns)::"cc");
  const std::uint32_t measured = platform::instructions(begin, platform::now());
  platform::print(replay::Line("calibration ").add(2 * kTurns).space().add(measured).end());
}

}  // namespace

namespace platform {

void print(const char* text) { semihosting::print(text); }

std::uint32_t now() { return systick().value; }

std::uint32_t instructions(std::uint32_t begin, std::uint32_t end) {
  return ((begin - end) & kCounterMask) * kInstructionsPerCount;
}

void paint_stack() {
  std::uint32_t* top;
  asm volatile("mov %0, sp" : "=r"(top));
  for (volatile std::uint32_t* word = &stack_end; word < top; ++word) *word = kPaint;
}

std::uint32_t stack_used() {
  const volatile std::uint32_t* word = &stack_end;
  while (*word == kPaint) ++word;
  return std::uint32_t(reinterpret_cast<std::uintptr_t>(&stack_begin) -
                       reinterpret_cast<std::uintptr_t>(word));
}

}  // namespace platform

int main() {
  replay::Recording recording;
  if (!replay::read(recording_begin, std::size_t(recording_end - recording_begin), recording)) {
    platform::print("no recording\n");
    return 1;
  }
  start_counter();
  print_calibration();
#ifdef REPLAY_PAPER
  replay::paper(recording);
#endif
#ifdef REPLAY_FULL
  replay::full(recording);
#endif
}
