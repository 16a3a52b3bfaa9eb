// Counts every allocation of the test program, whatever the build type.
#pragma once

namespace tensegrity::testing {

// Calls of malloc, calloc, realloc, aligned_alloc and operator new since the program started. Not
// available (always zero growth) under a sanitizer that brings its own malloc.
long allocations();

}  // namespace tensegrity::testing
