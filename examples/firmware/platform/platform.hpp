// What the replay needs of the machine it runs on: text out, and on boards what things cost.
#pragma once

#include <cstdint>

namespace platform {

// Everything that is printed: by semihosting on boards, to standard output on the host.
void print(const char* text);

// ---- costs. Only boards measure them: on the host these do nothing and return 0.

// A count that runs down; `instructions` takes two of them.
std::uint32_t now();
// Instructions from one count to a later one, to within 40; at most 671 million.
std::uint32_t instructions(std::uint32_t begin, std::uint32_t end);

// Fills the free stack with a pattern, and how deep the stack has been since then [bytes].
void paint_stack();
std::uint32_t stack_used();

}  // namespace platform
